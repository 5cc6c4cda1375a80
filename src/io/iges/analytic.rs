//! Surfaces and curves given by numbers: planes (108, 190), cylinders (192), cones (194), spheres (196), tori (198),
//! ruled (118) and offset surfaces (140), conic arcs (104) and polylines (106).
//!
//! Unbounded surfaces reach as far as the loops of their face ([`Reader::reach`]); without a face they are not opened.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::params::{ParamError, Params};
use super::{Geometry, Reader};
use crate::kernel::geom::{Curve, Surface, analytic};

fn text(e: impl std::fmt::Display) -> String {
    e.to_string()
}

fn triple(params: &mut Params<'_>) -> Result<DVec3, ParamError> {
    Ok(DVec3::new(params.real("a coordinate")?, params.real("a coordinate")?, params.real("a coordinate")?))
}

impl Reader<'_> {
    /// The point (116) or direction (123) that a pointer names, at its own place.
    fn point_or_direction(&mut self, pointer: usize, kind: i64) -> Result<DVec3, String> {
        let at = self.directory.find(pointer).filter(|&at| self.directory.entries[at].kind == kind);
        let Some(at) = at else { return Err(format!("entity {pointer} is no {}", super::kinds::name(kind))) };
        let transform = self.directory.entries[at].transform;
        let value = self.record(at, |_, params| triple(params))?.map_err(text)?;
        let map = self.transform(transform)?.unwrap_or(DAffine3::IDENTITY);
        let value = if kind == 116 { map.transform_point3(value) } else { map.transform_vector3(value) };
        if value.is_finite() { Ok(value) } else { Err(format!("entity {pointer} is not finite")) }
    }

    /// The frame of a location, an axis and a reference direction; any reference where there is none.
    fn frame(&mut self, location: usize, axis: usize, reference: usize) -> Result<DAffine3, String> {
        let origin = self.point_or_direction(location, 116)?;
        let direction = |reader: &mut Self, pointer: usize| -> Result<Option<DVec3>, String> {
            match pointer {
                0 => Ok(None),
                _ => Ok(reader.point_or_direction(pointer, 123)?.try_normalize()),
            }
        };
        let z = direction(self, axis)?.unwrap_or(DVec3::Z);
        let near_x = direction(self, reference)?.unwrap_or_else(|| z.any_orthonormal_vector());
        let x = (near_x - z * near_x.dot(z)).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
        Ok(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin))
    }

    /// A surface of the kinds 108 and 190 to 198.
    pub(super) fn analytic(&mut self, kind: i64, form: i64, params: &mut Params<'_>) -> Result<Surface, String> {
        let reach = std::mem::take(&mut self.reach);
        let bounded = |reach: &[DVec3]| {
            if reach.is_empty() { Err("it has no bounds: no face uses it".to_owned()) } else { Ok(()) }
        };
        match kind {
            108 => {
                let normal = triple(params).map_err(text)?;
                let d = params.real("a coefficient").map_err(text)?;
                let z = normal.try_normalize().ok_or("its normal has no length")?;
                let origin = z * (d / normal.length());
                let (x, y) = z.any_orthonormal_pair();
                bounded(&reach)?;
                let frame = DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), origin);
                analytic::plane(&frame, &reach).map_err(text)
            }
            190 => {
                let [location, normal] = [params.pointer().map_err(text)?, params.pointer().map_err(text)?];
                let reference = if form == 1 { params.pointer().map_err(text)? } else { 0 };
                bounded(&reach)?;
                analytic::plane(&self.frame(location, normal, reference)?, &reach).map_err(text)
            }
            192 | 194 => {
                let [location, axis] = [params.pointer().map_err(text)?, params.pointer().map_err(text)?];
                let radius = params.real("a radius").map_err(text)?;
                let angle = if kind == 194 { params.real("an angle").map_err(text)? } else { 0.0 };
                let reference = if form == 1 { params.pointer().map_err(text)? } else { 0 };
                bounded(&reach)?;
                let frame = self.frame(location, axis, reference)?;
                analytic::cone(&frame, radius, analytic::radians(angle), &reach).map_err(text)
            }
            196 => {
                let location = params.pointer().map_err(text)?;
                let radius = params.real("a radius").map_err(text)?;
                let [axis, reference] = match form {
                    1 => [params.pointer().map_err(text)?, params.pointer().map_err(text)?],
                    _ => [0, 0],
                };
                analytic::sphere(&self.frame(location, axis, reference)?, radius).map_err(text)
            }
            _ => {
                let [location, axis] = [params.pointer().map_err(text)?, params.pointer().map_err(text)?];
                let major = params.real("a radius").map_err(text)?;
                let minor = params.real("a radius").map_err(text)?;
                let reference = if form == 1 { params.pointer().map_err(text)? } else { 0 };
                analytic::torus(&self.frame(location, axis, reference)?, major, minor, true).map_err(text)
            }
        }
    }

    /// A ruled surface (118).
    pub(super) fn ruled(
        &mut self,
        form: i64,
        params: &mut Params<'_>,
        depth: usize,
        notes: &mut Vec<String>,
    ) -> Result<Surface, String> {
        let pointers = [params.pointer().map_err(text)?, params.pointer().map_err(text)?];
        let turned = params.integer("a direction").map_err(text)? == 1;
        let first = self.one_curve(pointers[0], depth, "first curve")?;
        let second = self.one_curve(pointers[1], depth, "second curve")?;
        let second = if turned { second.reversed() } else { second };
        if form != 0 {
            return analytic::ruled(&first, &second).map_err(text);
        }
        // Form 0 joins equal fractions of the arc lengths.
        let (made, off) = analytic::ruled_by_length(&first, &second).map_err(text)?;
        if off > 1e-6 * made.bounds().diagonal() {
            notes.push(format!("its lines join equal fractions of the arc lengths within {off:.1e} only"));
        }
        Ok(made)
    }

    /// An offset surface (140).
    pub(super) fn offset(
        &mut self,
        params: &mut Params<'_>,
        depth: usize,
        notes: &mut Vec<String>,
    ) -> Result<Surface, String> {
        let indicator = triple(params).map_err(text)?;
        let distance = params.real("a distance").map_err(text)?;
        let pointer = params.pointer().map_err(text)?;
        if depth >= 16 {
            return Err("entities are nested more than 16 deep, or lead back to themselves".into());
        }
        let Some(at) = self.directory.find(pointer) else { return Err(format!("entity {pointer} does not exist")) };
        self.unfold(64 * self.directory.entries[at].parameter_lines.clamp(1, self.sections.parameter.len().max(1)))?;
        let transform = self.directory.entries[at].transform;
        let Geometry::Surfaces(mut surfaces) = self.geometry(at, depth + 1)?.0 else {
            return Err(format!("entity {pointer} is no surface"));
        };
        let (Some(surface), 0) = (surfaces.pop(), surfaces.len()) else {
            return Err("the surface that it is off is in several parts".into());
        };
        let surface = match self.transform(transform)? {
            Some(map) => surface.transformed(&map),
            None => surface,
        };
        // The indicator points to the side on which positive distances lie, seen from the middle.
        let [u, v] = surface.domain();
        let middle = DVec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
        let normal = crate::kernel::geom::unit_normal(&surface, middle).unwrap_or(indicator);
        let signed = if normal.dot(indicator) < 0.0 { -distance } else { distance };
        let (made, off) = analytic::offset(&surface, signed).map_err(text)?;
        if off > 1e-6 * made.bounds().diagonal() {
            notes.push(format!("the offset is followed within {off:.1e} only"));
        }
        Ok(made)
    }
}

