//! Control nets as files have them, made into curves and surfaces as the kernel wants them.
//!
//! Files contain knots that decrease by a rounding error, basis functions without support (an end knot more than
//! degree + 1 times) and interior knots of multiplicity degree + 1, where the spline may jump. The first are
//! levelled, the second removed; at the third the spline is joined where both sides agree and cut in two where
//! they do not. What was done is said in notes. Numbers that need no repair are not touched by any arithmetic.

use glam::DVec3;

use crate::kernel::geom::{Curve, Knots, Surface};

/// What two ends may differ and still be one point, as a fraction of the net's largest coordinate.
const SAME: f64 = 1e-12;
/// How much knots may decrease and still be levelled, as a fraction of their range.
const LEVEL: f64 = 1e-9;

/// A control net with raw knots, u running fastest. A curve has one row and no second direction.
#[derive(Clone, Debug)]
pub struct RawNet {
    /// Degrees along u and v.
    pub degree: [usize; 2],
    /// Knots along u and v.
    pub knots: [Vec<f64>; 2],
    /// Numbers of control points along u and v.
    pub count: [usize; 2],
    /// Control points.
    pub points: Vec<DVec3>,
    /// Weights.
    pub weights: Option<Vec<f64>>,
}

impl RawNet {
    /// A curve's net.
    pub fn curve(degree: usize, knots: Vec<f64>, points: Vec<DVec3>, weights: Option<Vec<f64>>) -> Self {
        Self { degree: [degree, 0], knots: [knots, Vec::new()], count: [points.len(), 1], points, weights }
    }

    /// The curves that this net describes: one, or several where it jumps.
    pub fn into_curves(self, notes: &mut Vec<String>) -> Result<Vec<Curve>, String> {
        let pieces = self.tidied(0, "", notes)?;
        let curve = |net: Self| {
            let [knots, _] = net.knots;
            let knots = Knots::new(net.degree[0], knots).map_err(|e| e.to_string())?;
            Curve::new(knots, net.points, net.weights).map_err(|e| e.to_string())
        };
        pieces.into_iter().map(curve).collect()
    }

    /// The surfaces that this net describes: one, or several where it jumps.
    pub fn into_surfaces(self, notes: &mut Vec<String>) -> Result<Vec<Surface>, String> {
        let mut surfaces = Vec::new();
        for strip in self.tidied(0, " along u", notes)? {
            for net in strip.tidied(1, " along v", notes)? {
                let [u, v] = net.knots;
                let u = Knots::new(net.degree[0], u).map_err(|e| format!("knots along u: {e}"))?;
                let v = Knots::new(net.degree[1], v).map_err(|e| format!("knots along v: {e}"))?;
                surfaces.push(Surface::new(u, v, net.points, net.weights).map_err(|e| e.to_string())?);
            }
        }
        Ok(surfaces)
    }

    /// This net with regular knots in direction `d`, cut where it jumps.
    fn tidied(mut self, d: usize, along: &str, notes: &mut Vec<String>) -> Result<Vec<Self>, String> {
        let p = self.degree[d];
        if self.count[0].checked_mul(self.count[1]) != Some(self.points.len())
            || self.weights.as_ref().is_some_and(|w| w.len() != self.points.len())
            || self.knots[d].len() != self.count[d] + p + 1
        {
            return Err(format!("the numbers of knots and control points{along} do not go together"));
        }
        self.level(d, along, notes);
        let null: Vec<usize> = (0..self.count[d]).filter(|&i| self.knots[d][i] == self.knots[d][i + p + 1]).collect();
        if !null.is_empty() && null.len() < self.count[d] {
            notes.push(format!("{} control points without influence{along} were left out", null.len()));
            self.leave_out(d, &null);
        }
        let joined: Vec<usize> = {
            let size = self.points.iter().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
            self.jumps(d).filter(|&first| self.agrees(d, first - 1, first, SAME * size)).collect()
        };
        if !joined.is_empty() {
            notes.push(format!("{} full knots{along} without a jump lost one of their copies", joined.len()));
            self.leave_out(d, &joined);
        }
        let cuts: Vec<usize> = self.jumps(d).collect();
        if cuts.is_empty() {
            return Ok(vec![self]);
        }
        notes.push(format!("cut in {} pieces{along} at knots where it jumps", cuts.len() + 1));
        let starts = std::iter::once(0).chain(cuts.iter().copied());
        let ends = cuts.iter().copied().chain(std::iter::once(self.count[d]));
        Ok(starts.zip(ends).map(|(start, end)| self.piece(d, start, end)).collect())
    }

