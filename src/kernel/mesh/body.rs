//! What can be projected on and intersected: a parametric surface or a face on one, or triangles without one.

use std::sync::Arc;

use super::facets::Facets;
use crate::kernel::geom::trim::{Face, Sheet};
use crate::kernel::geom::{Aabb, Surface};

/// A body of a model.
#[derive(Clone, Debug)]
pub enum Body {
    /// A parametric surface.
    Surface(Arc<Surface>),
    /// The trimmed part of one.
    Face(Arc<Face>),
    /// A mesh or block without a parametric description: its triangles are the truth.
    Facets(Arc<Facets>),
}

impl From<Arc<Surface>> for Body {
    fn from(surface: Arc<Surface>) -> Self {
        Self::Surface(surface)
    }
}

impl From<Arc<Face>> for Body {
    fn from(face: Arc<Face>) -> Self {
        Self::Face(face)
    }
}

impl From<Sheet> for Body {
    fn from(sheet: Sheet) -> Self {
        match sheet {
            Sheet::Whole(surface) => Self::Surface(surface),
            Sheet::Trimmed(face) => Self::Face(face),
        }
    }
}

impl From<Arc<Facets>> for Body {
    fn from(facets: Arc<Facets>) -> Self {
        Self::Facets(facets)
    }
}

impl Body {
    /// The whole surface of a surface or face.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Face(face) => Some(face.surface()),
            Self::Facets(_) => None,
        }
    }

    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Surface(surface) => surface.bounds(),
            Self::Face(face) => face.bounds(),
            Self::Facets(facets) => facets.bounds(),
        }
    }
}
