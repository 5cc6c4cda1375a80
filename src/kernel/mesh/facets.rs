//! Bodies without a parametric description: a triangle mesh, or a structured block as triangles, with the curves
//! on it that can be picked.
//!
//! HJR99 needs two things of such a body: triangles to intersect and to project on (3.3: "if the parametric
//! representation of the original surfaces is not known, we simply use the intersections with the surface
//! triangulations"), and curves that can bound a patch. The curves of a mesh are its border loops and its feature
//! edges (edges whose triangles' normals differ by more than [`FEATURE_ANGLE`], and edges of more than two triangles);
//! those of a block are its grid lines. A chain of edges is cut where it turns a corner, so that the rim of a
//! rectangular hole is four curves: at a vertex where the directions to both sides, taken over a twenty-fifth of the
//! chain's length so that a jagged rim is not all corners, differ by more than [`CORNER_ANGLE`].
//!
//! Curves are made when they are first asked for; O(n log n) in the triangles. Nothing fails: what has no length
//! is no curve.

use std::sync::OnceLock;

use glam::DVec3;
use serde::{Deserialize, Serialize, Serializer};

use super::grid::{Grid, GridError};
use super::tri_mesh::{EdgeChain, MeshError, TriMesh};
use super::weld::Welder;
use crate::kernel::geom::{Aabb, Curve};

/// The dihedral angle of a feature edge, in degrees.
pub const FEATURE_ANGLE: f64 = 30.0;
/// The angle by which a chain turns at a corner, in degrees.
pub const CORNER_ANGLE: f64 = 45.0;
/// The length over which a direction is taken at a corner, as a fraction of the chain's length.
const CORNER_REACH: f64 = 0.04;

/// Which curve of a body it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FacetCurveKind {
    /// A part of the border or of the rim of a hole.
    Border,
    /// Edges at which the surface has a crease, or at which more than two triangles meet.
    Feature,
    /// The border line of a face of a block.
    GridBorder,
    /// A grid line inside a face of a block.
    GridLine,
}

/// A polyline on a body.
#[derive(Clone, Debug)]
pub struct FacetCurve {
    /// What it is.
    pub kind: FacetCurveKind,
    /// Its name for people: "border 3", "k max, i = 4".
    pub name: String,
    /// The polyline as a curve of degree 1.
    pub curve: Curve,
}

/// A mesh or a block.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "FacetsData")]
pub struct Facets {
    mesh: TriMesh,
    grid: Option<Grid>,
    bounds: Aabb,
    curves: OnceLock<Vec<FacetCurve>>,
}

/// Why numbers are no body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FacetsError {
    /// The triangles are wrong.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The block is wrong.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// A body as projects have it, unchecked: a block has counts, a mesh has triangles.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FacetsData {
    #[serde(default)]
    counts: Option<[usize; 3]>,
    points: Vec<DVec3>,
    #[serde(default)]
    blank: Option<Vec<i32>>,
    #[serde(default)]
    triangles: Vec<[u32; 3]>,
    #[serde(default)]
    groups: Vec<(String, usize, usize)>,
}

/// What is written of a body.
#[derive(Serialize)]
struct FacetsRef<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    counts: Option<[usize; 3]>,
    points: &'a [DVec3],
    #[serde(skip_serializing_if = "Option::is_none")]
    blank: Option<&'a [i32]>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    triangles: &'a [[u32; 3]],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    groups: &'a [(&'a str, usize, usize)],
}

impl Serialize for Facets {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let groups: Vec<_> =
            self.mesh.groups.iter().map(|g| (g.name.as_str(), g.triangles.start, g.triangles.end)).collect();
        let data = match &self.grid {
            Some(grid) => FacetsRef {
                counts: Some(grid.counts()),
                points: grid.points(),
                blank: grid.blank(),
                triangles: &[],
                groups: &[],
            },
            None => FacetsRef {
                counts: None,
                points: self.mesh.points(),
                blank: None,
                triangles: self.mesh.triangles(),
                groups: &groups,
            },
        };
        data.serialize(to)
    }
}

impl TryFrom<FacetsData> for Facets {
    type Error = FacetsError;