    /// Raises knots that decrease by no more than rounding.
    fn level(&mut self, d: usize, along: &str, notes: &mut Vec<String>) {
        let knots = &mut self.knots[d];
        let (Some(&first), Some(&last)) = (knots.first(), knots.last()) else { return };
        let slack = LEVEL * (last - first).abs();
        if !slack.is_finite() {
            return; // the knots are refused where they are checked
        }
        let mut levelled = 0;
        for i in 1..knots.len() {
            if knots[i] < knots[i - 1] && knots[i - 1] - knots[i] <= slack {
                knots[i] = knots[i - 1];
                levelled += 1;
            }
        }
        if levelled > 0 {
            notes.push(format!("{levelled} knots{along} decreased by a rounding error and were levelled"));
        }
    }

    /// The first knots of all groups of degree + 1 equal knots strictly inside the domain.
    fn jumps(&self, d: usize) -> impl Iterator<Item = usize> + '_ {
        let (p, knots, n) = (self.degree[d], &self.knots[d], self.count[d]);
        (p + 1..n).filter(move |&i| knots[i] > knots[p] && knots[i] == knots[i + p] && knots[i] < knots[n])
    }

    /// Where control point (i, line) of direction `d` is.
    fn at(&self, d: usize, i: usize, line: usize) -> usize {
        if d == 0 { line * self.count[0] + i } else { i * self.count[0] + line }
    }

    /// Whether two rows (columns) of control points are the same, weights included.
    fn agrees(&self, d: usize, a: usize, b: usize, same: f64) -> bool {
        (0..self.count[1 - d]).all(|line| {
            let (a, b) = (self.at(d, a, line), self.at(d, b, line));
            let weights = self.weights.as_ref().map_or((1.0, 1.0), |w| (w[a], w[b]));
            self.points[a].distance(self.points[b]) <= same && (weights.0 - weights.1).abs() <= SAME * weights.0.abs()
        })
    }

    /// Removes the control points i (whole rows or columns) of a sorted list, each with the knot i.
    fn leave_out(&mut self, d: usize, list: &[usize]) {
        let nu = self.count[0];
        let stays = |i: usize| list.binary_search(&i).is_err();
        retain_by_index(&mut self.knots[d], stays);
        let point_stays = |at: usize| stays(if d == 0 { at % nu } else { at / nu });
        retain_by_index(&mut self.points, point_stays);
        if let Some(weights) = &mut self.weights {
            retain_by_index(weights, point_stays);
        }
        self.count[d] -= list.len();
    }

    /// The piece with the control points `start..end` of direction `d`.
    fn piece(&self, d: usize, start: usize, end: usize) -> Self {
        let mut knots = self.knots.clone();
        knots[d] = self.knots[d][start..=end + self.degree[d]].to_vec();
        let mut count = self.count;
        count[d] = end - start;
        let nu = self.count[0];
        let (columns, rows) = if d == 0 { (start..end, 0..self.count[1]) } else { (0..nu, start..end) };
        let places = || rows.clone().flat_map(|j| columns.clone().map(move |i| j * nu + i));
        Self {
            degree: self.degree,
            knots,
            count,
            points: places().map(|at| self.points[at]).collect(),
            weights: self.weights.as_ref().map(|w| places().map(|at| w[at]).collect()),
        }
    }
}

