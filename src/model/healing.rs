//! Healing a document: a specification in, patches with their evidence out.
//!
//! Patches that share a boundary agree along it only when they are healed together (HJR99 3.7: one set of knots and control
//! points). So a new patch is healed with the patches of the document that it shares boundaries with, and with
//! theirs: [`with_neighbours`]. They come in the document's order, because means at common corners are taken in that
//! order: [`super::replay::spec_of`] then writes a specification that gives the same bits.

use std::sync::Arc;

use super::document::{Document, EntityId, Patch};
use super::resolve::{ResolveError, resolve, used};
use super::spec::{HealSpec, PatchSpec};
use crate::kernel::heal::{HealError, Healed, SharedBoundary, heal, share_boundary};
use crate::kernel::job::Job;

/// Why a document was not healed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HealingError {
    /// The specification does not fit the document.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// The kernel could not make the patches.
    #[error(transparent)]
    Heal(#[from] HealError),
    /// A patch of the document is in the way.
    #[error(
        "{source}; \"{neighbour}\" is a patch of the model: hide or delete it to heal \"{patch}\" without regard to it"
    )]
    Neighbour {
        /// The patch to be made.
        patch: String,
        /// The patch that is there.
        neighbour: String,
        /// Which rule the two break.
        source: Box<HealError>,
    },
}

/// What came of healing a document.
#[derive(Clone, Debug)]
pub struct Healing {
    /// The patches as the document keeps them, ready for `Command::Heal`.
    pub patches: Vec<(String, Patch)>,
    /// Samples, deviations, shared boundaries and corner gaps.
    pub healed: Healed,
}

impl Healing {
    /// Takes over the patches of another heal of the same document.
    fn extend(&mut self, other: Self) {
        let first = self.patches.len();
        self.patches.extend(other.patches);
        let mine = &mut self.healed;
        mine.patches.extend(other.healed.patches);
        let moved = |s: SharedBoundary| SharedBoundary { patches: s.patches.map(|p| p + first), ..s };
        mine.shared.extend(other.healed.shared.into_iter().map(moved));
        mine.loops.extend(other.healed.loops);
        mine.complete &= other.healed.complete;
    }
}

/// Heals a document by a specification, and by those that follow in it. The document itself is not changed.
pub fn run(document: &Document, spec: &HealSpec, job: &Job) -> Result<Healing, HealingError> {
    let heals = spec.heals();
    let mut all: Option<Healing> = None;
    for (k, spec) in heals.iter().enumerate() {
        let at = |k: usize| k as f64 / heals.len() as f64;
        let one = one(document, spec, &job.part(at(k), at(k + 1)))?;
        match &mut all {
            Some(all) => all.extend(one),
            None => all = Some(one),
        }
        if job.is_cancelled() {
            break;
        }
    }
    match all {
        Some(all) => Ok(all),
        None => Err(HealError::NoPatch.into()),
    }
}

fn one(document: &Document, spec: &HealSpec, job: &Job) -> Result<Healing, HealingError> {
    let input = resolve(spec, document, job)?;
    let healed = heal(&input.patches, &input.surfaces, &input.options, job)?;
    let settings = used(spec, document);
    let keep = |(patch, spec): (&crate::kernel::heal::HealedPatch, &PatchSpec)| {
        let surface = Arc::new(patch.surface.clone());
        let (settings, report) = (settings.clone(), patch.report.clone());
        (patch.name.clone(), Patch { surface, spec: spec.clone(), settings, report })
    };
    let patches = healed.patches.iter().zip(&spec.patches).map(keep).collect();
    Ok(Healing { patches, healed })
}

/// A patch healed together with its neighbours.
#[derive(Clone, Debug)]
pub struct Joined {
    /// All of them.
    pub healing: Healing,
    /// Which of them is the one that was asked for.
    pub new: usize,
    /// The entities whose places the others take, in the order of `healing.patches` without the new one.
    pub neighbours: Vec<EntityId>,
}

