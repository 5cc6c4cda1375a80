//! Offset curves (130): a base curve, a distance that is constant, linear in the parameter or the arc length, or a coordinate
//! of another curve, and the normal of the plane. C(t) + f (V x T) as IGES 5.3 has it, followed by a cubic spline.

use glam::DVec3;

use super::Reader;
use super::params::{ParamError, Params};
use crate::kernel::geom::Curve;
use crate::kernel::geom::arc_length::ArcLength;
use crate::kernel::geom::fitted::{Fitted, offset_curve};

/// What the distance depends on.
enum Distance {
    /// Nothing.
    Constant(f64),
    /// It grows from one value to another between two places.
    Linear([(f64, f64); 2]),
    /// It is a coordinate of a curve at its parameter.
    Function(Curve, usize),
}

impl Reader<'_> {
    /// An offset curve, in the coordinates of its record.
    pub(super) fn offset_curve(
        &mut self,
        params: &mut Params<'_>,
        depth: usize,
        notes: &mut Vec<String>,
    ) -> Result<Curve, String> {
        let text = |e: ParamError| e.to_string();
        let base = params.pointer().map_err(text)?;
        let flag = params.integer("how the distance varies").map_err(text)?;
        let function = params.pointer().map_err(text)?;
        let coordinate = params.integer("a coordinate").map_err(text)?;
        let by_length = params.integer("what the distance depends on").map_err(text)? == 1;
        let mut real = || params.real_or(0.0, "a distance").map_err(text);
        let [d1, t1, d2, t2] = [real()?, real()?, real()?, real()?];
        let across = DVec3::new(real()?, real()?, real()?);
        let range = [real()?, real()?];
        let distance = match flag {
            0 | 1 => Distance::Constant(d1),
            2 if t1 != t2 => Distance::Linear([(t1, d1), (t2, d2)]),
            2 => return Err("its distance varies between two places that are the same".into()),
            3 => {
                let axis = usize::try_from(coordinate - 1).ok().filter(|&k| k < 3);
                let axis = axis.ok_or_else(|| format!("its distance is coordinate {coordinate}, expected 1 to 3"))?;
                Distance::Function(self.one_curve(function, depth, "distance")?, axis)
            }
            other => return Err(format!("the way {other} in which its distance varies is unknown")),
        };
        let curve = self.one_curve(base, depth, "base curve")?;
        let curve = self.between_parameters(curve, base, range, notes)?;
        let length = ArcLength::new(&curve);
        // What the distance is asked at, and how fast that changes.
        let place = |t: f64| {
            if by_length { [length.length_at(&curve, t), curve.derivatives(t, 1)[1].length()] } else { [t, 1.0] }
        };
        let at = |t: f64| {
            let [s, speed] = place(t);
            match &distance {
                Distance::Constant(d) => [*d, 0.0],
                Distance::Linear([(t1, d1), (t2, d2)]) => {
                    let slope = (d2 - d1) / (t2 - t1);
                    [d1 + slope * (s - t1), slope * speed]
                }
                Distance::Function(curve, axis) => {
                    let [low, high] = curve.domain();
                    let [f, df, ..] = curve.derivatives(s.clamp(low, high), 1);
                    [f[*axis], if (low..=high).contains(&s) { df[*axis] * speed } else { 0.0 }]
                }
            }
        };
        let Fitted { curve: made, off } = offset_curve(&curve, across, &at).map_err(|e| e.to_string())?;
        if off > 1e-6 * made.bounds().diagonal() {
            notes.push(format!("the offset is followed within {off:.1e} only"));
        }
        Ok(made)
    }

    /// The base curve between the parameters that the record names, where they are those of the curve as it was read.
    fn between_parameters(
        &mut self,
        curve: Curve,
        pointer: usize,
        [from, to]: [f64; 2],
        notes: &mut Vec<String>,
    ) -> Result<Curve, String> {
        let kind = self.directory.find(pointer).map_or(0, |at| self.directory.entries[at].kind);
        let [start, end] = curve.domain();
        if from == to {
            return Ok(curve);
        }
        if !matches!(kind, 110 | 112 | 126 | 130) {
            // The parameter of an arc is its angle: a range of the angle that it has is the whole.
            let whole = kind == 100 && {
                let [_, d, dd, _] = curve.derivatives(start, 2);
                let bend = d.cross(dd).length() / d.length().powi(3);
                (ArcLength::new(&curve).length() * bend - (to - from)).abs() < 1e-6
            };
            if !whole {
                notes.push(format!("its range of parameters {from} to {to} is not looked at; it is offset whole"));
            }
            return Ok(curve);
        }
        let slack = 1e-9 * (end - start);
        let (low, high) = (from.min(to).max(start), from.max(to).min(end));
        if low <= start + slack && high >= end - slack {
            return Ok(curve);
        }
        if !(low < high) {
            return Err(format!(
                "its range of parameters {from} to {to} is outside that of its curve, {start} to {end}"
            ));
        }
        curve.restricted(low, high).map_err(|e| e.to_string())
    }
}
