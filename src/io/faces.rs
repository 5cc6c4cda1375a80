//! Trimmed faces while a file is read: what the readers of IGES and STEP have in common.
//!
//! A reader opens every face as its whole surface first and notes the loops that trim it; [`make`] trims them all at the end,
//! on all threads, in file order. A face whose loops cannot be followed stays whole, and its reader is told why.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::report::{ImportReport, Severity};
use crate::kernel::geom::Surface;
use crate::kernel::geom::ring::{self, EdgeInput, RingOptions};
use crate::kernel::geom::trim::SurfaceKind;
use crate::model::document::{Entity, Shape};

/// Loops further open than this part of the surface's size are said to have been closed.
const OPEN: f64 = 1e-3;
/// Edges further off their surface than this part of its size are said to be.
const OFF: f64 = 1e-4;

/// A face that was read and is still to be trimmed.
#[derive(Debug)]
pub struct FaceJob<K> {
    /// What names it in the reader's report.
    pub name: K,
    /// The place of its entity in the document.
    pub at: usize,
    /// Its surface.
    pub surface: Arc<Surface>,
    /// What that was.
    pub kind: SurfaceKind,
    /// Its loops, counter-clockwise on the surface where the file can be trusted.
    pub rings: Vec<Vec<EdgeInput>>,
    /// Whether the file says how loops run.
    pub oriented: bool,
}

/// Trims the faces, and says what is to be reported as a warning of which.
pub fn make<K: Copy + Sync>(jobs: &[FaceJob<K>], entities: &mut [Entity]) -> Vec<(K, String)> {
    let run = |job: &FaceJob<K>| {
        let options = RingOptions { oriented: job.oriented, ..RingOptions::default() };
        ring::face(&job.surface, job.kind, &job.rings, &options)
    };
    let made: Vec<_> = jobs.par_iter().map(run).collect();
    let mut warnings = Vec::new();
    for (job, made) in jobs.iter().zip(made) {
        let made = match made {
            Ok(made) => made,
            Err(reason) => {
                warnings.push((job.name, format!("opened as its whole surface: {reason}")));
                continue;
            }
        };
        let size = job.surface.bounds().diagonal();
        if made.gap > OPEN * size {
            let reason = format!("its loops are open by up to {:.3e}; they were closed straight", made.gap);
            warnings.push((job.name, reason));
        }
        if made.off > OFF * size {
            warnings.push((job.name, format!("its edges lie up to {:.3e} off its surface", made.off)));
        }
        if let Some(entity) = entities.get_mut(job.at) {
            entity.shape = Shape::Face(Arc::new(made.face));
        }
    }
    warnings
}

/// Points on the loops: what an unbounded surface must reach.
pub fn reach(rings: &[Vec<EdgeInput>]) -> impl Iterator<Item = DVec3> + '_ {
    rings.iter().flatten().filter_map(|e| e.curve.as_ref()).flat_map(|c| c.sampled(4)).map(|(_, p)| p)
}

/// A file in which everything is marked hidden would open as nothing.
pub fn show_all_if_all_are_hidden(entities: &mut [Entity], report: &mut ImportReport) {
    let all = entities.len();
    if all == 0 || entities.iter().any(|e| e.visible) {
        return;
    }
    entities.iter_mut().for_each(|e| e.visible = true);
    report.add(Severity::Warning, "file", None, None, format!("all {all} entities are hidden; all are shown"));
}
