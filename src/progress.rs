//! Progress of long work on stderr: bars with ETA on a terminal, plain lines elsewhere.
//!
//! The only reader of a clock in the library; nothing of it reaches a file.

use std::io::{IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// At most one plain line in so long.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// How far one unit of work has come. May be told of from several threads.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    name: String,
    what: String,
    plain: Option<Mutex<Plain>>,
}

/// The state of plain lines.
#[derive(Debug)]
struct Plain {
    began: Instant,
    said: Instant,
}

impl Progress {
    /// Progress of the work `name` over `total` of `what` (`episodes`, `steps`), shown on stderr.
    pub fn new(name: &str, total: u64, what: &str) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let target = if on_terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        if let Ok(style) = ProgressStyle::with_template(&format!(
            "{{prefix:<28}} {{bar:32}} {{pos}}/{{len}} {what}  {{elapsed}} (left {{eta}})  {{msg}}"
        )) {
            bar.set_style(style.progress_chars("━╸─"));
        }
        bar.set_prefix(name.to_owned());
        let plain = (!on_terminal).then(|| {
            let now = now();
            Mutex::new(Plain { began: now, said: now })
        });
        Self { bar, name: name.to_owned(), what: what.to_owned(), plain }
    }

    /// Progress that is not shown.
    pub fn hidden() -> Self {
        Self { bar: ProgressBar::hidden(), name: String::new(), what: String::new(), plain: None }
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
        self.bar.finish_and_clear();
        if self.plain.is_some() || !self.bar.is_hidden() {
            say(&format!("{}: {result} in {}", self.name, duration(self.elapsed())));
        }
    }

    fn elapsed(&self) -> Duration {
        match &self.plain {
            Some(plain) => plain.lock().map_or(Duration::ZERO, |plain| plain.began.elapsed()),
            None => self.bar.elapsed(),
        }
    }

    fn line_if_due(&self) {
        let Some(plain) = &self.plain else { return };
        let Ok(mut plain) = plain.lock() else { return };
        if plain.said.elapsed() < LINE_EVERY {
            return;
        }
        plain.said = now();
        let (done, total) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let left = plain.began.elapsed().as_secs_f64() * (total.saturating_sub(done)) as f64 / done.max(1) as f64;
        let left = duration(Duration::from_secs_f64(left.min(1e6)));
        let message = self.bar.message();
        say(&format!("{}: {done}/{total} {}, {left} left  {message}", self.name, self.what));
    }
}

#[expect(clippy::disallowed_methods, reason = "progress is for people; it reaches no file")]
fn now() -> Instant {
    Instant::now()
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
    use std::time::Duration;

    use super::duration;

    #[test]
    fn durations_are_told_in_the_unit_that_fits() {
        let told = [0.25, 61.0, 7325.0].map(|secs| duration(Duration::from_secs_f64(secs)));
        assert_eq!(told, ["0.2 s", "1 min 01 s", "2 h 02 min"]);
    }
}
