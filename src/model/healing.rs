//! Healing a document: a specification in, patches with their evidence out.

use std::sync::Arc;

use super::document::{Document, Patch};
use super::resolve::{ResolveError, resolve};
use super::spec::HealSpec;
use crate::kernel::heal::{HealError, Healed, heal};
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
}

/// What came of healing a document.
#[derive(Clone, Debug)]
pub struct Healing {
    /// The patches as the document keeps them, ready for `Command::AddPatches`.
    pub patches: Vec<(String, Patch)>,
    /// Samples, deviations, shared boundaries and corner gaps.
    pub healed: Healed,
}

/// Heals a document by a specification. The document itself is not changed.
pub fn run(document: &Document, spec: &HealSpec, job: &Job) -> Result<Healing, HealingError> {
    let input = resolve(spec, document, job)?;
    let healed = heal(&input.patches, &input.surfaces, &input.options, job)?;
    let patches = healed
        .patches
        .iter()
        .zip(&spec.patches)
        .map(|(patch, spec)| {
            let kept =
                Patch { surface: Arc::new(patch.surface.clone()), spec: spec.clone(), report: patch.report.clone() };
            (patch.name.clone(), kept)
        })
        .collect();
    Ok(Healing { patches, healed })
}
