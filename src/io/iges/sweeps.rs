//! Swept surfaces, exactly: surfaces of revolution (120) and tabulated cylinders (122).

use glam::DVec3;

use super::Reader;
use super::params::{ParamError, Params};
use crate::kernel::geom::{Curve, Surface, sweep};

impl Reader<'_> {
    /// A surface of revolution: axis line, generatrix, start and end angle. u runs along the generatrix, v is the
    /// angle.
    pub fn revolution(&mut self, params: &mut Params<'_>, depth: usize) -> Result<Surface, String> {
        let text = |e: ParamError| e.to_string();
        let (axis, generatrix) = (params.pointer().map_err(text)?, params.pointer().map_err(text)?);
        let from = params.real_or(0.0, "the start angle").map_err(text)?;
        let to = params.real_or(std::f64::consts::TAU, "the end angle").map_err(text)?;
        let [foot, tip] = self.one_curve(axis, depth, "axis")?.ends();
        let meridian = self.one_curve(generatrix, depth, "generatrix")?;
        let surface = sweep::revolved(&meridian, foot, tip - foot, from, to).map_err(|e| e.to_string())?;
        Ok(surface.swapped())
    }

    /// A tabulated cylinder: directrix and the place where its start ends up. u runs along the directrix.
    pub fn tabulated(&mut self, params: &mut Params<'_>, depth: usize) -> Result<Surface, String> {
        let text = |e: ParamError| e.to_string();
        let directrix = params.pointer().map_err(text)?;
        let mut end = DVec3::ZERO;
        for axis in 0..3 {
            end[axis] = params.real_or(0.0, "a coordinate").map_err(text)?;
        }
        let curve = self.one_curve(directrix, depth, "directrix")?;
        sweep::extruded(&curve, end - curve.ends()[0]).map_err(|e| e.to_string())
    }

    /// The curve that a pointer names, at its own place.
    pub(super) fn one_curve(&mut self, pointer: usize, depth: usize, what: &str) -> Result<Curve, String> {
        let mut curves = self.placed_curves(pointer, depth).map_err(|reason| format!("its {what}: {reason}"))?;
        match (curves.pop(), curves.len()) {
            (Some(curve), 0) => Ok(curve),
            (_, more) => Err(format!("its {what} is in {} pieces", more + 1)),
        }
    }
}
