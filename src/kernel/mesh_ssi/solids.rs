//! Surfaces, faces and triangulations as bodies in which points of three are looked for ([`crate::kernel::ssi::triple`]).

use std::collections::HashMap;
use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::sheet::Sheet;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::three::{Bodies, Surfaces, Touch};

/// Bodies by their numbers; of those without a surface the triangles, whose tree is built when it is first needed.
pub struct Solids<'a> {
    surfaces: Surfaces<'a>,
    facets: HashMap<usize, (&'a Body, OnceLock<Sheet>)>,
}

impl<'a> Solids<'a> {
    /// Of a list.
    pub fn new(list: impl IntoIterator<Item = &'a (usize, Body)> + Clone) -> Self {
        let surfaces = list.clone().into_iter().filter_map(|(n, body)| Some((*n, &**body.surface()?)));
        let facets = list.into_iter().filter(|(_, body)| body.surface().is_none());
        Self {
            surfaces: Surfaces::new(surfaces),
            facets: facets.map(|(n, body)| (*n, (body, OnceLock::new()))).collect(),
        }
    }

    /// The triangles of a body without a surface, and which of them is nearest to a point.
    fn triangle(&self, body: usize, near: DVec3) -> Option<(&Sheet, u32)> {
        let (body, sheet) = self.facets.get(&body)?;
        let sheet = sheet.get_or_init(|| Sheet::new(body, f64::INFINITY));
        Some((sheet, sheet.tree().nearest(near, f64::INFINITY)?.triangle))
    }
}

impl Bodies for Solids<'_> {
    fn touch(&self, body: usize, uv: DVec2, near: DVec3) -> Option<Touch> {
        let Some((sheet, triangle)) = self.triangle(body, near) else { return self.surfaces.touch(body, uv, near) };
        let (point, normal) = sheet.plane(triangle);
        Some(Touch { point, normal, partials: None })
    }

    fn settled(&self, body: usize, uv: DVec2) -> DVec2 {
        self.surfaces.settled(body, uv)
    }

    fn place(&self, body: usize, uv: DVec2, point: DVec3) -> DVec2 {
        self.triangle(body, point).map_or(uv, |(sheet, triangle)| sheet.uv_in(triangle, point))
    }
}
