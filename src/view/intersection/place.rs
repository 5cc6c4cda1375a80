//! Places of points of contact: a point of three surfaces is a junction of each of its pairs, and one place.

use std::collections::HashMap;

use crate::kernel::ssi::result::{Junction, JunctionKind};

/// For each junction the first one at the same place.
pub fn firsts(junctions: &[Junction]) -> Vec<usize> {
    let mut seen: HashMap<[u64; 3], usize> = HashMap::new();
    let of = |(k, j): (usize, &Junction)| match j.kind {
        // The kernel gives all of them the same position.
        JunctionKind::ThreeSurfaces => *seen.entry(j.xyz.to_array().map(f64::to_bits)).or_insert(k),
        _ => k,
    };
    junctions.iter().enumerate().map(of).collect()
}

/// The junctions that are the first at their place.
pub fn distinct(junctions: &[Junction]) -> impl Iterator<Item = (usize, &Junction)> {
    let firsts = firsts(junctions);
    junctions.iter().enumerate().filter(move |(k, _)| firsts[*k] == *k)
}

/// For each junction that is the first at its place the numbers of all surfaces that meet there, in increasing order; none
/// for the others.
pub fn surfaces(junctions: &[Junction]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); junctions.len()];
    for (j, first) in junctions.iter().zip(firsts(junctions)) {
        all[first].extend([j.a, j.b]);
    }
    for here in &mut all {
        here.sort_unstable();
        here.dedup();
    }
    all
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;

    #[test]
    fn a_point_of_three_surfaces_is_one_place_and_contacts_of_pairs_are_their_own() {
        let at = |a, b, x, kind| Junction { xyz: DVec3::X * x, a, uv: DVec2::ZERO, b, st: DVec2::ZERO, gap: 0.0, kind };
        let three = JunctionKind::ThreeSurfaces;
        let all = [
            at(0, 1, 0.5, three),
            at(3, 4, 0.5, JunctionKind::X),
            at(1, 2, 0.5, three),
            at(0, 2, 0.7, three),
            at(0, 2, 0.5, three),
        ];
        assert_eq!(firsts(&all), [0, 1, 0, 3, 0]);
        assert_eq!(distinct(&all).map(|(k, _)| k).collect::<Vec<_>>(), [0, 1, 3]);
        assert_eq!(surfaces(&all)[firsts(&all)[4]], [0, 1, 2]);
        assert_eq!(surfaces(&all)[1], [3, 4]);
    }
}
