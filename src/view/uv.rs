//! The domain of a surface as a picture: knot lines and whatever a tool marks in it, as plain data.
//!
//! A [`UvPicture`] is made by a tool (or by [`UvPicture::plain`]) and drawn by the window's uv view; a [`UvMark`] is a
//! shape in parameters with a paint, a label for the cursor and a number by which the tool knows it again. What is
//! under the cursor is found within a radius in pixels: points first, then outlines, then the smallest filled shape
//! around it.

use std::sync::Arc;

use glam::DVec2;

use super::uv_map::UvMap;
use crate::kernel::geom::Surface;
use crate::model::document::EntityId;

/// How near the cursor must be to a point or a line, in pixels.
pub const RADIUS: f64 = 8.0;

/// A colour by what it means; the window knows what it looks like in its theme.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum UvInk {
    /// As text.
    #[default]
    Text,
    /// Steps back.
    Quiet,
    /// What is selected or active.
    Accent,
    /// Fine.
    Good,
    /// Needs a look.
    Warn,
    /// Wrong.
    Bad,
    /// One of four colours that are told apart, by number modulo 4.
    Side(usize),
    /// This one, sRGB.
    Own([f32; 3]),
}

/// How a line is broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UvDash {
    /// It is not.
    #[default]
    Solid,
    /// Long strokes.
    Long,
    /// Short strokes.
    Short,
}

/// The form of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UvGlyph {
    /// A filled disc: ends of curves.
    #[default]
    Round,
    /// A circle.
    Ring,
    /// Two strokes.
    Cross,
    /// Branch points.
    Diamond,
    /// Isolated points.
    Square,
    /// Miter points.
    Triangle,
}

/// A shape in parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum UvShape {
    /// Low and high corner.
    Rectangle([DVec2; 2]),
    /// Four corners in order around it.
    Quad([DVec2; 4]),
    /// A polyline; closed when its last point is its first.
    Polyline(Vec<DVec2>),
    /// What loops enclose by the even-odd rule: an outer one, then its holes. Filled by hatching.
    Region(Vec<Vec<DVec2>>),
    /// One point.
    Point(DVec2, UvGlyph),
}

/// Something in the domain.
#[derive(Clone, Debug, PartialEq)]
pub struct UvMark {
    /// Where.
    pub shape: UvShape,
    /// The colour of outline, line or point.
    pub ink: UvInk,
    /// The width of the line, or the diameter of the point, in points on screen; 0: no outline.
    pub width: f32,
    /// How the line is broken.
    pub dash: UvDash,
    /// How opaque the inside is, 0..=1.
    pub fill: f32,
    /// What the cursor says over it; nothing when empty.
    pub label: String,
    /// Whether the label also stands beside it.
    pub named: bool,
    /// The tool's number for it; what has none cannot be hovered or clicked.
    pub id: Option<u64>,
}

impl UvMark {
    fn new(shape: UvShape, width: f32, fill: f32) -> Self {
        let (ink, dash) = (UvInk::default(), UvDash::default());
        Self { shape, ink, width, dash, fill, label: String::new(), named: false, id: None }
    }

    /// A rectangle from its low to its high corner, with a faint inside.
    pub fn rectangle(corners: [DVec2; 2]) -> Self {
        Self::new(UvShape::Rectangle(corners), 1.5, 0.18)
    }

    /// A quadrangle, corners in order, with a faint inside.
    pub fn quad(corners: [DVec2; 4]) -> Self {
        Self::new(UvShape::Quad(corners), 1.5, 0.3)
    }

    /// A polyline.
    pub fn polyline(points: Vec<DVec2>) -> Self {
        Self::new(UvShape::Polyline(points), 2.0, 0.0)
    }

    /// A hatched region, outer loop first.
    pub fn region(loops: Vec<Vec<DVec2>>) -> Self {
        Self::new(UvShape::Region(loops), 1.5, 0.6)
    }

    /// A point.
    pub fn point(at: DVec2, glyph: UvGlyph) -> Self {
        Self::new(UvShape::Point(at, glyph), 9.0, 1.0)
    }

    /// In this colour.
    #[must_use]
    pub fn ink(self, ink: UvInk) -> Self {
        Self { ink, ..self }
    }

    /// With this width of the line or diameter of the point.
    #[must_use]
    pub fn width(self, width: f32) -> Self {
        Self { width, ..self }
    }

