//! What can be projected on and intersected: a parametric surface, or triangles without one.

use std::sync::Arc;

use super::facets::Facets;
use crate::kernel::geom::{Aabb, Surface};

/// A body of a model.
#[derive(Clone, Debug)]
pub enum Body {
    /// A parametric surface.
    Surface(Arc<Surface>),
    /// A mesh or block without a parametric description: its triangles are the truth.
    Facets(Arc<Facets>),
}

impl From<Arc<Surface>> for Body {
    fn from(surface: Arc<Surface>) -> Self {
        Self::Surface(surface)
    }
}

impl From<Arc<Facets>> for Body {
    fn from(facets: Arc<Facets>) -> Self {
        Self::Facets(facets)
    }
}

impl Body {
    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Surface(surface) => surface.bounds(),
            Self::Facets(facets) => facets.bounds(),
        }
    }
}
