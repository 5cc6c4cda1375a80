//! The worst points of patches, for the list that zooms to them and the marks in the view.

use glam::{DVec2, DVec3};

use crate::kernel::heal::deviation::Deviation;
use crate::model::document::EntityId;

/// A point where a patch is far from the originals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// Which patch.
    pub patch: EntityId,
    /// Its parameters there.
    pub uv: DVec2,
    /// The point.
    pub point: DVec3,
    /// How far it is from the originals.
    pub distance: f64,
}

/// The `count` worst points of all patches, worst first, no two within `apart` of each other: a peak is listed once, not
/// with all its neighbours.
pub fn worst<'a>(patches: impl IntoIterator<Item = (EntityId, &'a Deviation)>, count: usize, apart: f64) -> Vec<Worst> {
    let mut all: Vec<Worst> = patches
        .into_iter()
        .flat_map(|(patch, deviation)| {
            deviation.checks.iter().filter_map(move |check| {
                let distance = check.distance.filter(|d| d.is_finite())?;
                Some(Worst { patch, uv: check.uv, point: check.point, distance })
            })
        })
        .collect();
    // Stable: equal errors keep the order of the patches and their parameters.
    all.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    let mut out: Vec<Worst> = Vec::new();
    for candidate in all {
        if out.len() >= count {
            break;
        }
        if out.iter().all(|w| w.point.distance(candidate.point) >= apart) {
            out.push(candidate);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::heal::deviation::{Check, Kind};

    fn check(x: f64, distance: Option<f64>) -> Check {
        Check { kind: Kind::G, uv: DVec2::new(x, 0.5), point: DVec3::X * x, distance }
    }

    #[test]
    fn each_peak_is_listed_once_and_gaps_never() {
        let first = Deviation {
            checks: vec![check(0.0, Some(3.0)), check(0.1, Some(2.9)), check(5.0, Some(1.0)), check(9.0, None)],
            ..Deviation::default()
        };
        let second =
            Deviation { checks: vec![check(7.0, Some(2.0)), check(7.05, Some(f64::NAN))], ..Deviation::default() };
        let found = worst([(EntityId(1), &first), (EntityId(2), &second)], 3, 0.5);
        let listed: Vec<(u64, f64)> = found.iter().map(|w| (w.patch.0, w.distance)).collect();
        assert_eq!(listed, [(1, 3.0), (2, 2.0), (1, 1.0)]);
        assert_eq!(worst([(EntityId(1), &first)], 1, 0.5).len(), 1);
        assert!(worst([], 3, 1.0).is_empty());
    }
}
