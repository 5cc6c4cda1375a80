//! The drawing of a result: lines by class, and one glyph where something ends, crosses, touches or stays open.

use glam::DVec3;

use super::hatch::region;
use super::style::{Mark, Stroke, Style, junction};
use super::{Class, Found, Item, place};
use crate::kernel::ssi::result::CurveEnd;

/// A line to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLine {
    /// Its points.
    pub points: Vec<DVec3>,
    /// What it looks like.
    pub style: Style,
    /// What it is.
    pub of: Item,
}

/// A glyph to draw; its size on the screen does not depend on the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnGlyph {
    /// Where.
    pub at: DVec3,
    /// Its outline.
    pub mark: Mark,
    /// `0xRRGGBB`.
    pub rgb: u32,
    /// Diameter in points.
    pub size: f32,
    /// What it is.
    pub of: Item,
}

/// Lines and glyphs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Lines, the more important ones later.
    pub lines: Vec<DrawnLine>,
    /// Glyphs.
    pub glyphs: Vec<DrawnGlyph>,
    /// The hatch lines of coincident regions, and their colour.
    pub hatching: (Vec<Vec<DVec3>>, u32),
}

/// What is emphasised.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Focus {
    /// Under the cursor.
    pub hovered: Option<Item>,
    /// Chosen in the list or by a click.
    pub chosen: Option<Item>,
}

impl Drawing {
    /// What to draw of a result.
    pub fn new(found: &Found, focus: Focus, dark: bool) -> Self {
        let regions = 0..found.result.regions.len();
        let hatching = (regions.flat_map(|k| region(found, k)).collect(), Class::CoincidentBoundary.style(dark).rgb);
        let mut drawing = Self { hatching, ..Self::default() };
        for (k, place) in found.result.unresolved.iter().enumerate() {
            let item = Item::Unresolved(k);
            let style = focused(Class::Unresolved.style(dark), item, focus);
            for (number, area) in [(place.a, place.uv_box), (place.b, place.st_box)] {
                let points = found.box_outline(number, area);
                drawing.glyph(points.first().copied(), Mark::Unresolved, style.rgb, 11.0, item);
                drawing.line(points, style, item);
            }
        }
        for (k, curve) in found.result.curves.iter().enumerate() {
            let item = Item::Curve(k);
            let style = focused(Class::of(curve.kind).style(dark), item, focus);
            drawing.line(curve.points.iter().map(|p| p.xyz).collect(), style, item);
            let ends = [curve.points.first(), curve.points.last()].map(|p| p.map(|p| p.xyz));
            if curve.closed {
                drawing.glyph(ends[0], Mark::Loop, style.rgb, 10.0, item);
                continue;
            }
            for (at, end) in ends.into_iter().zip(curve.ends) {
                match end {
                    CurveEnd::Boundary => drawing.glyph(at, Mark::End, style.rgb, 8.0, item),
                    CurveEnd::Loop => drawing.glyph(at, Mark::Loop, style.rgb, 10.0, item),
                    CurveEnd::Unresolved => {
                        drawing.glyph(at, Mark::Unresolved, Class::Unresolved.style(dark).rgb, 13.0, item);
                    }
                    // The point itself is drawn below.
                    CurveEnd::Junction | CurveEnd::Miter => {}
                }
            }
        }
        for (k, point) in place::distinct(&found.result.junctions) {
            let item = Item::Junction(k);
            let class = if junction(point.kind).0 == Mark::Isolated { Class::Tangential } else { Class::Transversal };
            let size = if focus.hovered == Some(item) || focus.chosen == Some(item) { 17.0 } else { 13.0 };
            drawing.glyph(Some(point.xyz), junction(point.kind).0, class.style(dark).rgb, size, item);
        }
        for (k, miter) in found.result.miters.iter().enumerate() {
            let item = Item::Miter(k);
            let size = if focus.hovered == Some(item) || focus.chosen == Some(item) { 18.0 } else { 14.0 };
            drawing.glyph(Some(miter.xyz), Mark::Miter, Class::SelfIntersection.style(dark).rgb, size, item);
        }
        drawing
    }

    fn line(&mut self, points: Vec<DVec3>, style: Style, of: Item) {
        if points.len() > 1 {
            self.lines.push(DrawnLine { points, style, of });
        }
    }

    fn glyph(&mut self, at: Option<DVec3>, mark: Mark, rgb: u32, size: f32, of: Item) {
        if let Some(at) = at {
            self.glyphs.push(DrawnGlyph { at, mark, rgb, size, of });
        }
    }
}

