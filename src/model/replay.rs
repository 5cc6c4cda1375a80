//! The specification of all patches of a document, so that a session can be replayed from the command line.
//!
//! Patches that were healed together have the same settings and agree along a common border bit for bit; they go into one
//! heal, in the order of the document. Everything else is a heal of its own. Numbers of surfaces and curves are
//! those of the model when the patch was healed. A patch whose neighbour was deleted after both were healed together is
//! replayed without it, and may then be refined less.

use std::sync::Arc;

use glam::DVec3;

use super::document::{Document, Patch};
use super::spec::HealSpec;
use crate::kernel::geom::{Side, Surface};

/// The specification that heals every patch of the document again; `None` without patches.
pub fn spec_of(document: &Document) -> Option<HealSpec> {
    let patches: Vec<&Arc<Patch>> = document.patches().map(|(_, patch)| patch).collect();
    let mut group: Vec<usize> = (0..patches.len()).collect();
    for b in 0..patches.len() {
        for a in 0..b {
            let joined =
                patches[a].settings == patches[b].settings && share_border(&patches[a].surface, &patches[b].surface);
            if joined && group[a] != group[b] {
                let (keep, drop) = (group[a].min(group[b]), group[a].max(group[b]));
                group.iter_mut().filter(|g| **g == drop).for_each(|g| *g = keep);
            }
        }
    }
    let mut heals = (0..patches.len()).filter(|&k| group[k] == k).map(|first| {
        let members = (first..patches.len()).filter(|&k| group[k] == first);
        patches[first].settings.with_patches(members.map(|k| patches[k].spec.clone()).collect())
    });
    let mut spec = heals.next()?;
    spec.then = heals.collect();
    Some(spec)
}

/// Whether two surfaces have a row of border control points in common to the bit, in either direction.
fn share_border(a: &Surface, b: &Surface) -> bool {
    let border = |s: &Surface, side: Side| -> Vec<[u64; 3]> {
        let points = s.border(side).map(|c| c.points().to_vec()).unwrap_or_default();
        points.iter().map(|p: &DVec3| p.to_array().map(f64::to_bits)).collect()
    };
    Side::ALL.iter().any(|&x| {
        let mut row = border(a, x);
        let meets = |row: &[[u64; 3]]| Side::ALL.iter().any(|&y| border(b, y) == row);
        meets(&row) || {
            row.reverse();
            meets(&row)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::job::Job;
    use crate::model::command::Command;
    use crate::model::document::{Shape, Unit};
    use crate::model::healing::{run, with_neighbours};
    use crate::model::spec::{IsoAt, PatchSpec, Piece};

    /// A bumpy sheet over 0..3 x 0..1.
    fn sheet() -> Document {
        use crate::kernel::geom::Knots;
        let (ku, kv) = (Knots::bezier(3, 0.0, 3.0), Knots::bezier(3, 0.0, 1.0));
        let points = (0..16).map(|k| {
            let (i, j) = (k % 4, k / 4);
            DVec3::new(i as f64, j as f64 / 3.0, [0.0, 0.4, -0.3, 0.1][(i + 2 * j) % 4])
        });
        let surface = Surface::new(ku.unwrap(), kv.unwrap(), points.collect(), None).unwrap();
        let mut document = Document::new(Unit::Millimetre);
        document.add("sheet", Shape::Surface(Arc::new(surface)), None);
        document
    }

    fn patch(name: &str, u: [f64; 2]) -> PatchSpec {
        let iso = |at, from, to| vec![Piece::Iso { surface: 0, at, from, to }];
        let sides = [
            iso(IsoAt::V(0.1), u[0], u[1]),
            iso(IsoAt::U(u[1]), 0.1, 0.9),
            iso(IsoAt::V(0.9), u[0], u[1]),
            iso(IsoAt::U(u[0]), 0.1, 0.9),
        ];
        PatchSpec { name: name.to_owned(), sides, ..PatchSpec::default() }
    }

    fn accept(document: &Document, spec: &HealSpec) -> Document {
        let joined = with_neighbours(document, spec, None, &Job::new()).unwrap();
        let mut all: Vec<_> = joined.healing.patches;
        let new = all.remove(joined.new);
        let replaced = joined.neighbours.into_iter().zip(all.into_iter().map(|p| Arc::new(p.1))).collect();
        Command::Heal { added: vec![new], replaced }.apply(document).unwrap()
    }

    fn bits(surface: &Surface) -> Vec<u64> {
        surface.points().iter().flat_map(|p| p.to_array().map(f64::to_bits)).collect()
    }

    #[test]
    fn what_was_healed_one_after_the_other_replays_bit_for_bit() {
        let original = sheet();
        let first = HealSpec { tol: Some(1e-3), patches: vec![patch("a", [0.1, 1.0])], ..HealSpec::default() };
        // Shares u = 1 with the first and wants more: both are refined.
        let finer = HealSpec { tol: Some(2e-6), neighbours: 5, ..first.with_patches(vec![patch("b", [1.0, 1.7])]) };
        let apart = HealSpec { min_resolution: 6, gamma: 0.01, ..first.with_patches(vec![patch("c", [2.0, 2.9])]) };
        let mut document = accept(&original, &first);
        let coarse = document.patches().next().unwrap().1.report.resolution;
        document = accept(&accept(&document, &finer), &apart);
        let fine = document.patches().next().unwrap().1.report.resolution;
        assert!(fine[1] > coarse[1], "the neighbour follows: {coarse:?} {fine:?}");
        let kept: Vec<_> = document.patches().map(|(_, p)| Arc::clone(p)).collect();
        assert!(share_border(&kept[0].surface, &kept[1].surface) && !share_border(&kept[1].surface, &kept[2].surface));

        let text = spec_of(&document).unwrap().to_ron().unwrap();
        let spec = HealSpec::from_ron(&text).unwrap();
        assert_eq!((spec.patches.len(), spec.then.len()), (2, 1), "{text}");
        let again = run(&original, &spec, &Job::new()).unwrap();
        assert_eq!(again.healed.shared.len(), 1);
        for (kept, (name, made)) in kept.iter().zip(&again.patches) {
            assert_eq!((bits(&kept.surface), &kept.report), (bits(&made.surface), &made.report), "{name}");
        }
        // The patches in the file do not matter.
        let again = run(&document, &spec, &Job::new()).unwrap();
        assert!(kept.iter().zip(&again.patches).all(|(k, (_, m))| bits(&k.surface) == bits(&m.surface)));
    }

    #[test]
    fn a_patch_that_breaks_the_full_face_rule_names_the_neighbour_and_hiding_it_helps() {
        let spec = HealSpec { tol: Some(1e-3), patches: vec![patch("a", [0.1, 1.0])], ..HealSpec::default() };
        let mut document = accept(&sheet(), &spec);
        let mut half = patch("half", [1.0, 2.0]);
        for side in &mut half.sides {
            for piece in side {
                match piece {
                    Piece::Iso { at: IsoAt::V(v), .. } if *v == 0.9 => *v = 0.5,
                    Piece::Iso { to, .. } if *to == 0.9 => *to = 0.5,
                    _ => {}
                }
            }
        }
        let half = spec.with_patches(vec![half]);
        let error = with_neighbours(&document, &half, None, &Job::new()).unwrap_err().to_string();
        assert!(error.contains("full-face") && error.contains("hide or delete"), "{error}");
        let ids = document.patches().map(|(id, _)| id).collect();
        document = Command::SetVisible { ids, visible: false }.apply(&document).unwrap();
        assert!(with_neighbours(&document, &half, None, &Job::new()).is_ok());
    }
}
