//! What a camera saw: colours, depths and segments.

use crate::scene::BodyIndex;

/// What a picture tells of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Red, green, blue.
    Color,
    /// How far away it is.
    Depth,
    /// What it shows: [`Segment::number`].
    Segments,
}

impl std::str::FromStr for Channel {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "color" => Ok(Self::Color),
            "depth" => Ok(Self::Depth),
            "segments" => Ok(Self::Segments),
            _ => Err(format!("unknown channel {word:?}; allowed: color, depth, segments")),
        }
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Segment {
    /// Nothing.
    Background,
    /// The table.
    Table,
    /// The gripper, its stem or its arm.
    Gripper,
    /// A body.
    Body(BodyIndex),
}

impl Segment {
    /// As pictures hold it: background 0, table 1, gripper 2, then the bodies.
    pub const fn number(self) -> u16 {
        match self {
            Self::Background => 0,
            Self::Table => 1,
            Self::Gripper => 2,
            Self::Body(BodyIndex(index)) => index + 3,
        }
    }

    /// From a picture's number.
    pub const fn from_number(number: u16) -> Self {
        match number {
            0 => Self::Background,
            1 => Self::Table,
            2 => Self::Gripper,
            _ => Self::Body(BodyIndex(number - 3)),
        }
    }
}

/// A rendered picture; rows from above, pixels from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// Red, green, blue (sRGB) of each pixel: `[height, width, 3]`; empty where only depths were drawn.
    pub rgb: Vec<u8>,
    /// Distance along the camera's axis in metres, `[height, width]`; infinite where there is nothing.
    pub depth_m: Vec<f32>,
    /// See [`Segment::number`], `[height, width]`.
    pub segments: Vec<u16>,
}

impl Picture {
    /// What a pixel shows.
    pub fn segment(&self, column: u32, row: u32) -> Segment {
        Segment::from_number(self.segments[(row * self.width + column) as usize])
    }

    /// The depth of a pixel, in metres.
    pub fn depth_at_m(&self, column: u32, row: u32) -> f32 {
        self.depth_m[(row * self.width + column) as usize]
    }

    /// The colour of a pixel.
    pub fn color(&self, column: u32, row: u32) -> [u8; 3] {
        let first = 3 * (row * self.width + column) as usize;
        [self.rgb[first], self.rgb[first + 1], self.rgb[first + 2]]
    }

    /// Depths in whole millimetres, `[height, width]`; 0 where there is nothing, or it is farther than 65 m.
    pub fn depth_mm(&self) -> Vec<u16> {
        let millimetres = |&depth_m: &f32| (1000.0 * depth_m).round();
        let whole = |depth: f32| if depth <= f32::from(u16::MAX) { depth as u16 } else { 0 };
        self.depth_m.iter().map(millimetres).map(whole).collect()
    }

    /// Whether any pixel shows a body.
    pub fn shows_a_body(&self) -> bool {
        self.segments.iter().any(|&segment| matches!(Segment::from_number(segment), Segment::Body(_)))
    }

    pub(super) fn resize(&mut self, width: u32, height: u32) {
        let n_pixels = width as usize * height as usize;
        (self.width, self.height) = (width, height);
        self.rgb.resize(3 * n_pixels, 0);
        self.depth_m.resize(n_pixels, f32::INFINITY);
        self.segments.resize(n_pixels, 0);
    }
}