fn focused(style: Style, item: Item, focus: Focus) -> Style {
    let more = match (focus.chosen == Some(item), focus.hovered == Some(item)) {
        (true, _) => 2.5,
        (_, true) => 1.0,
        _ => 0.0,
    };
    let width = style.width + more;
    // A double line that is wider is still two lines.
    Style { width: if style.stroke == Stroke::Double { width + 0.5 * more } else { width }, ..style }
}

/// The entries of the legend: what there is, and how many of it; unresolved first.
pub fn legend(found: &Found) -> Vec<(Class, usize)> {
    let open = found.result.unresolved.len();
    let count = |class| match class {
        Class::Unresolved => open,
        _ => found.result.curves.iter().filter(|c| Class::of(c.kind) == class).count(),
    };
    Class::ALL.into_iter().map(|class| (class, count(class))).filter(|(_, n)| *n > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::ssi::result::{Junction, JunctionKind, Unresolved};
    use crate::view::intersection::testing::{document, graph, met, square, two_planes};

    #[test]
    fn a_segment_has_two_round_ends() {
        let drawing = Drawing::new(&met(&two_planes()), Focus::default(), true);
        assert_eq!(drawing.lines.len(), 1);
        assert_eq!(drawing.lines[0].style.stroke, Stroke::Solid);
        assert!(drawing.glyphs.iter().all(|g| g.mark == Mark::End) && drawing.glyphs.len() == 2);
    }

    #[test]
    fn a_saddle_in_its_tangent_plane_has_one_diamond_and_a_circle_one_ring() {
        let floor = |z| square(DVec3::Z * z, DVec3::X * 1.5, DVec3::Y * 1.5);
        let saddle = met(&document([graph(|x, y| x * x - y * y), floor(0.0)]));
        let drawing = Drawing::new(&saddle, Focus::default(), false);
        assert_eq!(drawing.lines.len(), 4, "four branches from the crossing");
        assert_eq!(drawing.glyphs.iter().filter(|g| g.mark == Mark::Junction).count(), 1);
        assert_eq!(drawing.glyphs.iter().filter(|g| g.mark == Mark::End).count(), 4);
        let bowl = met(&document([graph(|x, y| x * x + y * y), floor(0.25)]));
        let drawing = Drawing::new(&bowl, Focus::default(), false);
        assert_eq!(drawing.lines.len(), 1);
        assert_eq!(drawing.glyphs.iter().map(|g| g.mark).collect::<Vec<_>>(), [Mark::Loop]);
        let touching = met(&document([graph(|x, y| x * x + y * y), floor(0.0)]));
        let drawing = Drawing::new(&touching, Focus::default(), false);
        assert!(drawing.lines.is_empty());
        assert_eq!(drawing.glyphs.iter().map(|g| g.mark).collect::<Vec<_>>(), [Mark::Isolated]);
    }

    #[test]
    fn what_is_open_is_drawn_on_both_surfaces_and_counted() {
        let mut found = met(&two_planes());
        let area = [[0.2, 0.4], [0.5, 0.6]];
        let reason = "the cap".to_owned();
        found.result.unresolved.push(Unresolved { a: 0, uv_box: area, b: 1, st_box: area, reason });
        let drawing = Drawing::new(&found, Focus::default(), true);
        let open: Vec<_> = drawing.lines.iter().filter(|l| l.of == Item::Unresolved(0)).collect();
        assert_eq!(open.len(), 2);
        assert!(
            open.iter().all(|l| matches!(l.style.stroke, Stroke::Dashed(..)) && l.points.first() == l.points.last())
        );
        assert_eq!(legend(&found), [(Class::Unresolved, 1), (Class::Transversal, 1)]);
    }

    #[test]
    fn focus_widens_and_numbers_that_are_gone_draw_nothing() {
        let mut found = met(&two_planes());
        let plain = Drawing::new(&found, Focus::default(), true).lines[0].style.width;
        let item = Item::Curve(0);
        let hovered = Drawing::new(&found, Focus { hovered: Some(item), chosen: None }, true).lines[0].style.width;
        let chosen = Drawing::new(&found, Focus { hovered: None, chosen: Some(item) }, true).lines[0].style.width;
        assert!(plain < hovered && hovered < chosen);
        let point = found.result.curves[0].points[0];
        let (a, b) = (7, 9);
        let kind = JunctionKind::X;
        found.result.junctions.push(Junction { xyz: point.xyz, a, uv: point.uv, b, st: point.st, gap: 0.0, kind });
        let area = [[0.0, 1.0]; 2];
        found.result.unresolved.push(Unresolved { a: 7, uv_box: area, b: 9, st_box: area, reason: String::new() });
        assert!(Drawing::new(&found, Focus::default(), true).lines.iter().all(|l| l.of == item));
    }
}
