//! Progress of long work on stderr: bars with ETA on a terminal, plain lines elsewhere.
//!
//! The only reader of clocks in the library. What [`Stopwatch`] reads reaches `costs.json` and the report, nothing else.

use std::io::{IsTerminal as _, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::words::{counted, noun};
use cpu_time::ProcessTime;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// At most one plain line in so long.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// How far one unit of work has come. May be told of from several threads.
pub struct Progress {
    bar: ProgressBar,
    name: String,
    what: String,
    plain: Option<Mutex<Plain>>,
}

/// The state of plain lines.
struct Plain {
    began: Instant,
    /// What was done before it began.
    before: u64,
    said: Instant,
    every: Duration,
    out: Box<dyn Write + Send>,
}

impl Plain {
    /// One line. Nothing is left to do when the stream is closed.
    fn say(&mut self, line: &str) {
        let _closed = writeln!(self.out, "{}", line.trim_end());
    }
}

impl Progress {
    /// Progress of the work `name` over `total` of `what` (`episode`, `step`), shown on stderr.
    pub fn new(name: &str, total: u64, what: &str) -> Self {
        if !std::io::stderr().is_terminal() {
            return Self::plain(name, total, what, LINE_EVERY, Box::new(std::io::stderr()));
        }
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
        let what = noun(total, what);
        if let Ok(style) = ProgressStyle::with_template(&format!(
            "{{prefix:<28}} {{bar:32}} {{pos}}/{{len}} {what}  {{elapsed}} (left {{eta}})  {{msg}}"
        )) {
            bar.set_style(style.progress_chars("━╸─"));
        }
        bar.set_prefix(name.to_owned());
        Self { bar, name: name.to_owned(), what, plain: None }
    }

    /// Progress told in lines: one at once, then at most one in `every`, one at the end.
    fn plain(name: &str, total: u64, what: &str, every: Duration, out: Box<dyn Write + Send>) -> Self {
        let began = now();
        let mut plain = Plain { began, before: 0, said: began, every, out };
        plain.say(&format!("{name}: {}", counted(total, what)));
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
        let what = noun(total, what);
        Self { bar, name: name.to_owned(), what, plain: Some(Mutex::new(plain)) }
    }

    /// Progress that is not shown.
    pub fn hidden() -> Self {
        Self { bar: ProgressBar::hidden(), name: String::new(), what: String::new(), plain: None }
    }

    /// So much was done before; what is left takes its time from what follows.
    pub fn carry_on_after(&self, done: u64) {
        self.bar.set_position(done);
        self.bar.reset_eta();
        if let Some(Ok(mut plain)) = self.plain.as_ref().map(Mutex::lock) {
            plain.before = done;
        }
    }

    /// So many more are done.
    pub fn inc(&self, done: u64) {
        self.bar.inc(done);
        self.line_if_due();
    }

    /// Something to say beside the bar, such as a loss.
    pub fn message(&self, message: &str) {
        self.bar.set_message(message.to_owned());
    }

    /// The work is done, with its result.
    pub fn finish(&self, result: &str) {
        let shown = !self.bar.is_hidden();
        self.bar.finish_and_clear();
        let line = |elapsed| format!("{}: {result} in {}", self.name, duration(elapsed));
        match &self.plain {
            Some(plain) => {
                let Ok(mut plain) = plain.lock() else { return };
                let line = line(plain.began.elapsed());
                plain.say(&line);
            }
            None if shown => say(&line(self.bar.elapsed())),
            None => {}
        }
    }

    fn line_if_due(&self) {
        let Some(plain) = &self.plain else { return };
        let Ok(mut plain) = plain.lock() else { return };
        if plain.said.elapsed() < plain.every {
            return;
        }
        plain.said = now();
        let (done, total) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let done_since = done.saturating_sub(plain.before).max(1);
        let left = plain.began.elapsed().as_secs_f64() * (total.saturating_sub(done)) as f64 / done_since as f64;
        let left = duration(Duration::from_secs_f64(left.min(1e6)));
        let message = self.bar.message();
        plain.say(&format!("{}: {done}/{total} {}, {left} left  {message}", self.name, self.what));
    }
}

#[expect(clippy::disallowed_methods, reason = "the one place that reads the clock")]
fn now() -> Instant {
    Instant::now()
}

/// Measures what work takes.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    began: Instant,
    /// `None` where the system does not say.
    cpu: Option<ProcessTime>,
}

