//! Welding of a whole soup of triangles at once: what [`super::weld::Welder`] does corner by corner, on all threads.
//!
//! The corners of a soup in random order hit a table of millions of vertices at random, and every hit is a miss of the
//! caches. So corners are first sorted into buckets by the high bits of a hash, run by run while the file is read
//! ([`Part`]); the corners of one bucket then meet in a table that fits in a core's cache (a radix join; Manegold, Boncz
//! and Kersten, *Optimizing main-memory join on modern hardware*, 2002). A bucket notes for each corner the first one
//! at its place; the number of a vertex is how many first corners come before its own, counted in a bit field.
//!
//! Equal means equal coordinates but for the sign of zero. Vertices are numbered in the order in which they first occur,
//! whatever the number of threads. O(n); 16 bytes a corner meanwhile. Triangles with a coordinate that is not finite,
//! or with two equal corners, are left out and counted.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering::Relaxed};

use glam::DVec3;
use rayon::prelude::*;

/// Two hundred megabytes of triangles make tables of a quarter of a megabyte.
const BUCKETS: usize = 256;
/// Stands for the first corner at the place of one that is left out.
const NONE: u32 = u32::MAX;
/// The most triangles whose corners can be numbered.
pub const MOST: usize = (u32::MAX / 3) as usize;

#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    /// The bits of its coordinates, with one zero only.
    key: [u32; 3],
    /// Its number in its part.
    number: u32,
}

/// A run of triangles with its corners sorted into buckets.
#[derive(Clone, Debug)]
pub struct Part {
    triangles: usize,
    not_finite: usize,
    corners: Vec<Corner>,
    /// One past the last corner of each bucket.
    ends: Vec<u32>,
}

impl Part {
    /// Sorts the corners of some triangles.
    pub fn new(triangles: impl ExactSizeIterator<Item = [[f32; 3]; 3]>) -> Self {
        let count = triangles.len();
        let mut loose: Vec<(Corner, u8)> = Vec::with_capacity(3 * count);
        let mut ends = vec![0_u32; BUCKETS];
        for (t, triangle) in triangles.enumerate() {
            if !triangle.iter().flatten().all(|c| c.is_finite()) {
                continue;
            }
            for (k, corner) in triangle.into_iter().enumerate() {
                let key = corner.map(|c| (c + 0.0).to_bits());
                let bucket = (hash(key) >> 56) as u8;
                ends[bucket as usize] += 1;
                loose.push((Corner { key, number: (3 * t + k) as u32 }, bucket));
            }
        }
        let mut place = 0;
        for end in &mut ends {
            (*end, place) = (place, place + *end);
        }
        let mut corners = vec![Corner::default(); loose.len()];
        for (corner, bucket) in &loose {
            let place = &mut ends[*bucket as usize];
            corners[*place as usize] = *corner;
            *place += 1;
        }
        Self { triangles: count, not_finite: count - loose.len() / 3, corners, ends }
    }

    fn bucket(&self, k: usize) -> &[Corner] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.corners[start as usize..self.ends[k] as usize]
    }
}

/// A soup that was welded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Welded {
    /// The vertices in the order in which they first occur.
    pub points: Vec<DVec3>,
    /// The triangles in their order.
    pub triangles: Vec<[u32; 3]>,
    /// How many triangles were left out because a coordinate is not finite.
    pub not_finite: usize,
    /// How many were left out because two of their corners are equal.
    pub collapsed: usize,
}

/// Welds the parts of a soup, of no more than [`MOST`] triangles in all.
pub fn weld(parts: &[Part]) -> Welded {
    // The number of the first corner of each part.
    let mut offsets = Vec::with_capacity(parts.len());
    let mut total = 0;
    for part in parts {
        offsets.push(total as u32);
        total += 3 * part.triangles;
    }
    let firsts: Vec<AtomicU32> = (0..total).into_par_iter().map(|_| AtomicU32::new(NONE)).collect();
    (0..BUCKETS).into_par_iter().for_each(|k| weld_bucket(parts, &offsets, k, &firsts));
    let ranks = Ranks::new(&firsts);

    let mut points: Vec<DVec3> = (0..ranks.before(total)).into_par_iter().map(|_| DVec3::ZERO).collect();
    let mut rest = &mut points[..];
    let mut slices = Vec::with_capacity(parts.len());
    for (part, &offset) in parts.iter().zip(&offsets) {
        let start = ranks.before(offset as usize);
        let (own, behind) = rest.split_at_mut(ranks.before(offset as usize + 3 * part.triangles) - start);
        slices.push((part, offset, start, own));
        rest = behind;
    }
    slices.into_par_iter().for_each(|(part, offset, start, own)| {
        for corner in &part.corners {
            let number = offset + corner.number;
            if firsts[number as usize].load(Relaxed) == number {
                own[ranks.before(number as usize) - start] =
                    DVec3::from_array(corner.key.map(|bits| f64::from(f32::from_bits(bits))));
            }
        }
    });

    let collapsed = AtomicUsize::new(0);
    let vertex = |first: &AtomicU32| match first.load(Relaxed) {
        NONE => NONE,
        first => ranks.before(first as usize) as u32,
    };
    let triangle = |corners: &[AtomicU32]| {
        let triangle = [0, 1, 2].map(|k| vertex(&corners[k]));
        collapsed.fetch_add(usize::from(triangle[0] != NONE && !is_whole(&triangle)), Relaxed);
        triangle
    };
    let mut triangles: Vec<[u32; 3]> = firsts.par_chunks_exact(3).map(triangle).collect();
    let (collapsed, not_finite) = (collapsed.into_inner(), parts.iter().map(|p| p.not_finite).sum());
    if collapsed + not_finite > 0 {
        triangles.retain(is_whole);
    }
    Welded { points, triangles, not_finite, collapsed }
}