/// A conic arc (104).
pub(super) fn conic(params: &mut Params<'_>) -> Result<Curve, String> {
    let mut real = || params.real("a coefficient").map_err(text);
    let coefficients = [real()?, real()?, real()?, real()?, real()?, real()?];
    let z = real()?;
    let ends = [DVec2::new(real()?, real()?), DVec2::new(real()?, real()?)];
    let curve = analytic::conic(coefficients, ends[0], ends[1]).map_err(text)?;
    Ok(curve.transformed(&DAffine3::from_translation(DVec3::Z * z)))
}

/// Copious data (106): the forms that are a polyline. Loose points are none.
pub(super) fn copious(form: i64, params: &mut Params<'_>) -> Result<Curve, String> {
    let kind = params.integer("the kind of tuples").map_err(text)?;
    if !matches!(form, 11..=13 | 63) {
        return Err(format!("form {form} is a set of points or a drawing aid, no curve"));
    }
    let width = match kind {
        1 => 2,
        2 => 3,
        3 => 6,
        other => return Err(format!("tuples of kind {other} are unknown")),
    };
    let count = params.count("tuples", width).map_err(text)?;
    let z = if kind == 1 { params.real("a coordinate").map_err(text)? } else { 0.0 };
    let mut points = Vec::new();
    for _ in 0..count {
        let mut tuple = [0.0; 6];
        for value in tuple.iter_mut().take(width) {
            *value = params.real("a coordinate").map_err(text)?;
        }
        points.push(if kind == 1 {
            DVec3::new(tuple[0], tuple[1], z)
        } else {
            DVec3::new(tuple[0], tuple[1], tuple[2])
        });
    }
    if form == 63
        && points.first() != points.last()
        && let Some(&first) = points.first()
    {
        points.push(first);
    }
    points.dedup();
    if points.len() < 2 {
        return Err("it has no length".into());
    }
    Curve::polyline(&points).map_err(text)
}
