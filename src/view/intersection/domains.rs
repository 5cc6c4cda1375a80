//! A result in the parameter domains of its surfaces, for the uv view: preimages of curves, points, boxes and regions.
//!
//! Both preimages of an intersection curve have its colour; of a self-intersection, whose preimages lie in one domain,
//! the second has a colour of its own, and the two are glued where they meet: at the miter points, with their
//! quadrangles. The cursor is marked in every domain that it has a preimage in.

use glam::DVec2;

use super::marks::Focus;
use super::style::{Mark, Stroke, junction};
use super::{Class, Found, Item, OnCurve, hatch, place};
use crate::kernel::ssi::result::{CurveEnd, CurvePoint};
use crate::view::uv::{UvDash, UvGlyph, UvInk, UvMark, UvPicture};

/// The pictures of the at most two domains that matter now: those of the cursor, of what is chosen, or the first two.
pub fn pictures(found: &Found, focus: Focus, cursor: Option<OnCurve>, dark: bool) -> Vec<UvPicture> {
    shown(found, focus, cursor).into_iter().filter_map(|n| picture(found, n, focus, cursor, dark)).collect()
}

/// The surfaces whose domains are shown.
fn shown(found: &Found, focus: Focus, cursor: Option<OnCurve>) -> Vec<usize> {
    let r = &found.result;
    let first = |k: usize| r.curves.get(k).and_then(|c| c.points.first()).map(|p| [p.a, p.b]);
    let of_item = |item| match item {
        Item::Curve(k) => first(k),
        Item::Junction(k) => r.junctions.get(k).map(|j| [j.a, j.b]),
        Item::Miter(k) => r.miters.get(k).map(|m| [m.a, m.a]),
        Item::Region(k) => r.regions.get(k)?.boundary.first()?.first().map(|p| [p.a, p.b]),
        Item::Unresolved(k) => r.unresolved.get(k).map(|u| [u.a, u.b]),
    };
    let at_cursor = cursor.and_then(|c| c.point(found)).map(|p| [p.a, p.b]);
    let pair = at_cursor.or_else(|| focus.chosen.and_then(of_item)).or_else(|| first(0));
    let mut numbers = match pair {
        Some(pair) => pair.to_vec(),
        None => found.numbers().into_iter().take(2).collect(),
    };
    numbers.dedup();
    numbers
}

/// The number by which the uv view knows an item.
pub fn id_of(item: Item) -> u64 {
    let (kind, k) = match item {
        Item::Curve(k) => (0, k),
        Item::Junction(k) => (1, k),
        Item::Miter(k) => (2, k),
        Item::Region(k) => (3, k),
        Item::Unresolved(k) => (4, k),
    };
    (kind << 48) | k as u64
}

/// The item with that number.
pub fn item_of(id: u64) -> Option<Item> {
    let k = (id & ((1 << 48) - 1)) as usize;
    Some(match id >> 48 {
        0 => Item::Curve(k),
        1 => Item::Junction(k),
        2 => Item::Miter(k),
        3 => Item::Region(k),
        4 => Item::Unresolved(k),
        _ => return None,
    })
}