    /// With a broken line.
    #[must_use]
    pub fn dash(self, dash: UvDash) -> Self {
        Self { dash, ..self }
    }

    /// With an inside as opaque as this.
    #[must_use]
    pub fn fill(self, fill: f32) -> Self {
        Self { fill, ..self }
    }

    /// With what the cursor says over it.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    /// With its label beside it.
    #[must_use]
    pub fn named(self) -> Self {
        Self { named: true, ..self }
    }

    /// Known to the tool by this number: it can be hovered and clicked.
    #[must_use]
    pub fn id(self, id: u64) -> Self {
        Self { id: Some(id), ..self }
    }

    /// The box around it: low and high corner.
    pub fn bounds(&self) -> [DVec2; 2] {
        let around = |points: &mut dyn Iterator<Item = DVec2>| {
            points.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[a, b], p| [a.min(p), b.max(p)])
        };
        match &self.shape {
            UvShape::Rectangle([a, b]) => [a.min(*b), a.max(*b)],
            UvShape::Quad(corners) => around(&mut corners.iter().copied()),
            UvShape::Polyline(points) => around(&mut points.iter().copied()),
            UvShape::Region(loops) => around(&mut loops.iter().flatten().copied()),
            UvShape::Point(p, _) => [*p, *p],
        }
    }

    /// Where a label beside it goes.
    pub fn anchor(&self) -> DVec2 {
        match &self.shape {
            UvShape::Polyline(points) => points.get(points.len() / 2).copied().unwrap_or(DVec2::NAN),
            _ => {
                let [low, high] = self.bounds();
                0.5 * (low + high)
            }
        }
    }

    /// The outline as runs of points: closed ones end where they begin.
    pub fn outline(&self) -> Vec<Vec<DVec2>> {
        match &self.shape {
            UvShape::Rectangle([a, b]) => {
                vec![vec![*a, DVec2::new(b.x, a.y), *b, DVec2::new(a.x, b.y), *a]]
            }
            UvShape::Quad([a, b, c, d]) => vec![vec![*a, *b, *c, *d, *a]],
            UvShape::Polyline(points) => vec![points.clone()],
            UvShape::Region(loops) => loops.iter().map(|run| closed(run)).collect(),
            UvShape::Point(..) => Vec::new(),
        }
    }

    /// Whether the inside of a filled shape holds a point.
    pub fn contains(&self, p: DVec2) -> bool {
        match &self.shape {
            UvShape::Rectangle(_) => {
                let [a, b] = self.bounds();
                p.cmpge(a).all() && p.cmple(b).all()
            }
            UvShape::Quad(_) | UvShape::Region(_) => inside(&self.outline(), p),
            UvShape::Polyline(_) | UvShape::Point(..) => false,
        }
    }
}

fn closed(run: &[DVec2]) -> Vec<DVec2> {
    let mut out = run.to_vec();
    if let Some(first) = run.first().copied().filter(|first| run.last() != Some(first)) {
        out.push(first);
    }
    out
}

/// The even-odd rule.
fn inside(loops: &[Vec<DVec2>], p: DVec2) -> bool {
    let crossings = loops.iter().flat_map(|run| run.windows(2)).filter(|e| {
        let (a, b) = (e[0], e[1]);
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

/// Pieces of lines of rising slope, `step` apart, inside loops of pixels. What a region is filled with.
pub fn hatching(loops: &[Vec<DVec2>], step: f64) -> Vec<[DVec2; 2]> {
    // Turned by 45 degrees the hatching is horizontal.
    let turn = DVec2::from_angle(std::f64::consts::FRAC_PI_4);
    let back = DVec2::new(turn.x, -turn.y);
    let turned: Vec<Vec<DVec2>> = loops.iter().map(|run| run.iter().map(|p| turn.rotate(*p)).collect()).collect();
    let all = || turned.iter().flatten();
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.y), b.max(p.y)));
    if !(low.is_finite() && high.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let mut out = Vec::new();
    // Lines through multiples of the step, so that the hatching of neighbours lines up.
    let mut y = (low / step).ceil() * step;
    while y <= high {
        let mut cuts: Vec<f64> = Vec::new();
        for e in turned.iter().flat_map(|run| run.windows(2)) {
            let (a, b) = (e[0], e[1]);
            if (a.y > y) != (b.y > y) {
                cuts.push(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
            }
        }
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.chunks_exact(2) {
            out.push([pair[0], pair[1]].map(|x| back.rotate(DVec2::new(x, y))));
        }
        y += step;
    }
    out
}

/// Small squares of colour over the whole domain, for fields that are too fine to draw one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct UvCells {
    /// Changes whenever the colours do and is never used twice.
    pub revision: u64,
    /// Breaks of the domain in u and v; the columns between two neighbours are equally wide.
    pub breaks: [Vec<f64>; 2],
    /// Columns between two breaks in u, and rows between two in v.
    pub per_span: [usize; 2],
    /// Colours, sRGB with alpha, u running fastest, from low v up.
    pub colors: Arc<Vec<[u8; 4]>>,
}

impl UvCells {
    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [0, 1].map(|k| self.breaks[k].len().saturating_sub(1) * self.per_span[k])
    }
}

