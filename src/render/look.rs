//! How things look that are nobody's place or form: light, colours, letters, and how finely pictures are drawn.

use crate::geometry::Vec3;

/// Sun and sky, in linear light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Towards the sun; of any length but 0.
    pub to_sun: Vec3,
    /// What the sun adds to a face that looks towards it.
    pub sun: [f32; 3],
    /// What comes from above to a face that looks up.
    pub sky: [f32; 3],
    /// What comes from below to a face that looks down.
    pub ground: [f32; 3],
}

/// How finely shadows are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadows {
    /// Not at all.
    None,
    /// With sharp edges.
    Sharp,
    /// With soft edges.
    Soft,
}

/// The letters on blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letters {
    /// None.
    None,
    /// In the middle of a face, which keeps its colour.
    Small,
    /// As large as a face: to tell blocks apart by letters alone, also in small pictures.
    Large,
}

/// The settings of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Sun and sky.
    pub light: Light,
    /// Shadows.
    pub shadows: Shadows,
    /// Samples across and down a pixel, 1 to 4: more make edges smoother. Colours are their mean; depth and segment are
    /// those of the nearest.
    pub samples: u32,
    /// The letters on blocks.
    pub letters: Letters,
    /// How high an arm stands above the gripper's hand, in metres.
    pub stem_m: f32,
    /// The colour of each body; where there is none, the scene's.
    pub body_colors: Vec<[u8; 3]>,
    /// The colour of the table.
    pub table_color: [u8; 3],
    /// Behind everything: at the picture's upper and lower side.
    pub background: [[u8; 3]; 2],
}

impl Look {
    /// For networks: one sample a pixel, sharp shadows, a hand without an arm.
    pub fn plain() -> Self {
        Self {
            light: Light {
                to_sun: Vec3::new(-0.42, -0.5, 1.0),
                sun: [0.80, 0.76, 0.68],
                sky: [0.44, 0.46, 0.50],
                ground: [0.20, 0.19, 0.18],
            },
            shadows: Shadows::Sharp,
            samples: 1,
            letters: Letters::Small,
            stem_m: 0.05,
            body_colors: Vec::new(),
            table_color: [196, 164, 128],
            background: [[226, 230, 234], [186, 192, 198]],
        }
    }

    /// As [`Look::plain`], with 2x2 samples: at 64 pixels small things keep their place between pixels.
    pub fn smooth() -> Self {
        Self { samples: 2, ..Self::plain() }
    }

    /// For people: soft shadows, an arm, smooth edges.
    pub fn fine() -> Self {
        Self { shadows: Shadows::Soft, samples: 2, stem_m: 0.7, ..Self::plain() }
    }
}

/// Red, green, blue of a picture as linear light.
pub(super) fn linear(rgb: [u8; 3]) -> [f32; 3] {
    rgb.map(|channel| {
        let value = f32::from(channel) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    })
}

/// Towards another colour of linear light.
pub(super) fn mixed(from: [f32; 3], to: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|channel| from[channel] + (to[channel] - from[channel]) * share)
}