    fn try_from(data: FacetsData) -> Result<Self, FacetsError> {
        match data.counts {
            Some(counts) => Self::of_block(Grid::new(counts, data.points, data.blank)?),
            None => {
                let mut mesh = TriMesh::new(data.points, data.triangles)?;
                mesh.set_groups(data.groups);
                Ok(Self::of_mesh(mesh))
            }
        }
    }
}

impl Facets {
    /// A triangle mesh.
    pub fn of_mesh(mesh: TriMesh) -> Self {
        let bounds = mesh.bounds();
        Self { mesh, grid: None, bounds, curves: OnceLock::new() }
    }

    /// A structured block: its surface grid, or the six faces of a solid one, turned outwards. Equal points become one
    /// vertex.
    pub fn of_block(grid: Grid) -> Result<Self, FacetsError> {
        let mut welder = Welder::with_capacity(grid.points().len().min(1 << 22));
        let mut triangles = Vec::new();
        let too_many = || MeshError::TooMany { got: grid.points().len(), limit: u32::MAX as usize };
        let faces = grid.surfaces();
        let solid = faces.len() > 1;
        for (number, face) in faces.into_iter().enumerate() {
            let part = face.triangulated()?;
            // The two directions of these faces turn inwards where i, j, k are right-handed.
            let inwards = solid && matches!(number, 0 | 3 | 4);
            for corners in part.triangles() {
                let mut own = [0; 3];
                for (own, &k) in own.iter_mut().zip(corners) {
                    *own = welder.vertex(part.points()[k as usize]).ok_or_else(too_many)?;
                }
                if own[0] != own[1] && own[1] != own[2] && own[2] != own[0] {
                    triangles.push(if inwards { [own[0], own[2], own[1]] } else { own });
                }
            }
        }
        let mut mesh = TriMesh::new(welder.into_points(), triangles)?;
        if solid && mesh.volume() < 0.0 {
            mesh.reverse();
        }
        let bounds = mesh.bounds();
        Ok(Self { mesh, grid: Some(grid), bounds, curves: OnceLock::new() })
    }

    /// The triangles.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The block; `None` for a mesh.
    pub fn grid(&self) -> Option<&Grid> {
        self.grid.as_ref()
    }

    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Its curves in a fixed order: the borders of a mesh and then its feature edges; the grid lines of a block,
    /// face by face, those of constant j first.
    pub fn curves(&self) -> &[FacetCurve] {
        if let Some(curves) = self.curves.get() {
            return curves;
        }
        // Made before the lock is taken: the work is parallel, and a thread that waits for its parts may meanwhile take up
        // other work that asks for these very curves. Whoever comes second throws equal ones away.
        let made = match &self.grid {
            None => mesh_curves(&self.mesh),
            Some(grid) => grid_curves(grid),
        };
        self.curves.get_or_init(|| made)
    }
}

fn mesh_curves(mesh: &TriMesh) -> Vec<FacetCurve> {
    let mut out = Vec::new();
    let (border, sharp) = mesh.border_loops_and_feature_edges(FEATURE_ANGLE.to_radians());
    let chains = [(FacetCurveKind::Border, "border", border), (FacetCurveKind::Feature, "feature edge", sharp)];
    for (kind, word, chains) in chains {
        let mut number = 0;
        for chain in chains {
            for points in cut_at_corners(mesh, &chain) {
                if let Ok(curve) = Curve::polyline(&points) {
                    out.push(FacetCurve { kind, name: format!("{word} {number}"), curve });
                    number += 1;
                }
            }
        }
    }
    out
}