/// Heals the first patch of a specification together with those visible patches of the document that it shares
/// boundaries with, directly or through others; all get its settings. `replacing` is the entity whose place it will
/// take. Patches whose sides are gone from the model cannot be healed again and are named in a warning.
pub fn with_neighbours(
    document: &Document,
    spec: &HealSpec,
    replacing: Option<EntityId>,
    job: &Job,
) -> Result<Joined, HealingError> {
    let Some(wanted) = spec.patches.first() else { return Err(HealError::NoPatch.into()) };
    if document.patches().all(|(id, _)| Some(id) == replacing) {
        let alone = spec.with_patches(vec![wanted.clone()]);
        return Ok(Joined { healing: run(document, &alone, job)?, new: 0, neighbours: Vec::new() });
    }
    let input_of = |patch: &PatchSpec| {
        let resolved = resolve(&spec.with_patches(vec![patch.clone()]), document, job)?;
        resolved.patches.into_iter().next().ok_or(HealingError::Heal(HealError::NoPatch))
    };
    let options = super::resolve::options(spec, document);
    let new = input_of(wanted)?;
    let mut others = Vec::new();
    for (id, patch) in document.patches().filter(|(id, _)| Some(*id) != replacing) {
        let Some(entity) = document.get(id).filter(|e| e.visible) else { continue };
        let kept = as_it_was(patch, options.joining_tol);
        match input_of(&kept) {
            Ok(input) => others.push((id, kept, input)),
            Err(why) => job.warn(format!("\"{}\" cannot be healed again together with this patch: {why}", entity.name)),
        }
    }
    let mut together = vec![false; others.len()];
    for (k, (_, kept, input)) in others.iter().enumerate() {
        together[k] = match share_boundary(&new, input, &options) {
            Ok(shares) => shares,
            Err(source @ HealError::Connect(_)) => {
                let (patch, neighbour, source) = (wanted.name.clone(), kept.name.clone(), Box::new(source));
                return Err(HealingError::Neighbour { patch, neighbour, source });
            }
            // What is wrong with one of the two alone is found below, or is of no account.
            Err(_) => false,
        };
    }
    let mut queue: Vec<usize> = (0..others.len()).filter(|&k| together[k]).collect();
    while let Some(k) = queue.pop() {
        for next in 0..others.len() {
            if !together[next] && share_boundary(&others[k].2, &others[next].2, &options).unwrap_or(false) {
                together[next] = true;
                queue.push(next);
            }
        }
    }
    let place = |id: EntityId| document.entities().iter().position(|e| e.id == id).unwrap_or(usize::MAX);
    let mut patches: Vec<(usize, Option<EntityId>, PatchSpec)> = others
        .into_iter()
        .zip(together)
        .filter(|(_, together)| *together)
        .map(|((id, kept, _), _)| (place(id), Some(id), kept))
        .collect();
    patches.push((replacing.map_or(usize::MAX, place), None, wanted.clone()));
    patches.sort_by_key(|p| p.0);
    let new = patches.iter().position(|p| p.1.is_none()).unwrap_or(0);
    let neighbours = patches.iter().filter_map(|p| p.1).collect();
    let all = spec.with_patches(patches.into_iter().map(|p| p.2).collect());
    Ok(Joined { healing: run(document, &all, job)?, new, neighbours })
}