/// What work took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// CPU-seconds of the process, all threads together.
    pub cpu_secs: f64,
    /// Seconds on the clock.
    pub wall_secs: f64,
}

impl Stopwatch {
    /// Begins to measure.
    pub fn start() -> Self {
        Self { began: now(), cpu: ProcessTime::try_now().ok() }
    }

    /// What was taken since.
    pub fn taken(&self) -> Taken {
        let cpu = self.cpu.and_then(|cpu| cpu.try_elapsed().ok()).unwrap_or_default();
        Taken { cpu_secs: cpu.as_secs_f64(), wall_secs: self.began.elapsed().as_secs_f64() }
    }
}

/// One line on stderr. Nothing is left to do when stderr is closed.
pub fn say(line: &str) {
    let _closed = writeln!(std::io::stderr().lock(), "{}", line.trim_end());
}

fn duration(duration: Duration) -> String {
    let secs = duration.as_secs_f64();
    match secs {
        secs if secs < 60.0 => format!("{secs:.1} s"),
        secs if secs < 3600.0 => format!("{:.0} min {:02.0} s", (secs / 60.0).floor(), secs % 60.0),
        secs => format!("{:.0} h {:02.0} min", (secs / 3600.0).floor(), (secs / 60.0) % 60.0),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    use super::{Progress, duration};

    /// What was written, shared with the writer.
    #[derive(Clone, Default)]
    struct Said(Arc<Mutex<Vec<u8>>>);

    impl Write for Said {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Said {
        fn lines(&self) -> Vec<String> {
            String::from_utf8(self.0.lock().unwrap().clone()).unwrap().lines().map(str::to_owned).collect()
        }
    }

    fn plain(every: Duration) -> (Progress, Said) {
        let said = Said::default();
        (Progress::plain("generate", 4, "episode", every, Box::new(said.clone())), said)
    }

    #[test]
    fn without_a_terminal_there_is_a_line_at_the_start_and_one_at_the_end() {
        let (progress, said) = plain(Duration::MAX);
        (0..4).for_each(|_| progress.inc(1));
        progress.finish("4 episodes");
        let lines = said.lines();
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert_eq!(lines[0], "generate: 4 episodes");
        assert!(lines[1].starts_with("generate: 4 episodes in 0."), "{lines:?}");
    }

    #[test]
    fn a_line_that_is_due_tells_how_far_and_how_long_and_the_message() {
        let (progress, said) = plain(Duration::ZERO);
        progress.message("loss 0.5");
        progress.inc(4);
        assert_eq!(said.lines()[1], "generate: 4/4 episodes, 0.0 s left  loss 0.5");
    }

    #[test]
    fn what_was_done_before_does_not_shorten_the_time_that_is_left() {
        let (progress, said) = plain(Duration::ZERO);
        progress.carry_on_after(2);
        std::thread::sleep(Duration::from_millis(200));
        progress.inc(1);
        let line = &said.lines()[1];
        let left: f64 =
            line.strip_prefix("generate: 3/4 episodes, ").unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(left >= 0.2, "{line}");
    }

    #[test]
    fn lines_of_several_threads_are_whole_and_none_is_lost() {
        let (progress, said) = plain(Duration::ZERO);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| progress.inc(1));
            }
        });
        let lines = said.lines();
        assert_eq!(lines.len(), 5, "{lines:?}");
        assert!(lines[1..].iter().all(|line| line.starts_with("generate: ") && line.contains("/4 episodes, ")));
    }

    #[test]
    fn nothing_comes_of_hidden_progress() {
        let progress = Progress::hidden();
        progress.inc(1);
        progress.finish("done");
        assert!(progress.plain.is_none() && progress.bar.is_hidden());
    }

    #[test]
    fn durations_are_told_in_the_unit_that_fits() {
        let told = [0.25, 61.0, 7325.0].map(|secs| duration(Duration::from_secs_f64(secs)));
        assert_eq!(told, ["0.2 s", "1 min 01 s", "2 h 02 min"]);
    }
}
