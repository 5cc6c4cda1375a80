//! Welding: a soup of triangle corners becomes an indexed mesh by giving equal corners one vertex.
//!
//! Equal means equal coordinates, bit for bit but for the sign of zero; a tolerance would move geometry. One
//! open-addressing table, linear in the number of corners; the vertices come in the order in which they first
//! occur. [`Welder`] takes corners one by one; [`weld`] takes all at once, sorts them by hash into buckets whose tables
//! fit into the cache, and works on several threads with the same result.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;
use rayon::prelude::*;

/// Corners that one task of [`weld`] sorts.
const CHUNK: usize = 1 << 18;
/// Buckets of [`weld`], as a power of two.
const BUCKET_BITS: u32 = 8;

/// Gives equal corners `at(0) .. at(count - 1)` one vertex: the vertices in the order in which they first occur, and the
/// vertex of every corner. All corners must be finite. `None` when `u32` cannot number them.
pub fn weld(count: usize, at: impl Fn(usize) -> DVec3 + Sync) -> Option<(Vec<DVec3>, Vec<u32>)> {
    if u32::try_from(count).is_err() {
        return None;
    }
    let chunks = count.div_ceil(CHUNK);
    let range = |chunk: usize| chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
    // Corners by bucket, chunk by chunk, each in increasing order.
    let sorted: Vec<Vec<Vec<u32>>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let mut buckets = Vec::new();
            buckets.resize_with(1 << BUCKET_BITS, || Vec::with_capacity(CHUNK >> (BUCKET_BITS - 1)));
            for k in range(chunk) {
                buckets[(hash(at(k) + DVec3::ZERO) >> (64 - BUCKET_BITS)) as usize].push(k as u32);
            }
            buckets
        })
        .collect();
    // The first corner that is equal to each.
    let first: Vec<AtomicU32> = (0..count).into_par_iter().map(|_| AtomicU32::new(0)).collect();
    (0..1_usize << BUCKET_BITS).into_par_iter().for_each(|bucket| {
        let inside: usize = sorted.iter().map(|chunk| chunk[bucket].len()).sum();
        let mut table: Vec<(u32, DVec3)> = vec![(u32::MAX, DVec3::ZERO); (2 * inside.max(4)).next_power_of_two()];
        let mask = table.len() - 1;
        for &k in sorted.iter().flat_map(|chunk| &chunk[bucket]) {
            let p = at(k as usize) + DVec3::ZERO; // -0 becomes 0
            let mut slot = hash(p) as usize & mask;
            let found = loop {
                let (leader, other) = table[slot];
                if leader == u32::MAX {
                    table[slot] = (k, p);
                    break k;
                }
                if other == p {
                    break leader;
                }
                slot = (slot + 1) & mask;
            };
            first[k as usize].store(found, Ordering::Relaxed);
        }
    });
    drop(sorted);
    let first = |k: usize| first[k].load(Ordering::Relaxed);
    let mut number = vec![0_u32; count];
    let mut vertices = 0;
    for (k, number) in number.iter_mut().enumerate() {
        if first(k) as usize == k {
            *number = vertices;
            vertices += 1;
        }
    }
    let points: Vec<Vec<DVec3>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| range(chunk).filter(|&k| first(k) as usize == k).map(|k| at(k) + DVec3::ZERO).collect())
        .collect();
    let of_corner = (0..count).into_par_iter().map(|k| number[first(k) as usize]).collect();
    Some((points.concat(), of_corner))
}

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
    fn all_at_once_is_the_same_as_one_by_one() {
        let at = |k: usize| DVec3::new((k * 7919 % 301) as f64, (k % 17) as f64 - 8.0, -0.0);
        let count = 2 * CHUNK + 77;
        let (points, corners) = weld(count, at).unwrap();
        let mut welder = Welder::with_capacity(16);
        let slow: Vec<u32> = (0..count).map(|k| welder.vertex(at(k)).unwrap()).collect();
        assert_eq!(corners, slow);
        assert_eq!(points, welder.into_points());
        assert_eq!(weld(0, at), Some((vec![], vec![])));
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
