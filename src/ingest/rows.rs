//! Rows from the messages of files, as they come.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use super::counts::IngestSummary;
use super::decode::Decoder;
use super::episode::{Bound, Bounds};
use super::error::IngestError;
use super::map::{Clock, Map, Task, nanos};
use super::observe::Observer;
use super::picture::Reason;
use super::probe::{self, Feature};
use super::sample::{Content, Sampler};
use super::track::{Taken, Track};
use super::value::Value;
use crate::dataset::plain::{Cell, Picture, PlainKind, PlainWriter};
use crate::recording::{AnyMessage, read_messages};
use crate::video::{H264Encoder, VideoError};

/// The rows of all files.
pub(super) struct Rows<'m> {
    map: &'m Map,
    features: &'m [Feature<'m>],
    observer: Option<Observer>,
    writer: PlainWriter,
    summary: IngestSummary,
}

impl<'m> Rows<'m> {
    pub(super) fn new(
        map: &'m Map,
        features: &'m [Feature<'m>],
        observer: Option<Observer>,
        writer: PlainWriter,
    ) -> Self {
        Self { map, features, observer, writer, summary: IngestSummary::default() }
    }

    /// Adds the episodes of a file.
    pub(super) fn file(&mut self, path: &Path) -> Result<(), IngestError> {
        let mut reading = Reading::new(path, self);
        read_messages(path, |message| {
            reading.message(message)?;
            Ok::<_, IngestError>(ControlFlow::Continue(()))
        })?;
        reading.finish()
    }

    /// Ends the dataset.
    pub(super) fn finish(mut self) -> Result<IngestSummary, IngestError> {
        if self.summary.episodes == 0 {
            return Err(IngestError::NoEpisode { told: self.summary.lines().join("; ") });
        }
        self.summary.tasks = self.writer.finish()?.tasks;
        Ok(self.summary)
    }
}

/// Who wants the messages of a topic.
#[derive(Clone, Copy)]
enum Use {
    /// A source, by its number among all.
    Sample(usize),
    Bounds,
    Task,
}

/// Where a file is being read: between episodes, before the first row of one, or in one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Closed,
    /// From this time on; whether rows of the same episode came before.
    Seeking {
        begin: i64,
        is_remainder: bool,
    },
    Open {
        base: i64,
        n_rows: u64,
    },
}

/// A file being read.
struct Reading<'r, 'm> {
    path: &'r Path,
    map: &'m Map,
    features: &'m [Feature<'m>],
    observer: Option<&'r mut Observer>,
    writer: &'r mut PlainWriter,
    summary: &'r mut IngestSummary,
    uses: BTreeMap<&'m str, Vec<Use>>,
    decoders: BTreeMap<u16, Decoder>,
    samplers: Vec<Sampler<'m>>,
    /// One for each source of each feature, and that feature.
    tracks: Vec<(usize, Track)>,
    encoders: Vec<Option<H264Encoder>>,
    bounds: Bounds<'m>,
    task: Option<String>,
    state: State,
    first_nanos: Option<i64>,
    /// The youngest time that has been met.
    youngest_nanos: i64,
}

impl<'r, 'm> Reading<'r, 'm> {
    fn new(path: &'r Path, rows: &'r mut Rows<'m>) -> Self {
        let Rows { map, features, observer, writer, summary } = rows;
        let (map, features) = (*map, *features);
        let bounds = Bounds::new(&map.episodes);
        let mut uses: BTreeMap<&str, Vec<Use>> = BTreeMap::new();
        let (mut samplers, mut tracks) = (Vec::new(), Vec::new());
        for (number, feature) in features.iter().enumerate() {
            for (source, &width) in feature.map.from.iter().zip(&feature.widths) {
                uses.entry(source.topic.as_str()).or_default().push(Use::Sample(tracks.len()));
                samplers.push(Sampler::new(feature.map, source));
                tracks.push((number, Track::new(feature.map, width)));
            }
        }
        if let Some(topic) = bounds.topic() {
            uses.entry(topic).or_default().push(Use::Bounds);
        }
        let task = match &map.task {
            Task::Text(text) => Some(text.clone()),
            Task::Topic { topic, .. } => {
                uses.entry(topic).or_default().push(Use::Task);
                None
            }
        };
        Self {
            path,
            map,
            features,
            observer: observer.as_mut(),
            writer,
            summary,
            uses,
            decoders: BTreeMap::new(),
            samplers,
            tracks,
            encoders: features.iter().map(|_| None).collect(),
            bounds,
            task,
            state: State::Closed,
            first_nanos: None,
            youngest_nanos: i64::MIN,
        }
    }

