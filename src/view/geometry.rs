//! What has a shape, and the names of the curves on it.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::kernel::geom::trim::Face;
use crate::kernel::geom::{Aabb, Curve, Direction, Side, Surface};
use crate::kernel::mesh::facets::{FacetCurve, Facets};
use crate::model::document::EntityId;

/// Names a curve that is drawn and can be picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CurveRef {
    /// A free curve of the document.
    Free(EntityId),
    /// A border of a surface.
    Border(EntityId, Side),
    /// An edge of a trimmed face: its loop and its place there.
    Edge(EntityId, u32, u32),
    /// An iso-curve of a surface: the direction that is fixed and its value.
    Iso(EntityId, Direction, f64),
    /// A border or feature edge of a mesh, or a border line of a block, by its place among its curves.
    Chain(EntityId, u32),
    /// A grid line inside a face of a block, by its place among the block's curves.
    GridLine(EntityId, u32),
}

impl CurveRef {
    /// The entity it belongs to.
    pub fn entity(&self) -> EntityId {
        match *self {
            Self::Free(id)
            | Self::Border(id, _)
            | Self::Edge(id, ..)
            | Self::Iso(id, ..)
            | Self::Chain(id, _)
            | Self::GridLine(id, _) => id,
        }
    }

    /// Whether it lies inside a surface and is drawn only where iso-lines are.
    pub fn is_iso(&self) -> bool {
        matches!(self, Self::Iso(..) | Self::GridLine(..))
    }
}

/// What has a shape.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// A surface or healed patch.
    Surface(Arc<Surface>),
    /// A trimmed face; `whole` draws the whole surface under it as well.
    Face {
        /// The face.
        face: Arc<Face>,
        /// Whether the whole surface is drawn.
        whole: bool,
    },
    /// A free curve.
    Curve(Arc<Curve>),
    /// A mesh or block.
    Facets(Arc<Facets>),
}