/// The domain of one surface and what is marked in it.
#[derive(Clone, Debug, PartialEq)]
pub struct UvPicture {
    /// Of which entity.
    pub entity: EntityId,
    /// What stands above it.
    pub title: String,
    /// `[[u0, u1], [v0, v1]]`.
    pub domain: [[f64; 2]; 2],
    /// Distinct knots inside the domain and at its ends, in u and in v.
    pub knots: [Vec<f64>; 2],
    /// A field of colours under everything.
    pub cells: Option<UvCells>,
    /// What is marked, the last on top.
    pub marks: Vec<UvMark>,
}

/// A mark under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvHit {
    /// Its place among the marks.
    pub mark: usize,
    /// The tool's number for it.
    pub id: u64,
    /// Pixels from the cursor; 0 inside a filled shape.
    pub distance: f64,
}

impl UvPicture {
    /// A domain with its knot lines and nothing else.
    pub fn plain(entity: EntityId, title: impl Into<String>, surface: &Surface) -> Self {
        Self {
            entity,
            title: title.into(),
            domain: surface.domain(),
            knots: surface.knots().each_ref().map(|k| k.breaks()),
            cells: None,
            marks: Vec::new(),
        }
    }

    /// The mark under a pixel. Points within the radius first, the nearest of them; then lines and outlines; then the
    /// filled shape with the smallest box around the cursor. Among equals the last, which lies on top.
    pub fn hit(&self, map: &UvMap, pixel: DVec2, radius: f64) -> Option<UvHit> {
        let uv = map.to_uv(pixel);
        let reach = radius / map.scale();
        let mut best: Option<(u8, f64, UvHit)> = None;
        for (at, mark) in self.marks.iter().enumerate() {
            let Some(id) = mark.id else { continue };
            let [low, high] = mark.bounds();
            if uv.cmplt(low - reach).any() || uv.cmpgt(high + reach).any() {
                continue;
            }
            let place = match &mark.shape {
                UvShape::Point(p, _) => {
                    let away = map.to_pixel(*p).distance(pixel);
                    (away <= radius).then_some((0, away, away))
                }
                _ => {
                    let runs = mark.outline();
                    let edges = runs.iter().flat_map(|run| run.windows(2));
                    let away = edges
                        .map(|e| segment_distance(pixel, map.to_pixel(e[0]), map.to_pixel(e[1])))
                        .fold(f64::INFINITY, f64::min);
                    let open = matches!(mark.shape, UvShape::Polyline(_));
                    if open {
                        (away <= radius).then_some((1, away, away))
                    } else if mark.contains(uv) {
                        let size = (high - low) * map.scale();
                        Some((2, size.x * size.y, 0.0))
                    } else {
                        (away <= radius).then_some((3, away, away))
                    }
                }
            };
            let Some((class, order, distance)) = place else { continue };
            let better = best.is_none_or(|(c, o, _)| (class, order) <= (c, o));
            if better {
                best = Some((class, order, UvHit { mark: at, id, distance }));
            }
        }
        best.map(|(.., hit)| hit)
    }
}