/// The polylines between the corners of a chain; a closed chain without corners stays whole.
fn cut_at_corners(mesh: &TriMesh, chain: &EdgeChain) -> Vec<Vec<DVec3>> {
    let points: Vec<DVec3> = chain.vertices.iter().map(|&v| mesh.points()[v as usize]).collect();
    let mut at = vec![0.0];
    for pair in points.windows(2) {
        at.push(at[at.len() - 1] + pair[0].distance(pair[1]));
    }
    let total = at[at.len() - 1];
    let last = points.len() - 1;
    if !(total > 0.0) || last < 3 {
        return vec![points];
    }
    let reach = CORNER_REACH * total;
    let on = |s: f64| {
        let s = if chain.closed { s.rem_euclid(total) } else { s.clamp(0.0, total) };
        let k = at.partition_point(|&a| a <= s).clamp(1, last);
        let width = at[k] - at[k - 1];
        points[k - 1].lerp(points[k], if width > 0.0 { (s - at[k - 1]) / width } else { 0.0 })
    };
    let turning = |k: usize| {
        let (before, after) = (points[k] - on(at[k] - reach), on(at[k] + reach) - points[k]);
        if before.length_squared() > 0.0 && after.length_squared() > 0.0 { before.angle_between(after) } else { 0.0 }
    };
    let first = usize::from(!chain.closed);
    let turns: Vec<(usize, f64)> =
        (first..last).map(|k| (k, turning(k))).filter(|(_, a)| *a > CORNER_ANGLE.to_radians()).collect();
    let apart = |a: f64, b: f64| {
        let d = (a - b).abs();
        if chain.closed { d.min(total - d) } else { d }
    };
    // Of several vertices within the reach of one another the one that turns most is the corner.
    let corners: Vec<usize> = turns
        .iter()
        .filter(|(k, a)| {
            turns.iter().all(|(m, b)| m == k || apart(at[*m], at[*k]) > reach || b < a || (b == a && m > k))
        })
        .map(|(k, _)| *k)
        .collect();
    if corners.is_empty() {
        return vec![points];
    }
    let mut pieces = Vec::new();
    if chain.closed {
        for (i, &from) in corners.iter().enumerate() {
            let to = corners[(i + 1) % corners.len()];
            let piece = if from < to {
                points[from..=to].to_vec()
            } else {
                points[from..last].iter().chain(&points[..=to]).copied().collect()
            };
            pieces.push(piece);
        }
    } else {
        let mut from = 0;
        for to in corners.into_iter().chain([last]) {
            pieces.push(points[from..=to].to_vec());
            from = to;
        }
    }
    pieces
}