    fn message(&mut self, message: &AnyMessage<'_>) -> Result<(), IngestError> {
        let Some(uses) = self.uses.get(message.channel.topic.as_str()).cloned() else { return Ok(()) };
        let decoder = probe::decoder(self.path, &mut self.decoders, message.channel)?;
        let decoded = decoder.decode(message.data);
        let at = self.time(message, decoded.as_ref().ok());
        self.first_nanos.get_or_insert(at);
        self.youngest_nanos = self.youngest_nanos.max(at);
        for used in uses {
            match (used, &decoded) {
                (Use::Sample(number), decoded) => self.sample(number, at, decoded.as_ref(), &message.channel.topic),
                (Use::Bounds, Ok(value)) => self.bounds.message(at, value),
                (Use::Task, Ok(value)) => self.task_text(value),
                (_, Err(_)) => {}
            }
        }
        self.advance(false)
    }

    /// When a message is. One that cannot be decoded, of which no row is made, has the time at which it was recorded.
    fn time(&mut self, message: &AnyMessage<'_>, value: Option<&Value>) -> i64 {
        let whole = |nanos: u64| i64::try_from(nanos).unwrap_or(i64::MAX);
        let recorded = whole(message.log_time_nanos);
        match (self.map.clock, value) {
            (Clock::Publish, _) => whole(message.publish_time_nanos),
            (Clock::Log, _) | (Clock::Header, None) => recorded,
            (Clock::Header, Some(value)) => value.stamp_nanos().unwrap_or_else(|| {
                *self.summary.without_stamp.entry(message.channel.topic.clone()).or_default() += 1;
                recorded
            }),
        }
    }

    fn sample(&mut self, number: usize, at: i64, message: Result<&Value, &Reason>, topic: &str) {
        if message.is_ok_and(|message| self.samplers[number].is_of_others(message)) {
            return;
        }
        let secs = self.secs(at);
        let (feature, track) = &mut self.tracks[number];
        track.counts.messages += 1;
        let taken = message.map_err(Clone::clone).and_then(|message| self.samplers[number].take(message));
        let feature = &self.features[*feature];
        let fitting = taken.and_then(|(content, kind)| feature.misfit(&kind, track.width).map_or(Ok(content), Err));
        match fitting {
            Ok(content) => {
                track.push(at, content);
                self.bounds.sample(at);
            }
            Err(reason) => {
                track.counts.unusable += 1;
                let why = || format!("the first at {secs:.3} s: {reason}");
                self.summary.why_unusable.entry(topic.to_owned()).or_insert_with(why);
            }
        }
    }

    fn task_text(&mut self, message: &Value) {
        let Task::Topic { field, .. } = &self.map.task else { return };
        if let Some(Value::Text(text)) = field.select(message) {
            self.task = Some(text);
        }
    }

    /// Makes the rows that no later message can change.
    fn advance(&mut self, is_over: bool) -> Result<(), IngestError> {
        let lookahead = self.tracks.iter().map(|(_, track)| track.lookahead_nanos()).max().unwrap_or_default();
        let settled = match is_over {
            true => i64::MAX,
            false => self.youngest_nanos.saturating_sub(nanos(self.map.slack_secs)).saturating_sub(lookahead),
        };
        loop {
            let has_moved = match self.state {
                State::Closed => self.open_next(settled),
                State::Seeking { begin, is_remainder } => self.seek(begin, is_remainder, settled)?,
                State::Open { base, n_rows } => self.next_row(base, n_rows, settled)?,
            };
            if !has_moved {
                return Ok(());
            }
        }
    }