fn segment_distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let t = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + d * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::uv_map::UvNavigation;

    const SIZE: DVec2 = DVec2::new(300.0, 300.0);

    fn picture(marks: Vec<UvMark>) -> (UvPicture, UvMap) {
        let domain = [[0.0, 2.0], [0.0, 1.0]];
        let picture = UvPicture {
            entity: EntityId(1),
            title: String::new(),
            domain,
            knots: [vec![0.0, 2.0], vec![0.0, 1.0]],
            cells: None,
            marks,
        };
        (picture, UvMap::new(domain, SIZE, UvNavigation::default()))
    }

    fn hit(marks: Vec<UvMark>, uv: DVec2) -> Option<u64> {
        let (picture, map) = picture(marks);
        picture.hit(&map, map.to_pixel(uv), RADIUS).map(|hit| hit.id)
    }

    #[test]
    fn points_come_before_lines_and_lines_before_what_is_filled() {
        let at = DVec2::new(1.0, 0.5);
        let rectangle = UvMark::rectangle([DVec2::ZERO, DVec2::new(2.0, 1.0)]).id(1);
        let line = UvMark::polyline(vec![DVec2::new(0.0, 0.5), DVec2::new(2.0, 0.5)]).id(2);
        let point = UvMark::point(at, UvGlyph::Round).id(3);
        let all = vec![point.clone(), line.clone(), rectangle.clone()];
        assert_eq!(hit(all.clone(), at), Some(3));
        assert_eq!(hit(all.clone(), DVec2::new(0.3, 0.5)), Some(2));
        assert_eq!(hit(all.clone(), DVec2::new(0.3, 0.2)), Some(1));
        assert_eq!(hit(all, DVec2::new(-1.0, 0.2)), None);
        let dumb = UvMark { id: None, ..point };
        assert_eq!(hit(vec![rectangle, dumb], at), Some(1), "what has no number is not there for the cursor");
    }

    #[test]
    fn of_nested_rectangles_the_smallest_is_hit() {
        let big = UvMark::rectangle([DVec2::ZERO, DVec2::new(2.0, 1.0)]).id(1);
        let small = UvMark::rectangle([DVec2::splat(0.25), DVec2::splat(0.75)]).id(2);
        for marks in [vec![big.clone(), small.clone()], vec![small, big]] {
            assert_eq!(hit(marks.clone(), DVec2::splat(0.5)), Some(2));
            assert_eq!(hit(marks, DVec2::new(1.5, 0.5)), Some(1));
        }
    }

    #[test]
    fn the_radius_is_in_pixels_at_any_magnification() {
        let (picture, _) = picture(vec![UvMark::point(DVec2::new(1.0, 0.5), UvGlyph::Ring).id(7)]);
        for zoom in [1.0, 40.0, 1e5] {
            let map = UvMap::new(picture.domain, SIZE, UvNavigation { zoom, center: DVec2::splat(0.5) });
            let at = map.to_pixel(DVec2::new(1.0, 0.5));
            assert!(picture.hit(&map, at + DVec2::X * (RADIUS - 0.1), RADIUS).is_some());
            assert!(picture.hit(&map, at + DVec2::X * (RADIUS + 0.1), RADIUS).is_none());
        }
    }

    #[test]
    fn a_region_with_a_hole_is_hatched_and_hit_outside_the_hole_only() {
        let square = |a: f64, b: f64| vec![DVec2::new(a, a), DVec2::new(b, a), DVec2::new(b, b), DVec2::new(a, b)];
        let region = UvMark::region(vec![square(0.0, 1.0), square(0.4, 0.6)]).id(1);
        assert!(region.contains(DVec2::splat(0.2)) && !region.contains(DVec2::splat(0.5)));
        let loops: Vec<Vec<DVec2>> =
            region.outline().iter().map(|run| run.iter().map(|p| *p * 100.0).collect()).collect();
        let lines = hatching(&loops, 2.0);
        let length: f64 = lines.iter().map(|[a, b]| a.distance(*b)).sum();
        // Lines two apart cover half a unit of length for each unit of area, up to the rim.
        let area = 100.0 * 100.0 - 20.0 * 20.0;
        assert!((length - 0.5 * area).abs() < 0.02 * area, "{length}");
        for [a, b] in lines {
            let middle = 0.5 * (a + b) / 100.0;
            assert!(region.contains(middle), "{middle}");
            assert!(
                ((b - a).normalize() * DVec2::new(1.0, -1.0) - 0.5_f64.sqrt()).length() < 1e-9
                    || (b - a).length() < 1e-9
            );
        }
    }

    #[test]
    fn a_plain_picture_shows_the_knots() {
        use glam::DVec3;
        let surface = Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]).unwrap();
        let picture = UvPicture::plain(EntityId(4), "plane", &surface);
        assert_eq!(picture.domain, surface.domain());
        assert_eq!(picture.knots, [vec![0.0, 1.0], vec![0.0, 1.0]]);
    }
}
