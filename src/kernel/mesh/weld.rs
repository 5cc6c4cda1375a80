//! Welding: a soup of triangle corners becomes an indexed mesh by giving equal corners one vertex.
//!
//! Equal means equal coordinates, bit for bit but for the sign of zero; a tolerance would move geometry. One
//! open-addressing table of `u32`, linear in the number of corners; the vertices come in the order in which they first
//! occur. Corners come one by one; [`super::soup`] takes all of a large file at once.

use glam::DVec3;

/// Collects corners and numbers them.
#[derive(Clone, Debug)]
pub struct Welder {
    /// Vertex number + 1, 0 for a free slot; its length is a power of two.
    table: Vec<u32>,
    points: Vec<DVec3>,
}

impl Welder {
    /// A welder that expects about this many different vertices (it grows when there are more).
    pub fn with_capacity(vertices: usize) -> Self {
        Self { table: vec![0; (2 * vertices.max(8)).next_power_of_two()], points: Vec::with_capacity(vertices) }
    }

    /// The number of the vertex at `p`, made when it is new. `None` when `u32` cannot number any more.
    pub fn vertex(&mut self, p: DVec3) -> Option<u32> {
        if 2 * (self.points.len() + 1) > self.table.len() {
            self.grow();
        }
        let p = p + DVec3::ZERO; // -0 becomes 0
        let mask = self.table.len() - 1;
        let mut at = hash(p) as usize & mask;
        loop {
            match self.table[at] {
                0 => {
                    let index = u32::try_from(self.points.len()).ok().filter(|&k| k < u32::MAX)?;
                    self.table[at] = index + 1;
                    self.points.push(p);
                    return Some(index);
                }
                k if self.points[k as usize - 1] == p => return Some(k - 1),
                _ => at = (at + 1) & mask,
            }
        }
    }

    fn grow(&mut self) {
        let length = 2 * self.table.len();
        self.table = vec![0; length];
        for (index, &p) in self.points.iter().enumerate() {
            let mut at = hash(p) as usize & (length - 1);
            while self.table[at] != 0 {
                at = (at + 1) & (length - 1);
            }
            self.table[at] = index as u32 + 1;
        }
    }

    /// The vertices.
    pub fn into_points(self) -> Vec<DVec3> {
        self.points
    }
}

/// A mix of the coordinate bits (the finalizer of MurmurHash3, Appleby).
fn hash(p: DVec3) -> u64 {
    let mut h = p.x.to_bits() ^ p.y.to_bits().rotate_left(21) ^ p.z.to_bits().rotate_left(43);
    h = (h ^ (h >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    h = (h ^ (h >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    h ^ (h >> 33)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_corners_share_a_vertex_and_order_is_first_come() {
        let mut welder = Welder::with_capacity(0);
        let grid = |k: usize| DVec3::new((k % 7) as f64, (k / 7 % 7) as f64, (k / 49) as f64);
        for k in 0..343 {
            assert_eq!(welder.vertex(grid(k)), Some(k as u32));
        }
        for k in (0..343).rev() {
            assert_eq!(welder.vertex(grid(k)), Some(k as u32));
        }
        assert_eq!(welder.vertex(DVec3::new(-0.0, 0.0, -0.0)), Some(0));
        assert_eq!(welder.into_points().len(), 343);
    }
}