fn retain_by_index<T>(values: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut at = 0;
    values.retain(|_| {
        at += 1;
        keep(at - 1)
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Vec<DVec3> {
        (0..count).map(|i| DVec3::new(i as f64, ((i * 7) % 5) as f64, 0.3 * i as f64)).collect()
    }

    /// The value of a raw spline inside a non-empty span, straight from the Cox-de Boor recurrence.
    fn cox_de_boor(degree: usize, knots: &[f64], points: &[DVec3], t: f64) -> DVec3 {
        fn basis(i: usize, p: usize, knots: &[f64], t: f64) -> f64 {
            if p == 0 {
                return f64::from(u8::from(knots[i] <= t && t < knots[i + 1]));
            }
            let part = |top: f64, bottom: f64, value: f64| if bottom > 0.0 { top / bottom * value } else { 0.0 };
            part(t - knots[i], knots[i + p] - knots[i], basis(i, p - 1, knots, t))
                + part(knots[i + p + 1] - t, knots[i + p + 1] - knots[i + 1], basis(i + 1, p - 1, knots, t))
        }
        points.iter().enumerate().map(|(i, p)| *p * basis(i, degree, knots, t)).sum()
    }

    #[test]
    fn a_jump_cuts_the_curve_and_both_pieces_keep_their_points() {
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0];
        let net = points(7);
        let mut notes = Vec::new();
        let pieces = RawNet::curve(2, knots.clone(), net.clone(), None).into_curves(&mut notes).unwrap();
        assert_eq!((pieces.len(), notes.len()), (2, 1));
        assert_eq!(pieces[0].domain(), [0.0, 1.0]);
        assert_eq!(pieces[1].domain(), [1.0, 3.0]);
        for (piece, t) in [(0, 0.25), (0, 0.9), (1, 1.1), (1, 2.7)] {
            assert!(pieces[piece].eval(t).distance(cox_de_boor(2, &knots, &net, t)) < 1e-14);
        }
    }

    #[test]
    fn a_full_knot_without_a_jump_is_joined() {
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let mut net = points(6);
        net[3] = net[2];
        let mut notes = Vec::new();
        let pieces = RawNet::curve(2, knots.clone(), net.clone(), None).into_curves(&mut notes).unwrap();
        assert_eq!(pieces.len(), 1);
        for t in [0.1, 0.7, 1.0, 1.4] {
            assert!(pieces[0].eval(t).distance(cox_de_boor(2, &knots, &net, t)) < 1e-14);
        }
    }

    #[test]
    fn basis_functions_without_support_are_removed() {
        let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0];
        let net = points(10);
        let mut notes = Vec::new();
        let pieces = RawNet::curve(2, knots.clone(), net.clone(), None).into_curves(&mut notes).unwrap();
        assert_eq!(pieces.len(), 2);
        for (piece, t) in [(0, 0.25), (1, 1.1), (1, 1.7)] {
            assert!(pieces[piece].eval(t).distance(cox_de_boor(2, &knots, &net, t)) < 1e-14);
        }
    }

    #[test]
    fn surfaces_are_cut_in_both_directions() {
        let full = vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        let net = RawNet {
            degree: [1, 1],
            knots: [full.clone(), full],
            count: [4, 4],
            points: points(16),
            weights: Some((1..=16).map(f64::from).collect()),
        };
        let mut notes = Vec::new();
        let pieces = net.clone().into_surfaces(&mut notes).unwrap();
        assert_eq!(pieces.len(), 4);
        assert_eq!(pieces[1].point(1, 1), net.points[13]);
        assert_eq!(pieces[2].weights().unwrap(), [3.0, 4.0, 7.0, 8.0]);
    }

    #[test]
    fn rounding_is_levelled_and_true_disorder_is_not() {
        let mut notes = Vec::new();
        let level = RawNet::curve(1, vec![0.0, 0.0, 1.0, 1.0 - 1e-15, 2.0, 2.0], points(4), None);
        assert!(level.into_curves(&mut notes).is_ok());
        assert!(!notes.is_empty());
        let disorder = RawNet::curve(1, vec![0.0, 0.0, 1.0, 0.5, 2.0, 2.0], points(4), None);
        assert!(disorder.into_curves(&mut notes).unwrap_err().contains("knot 3"));
        for bad in [vec![], vec![0.0; 6], vec![f64::NAN; 6], vec![0.0, 0.0, f64::INFINITY, 1.0, 2.0, 2.0]] {
            assert!(RawNet::curve(1, bad, points(4), None).into_curves(&mut notes).is_err());
        }
    }
}
