//! The colours of the scene in light and dark surroundings, in one place.

use super::color::{Color, srgb};
use super::frame::{Background, Display};

/// Colours of everything that is not coloured by its own data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Theme {
    /// The backdrop.
    pub background: Background,
    /// Surfaces without a colour of their own.
    pub surface: Color,
    /// Healed patches.
    pub patch: Color,
    /// Free curves.
    pub curve: Color,
    /// Edges on filled surfaces.
    pub edge: Color,
    /// Edges where surfaces are not filled.
    pub bare_edge: Color,
    /// What is selected.
    pub accent: Color,
    /// The line along which the section plane cuts.
    pub cap: Color,
}

impl Theme {
    /// Dark lines on a pale ground.
    pub fn light() -> Self {
        Self {
            background: Background::light(),
            surface: srgb(0xb4c0cc),
            patch: srgb(0xe9b96a),
            curve: srgb(0x1f5fa8),
            edge: srgb(0x1c232b),
            bare_edge: srgb(0x27313c),
            accent: srgb(0xf07f13),
            cap: srgb(0xc8321f),
        }
    }

    /// Light on dark.
    pub fn dark() -> Self {
        Self {
            background: Background::dark(),
            surface: srgb(0xa3b0bd),
            patch: srgb(0xdca854),
            curve: srgb(0x63aef0),
            edge: srgb(0x0c0f12),
            bare_edge: srgb(0xc4ced9),
            accent: srgb(0xffa02e),
            cap: srgb(0xff6a4d),
        }
    }

    /// The colour of edges under these display flags.
    pub fn edge(&self, display: &Display) -> Color {
        let filled = (display.shaded || display.zebra) && !display.wireframe && !display.xray;
        if filled { self.edge } else { self.bare_edge }
    }
}
