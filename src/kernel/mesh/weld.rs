//! Welding: a soup of triangle corners becomes an indexed mesh by giving equal corners one vertex.
//!
//! Equal means equal coordinates, bit for bit but for the sign of zero; a tolerance would move geometry. One
//! open-addressing table of `u32`, linear in the number of corners; the vertices come in the order in which they first
//! occur. Corners come one by one, or in batches whose memory accesses overlap: first all table entries of a batch are
//! fetched, then the points that they name are compared.

use glam::DVec3;

/// Corners whose table entries are fetched together.
const BATCH: usize = 64;

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

    /// Appends the numbers of many corners to `out`, as [`Self::vertex`] would give them one by one. `None` when `u32`
    /// cannot number any more.
    pub fn vertices(&mut self, corners: &[DVec3], out: &mut Vec<u32>) -> Option<()> {
        let mut guess = [0_u32; BATCH];
        for batch in corners.chunks(BATCH) {
            let mask = self.table.len() - 1;
            for (guess, &p) in guess.iter_mut().zip(batch) {
                *guess = self.table[hash(p + DVec3::ZERO) as usize & mask];
            }
            for (&guess, &p) in guess.iter().zip(batch) {
                match guess.checked_sub(1) {
                    Some(k) if self.points[k as usize] == p => out.push(k),
                    _ => out.push(self.vertex(p)?),
                }
            }
        }
        Some(())
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
    fn batches_are_the_same_as_one_by_one() {
        let at = |k: usize| DVec3::new((k * 7919 % 301) as f64, (k % 17) as f64 - 8.0, -0.0);
        let corners: Vec<DVec3> = (0..20_077).map(at).collect();
        let (mut batches, mut one_by_one) = (Welder::with_capacity(16), Welder::with_capacity(16));
        let mut numbers = Vec::new();
        for part in corners.chunks(1000) {
            batches.vertices(part, &mut numbers).unwrap();
        }
        let slow: Vec<u32> = corners.iter().map(|&p| one_by_one.vertex(p).unwrap()).collect();
        assert_eq!(numbers, slow);
        assert_eq!(batches.into_points(), one_by_one.into_points());
    }

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
