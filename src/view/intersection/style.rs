//! What each kind of curve looks like: a colour and a line style of its own, so that neither alone tells it apart.

use crate::kernel::ssi::result::{CurveKind, JunctionKind};

/// The stroke of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stroke {
    /// Unbroken.
    Solid,
    /// Strokes and gaps, in points on the screen.
    Dashed(f32, f32),
    /// Two parallel strokes.
    Double,
}

/// What a point looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// The end of a curve: a disc.
    End,
    /// A junction: a diamond.
    Junction,
    /// An isolated contact: a square.
    Isolated,
    /// A miter point: a triangle.
    Miter,
    /// The start of a closed curve: a ring.
    Loop,
    /// Unresolved: a cross.
    Unresolved,
}

/// How something is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// `0xRRGGBB` in sRGB.
    pub rgb: u32,
    /// Width in points.
    pub width: f32,
    /// The stroke.
    pub stroke: Stroke,
}

/// The classes of the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// The surfaces cross.
    Transversal,
    /// The surfaces touch.
    Tangential,
    /// The border of a coincident region.
    CoincidentBoundary,
    /// A surface meets itself.
    SelfIntersection,
    /// A sharp edge.
    CuspEdge,
    /// A self-intersection of an offset.
    Offset,
    /// Where an offset is singular.
    OffsetContour,
    /// What could not be decided.
    Unresolved,
}

impl Class {
    /// All classes, in the order of the legend.
    pub const ALL: [Self; 8] = [
        Self::Unresolved,
        Self::Transversal,
        Self::Tangential,
        Self::CoincidentBoundary,
        Self::SelfIntersection,
        Self::CuspEdge,
        Self::Offset,
        Self::OffsetContour,
    ];

    /// The class of a kind.
    pub fn of(kind: CurveKind) -> Self {
        match kind {
            CurveKind::Transversal => Self::Transversal,
            CurveKind::Tangential => Self::Tangential,
            CurveKind::CoincidentBoundary => Self::CoincidentBoundary,
            CurveKind::SelfIntersection => Self::SelfIntersection,
            CurveKind::CuspEdge => Self::CuspEdge,
            CurveKind::Offset => Self::Offset,
            CurveKind::OffsetContour => Self::OffsetContour,
        }
    }

    /// What the legend calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Transversal => "Crossing",
            Self::Tangential => "Touching",
            Self::CoincidentBoundary => "Border of overlap",
            Self::SelfIntersection => "Self-intersection",
            Self::CuspEdge => "Cusp edge",
            Self::Offset => "Offset self-intersection",
            Self::OffsetContour => "Offset contour",
            Self::Unresolved => "Unresolved",
        }
    }

    /// One sentence about it.
    pub fn help(self) -> &'static str {
        match self {
            Self::Transversal => "The surfaces pass through each other along the curve",
            Self::Tangential => "The surfaces touch along the curve and have the same tangent planes there",
            Self::CoincidentBoundary => "Inside of it the surfaces lie on each other",
            Self::SelfIntersection => "Two places of the same surface meet along the curve",
            Self::CuspEdge => "The surface turns back sharply along the curve: Su x Sv vanishes",
            Self::Offset => "The offset surface meets itself",
            Self::OffsetContour => "The offset surface is singular",
            Self::Unresolved => "Whether the surfaces meet here could not be decided; nothing is claimed about it",
        }
    }

    /// How it is drawn on a dark or a light ground.
    pub fn style(self, dark: bool) -> Style {
        let (on_dark, on_light, width, stroke) = match self {
            Self::Transversal => (0x3fa9ff, 0x0a5cc0, 3.0, Stroke::Solid),
            Self::Tangential => (0xff9a3c, 0xa84600, 4.5, Stroke::Double),
            Self::CoincidentBoundary => (0xffe14a, 0x6e5600, 3.0, Stroke::Dashed(9.0, 5.0)),
            Self::SelfIntersection => (0xd09bff, 0x7322b4, 3.0, Stroke::Dashed(18.0, 2.5)),
            Self::CuspEdge => (0xff7d9c, 0x9c1244, 3.0, Stroke::Dashed(2.5, 3.0)),
            Self::Offset => (0x3fe0a6, 0x006a4e, 3.0, Stroke::Dashed(14.0, 4.0)),
            Self::OffsetContour => (0xb6e04a, 0x456000, 2.5, Stroke::Dashed(6.0, 2.5)),
            Self::Unresolved => (0xff4de1, 0xb4009a, 3.0, Stroke::Dashed(4.0, 3.5)),
        };
        Style { rgb: if dark { on_dark } else { on_light }, width, stroke }
    }
}

/// The mark of a junction and what it is called.
pub fn junction(kind: JunctionKind) -> (Mark, &'static str) {
    match kind {
        JunctionKind::X => (Mark::Junction, "Two branches cross"),
        JunctionKind::Isolated => (Mark::Isolated, "Isolated contact"),
        JunctionKind::NearMiss => (Mark::Junction, "Near miss"),
        JunctionKind::HigherOrder => (Mark::Junction, "Several branches meet"),
        JunctionKind::ThreeSurfaces => (Mark::Junction, "Three surfaces meet"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(rgb: u32) -> f64 {
        let lin = |shift: u32| {
            let v = f64::from(rgb >> shift & 255) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * lin(16) + 0.7152 * lin(8) + 0.0722 * lin(0)
    }

    /// Told apart without colours, and without line styles.
    #[test]
    fn no_two_classes_share_a_colour_or_a_stroke() {
        for dark in [false, true] {
            for (k, a) in Class::ALL.iter().enumerate() {
                for b in &Class::ALL[k + 1..] {
                    assert_ne!(a.style(dark).rgb, b.style(dark).rgb, "{a:?} {b:?}");
                    assert_ne!(a.style(dark).stroke, b.style(dark).stroke, "{a:?} {b:?}");
                }
            }
        }
    }

    /// WCAG 2.1 asks for 3 between a mark and its ground; the grounds are the backdrops at the middle of the view.
    #[test]
    fn every_class_stands_out_from_the_backdrop() {
        for (dark, ground) in [(false, 0xe3e9ee), (true, 0x272d34)] {
            for class in Class::ALL {
                let (a, b) = (luminance(class.style(dark).rgb), luminance(ground));
                let contrast = (a.max(b) + 0.05) / (a.min(b) + 0.05);
                assert!(contrast >= 3.0, "{class:?} {dark}: {contrast:.1}");
            }
        }
    }
}
