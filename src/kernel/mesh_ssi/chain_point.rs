//! A point of the triangulations as a point of the bodies themselves: with its parameters on both sides, and moved onto
//! both (HJR99 4, "Refinement") by the auxiliary planes of [`super::refine`], along the edge of a mesh on which it lies, or
//! along the border of a surface on which it has to stay.

use glam::DVec2;

use super::MeshIntersection;
use super::engine::Pair;
use super::refine::{Refined, Sheet as Touch, TANGENTIAL, refine};
use super::topology::{Mesh, Point};
use super::trace::Chain;
use crate::kernel::geom::closest::{closed_directions, line_from};
use crate::kernel::ssi::result::CurvePoint;

impl Pair<'_> {
    /// A point of a chain with its parameters on both sides.
    pub(super) fn start_at(&self, found: &MeshIntersection, chain: &Chain, k: usize) -> CurvePoint {
        let point = &found.topology.points[chain.points[k] as usize];
        let segment = chain.segments[k.min(chain.segments.len() - 1)];
        self.start(point, found.topology.segments[segment as usize].triangles)
    }

    /// A point of the triangulations with its parameters on both sides.
    fn start(&self, point: &Point, triangles: [u32; 2]) -> CurvePoint {
        let p = point.position;
        let [a, b] = self.sheets;
        let (uv, st) = match point.key.edge_of {
            Mesh::A => (a.uv_on(point.key.edge, p), b.uv_in(triangles[1], p)),
            Mesh::B => (a.uv_in(triangles[0], p), b.uv_on(point.key.edge, p)),
        };
        let [na, nb] = self.numbers;
        CurvePoint { xyz: p, a: na, uv, b: nb, st }
    }

    /// For the end of a curve on the border of a surface: the side whose border it is, and which of its
    /// parameters stays where it is.
    pub(super) fn border(&self, point: &Point) -> Option<(usize, usize)> {
        let side = usize::from(point.key.edge_of == Mesh::B);
        let sheet = self.sheets[side];
        let domain = sheet.surface()?.domain();
        let uv = point.key.edge.map(|k| sheet.uv_of(k));
        (0..2).find(|&d| uv[0][d] == uv[1][d] && domain[d].contains(&uv[0][d])).map(|d| (side, d))
    }

    /// The point of both sheets next to a point of the triangulations. One that lies on an edge of a mesh stays on it.
    pub(super) fn at_point(
        &self,
        start: CurvePoint,
        point: &Point,
        triangles: [u32; 2],
        fixed: Option<(usize, usize)>,
    ) -> Result<CurvePoint, String> {
        let side = usize::from(point.key.edge_of == Mesh::B);
        let (own, other) = (self.sheets[side], self.sheets[1 - side]);
        if let (None, Some(surface)) = (own.surface(), other.surface()) {
            let [p, q] = own.edge(point.key.edge);
            let uv = if side == 0 { start.st } else { start.uv };
            let foot = line_from(surface, closed_directions(surface), p, q - p, uv);
            // An edge that only the triangles meet is left to the planes.
            if foot.residual <= self.common.floor.max(1e-3 * self.common.tol) && (-1e-9..=1.0 + 1e-9).contains(&foot.t)
            {
                let mut at = CurvePoint { xyz: foot.point, ..start };
                *(if side == 0 { &mut at.st } else { &mut at.uv }) = foot.uv;
                return Ok(at);
            }
        }
        self.refined(start, triangles, fixed)
    }

    /// The point of both sheets next to `start`.
    pub(super) fn refined(
        &self,
        start: CurvePoint,
        triangles: [u32; 2],
        fixed: Option<(usize, usize)>,
    ) -> Result<CurvePoint, String> {
        let [a, b] = self.sheets;
        if a.surface().is_none() && b.surface().is_none() {
            return Ok(start);
        }
        let touch = |side: usize, uv: DVec2| match self.sheets[side].surface() {
            Some(surface) => Touch::Surface(surface, uv),
            None => {
                let (corner, normal) = self.sheets[side].plane(triangles[side]);
                Touch::Plane(corner, normal)
            }
        };
        let with =
            |r: Refined| CurvePoint { xyz: r.point, uv: r.a.unwrap_or(start.uv), st: r.b.unwrap_or(start.st), ..start };
        match fixed {
            Some((side, direction)) => {
                let uv = [start.uv, start.st];
                let other = touch(1 - side, uv[1 - side]);
                let (own, other) =
                    super::border::meet(self.sheets[side].surface(), uv[side], direction, other, self.common.floor)
                        .ok_or_else(|| {
                            "the end of a curve on a border was not reached from the triangles".to_owned()
                        })?;
                let mut point = start;
                (point.uv, point.st) =
                    if side == 0 { (own.0, other.unwrap_or(start.st)) } else { (other.unwrap_or(start.uv), own.0) };
                point.xyz = own.1;
                Ok(point)
            }
            None => refine(touch(0, start.uv), touch(1, start.st), self.common.floor)
                .or_else(|_| refine(touch(0, start.uv), touch(1, start.st), 1e-3 * self.common.tol))
                .map(with)
                .map_err(|e| format!("{e} (normals within {TANGENTIAL} rad are for the hybrid engine)")),
        }
    }
}