impl Geometry {
    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Surface(surface) => surface.bounds(),
            Self::Face { face, whole: false } => face.bounds(),
            Self::Face { face, whole: true } => face.surface().bounds(),
            Self::Curve(curve) => curve.bounds(),
            Self::Facets(facets) => facets.bounds(),
        }
    }

    /// The whole surface of a surface or face.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Face { face, .. } => Some(face.surface()),
            Self::Facets(_) | Self::Curve(_) => None,
        }
    }

    /// A border, feature edge or grid line of a mesh or block.
    fn facet_curve(&self, curve: &CurveRef) -> Option<&FacetCurve> {
        match (self, curve) {
            (Self::Facets(f), CurveRef::Chain(_, k) | CurveRef::GridLine(_, k)) => f.curves().get(*k as usize),
            _ => None,
        }
    }

    /// Whether its display is the same at every size: triangles that a file has are neither refined nor thinned.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Self::Facets(_))
    }

    /// Whether it is the same thing in memory.
    pub fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Surface(a), Self::Surface(b)) => Arc::ptr_eq(a, b),
            (Self::Face { face: a, whole: w }, Self::Face { face: b, whole: v }) => Arc::ptr_eq(a, b) && w == v,
            (Self::Curve(a), Self::Curve(b)) => Arc::ptr_eq(a, b),
            (Self::Facets(a), Self::Facets(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// The domain of one of its curves.
    pub fn curve_domain(&self, curve: &CurveRef) -> Option<[f64; 2]> {
        match (self, curve) {
            (Self::Curve(c), CurveRef::Free(_)) => Some(c.domain()),
            (Self::Face { face, .. }, CurveRef::Edge(_, ring, edge)) => {
                Some(face.edge(*ring as usize, *edge as usize)?.curve.domain())
            }
            (_, CurveRef::Border(_, Side::VMin | Side::VMax) | CurveRef::Iso(_, Direction::V, _)) => {
                Some(self.surface()?.domain()[0])
            }
            (_, CurveRef::Border(..) | CurveRef::Iso(..)) => Some(self.surface()?.domain()[1]),
            _ => self.facet_curve(curve).map(|c| c.curve.domain()),
        }
    }

    /// The surface parameters of a point of one of its curves.
    pub fn curve_uv(&self, curve: &CurveRef, t: f64) -> Option<DVec2> {
        let [u, v] = self.surface()?.domain();
        match *curve {
            CurveRef::Edge(_, ring, edge) => {
                let Self::Face { face, .. } = self else { return None };
                Some(face.edge(ring as usize, edge as usize)?.uv(t))
            }
            CurveRef::Border(_, Side::VMin) => Some(DVec2::new(t, v[0])),
            CurveRef::Border(_, Side::UMax) => Some(DVec2::new(u[1], t)),
            CurveRef::Border(_, Side::VMax) => Some(DVec2::new(t, v[1])),
            CurveRef::Border(_, Side::UMin) => Some(DVec2::new(u[0], t)),
            CurveRef::Iso(_, Direction::U, c) => Some(DVec2::new(c, t)),
            CurveRef::Iso(_, Direction::V, c) => Some(DVec2::new(t, c)),
            CurveRef::Free(_) | CurveRef::Chain(..) | CurveRef::GridLine(..) => None,
        }
    }

    /// One of its curves as a curve of its own, with the same parameter.
    pub fn curve(&self, curve: &CurveRef) -> Option<Curve> {
        match (self, curve) {
            (Self::Curve(c), CurveRef::Free(_)) => Some(c.as_ref().clone()),
            (Self::Face { face, .. }, CurveRef::Edge(_, ring, edge)) => {
                Some(face.edge(*ring as usize, *edge as usize)?.curve.as_ref().clone())
            }
            (_, CurveRef::Border(_, side)) => self.surface()?.border(*side).ok(),
            (_, CurveRef::Iso(_, fixed, c)) => self.surface()?.iso_curve(*fixed, *c).ok(),
            _ => self.facet_curve(curve).map(|c| c.curve.clone()),
        }
    }

    /// The interior knots of one of its curves.
    pub fn curve_knots(&self, curve: &CurveRef) -> Vec<f64> {
        let knots = match (self, curve) {
            (Self::Curve(c), CurveRef::Free(_)) => c.knots(),
            (Self::Face { face, .. }, CurveRef::Edge(_, ring, edge)) => match face.edge(*ring as usize, *edge as usize)
            {
                Some(edge) => edge.curve.knots(),
                None => return Vec::new(),
            },
            (Self::Surface(_) | Self::Face { .. }, CurveRef::Border(..) | CurveRef::Iso(..)) => {
                let Some(surface) = self.surface() else { return Vec::new() };
                match curve {
                    CurveRef::Border(_, Side::VMin | Side::VMax) | CurveRef::Iso(_, Direction::V, _) => {
                        &surface.knots()[0]
                    }
                    _ => &surface.knots()[1],
                }
            }
            _ => match self.facet_curve(curve) {
                Some(chain) => chain.curve.knots(),
                None => return Vec::new(),
            },
        };
        let breaks = knots.breaks();
        breaks[1..breaks.len() - 1].to_vec()
    }

    /// The point of one of its curves with first and second derivative.
    pub fn curve_jet(&self, curve: &CurveRef, t: f64) -> Option<[DVec3; 3]> {
        match self {
            Self::Curve(c) => {
                let [p, d, dd, _] = c.derivatives(t, 2);
                Some([p, d, dd])
            }
            Self::Facets(_) => {
                let [p, d, dd, _] = self.facet_curve(curve)?.curve.derivatives(t, 2);
                Some([p, d, dd])
            }
            Self::Surface(_) | Self::Face { .. } => {
                if let (Self::Face { face, .. }, CurveRef::Edge(_, ring, edge)) = (self, curve) {
                    let [p, d, dd, _] = face.edge(*ring as usize, *edge as usize)?.curve.derivatives(t, 2);
                    return Some([p, d, dd]);
                }
                let jet = self.surface()?.jet(self.curve_uv(curve, t)?, 2);
                let along_u = match curve {
                    CurveRef::Border(_, side) => matches!(side, Side::VMin | Side::VMax),
                    CurveRef::Iso(_, fixed, _) => *fixed == Direction::V,
                    CurveRef::Edge(..) | CurveRef::Free(_) | CurveRef::Chain(..) | CurveRef::GridLine(..) => {
                        return None;
                    }
                };
                Some(if along_u { [jet.p(), jet.u(), jet.d[2][0]] } else { [jet.p(), jet.v(), jet.d[0][2]] })
            }
        }
    }
}