fn grid_curves(grid: &Grid) -> Vec<FacetCurve> {
    let faces = grid.surfaces();
    let several = faces.len() > 1;
    let mut out = Vec::new();
    for (number, (face, [first, second])) in faces.iter().zip(grid.directions()).enumerate() {
        let [ni, nj, _] = face.counts();
        let mut line = |kind, name: String, chosen: Vec<usize>| {
            let name = if several { format!("{}, {name}", Grid::FACES[number]) } else { name };
            // Points that are blanked out break the line.
            for run in chosen.split(|&k| face.blank().is_some_and(|b| b[k] == 0)) {
                let points: Vec<DVec3> = run.iter().map(|&k| face.points()[k]).collect();
                if points.len() > 1
                    && let Ok(curve) = Curve::polyline(&points)
                {
                    out.push(FacetCurve { kind, name: name.clone(), curve });
                }
            }
        };
        let kind = |at: usize, count: usize| {
            if at == 0 || at + 1 == count { FacetCurveKind::GridBorder } else { FacetCurveKind::GridLine }
        };
        for j in 0..nj {
            line(kind(j, nj), format!("{second} = {j}"), (0..ni).map(|i| j * ni + i).collect());
        }
        for i in 0..ni {
            line(kind(i, ni), format!("{first} = {i}"), (0..nj).map(|j| j * ni + i).collect());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat sheet of n x n squares over [0, n]^2 with the squares of `hole` left out.
    fn sheet(n: usize, hole: impl Fn(usize, usize) -> bool) -> TriMesh {
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let points = (0..(n + 1) * (n + 1)).map(|k| DVec3::new((k % (n + 1)) as f64, (k / (n + 1)) as f64, 0.0));
        let mut triangles = Vec::new();
        for j in 0..n {
            for i in (0..n).filter(|&i| !hole(i, j)) {
                triangles
                    .extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
            }
        }
        TriMesh::new(points.collect(), triangles).unwrap()
    }

    #[test]
    fn the_rims_of_a_rectangular_hole_and_of_the_sheet_are_four_curves_each() {
        let facets = Facets::of_mesh(sheet(12, |i, j| (4..8).contains(&i) && (3..9).contains(&j)));
        let lengths: Vec<f64> = facets
            .curves()
            .iter()
            .map(|c| c.curve.points().windows(2).map(|p| p[0].distance(p[1])).sum::<f64>())
            .collect();
        assert_eq!(facets.curves().len(), 8);
        assert!(facets.curves().iter().all(|c| c.kind == FacetCurveKind::Border));
        assert_eq!(lengths.iter().filter(|l| (**l - 12.0).abs() < 1e-12).count(), 4);
        assert_eq!(lengths.iter().filter(|l| (**l - 4.0).abs() < 1e-12).count(), 2);
        assert_eq!(lengths.iter().filter(|l| (**l - 6.0).abs() < 1e-12).count(), 2);
    }

    #[test]
    fn a_round_rim_and_a_jagged_rim_are_one_curve() {
        let mut disk = vec![DVec3::ZERO];
        let n = 60;
        disk.extend(
            (0..n).map(|k| DVec3::new((0.1047197551 * f64::from(k)).cos(), (0.1047197551 * f64::from(k)).sin(), 0.0)),
        );
        let triangles: Vec<[u32; 3]> = (0..n as u32).map(|k| [0, 1 + k, 1 + (k + 1) % n as u32]).collect();
        for jag in [0.0, 0.03] {
            let points = disk.iter().enumerate().map(|(k, p)| *p * if k % 2 == 0 { 1.0 } else { 1.0 + jag }).collect();
            let facets = Facets::of_mesh(TriMesh::new(points, triangles.clone()).unwrap());
            assert_eq!(facets.curves().len(), 1, "jag {jag}");
        }
    }

    /// The lock was held while parts of the work were given to other threads, which could ask for the same curves.
    #[test]
    fn curves_can_be_asked_for_from_within_parallel_work() {
        use rayon::prelude::*;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        for _ in 0..8 {
            let facets = Facets::of_mesh(sheet(40, |i, j| i == 20 && j == 20));
            let counts: Vec<usize> = pool.install(|| (0..24).into_par_iter().map(|_| facets.curves().len()).collect());
            assert_eq!(counts, vec![8; 24]);
        }
    }

    #[test]
    fn a_block_has_its_grid_lines_and_one_closed_skin() {
        let counts = [3, 4, 5];
        let point = |k: usize| DVec3::new((k % 3) as f64, (k / 3 % 4) as f64, (k / 12) as f64);
        let grid = Grid::new(counts, (0..60).map(point).collect(), None).unwrap();
        let facets = Facets::of_block(grid).unwrap();
        assert_eq!(facets.mesh().defects().border_edges, 0, "the six faces share their edges");
        // Each pair of faces has its two counts of lines: 2 (4 + 5) + 2 (3 + 5) + 2 (3 + 4).
        assert_eq!(facets.curves().len(), 48);
        assert_eq!(facets.curves().iter().filter(|c| c.kind == FacetCurveKind::GridBorder).count(), 24);
        // A line is named as the block counts: on the face i = 0 lie lines of constant j and k.
        let named = facets.curves().iter().find(|c| c.name == "i min, k = 3").unwrap();
        assert!(named.curve.points().iter().all(|p| p.x == 0.0 && p.z == 3.0));
        assert!((facets.mesh().area() - 2.0 * (6.0 + 8.0 + 12.0)).abs() < 1e-12);
        // All six faces look outwards, also when k runs down.
        assert!((facets.mesh().volume() - 24.0).abs() < 1e-12);
        let down = |k: usize| point(k) * DVec3::new(1.0, 1.0, -1.0);
        let mirrored = Facets::of_block(Grid::new(counts, (0..60).map(down).collect(), None).unwrap()).unwrap();
        assert!((mirrored.mesh().volume() - 24.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_written_is_read_back_and_damage_is_an_error() {
        let block = Facets::of_block(
            Grid::new([2, 2, 1], vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE], Some(vec![1, 1, 1, 0])).unwrap(),
        );
        let mut mesh = sheet(2, |_, _| false);
        mesh.set_groups(vec![("left".into(), 0, 3), ("right".into(), 3, 8)]);
        for facets in [block.unwrap(), Facets::of_mesh(mesh)] {
            let text = ron::to_string(&facets).unwrap();
            let back: Facets = ron::from_str(&text).unwrap();
            assert_eq!((back.mesh(), back.grid()), (facets.mesh(), facets.grid()));
        }
        assert!(ron::from_str::<Facets>("(points:[],triangles:[(0,1,2)])").is_err());
        assert!(ron::from_str::<Facets>("(counts:Some((9,9,9)),points:[])").is_err());
    }
}