fn picture(found: &Found, number: usize, focus: Focus, cursor: Option<OnCurve>, dark: bool) -> Option<UvPicture> {
    let mut out = UvPicture::plain(found.id(number)?, found.name(number), found.surface(number)?);
    let r = &found.result;
    let mark = |mark: UvMark, item: Item, rgb: u32, label: String| {
        let more = if focus.chosen == Some(item) || focus.hovered == Some(item) { 1.5 } else { 0.0 };
        let width = mark.width + more;
        mark.ink(ink(rgb)).label(label).id(id_of(item)).width(width)
    };
    for k in 0..r.regions.len() {
        let item = Item::Region(k);
        let loops = [0, 1].map(|side| hatch::loops_on(found, k, number, side));
        for loops in loops.into_iter().flatten() {
            let rgb = Class::CoincidentBoundary.style(dark).rgb;
            out.marks.push(mark(UvMark::region(loops), item, rgb, format!("Overlap {}", k + 1)).width(0.0));
        }
        for hatch in found.hatches.get(k).into_iter().flatten().filter(|h| h.number == number) {
            let rgb = Class::CoincidentBoundary.style(dark).rgb;
            let line = |l: &Vec<DVec2>| mark(UvMark::polyline(l.clone()), item, rgb, format!("Overlap {}", k + 1));
            out.marks.extend(hatch.lines.iter().map(|l| line(l).width(1.0)));
        }
    }
    for (k, u) in r.unresolved.iter().enumerate() {
        let rgb = Class::Unresolved.style(dark).rgb;
        for (n, [us, vs]) in [(u.a, u.uv_box), (u.b, u.st_box)] {
            if n == number {
                let corners = [DVec2::new(us[0], vs[0]), DVec2::new(us[1], vs[1])];
                let shape = UvMark::rectangle(corners).dash(UvDash::Short);
                out.marks.push(mark(shape, Item::Unresolved(k), rgb, format!("Unresolved: {}", u.reason)));
            }
        }
    }
    for (k, m) in r.miters.iter().enumerate().filter(|(_, m)| m.a == number) {
        let rgb = Class::SelfIntersection.style(dark).rgb;
        let label = format!("Miter point {}, quadrangle", k + 1);
        out.marks.push(mark(UvMark::quad(m.quad).fill(0.45), Item::Miter(k), rgb, label));
    }
    for (k, curve) in r.curves.iter().enumerate() {
        let item = Item::Curve(k);
        let style = Class::of(curve.kind).style(dark);
        let dash = match style.stroke {
            Stroke::Dashed(on, _) if on < 8.0 => UvDash::Short,
            Stroke::Dashed(on, _) if on < 16.0 => UvDash::Long,
            _ => UvDash::Solid,
        };
        for side in 0..2 {
            let second = found.with_itself && side == 1;
            let rgb = if second { partner(dark) } else { style.rgb };
            let label = if found.with_itself {
                format!("Curve {}, {} preimage", k + 1, ["first", "second"][side])
            } else {
                format!("Curve {}", k + 1)
            };
            for run in runs(found, &curve.points, number, side) {
                let shape = UvMark::polyline(run).dash(dash);
                let width = shape.width.max(0.8 * style.width);
                out.marks.push(mark(shape.width(width), item, rgb, label.clone()));
            }
            if curve.closed {
                continue;
            }
            let ends = [curve.points.first(), curve.points.last()];
            for (p, end) in ends.into_iter().zip(curve.ends) {
                let Some(at) = p.and_then(|p| preimage(p, number, side)) else { continue };
                let (glyph, rgb) = match end {
                    CurveEnd::Unresolved => (UvGlyph::Cross, Class::Unresolved.style(dark).rgb),
                    _ => (UvGlyph::Round, rgb),
                };
                if !matches!(end, CurveEnd::Junction | CurveEnd::Miter) {
                    out.marks.push(UvMark::point(at, glyph).ink(ink(rgb)).width(6.0));
                }
            }
        }
    }
    for (k, j) in place::firsts(&r.junctions).into_iter().zip(&r.junctions) {
        let isolated = junction(j.kind).0 == Mark::Isolated;
        let class = if isolated { Class::Tangential } else { Class::Transversal };
        let glyph = if isolated { UvGlyph::Square } else { UvGlyph::Diamond };
        for (n, at) in [(j.a, j.uv), (j.b, j.st)] {
            if n == number {
                let label = format!("{} {}", junction(j.kind).1, k + 1);
                out.marks.push(mark(UvMark::point(at, glyph), Item::Junction(k), class.style(dark).rgb, label));
            }
        }
    }
    for (k, m) in r.miters.iter().enumerate().filter(|(_, m)| m.a == number) {
        let shape = UvMark::point(m.uv, UvGlyph::Triangle).width(10.0);
        let rgb = Class::SelfIntersection.style(dark).rgb;
        out.marks.push(mark(shape, Item::Miter(k), rgb, format!("Miter point {}", k + 1)));
    }
    if let Some(p) = cursor.and_then(|c| c.point(found)) {
        for side in 0..2 {
            if let Some(at) = preimage(&p, number, side) {
                out.marks.push(UvMark::point(at, UvGlyph::Ring).ink(UvInk::Accent).width(13.0));
                out.marks.push(UvMark::point(at, UvGlyph::Round).ink(UvInk::Accent).width(4.0));
            }
        }
    }
    Some(out)
}

