//! Cells that coincide over an area: a sheet folded onto itself, or two sheets that lie on one another.

use glam::{DVec2, DVec3};

use super::hull::Rect;
use super::march::turns;
use super::sheet::Sheet;

/// Coincidence is looked for in boxes between these sizes: in smaller ones being close proves nothing.
pub(crate) const COINCIDENCE_CELL: f64 = 1.0 / 24.0;
/// See [`COINCIDENCE_CELL`].
pub(crate) const FINEST_COINCIDENCE: f64 = 1.0 / 1024.0;

/// Two cells that coincide over an area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coincidence {
    pub a: Rect,
    pub b: Rect,
}

impl Coincidence {
    pub fn swapped(self) -> Self {
        Self { a: self.b, b: self.a }
    }
}

/// Whether two boxes coincide over an area: `None` when they do not, otherwise whether points of one have their
/// partners in the other. A piece that continues as its neighbour meets the same points, not others: seen in the
/// middle, since on a seam both are one point anyway.
pub(crate) fn coincide(sheet: &Sheet, (a, pa): (&Rect, usize), (b, pb): (&Rect, usize)) -> Option<bool> {
    let gap = 1e-11_f64.max(4.0 * sheet.rounding);
    let mut met = false;
    for k in 0..9 {
        let p = a.low + a.size() * DVec2::new(f64::from(k % 3) * 0.5, f64::from(k / 3) * 0.5);
        let s = sheet.jet_on(pa, p, 0).s;
        let (q, distance) = foot(sheet, pb, b.center(), s)?;
        if distance > gap
            || !b.grown(1.5).contains(q)
            || (k == 4 && (p - q - turns(sheet, p, q)).length() < 1e-3 * a.size().max_element())
        {
            return None;
        }
        met |= b.grown(1e-9).contains(q);
    }
    Some(met)
}

/// The closest point of a (continued) piece, by Gauss-Newton from a start.
pub(crate) fn foot(sheet: &Sheet, piece: usize, from: DVec2, s: DVec3) -> Option<(DVec2, f64)> {
    let mut q = from;
    for _ in 0..20 {
        let jet = sheet.jet_on(piece, q, 1);
        let r = s - jet.s;
        let (e, f, g) = (jet.d[0].length_squared(), jet.d[0].dot(jet.d[1]), jet.d[1].length_squared());
        let det = e * g - f * f;
        if det.is_nan() || det <= 1e-14 * e * g {
            return None;
        }
        let (x, y) = (jet.d[0].dot(r), jet.d[1].dot(r));
        let d = DVec2::new(g * x - f * y, e * y - f * x) / det;
        q += d;
        if !q.is_finite() || q.distance(from) > 1.0 {
            return None;
        }
        if d.length() < 1e-14 {
            break;
        }
    }
    Some((q, sheet.jet_on(piece, q, 0).s.distance(s)))
}
