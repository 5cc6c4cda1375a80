//! The two intersection engines behind one door: the same bodies in, the same [`Intersection`] out, so that both
//! results can be laid over one another.
//!
//! [`Engine::Bvh`] works on the exact surfaces and certifies that no branch is missing (thesis chapter 5); it needs
//! parametric bodies. Of trimmed faces the part inside their loops counts. [`Engine::Mesh`] works on triangulations (HJR99 section 4); it takes meshes and blocks too.

use std::sync::Arc;

use super::geom::{Aabb, Surface};
use super::job::Job;
use super::mesh::body::Body;
use super::mesh_ssi::engine::{self, MeshSsiError, MeshSsiOptions, intersect_bodies};
use super::mesh_ssi::solids::Solids;
use super::ssi::clip::clip;
use super::ssi::triple::{self, Size};
use super::ssi::{self, Intersection, SsiError, SsiOptions};
use super::tol::Tolerances;

/// Which engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Engine {
    /// Exact surfaces, with a certificate.
    #[default]
    Bvh,
    /// Triangulations.
    Mesh,
}

impl Engine {
    /// The engine that can take these bodies: triangulations where one of them is a mesh or block.
    pub fn for_bodies<'a>(bodies: impl IntoIterator<Item = &'a Body>) -> Self {
        if bodies.into_iter().any(|b| matches!(b, Body::Facets(_))) { Self::Mesh } else { Self::Bvh }
    }
}

/// Why bodies were not intersected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntersectError {
    /// The exact engine could not start.
    #[error(transparent)]
    Bvh(#[from] SsiError),
    /// The triangulation engine could not start.
    #[error(transparent)]
    Mesh(#[from] MeshSsiError),
    /// The exact engine was given triangles.
    #[error("body {number} is a mesh or block without a parametric description; use the mesh engine")]
    NotParametric {
        /// Its number.
        number: usize,
    },
}

/// Intersects all bodies of one side with all of the other, each with its number. `tol`: how closely curves follow, in
/// model units, 1e-6 of the diagonal when left out.
pub fn intersect_with(
    engine: Engine,
    a: &[(usize, Body)],
    b: &[(usize, Body)],
    tol: Option<f64>,
    job: &Job,
) -> Result<Intersection, IntersectError> {
    let mut result = match engine {
        Engine::Bvh => {
            let (a, b) = (parametric(a)?, parametric(b)?);
            ssi::engine::intersect(&borrowed(&a), &borrowed(&b), &SsiOptions { tol, ..SsiOptions::default() }, job)?
        }
        Engine::Mesh => intersect_bodies(a, b, &MeshSsiOptions { tol, ..MeshSsiOptions::default() }, job)?,
    };
    finish(&mut result, a.iter().chain(b), job);
    Ok(result)
}

/// Intersects every two of some bodies, each with its number, the one that comes first as `a`. `tol` as above.
pub fn intersect_every_pair(
    engine: Engine,
    bodies: &[(usize, Body)],
    tol: Option<f64>,
    job: &Job,
) -> Result<Intersection, IntersectError> {
    let mut result = match engine {
        Engine::Bvh => {
            let surfaces = parametric(bodies)?;
            ssi::pairs::every_pair(&borrowed(&surfaces), &SsiOptions { tol, ..SsiOptions::default() }, job)?
        }
        Engine::Mesh => engine::intersect_all(bodies, &MeshSsiOptions { tol, ..MeshSsiOptions::default() }, job)?,
    };
    finish(&mut result, bodies.iter(), job);
    Ok(result)
}

/// Both engines work on whole surfaces; of a face the part inside its loops counts. What is left is cut where three
/// bodies meet.
fn finish<'a>(result: &mut Intersection, bodies: impl Iterator<Item = &'a (usize, Body)> + Clone, job: &Job) {
    clip_to_faces(result, bodies.clone());
    if bodies.clone().count() > 2 && result.curves.len() > 1 {
        let bounds = bodies.clone().fold(Aabb::EMPTY, |all, (_, body)| all.union(&body.bounds()));
        let size = Size::of(&bounds, Tolerances::of(&bounds).gap);
        triple::cut(result, &Solids::new(bodies), size, job);
    }
}

fn clip_to_faces<'a>(result: &mut Intersection, bodies: impl Iterator<Item = &'a (usize, Body)> + Clone) {
    clip(result, &|number| {
        bodies.clone().find_map(|(n, body)| match body {
            Body::Face(face) if *n == number => Some(Arc::clone(face)),
            _ => None,
        })
    });
}

fn parametric(bodies: &[(usize, Body)]) -> Result<Vec<(usize, Arc<Surface>)>, IntersectError> {
    let one = |(number, body): &(usize, Body)| match body.surface() {
        Some(surface) => Ok((*number, Arc::clone(surface))),
        None => Err(IntersectError::NotParametric { number: *number }),
    };
    bodies.iter().map(one).collect()
}

fn borrowed(surfaces: &[(usize, Arc<Surface>)]) -> Vec<(usize, &Surface)> {
    surfaces.iter().map(|(n, s)| (*n, s.as_ref())).collect()
}