/// Whether no two corners are the same vertex (or stand for none).
fn is_whole([a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Notes for each corner of one bucket the first one at its place.
fn weld_bucket(parts: &[Part], offsets: &[u32], bucket: usize, firsts: &[AtomicU32]) {
    let count: usize = parts.iter().map(|part| part.bucket(bucket).len()).sum();
    // Six triangles meet at most vertices of most meshes.
    let mut table = vec![0_u32; (count / 2).max(8).next_power_of_two()];
    let mut known: Vec<([u32; 3], u32)> = Vec::with_capacity(count / 5);
    for (part, offset) in parts.iter().zip(offsets) {
        for corner in part.bucket(bucket) {
            let number = offset + corner.number;
            let mask = table.len() - 1;
            let mut at = hash(corner.key) as usize & mask;
            let first = loop {
                match table[at].checked_sub(1).map(|k| known[k as usize]) {
                    None => {
                        known.push((corner.key, number));
                        table[at] = known.len() as u32;
                        break number;
                    }
                    Some((key, first)) if key == corner.key => break first,
                    Some(_) => at = (at + 1) & mask,
                }
            };
            firsts[number as usize].store(first, Relaxed);
            if 2 * known.len() > table.len() {
                table = grown(2 * table.len(), &known);
            }
        }
    }
}

fn grown(length: usize, known: &[([u32; 3], u32)]) -> Vec<u32> {
    let mut table = vec![0_u32; length];
    for (k, (key, _)) in known.iter().enumerate() {
        let mut at = hash(*key) as usize & (length - 1);
        while table[at] != 0 {
            at = (at + 1) & (length - 1);
        }
        table[at] = k as u32 + 1;
    }
    table
}

/// How many first corners there are before any corner.
struct Ranks(Vec<Word>);

/// Sixty-four corners.
struct Word {
    /// Which of them are first corners.
    bits: u64,
    /// How many first corners come before them.
    before: u32,
}

impl Ranks {
    fn new(firsts: &[AtomicU32]) -> Self {
        let word = |(k, corners): (usize, &[AtomicU32])| {
            let is_first = |(i, first): (usize, &AtomicU32)| u64::from(first.load(Relaxed) as usize == 64 * k + i) << i;
            Word { bits: corners.iter().enumerate().map(is_first).fold(0, |all, bit| all | bit), before: 0 }
        };
        let mut words: Vec<Word> = firsts.par_chunks(64).enumerate().map(word).collect();
        words.push(Word { bits: 0, before: 0 });
        let mut before = 0;
        for word in &mut words {
            word.before = before;
            before += word.bits.count_ones();
        }
        Self(words)
    }

    fn before(&self, corner: usize) -> usize {
        let word = &self.0[corner / 64];
        word.before as usize + (word.bits & ((1 << (corner % 64)) - 1)).count_ones() as usize
    }
}

/// A mix of the coordinate bits (multiplications and shifts after the finalizer of MurmurHash3, Appleby).
fn hash([x, y, z]: [u32; 3]) -> u64 {
    let h = (u64::from(x) | u64::from(y) << 32).wrapping_mul(0xff51_afd7_ed55_8ccd)
        ^ u64::from(z).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    let h = (h ^ (h >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h ^ (h >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::mesh::weld::Welder;

    /// Triangles over a coarse grid of places: many equal corners, both zeros, some collapsed, some not finite.
    fn triangles(count: usize) -> Vec<[[f32; 3]; 3]> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize
        };
        let places = [-1.0_f32, -0.0, 0.0, 0.5, 3.0, 1e-30, -1e30, 7.25];
        let mut corner = || [0; 3].map(|_| if next() % 997 == 0 { f32::NAN } else { places[next() % places.len()] });
        (0..count).map(|_| [corner(), corner(), corner()]).collect()
    }

    /// Welded one corner after the other.
    fn one_by_one(triangles: &[[[f32; 3]; 3]]) -> Welded {
        let (mut welder, mut out) = (Welder::with_capacity(0), Welded::default());
        for triangle in triangles {
            let corners = triangle.map(|c| DVec3::from_array(c.map(f64::from)));
            if !corners.iter().all(|p| p.is_finite()) {
                out.not_finite += 1;
                continue;
            }
            let corners = corners.map(|p| welder.vertex(p).unwrap());
            if is_whole(&corners) { out.triangles.push(corners) } else { out.collapsed += 1 }
        }
        Welded { points: welder.into_points(), ..out }
    }

    #[test]
    fn all_at_once_is_the_same_as_one_by_one_for_any_parts_and_threads() {
        let all = triangles(3000);
        let expected = one_by_one(&all);
        assert!(expected.not_finite > 0 && expected.collapsed > 0 && expected.points.len() > 300);
        for (size, threads) in [(3000, 1), (1000, 2), (7, 3)] {
            let parts: Vec<Part> = all.chunks(size).map(|part| Part::new(part.iter().copied())).collect();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| weld(&parts)), expected, "parts of {size} on {threads} threads");
        }
    }

    #[test]
    fn triangles_without_a_common_corner_and_no_triangles_at_all_are_welded() {
        let apart: Vec<[[f32; 3]; 3]> =
            (0..5000).map(|k| [0.1, 0.2, 0.3].map(|h| [k as f32, h, k as f32 * h])).collect();
        let welded = weld(&[Part::new(apart.iter().copied())]);
        assert_eq!((welded.points.len(), welded.triangles.len()), (15_000, 5000));
        assert_eq!(weld(&[]), Welded::default());
        assert_eq!(weld(&[Part::new(std::iter::empty())]), Welded::default());
    }
}
