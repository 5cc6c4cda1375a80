//! Structured grids: blocks of points in i, j, k order, as Plot3D files hold them.

use glam::DVec3;

use super::tri_mesh::{MeshError, TriMesh};

/// A block of `counts[0] x counts[1] x counts[2]` points, i running fastest. A surface grid has one count of 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    counts: [usize; 3],
    points: Vec<DVec3>,
    /// IBLANK values in the order of the points: 0 blanks a point out.
    blank: Option<Vec<i32>>,
}

/// Why numbers are no structured grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{points} points and {blanks:?} blanking values for {counts:?}")]
pub struct GridError {
    /// The counts in i, j, k.
    pub counts: [usize; 3],
    /// The number of points.
    pub points: usize,
    /// The number of blanking values, if any.
    pub blanks: Option<usize>,
}

impl Grid {
    /// The names of the faces of a solid block, in the order of [`Self::surfaces`].
    pub const FACES: [&'static str; 6] = ["i min", "i max", "j min", "j max", "k min", "k max"];

    /// Checks and keeps a block.
    pub fn new(counts: [usize; 3], points: Vec<DVec3>, blank: Option<Vec<i32>>) -> Result<Self, GridError> {
        let expected = counts.iter().try_fold(1_usize, |n, &c| n.checked_mul(c));
        let blanks = blank.as_ref().map(Vec::len);
        if counts.contains(&0) || expected != Some(points.len()) || blanks.is_some_and(|n| n != points.len()) {
            return Err(GridError { counts, points: points.len(), blanks });
        }
        Ok(Self { counts, points, blank })
    }

    /// The numbers of points in i, j, k.
    pub fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// The points, i running fastest.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The blanking values.
    pub fn blank(&self) -> Option<&[i32]> {
        self.blank.as_deref()
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.counts[1] + j) * self.counts[0] + i
    }

    /// The surface grids of the block: itself when one count is 1, else its faces i min, i max, j min, j max,
    /// k min, k max. Blanking goes with the points.
    pub fn surfaces(&self) -> Vec<Self> {
        if self.counts.contains(&1) {
            return vec![self.flattened()];
        }
        let mut faces = Vec::with_capacity(6);
        for axis in 0..3 {
            let (first, second) = ([1, 0, 0][axis], [2, 2, 1][axis]);
            for at in [0, self.counts[axis] - 1] {
                let counts = [self.counts[first], self.counts[second], 1];
                let mut chosen = Vec::with_capacity(counts[0] * counts[1]);
                for b in 0..counts[1] {
                    for a in 0..counts[0] {
                        let mut ijk = [0; 3];
                        (ijk[axis], ijk[first], ijk[second]) = (at, a, b);
                        chosen.push(self.index(ijk));
                    }
                }
                faces.push(self.picked(counts, &chosen));
            }
        }
        faces
    }

    /// What the block calls the two directions of each of [`Self::surfaces`].
    pub fn directions(&self) -> Vec<[char; 2]> {
        const IJK: [char; 3] = ['i', 'j', 'k'];
        if self.counts.contains(&1) {
            // Those that run come first; of a line or a point the others make up the number.
            let (runs, rests): (Vec<usize>, Vec<usize>) = (0..3).partition(|&d| self.counts[d] > 1);
            let order = [runs, rests].concat();
            return vec![[IJK[order[0]], IJK[order[1]]]];
        }
        [['j', 'k'], ['i', 'k'], ['i', 'j']].into_iter().flat_map(|pair| [pair; 2]).collect()
    }

    /// A surface grid with its count of 1 moved to the end.
    fn flattened(&self) -> Self {
        let mut counts: Vec<usize> = self.counts.iter().copied().filter(|&c| c > 1).collect();
        counts.resize(3, 1);
        Self { counts: [counts[0], counts[1], counts[2]], ..self.clone() }
    }

    fn picked(&self, counts: [usize; 3], chosen: &[usize]) -> Self {
        Self {
            counts,
            points: chosen.iter().map(|&k| self.points[k]).collect(),
            blank: self.blank.as_ref().map(|b| chosen.iter().map(|&k| b[k]).collect()),
        }
    }

    /// The two triangles of every cell of a surface grid (third count 1) none of whose points is blanked out.
    pub fn triangulated(&self) -> Result<TriMesh, MeshError> {
        let [ni, nj, _] = self.counts;
        let seen = |k: usize| self.blank.as_ref().is_none_or(|b| b[k] != 0);
        let mut triangles = Vec::with_capacity(2 * ni * nj);
        for j in 0..nj.saturating_sub(1) {
            for i in 0..ni.saturating_sub(1) {
                let at = j * ni + i;
                let corners = [at, at + 1, at + ni + 1, at + ni];
                if corners.into_iter().all(seen) {
                    let [a, b, c, d] = corners.map(|k| k as u32);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        TriMesh::new(self.points[..ni * nj].to_vec(), triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(counts: [usize; 3]) -> Grid {
        let [ni, nj, nk] = counts;
        let point = |k: usize| DVec3::new((k % ni) as f64, (k / ni % nj) as f64, (k / (ni * nj)) as f64);
        Grid::new(counts, (0..ni * nj * nk).map(point).collect(), None).unwrap()
    }

    #[test]
    fn the_faces_of_a_block_are_its_six_sides() {
        let faces = block([3, 4, 5]).surfaces();
        let area: Vec<f64> = faces.iter().map(|f| f.triangulated().unwrap().area()).collect();
        assert_eq!(area, [12.0, 12.0, 8.0, 8.0, 6.0, 6.0]);
        assert!(faces[1].points().iter().all(|p| p.x == 2.0) && faces[4].points().iter().all(|p| p.z == 0.0));
    }

    #[test]
    fn a_surface_grid_is_its_own_only_face_whichever_count_is_one() {
        for counts in [[1, 4, 3], [4, 1, 3], [4, 3, 1]] {
            let faces = block(counts).surfaces();
            assert_eq!(faces.len(), 1);
            assert_eq!(faces[0].triangulated().unwrap().area(), 6.0);
        }
    }

    #[test]
    fn directions_are_those_along_which_the_points_of_a_face_run() {
        for counts in [[3, 4, 5], [1, 4, 3], [4, 1, 3], [4, 3, 1]] {
            let grid = block(counts);
            for (face, directions) in grid.surfaces().iter().zip(grid.directions()) {
                let steps = [1, face.counts()[0]].map(|k| face.points()[k] - face.points()[0]);
                let axis = |c: char| [DVec3::X, DVec3::Y, DVec3::Z]["ijk".find(c).unwrap()];
                assert_eq!(steps, directions.map(axis), "{counts:?}");
            }
            assert_eq!(grid.surfaces().len(), grid.directions().len());
        }
    }

    #[test]
    fn blanked_points_take_their_cells_with_them() {
        let whole = block([3, 3, 1]);
        let mut blank = vec![1; 9];
        blank[0] = 0;
        let grid = Grid::new([3, 3, 1], whole.points().to_vec(), Some(blank)).unwrap();
        assert_eq!(grid.triangulated().unwrap().area(), 3.0);
    }
}