/// The specification of a patch under other settings: its ends are joined by the tolerance that they were joined by.
fn as_it_was(patch: &Patch, joining_tol: f64) -> PatchSpec {
    let mut spec = patch.spec.clone();
    spec.joining.tol = spec.joining.tol.or(patch.settings.joining_tol.filter(|tol| *tol != joining_tol));
    spec
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DVec3;

    use super::*;
    use crate::kernel::geom::ring::{EdgeInput, RingOptions, face};
    use crate::kernel::geom::trim::SurfaceKind;
    use crate::kernel::geom::{Curve, Knots, Surface, sweep};
    use crate::kernel::heal::deviation::count;
    use crate::model::document::{Shape, Unit};
    use crate::model::spec::Piece;

    /// Half the side of the patch.
    const HALF: f64 = 1.0;
    const HOLE: f64 = 0.6;

    /// A plane with a bump in its middle, which is all inside the hole of the face on it.
    fn bumpy() -> Surface {
        let n = 24;
        let knots =
            Knots::clamped(3, &(0..=n).map(|k| -1.5 + 3.0 * f64::from(k) / f64::from(n)).collect::<Vec<_>>(), 1)
                .unwrap();
        let at = knots.greville();
        let points = at
            .iter()
            .flat_map(|&y| at.iter().map(move |&x| DVec3::new(x, y, if x.hypot(y) < 0.25 { 0.2 } else { 0.0 })))
            .collect();
        Surface::new(knots.clone(), knots, points, None).unwrap()
    }

    fn document(holed: bool) -> Document {
        let surface = Arc::new(bumpy());
        let mut document = Document::new(Unit::Metre);
        if !holed {
            document.add("whole", Shape::Surface(surface), None);
            return document;
        }
        let c = [[-1.5, -1.5], [1.5, -1.5], [1.5, 1.5], [-1.5, 1.5]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let edge = |id, curve| EdgeInput { id, curve: Some(Arc::new(curve)), guide: None, reversed: false };
        let outer = (0..4).map(|k| edge(k as u64, Curve::segment(c[k], c[(k + 1) % 4]).unwrap())).collect();
        let hole = vec![edge(9, sweep::arc(DVec3::ZERO, DVec3::X * HOLE, DVec3::Y * HOLE, 0.0, TAU).unwrap())];
        let made = face(&surface, SurfaceKind::Spline, &[outer, hole], &RingOptions::default()).unwrap();
        document.add("holed", Shape::Face(Arc::new(made.face)), None);
        document
    }

    fn healed(holed: bool) -> Healing {
        let corners = [(-HALF, -HALF, 0.0), (HALF, -HALF, 0.0), (HALF, HALF, 0.0), (-HALF, HALF, 0.0)];
        let sides = std::array::from_fn(|k| vec![Piece::Line(corners[k], corners[(k + 1) % 4])]);
        let patch = PatchSpec { name: "over the hole".into(), sides, ..PatchSpec::default() };
        let spec = HealSpec {
            min_resolution: 32,
            max_resolution: 32,
            slab: Some(0.5),
            patches: vec![patch],
            ..HealSpec::default()
        };
        run(&document(holed), &spec, &Job::new()).unwrap()
    }

    fn highest(healing: &Healing) -> f64 {
        let surface = &healing.healed.patches[0].surface;
        let at = |k: usize| glam::DVec2::new((k % 41) as f64 / 40.0, (k / 41) as f64 / 40.0);
        (0..41 * 41).map(|k| surface.eval(at(k)).z.abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_hole_of_a_face_is_no_ground_to_project_on() {
        // On the whole surface the patch follows the bump; over the hole it is filled from what is around.
        let whole = healed(false);
        assert!(highest(&whole) > 0.1, "{}", highest(&whole));
        let holed = healed(true);
        assert!(highest(&holed) < 1e-6, "{}", highest(&holed));
        let samples = &holed.healed.patches[0].samples;
        for sample in samples.values().iter().filter(|s| s.status.is_projected()) {
            assert!(sample.point.truncate().length() > HOLE - 2e-3, "{}", sample.point);
        }
        // The samples over the hole are artificial: its area is that share of the patch.
        let share = count(samples)[2] as f64 / samples.values().len() as f64;
        let exact = 0.5 * TAU * HOLE * HOLE / (4.0 * HALF * HALF);
        assert!((share / exact - 1.0).abs() < 0.15, "{share} {exact}");
        assert_eq!(count(&whole.healed.patches[0].samples)[2], 0);
    }
}