/// The colour of the second preimage of a self-intersection.
fn partner(dark: bool) -> u32 {
    if dark { 0xff9a3c } else { 0xa84600 }
}

fn ink(rgb: u32) -> UvInk {
    UvInk::Own([16, 8, 0].map(|shift| (rgb >> shift & 255) as f32 / 255.0))
}

fn preimage(p: &CurvePoint, number: usize, side: usize) -> Option<DVec2> {
    let (n, at) = if side == 0 { (p.a, p.uv) } else { (p.b, p.st) };
    (n == number).then_some(at)
}

/// The preimage of a curve in one domain, broken where it leaves the surface and where it jumps across a seam.
pub fn runs(found: &Found, points: &[CurvePoint], number: usize, side: usize) -> Vec<Vec<DVec2>> {
    let mut out: Vec<Vec<DVec2>> = Vec::new();
    let mut last: Option<&CurvePoint> = None;
    for p in points {
        let Some(at) = preimage(p, number, side) else {
            last = None;
            continue;
        };
        match (last, out.last_mut()) {
            (Some(before), Some(run)) if found.joined(before, p, side) => run.push(at),
            _ => out.push(vec![at]),
        }
        last = Some(p);
    }
    out.retain(|run| run.len() > 1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::intersection::testing::{document, graph, met, square, two_planes};
    use crate::view::uv::UvShape;

    fn lines(picture: &UvPicture) -> Vec<Vec<DVec2>> {
        let line = |m: &UvMark| match &m.shape {
            UvShape::Polyline(points) => Some(points.clone()),
            _ => None,
        };
        picture.marks.iter().filter_map(line).collect()
    }

    #[test]
    fn both_domains_show_the_curve_and_the_cursor() {
        let found = met(&two_planes());
        let cursor = OnCurve::at_fraction(&found, 0, 0.5);
        let shown = pictures(&found, Focus::default(), cursor, true);
        assert_eq!(shown.iter().map(|p| p.entity).collect::<Vec<_>>(), [found.subjects[0].id, found.subjects[1].id]);
        for (number, picture) in shown.iter().enumerate() {
            let surface = found.surface(number).unwrap();
            let lines = lines(picture);
            assert_eq!(lines.len(), 1);
            // The preimage maps back onto the x axis.
            assert!(lines[0].iter().all(|&uv| surface.eval(uv).truncate().y.abs() < 1e-9));
            let rings = picture.marks.iter().filter(|m| matches!(m.shape, UvShape::Point(_, UvGlyph::Ring)));
            assert_eq!(rings.count(), 1);
            assert!(picture.marks.iter().filter_map(|m| m.id).all(|id| item_of(id) == Some(Item::Curve(0))));
        }
    }

    #[test]
    fn a_crossing_is_a_diamond_in_both_domains() {
        let floor = square(glam::DVec3::ZERO, glam::DVec3::X * 1.5, glam::DVec3::Y * 1.5);
        let found = met(&document([graph(|x, y| x * x - y * y), floor]));
        for picture in pictures(&found, Focus::default(), None, false) {
            let diamonds = picture.marks.iter().filter(|m| matches!(m.shape, UvShape::Point(_, UvGlyph::Diamond)));
            assert_eq!(diamonds.count(), 1);
            assert_eq!(lines(&picture).len(), 4);
        }
    }

    #[test]
    fn numbers_of_items_survive() {
        for item in [Item::Curve(0), Item::Junction(7), Item::Miter(1 << 40), Item::Region(3), Item::Unresolved(2)] {
            assert_eq!(item_of(id_of(item)), Some(item));
        }
        assert_eq!(item_of(9 << 48), None);
    }
}
