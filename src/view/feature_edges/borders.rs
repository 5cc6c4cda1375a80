//! The borders of a surface or face, cut where what is near them changes.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::super::display::{CurveRef, Geometry};
use super::{EdgeOptions, EdgePiece, Near, Part, kind_of};
use crate::kernel::geom::trim::{EdgeRole, Sheet};
use crate::kernel::geom::{Aabb, Side};
use crate::kernel::mesh::surface_set::Scratch;

/// The borders of a whole surface; the edges of a face, a seam once.
pub(super) fn borders_of(part: &Part, sheet: &Sheet) -> Vec<CurveRef> {
    let Some(face) = sheet.face() else { return Side::ALL.map(|side| CurveRef::Border(part.id, side)).into() };
    let mut out = Vec::new();
    for (r, ring) in face.rings().iter().enumerate() {
        for (e, edge) in ring.edges.iter().enumerate() {
            let again = ring.edges[..e].iter().any(|other| other.id == edge.id);
            if edge.role == EdgeRole::Model && !again {
                out.push(CurveRef::Edge(part.id, r as u32, e as u32));
            }
        }
    }
    out
}

pub(super) fn border(
    parts: &[Part],
    k: usize,
    sheet: &Sheet,
    curve: CurveRef,
    options: &EdgeOptions,
    out: &mut Vec<EdgePiece>,
) {
    let own = &parts[k];
    let surface = sheet.surface();
    let geometry = match sheet {
        Sheet::Whole(surface) => Geometry::Surface(Arc::clone(surface)),
        Sheet::Trimmed(face) => Geometry::Face { face: Arc::clone(face), whole: false },
    };
    let Some([start, end]) = geometry.curve_domain(&curve) else { return };
    let mut breaks = vec![start];
    breaks.extend(geometry.curve_knots(&curve));
    breaks.push(end);
    let places = places(&breaks, options);
    let uv = |t: f64| geometry.curve_uv(&curve, t).unwrap_or(DVec2::ZERO);
    let points: Vec<DVec3> = places.iter().map(|&t| surface.eval(surface.clamped(uv(t)))).collect();
    let size = Aabb::of(points.iter().copied());
    // A border that is shorter than what is joined is a pole.
    if size.diagonal() <= options.joining_tol.min(1e-6 * own.bounds.diagonal()) {
        return;
    }
    let others = near_to(parts, own, &size, options);
    let mut scratch = Scratch::default();
    let look = |t: f64| near(own, sheet, &curve, &others, uv(t), options, &mut scratch);
    stretches(curve, [start, end], &places, look, options, out);
}

/// Where a border is looked at.
pub(super) fn places(breaks: &[f64], options: &EdgeOptions) -> Vec<f64> {
    let spans = breaks.len() - 1;
    let per_span = options.per_span.max(24_usize.div_ceil(spans)).min(512_usize.div_ceil(spans)).max(1);
    let mut places = Vec::new();
    for pair in breaks.windows(2) {
        let step = (pair[1] - pair[0]) / per_span as f64;
        places.extend((0..per_span).map(|i| pair[0] + step * (i as f64 + 0.5)));
    }
    places
}

/// The other bodies that may be near a border in this box.
pub(super) fn near_to<'p>(parts: &'p [Part], own: &Part, size: &Aabb, options: &EdgeOptions) -> Vec<&'p Part> {
    let reach = size.grown(options.joining_tol + 0.5 * size.diagonal());
    parts.iter().filter(|p| p.id != own.id && p.bounds.overlaps(&reach)).collect()
}

/// Cuts a curve where what is near it changes.
pub(super) fn stretches(
    curve: CurveRef,
    [start, end]: [f64; 2],
    places: &[f64],
    mut look: impl FnMut(f64) -> Near,
    options: &EdgeOptions,
    out: &mut Vec<EdgePiece>,
) {
    let mut seen: Vec<Near> = places.iter().map(|&t| look(t)).collect();
    let same = |a: &Near, b: &Near| a.neighbours == b.neighbours && kind_of(a, options) == kind_of(b, options);
    for i in 1..seen.len().saturating_sub(1) {
        if !same(&seen[i], &seen[i - 1]) && same(&seen[i - 1], &seen[i + 1]) {
            seen[i] = seen[i - 1].clone();
        }
    }
    let mut from = start;
    let mut first = 0;
    for i in 0..seen.len() {
        let last = i + 1 == seen.len();
        if !last && same(&seen[i], &seen[i + 1]) {
            continue;
        }
        let to = if last {
            end
        } else {
            let (mut low, mut high) = (places[i], places[i + 1]);
            for _ in 0..30 {
                let middle = 0.5 * (low + high);
                if same(&look(middle), &seen[i]) { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let stretch = &seen[first..=i];
        out.push(EdgePiece {
            curve,
            range: [from, to],
            kind: kind_of(&seen[i], options),
            neighbours: seen[i].neighbours.clone(),
            max_gap: stretch.iter().map(|n| n.gap).fold(0.0, f64::max),
            max_angle: stretch.iter().map(|n| n.angle).fold(0.0, f64::max),
        });
        (from, first) = (to, i + 1);
    }
}

/// The bodies near a place of a border. `uv` is the place on the surface itself.
fn near(
    own: &Part,
    sheet: &Sheet,
    curve: &CurveRef,
    others: &[&Part],
    uv: DVec2,
    options: &EdgeOptions,
    scratch: &mut Scratch,
) -> Near {
    let surface = sheet.surface();
    let jet = surface.jet(uv, 1);
    let (p, normal) = (jet.p(), jet.normal());
    let mut out = Near::default();
    // The seam of a closed surface: the same parameter on the opposite border.
    let [u, v] = surface.domain();
    let opposite = match curve {
        CurveRef::Border(_, Side::VMin) => Some(DVec2::new(uv.x, v[1])),
        CurveRef::Border(_, Side::VMax) => Some(DVec2::new(uv.x, v[0])),
        CurveRef::Border(_, Side::UMin) => Some(DVec2::new(u[1], uv.y)),
        CurveRef::Border(_, Side::UMax) => Some(DVec2::new(u[0], uv.y)),
        // A face runs its seam twice.
        CurveRef::Edge(_, ring, edge) => sheet.face().and_then(|face| {
            let ring = face.rings().get(*ring as usize)?;
            let id = ring.edges.get(*edge as usize)?.id;
            (ring.edges.iter().filter(|e| e.id == id).count() > 1).then_some(uv)
        }),
        _ => None,
    };
    if let Some(opposite) = opposite {
        let across = surface.jet(opposite, 1);
        if across.p().distance(p) <= options.joining_tol {
            out.meet(own.id, across.p().distance(p), [normal, across.normal()]);
        }
    }
    out.meet_all(p, normal, others, options.joining_tol, scratch);
    out
}
