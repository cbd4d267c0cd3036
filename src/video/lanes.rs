//! Program lanes below a picture: what runs at each depth, and what has run so far.
//!
//! Each lane begins with the running call in words. Beside it stand the calls up to now, as bars in the colours of the
//! viewer, on an axis that is as long as the episode. A push of an adversary is a line across all lanes.

use std::collections::BTreeSet;

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::trace::{Episode, ProgramCall, calls_by_depth};
use crate::video::Rgb;

/// Height of a lane, in pixels.
const LANE: u32 = 20;
/// Height of the bar in a lane, in pixels.
const BAR: u32 = 14;
/// Around words and bars, in pixels.
const MARGIN: u32 = 6;
/// Behind the lanes.
const BACKGROUND: [u8; 3] = [22, 25, 30];
/// Of a lane in which nothing has run yet.
const EMPTY: [u8; 3] = [40, 45, 53];
/// Of a push.
const PUSH: [u8; 3] = [240, 98, 98];
/// Of words where nothing runs.
const TEXT: [u8; 3] = [225, 229, 235];
/// What is left of the colour of every other bar, so that neighbours of one colour can be told apart.
const ODD_SHADE: u32 = 75;

/// A call and the pixels between which its bar stands once it has ended.
struct Bar<'e> {
    call: &'e ProgramCall,
    begin: u32,
    end: u32,
}

/// The lanes of an episode below pictures of one width.
pub(super) struct Lanes<'e> {
    episode: &'e Episode,
    lanes: Vec<Vec<Bar<'e>>>,
    width: u32,
    /// Where the axis begins, in pixels.
    left: u32,
}

impl<'e> Lanes<'e> {
    /// Below pictures of this width.
    pub(super) fn new(episode: &'e Episode, width: u32) -> Self {
        let label = |call: &ProgramCall| call.label(&episode.scene).chars().count();
        let longest = episode.calls.iter().map(label).max().unwrap_or(0) as u32;
        let left = (2 * MARGIN + longest * glyph_width()).min(width / 2);
        let mut lanes = Self { episode, lanes: Vec::new(), width, left };
        lanes.lanes = calls_by_depth(episode).into_values().map(|calls| lanes.bars(&calls)).collect();
        lanes
    }

    /// How much higher pictures become.
    pub(super) fn height(&self) -> u32 {
        2 * MARGIN + LANE * self.lanes.len() as u32
    }

    /// All colours but those at the edges of words.
    pub(super) fn colors(&self) -> BTreeSet<[u8; 3]> {
        let bars = self.lanes.iter().flat_map(|bars| bars.iter().enumerate());
        let of_bars = bars.map(|(position, bar)| self.color(position, bar));
        of_bars.chain([BACKGROUND, EMPTY, PUSH, TEXT]).collect()
    }

    /// Of the nth bar of a lane.
    fn color(&self, position: usize, bar: &Bar<'_>) -> [u8; 3] {
        let share = if position.is_multiple_of(2) { 100 } else { ODD_SHADE };
        bar.call.color(&self.episode.scene).map(|part| (u32::from(part) * share / 100) as u8)
    }

    fn bars(&self, calls: &[&'e ProgramCall]) -> Vec<Bar<'e>> {
        let bar = |&call: &&'e ProgramCall| {
            let [begin, end] = [call.frames.begin, call.frames.last()].map(|frame| self.column(self.time(frame)));
            Bar { call, begin, end: end.max(begin + 1) }
        };
        calls.iter().map(bar).collect()
    }

    fn time(&self, frame: u32) -> u64 {
        self.episode.frames.get(frame as usize).or(self.episode.frames.last()).map_or(0, |frame| frame.time_nanos)
    }

    /// Where a time stands on the axis.
    fn column(&self, time_nanos: u64) -> u32 {
        let length = u64::from(self.width.saturating_sub(self.left + MARGIN));
        let end_nanos = self.episode.frames.last().map_or(1, |frame| frame.time_nanos.max(1));
        self.left + (time_nanos.min(end_nanos) as f64 / end_nanos as f64 * length as f64) as u32
    }

    /// The picture with the lanes as they are at this time below it.
    pub(super) fn below(&self, mut picture: Rgb, time_nanos: u64) -> Rgb {
        let [width, top] = picture.size_px;
        picture.size_px = [width, top + self.height()];
        let n_pixels = (self.height() * width) as usize;
        picture.bytes.extend(BACKGROUND.iter().copied().cycle().take(3 * n_pixels));
        let now = self.column(time_nanos);
        for (lane, bars) in self.lanes.iter().enumerate() {
            let middle = top + MARGIN + LANE * lane as u32 + LANE / 2;
            self.draw_lane(&mut picture, bars, middle, now);
        }
        for push in &self.episode.pushes {
            let column = self.column(self.time(push.frames.begin));
            if column <= now {
                fill(&mut picture, [column, column + 2], [top + MARGIN, top + self.height() - MARGIN], PUSH);
            }
        }
        picture
    }

    fn draw_lane(&self, picture: &mut Rgb, bars: &[Bar<'_>], middle: u32, now: u32) {
        let rows = [middle - BAR / 2, middle + BAR / 2];
        fill(picture, [self.left, self.width.saturating_sub(MARGIN)], rows, EMPTY);
        for (position, bar) in bars.iter().enumerate().filter(|(_, bar)| bar.begin <= now) {
            fill(picture, [bar.begin, bar.end.min(now + 1)], rows, self.color(position, bar));
        }
        if let Some(bar) = bars.iter().rev().find(|bar| bar.begin <= now && now <= bar.end) {
            let words = bar.call.label(&self.episode.scene);
            write(picture, &words, [MARGIN, middle - LANE / 2 + 2], self.left);
        }
    }
}

fn glyph_width() -> u32 {
    get_raster_width(FontWeight::Regular, RasterHeight::Size16) as u32
}

/// Fills columns and rows that lie in the picture.
fn fill(picture: &mut Rgb, columns: [u32; 2], rows: [u32; 2], color: [u8; 3]) {
    let [width, height] = picture.size_px;
    for row in rows[0]..rows[1].min(height) {
        for column in columns[0]..columns[1].min(width) {
            let at = 3 * (row * width + column) as usize;
            picture.bytes[at..at + 3].copy_from_slice(&color);
        }
    }
}

/// Writes words from their upper left corner on, no further than to `end`.
fn write(picture: &mut Rgb, words: &str, [left, top]: [u32; 2], end: u32) {
    let width = picture.size_px[0];
    for (position, letter) in words.chars().enumerate() {
        let first = left + position as u32 * glyph_width();
        let raster = get_raster(letter, FontWeight::Regular, RasterHeight::Size16);
        if first + glyph_width() > end.min(width) {
            return;
        }
        for (row, inks) in raster.iter().flat_map(|raster| raster.rows().enumerate()) {
            for (column, &ink) in inks.iter().enumerate() {
                let at = 3 * ((top + row as u32) * width + first + column as u32) as usize;
                for (part, text) in picture.bytes[at..at + 3].iter_mut().zip(TEXT) {
                    let share = u32::from(ink);
                    *part = ((u32::from(*part) * (255 - share) + u32::from(text) * share) / 255) as u8;
                }
            }
        }
    }
}
