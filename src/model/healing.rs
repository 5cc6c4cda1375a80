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