    fn open_next(&mut self, settled: i64) -> bool {
        let Some((at, bound)) = self.bounds.next() else {
            // What lies before the next episode is held no longer than it may be of use to it.
            self.forget(settled);
            return false;
        };
        self.bounds.pass();
        if bound == Bound::Begin {
            self.state = State::Seeking { begin: at, is_remainder: false };
        }
        true
    }

    fn forget(&mut self, before: i64) {
        if before < i64::MAX {
            self.tracks.iter_mut().for_each(|(_, track)| track.forget(before));
        }
    }

    /// Looks for the first time at which every source has something.
    fn seek(&mut self, begin: i64, is_remainder: bool, settled: i64) -> Result<bool, IngestError> {
        let firsts: Option<Vec<i64>> = self.tracks.iter().map(|(_, track)| track.first_from(begin)).collect();
        let base = firsts.and_then(|firsts| firsts.into_iter().max());
        let bound = self.bounds.next().filter(|&(at, _)| at <= base.unwrap_or(settled));
        match (base, bound) {
            (_, Some((at, bound))) => {
                self.summary.empty += u64::from(!is_remainder);
                self.end_at(at, bound);
            }
            (Some(base), None) if base <= settled => self.begin(base)?,
            (Some(_), None) => return Ok(false),
            (None, None) if settled == i64::MAX => {
                self.summary.empty += u64::from(!is_remainder);
                self.state = State::Closed;
            }
            (None, None) => {
                // A source without a message has its first one behind what is settled.
                let begin = begin.max(settled);
                self.state = State::Seeking { begin, is_remainder };
                self.forget(begin);
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Passes a bound.
    fn end_at(&mut self, at: i64, bound: Bound) {
        self.bounds.pass();
        self.state = match bound {
            Bound::Begin => State::Seeking { begin: at, is_remainder: false },
            Bound::End => State::Closed,
        };
    }

    fn begin(&mut self, base: i64) -> Result<(), IngestError> {
        let Some(task) = &self.task else {
            let topic = match &self.map.task {
                Task::Topic { topic, .. } => topic.clone(),
                Task::Text(_) => String::new(),
            };
            return Err(IngestError::NoTask { path: self.path.to_owned(), topic, secs: self.secs(base) });
        };
        self.writer.begin_episode(task);
        self.tracks.iter_mut().for_each(|(_, track)| track.begin_episode());
        if let Some(observer) = &mut self.observer {
            observer.begin_episode();
        }
        self.encoders.iter_mut().for_each(|encoder| *encoder = None);
        self.state = State::Open { base, n_rows: 0 };
        Ok(())
    }

    /// Seconds from the file's first message.
    fn secs(&self, at: i64) -> f64 {
        at.saturating_sub(self.first_nanos.unwrap_or(at)) as f64 / 1e9
    }

    /// Makes the next row of the episode, or ends it.
    fn next_row(&mut self, base: i64, n_rows: u64, settled: i64) -> Result<bool, IngestError> {
        let fps = i128::from(self.map.fps);
        let since = (i128::from(n_rows) * 1_000_000_000 + fps / 2) / fps;
        let at = base.saturating_add(i64::try_from(since).unwrap_or(i64::MAX));
        if let Some((bound_at, bound)) = self.bounds.next().filter(|&(bound_at, _)| bound_at <= at) {
            self.end_episode(n_rows)?;
            self.end_at(bound_at, bound);
            return Ok(true);
        }
        let is_behind_all =
            self.tracks.iter().filter_map(|(_, track)| track.last_nanos()).max().is_none_or(|last| at > last);
        if settled == i64::MAX && is_behind_all {
            self.end_episode(n_rows)?;
            self.state = State::Closed;
            return Ok(true);
        }
        if at > settled {
            return Ok(false);
        }
        if !self.tracks.iter().all(|(_, track)| track.is_fresh(at)) {
            self.end_episode(n_rows)?;
            self.summary.cut += u64::from(n_rows > 0);
            let begin = if n_rows > 0 { at } else { at.saturating_add(1) };
            self.state = State::Seeking { begin, is_remainder: true };
            return Ok(true);
        }
        let cells = self.cells(at)?;
        self.writer.row(cells)?;
        self.state = State::Open { base, n_rows: n_rows + 1 };
        self.forget(at);
        Ok(true)
    }

    fn end_episode(&mut self, n_rows: u64) -> Result<(), IngestError> {
        self.writer.end_episode()?;
        self.summary.episodes += u64::from(n_rows > 0);
        self.summary.frames += n_rows;
        Ok(())
    }

    /// What each feature holds at a time at which every source has something.
    fn cells(&mut self, at: i64) -> Result<Vec<Cell>, IngestError> {
        let mut cells: Vec<Cell> = Vec::with_capacity(self.features.len());
        for number in 0..self.tracks.len() {
            let (feature, track) = &mut self.tracks[number];
            let feature = *feature;
            let cell = match track.take(at) {
                Taken::One(Content::Numbers(numbers)) => Cell::Numbers(numbers),
                Taken::One(Content::Text(text)) => Cell::Text(text),
                Taken::One(Content::Picture(picture)) => self.picture(feature, picture)?,
                Taken::One(Content::Packet(packet, _)) => Cell::Video(vec![packet]),
                Taken::Packets(packets) => Cell::Video(packets),
                Taken::Repeated | Taken::Stale => return Err(self.repeated(feature, at)),
            };
            match (cells.get_mut(feature), cell) {
                (Some(Cell::Numbers(before)), Cell::Numbers(more)) => before.extend(more),
                (_, cell) => cells.push(cell),
            }
        }
        if let (Some(observer), Some(Cell::Numbers(numbers))) = (&mut self.observer, cells.first()) {
            let observed = observer.cells(numbers);
            cells.splice(0..1, observed);
        }
        Ok(cells)
    }

    /// A picture as it is stored: in a video it is encoded here.
    fn picture(&mut self, feature: usize, picture: Picture) -> Result<Cell, IngestError> {
        let PlainKind::Video(size_px) = self.features[feature].kind else { return Ok(Cell::Image(picture)) };
        let failed =
            |source: VideoError| IngestError::Encode { feature: self.features[feature].map.name.clone(), source };
        let encoder = match &mut self.encoders[feature] {
            Some(encoder) => encoder,
            none => none.insert(H264Encoder::of_camera(size_px, self.map.fps).map_err(failed)?),
        };
        let Picture::Rgb(_, rgb) = picture else { return Ok(Cell::Image(picture)) };
        let mut packet = Vec::new();
        encoder.encode(&rgb, false, &mut packet).map_err(failed)?;
        Ok(Cell::Video(vec![packet]))
    }

    fn repeated(&self, feature: usize, at: i64) -> IngestError {
        let map = self.features[feature].map;
        let topic = map.from.first().map_or_else(String::new, |source| source.topic.clone());
        IngestError::Repeated { path: self.path.to_owned(), feature: map.name.clone(), topic, secs: self.secs(at) }
    }

    /// Makes the rows that are left, and counts.
    fn finish(mut self) -> Result<(), IngestError> {
        self.advance(true)?;
        let mut sources = self.features.iter().flat_map(|feature| feature.map.from.iter());
        for (number, track) in &mut self.tracks {
            track.end();
            let (counts, Some(source)) = (track.counts, sources.next()) else { continue };
            if counts.messages == counts.unusable {
                let why = format!(" among {}", counts.messages);
                let (path, feature) = (self.path.to_owned(), self.features[*number].map.name.clone());
                let topics = self.uses.keys().map(|&topic| topic.to_owned()).collect();
                return Err(IngestError::NoTopic { path, feature, topic: source.topic.clone(), why, topics });
            }
            self.summary.topics.entry(source.topic.clone()).or_default().add(counts);
        }
        Ok(())
    }
}
