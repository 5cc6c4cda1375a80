//! Healing: a C1 bicubic patch over a discontinuous part of a model, inside four boundary curves.
//!
//! Hamann, Jean and Razdan, *CAGD Techniques for Surface Grid Generation* (1999), section 3, one file a step:
//!
//! | step | file |
//! |---|---|
//! | pieces -> sides -> one closed loop | [`side`], [`boundary_loop`] |
//! | discrete Coons patch (4), normals (5), slab (6)(7) | [`coons`], [`normals`], [`slab`] |
//! | projection (8)-(10), artificial projections (11)-(13) | [`project`], [`hardy`] |
//! | C1 bicubic B-spline (14)-(16) | [`fit`] |
//! | error at e, f, g and Gauss points 3.6, refinement | [`deviation`], [`refine`] |
//! | shared boundaries and their rules 3.7 | [`connect`] |
//! | what the editor shows while sides are picked | [`preview`] |
//!
//! The entry points are [`heal`] (one patch or many), [`heal_onto`] (the same on a tessellation that is at hand)
//! and [`preview::preview`].

pub mod boundary_loop;
pub mod connect;
pub mod coons;
pub mod deviation;
pub mod fit;
pub mod grid;
pub mod hardy;
pub mod normals;
pub mod preview;
pub mod project;
pub mod refine;
pub mod report;
pub mod side;
pub mod slab;

use crate::kernel::geom::{Aabb, Curve, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::surface_set::SurfaceSet;

use boundary_loop::{BoundaryLoop, LoopChoice, LoopError};
use connect::ConnectError;
use deviation::Deviation;
use grid::Grid;
use hardy::HardyOptions;
use project::Sample;
use report::{BoundaryMode, PatchReport};
use side::SideError;

/// One patch to make.
#[derive(Clone, Debug)]
pub struct PatchInput {
    /// What it is called in messages.
    pub name: String,
    /// The pieces of the four sides, in any order and direction.
    pub sides: [Vec<Curve>; 4],
    /// What becomes of each side.
    pub modes: [BoundaryMode; 4],
    /// How the sides follow each other; searched when `None`.
    pub choice: Option<LoopChoice>,
    /// What two ends may be apart and still be joined in this patch; that of the options when `None`.
    pub joining_tol: Option<f64>,
    /// Ends moved before the sides are joined: the side, from 0, and where its nearest end goes.
    pub moves: Vec<(usize, glam::DVec3)>,
}

/// How to heal. Lengths in model units.
#[derive(Clone, Debug, PartialEq)]
pub struct HealOptions {
    /// What two curve ends may be apart and still be joined.
    pub joining_tol: f64,
    /// The largest error wanted.
    pub tol: f64,
    /// The number of spans along a side to start with. Default 8.
    pub min_resolution: usize,
    /// The largest number of spans along a side. Default 128.
    pub max_resolution: usize,
    /// d of HJR99 (7); from the corners of each patch when `None`.
    pub slab: Option<f64>,
    /// Gap filling.
    pub hardy: HardyOptions,
    /// Twists of the bicubic.
    pub twist: fit::Twist,
    /// The chord tolerance of the tessellation that finds candidates.
    pub chord_tol: f64,
}

impl HealOptions {
    /// The defaults for a model with this bounding box: joining 1e-3, error 1e-4, chords 5e-4 of the diagonal.
    pub fn of(bounds: &Aabb) -> Self {
        let diagonal = if bounds.diagonal() > 0.0 { bounds.diagonal() } else { 1.0 };
        Self {
            joining_tol: 1e-3 * diagonal,
            tol: 1e-4 * diagonal,
            min_resolution: 8,
            max_resolution: 128,
            slab: None,
            hardy: HardyOptions::default(),
            twist: fit::Twist::Scheme,
            chord_tol: 5e-4 * diagonal,
        }
    }
}

/// Why nothing could be healed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HealError {
    /// An option has no meaning.
    #[error("{name} is {got}, it must be {expected}")]
    Option {
        /// Which.
        name: &'static str,
        /// Its value.
        got: String,
        /// What it may be.
        expected: &'static str,
    },
    /// No patch was asked for.
    #[error("there is no patch to make")]
    NoPatch,
    /// The pieces of a side do not join.
    #[error("patch \"{patch}\", side {side}: {source}")]
    Side {
        /// Which patch.
        patch: String,
        /// Which side, from 1.
        side: usize,
        /// What is wrong.
        source: SideError,
    },
    /// Four sides are no loop.
    #[error("patch \"{patch}\": {source}")]
    Loop {
        /// Which patch.
        patch: String,
        /// What is wrong.
        source: LoopError,
    },
    /// The patches do not go together.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// No sample of a patch lies on any original.
    #[error(
        "patch \"{patch}\": none of its {samples} samples has a projection within {slab:.3e} of its Coons patch; \
         enlarge the slab, add surfaces to project on, or pick sides nearer to them"
    )]
    NoProjection {
        /// Which patch.
        patch: String,
        /// How many samples were tried.
        samples: usize,
        /// How far from the Coons patch originals were looked for.
        slab: f64,
    },
}

/// What came of a heal.
#[derive(Clone, Debug)]
pub struct Healed {
    /// The patches, in the order in which they were given; fewer when the job was cancelled before the first
    /// resolution was done.
    pub patches: Vec<HealedPatch>,
    /// The boundaries that two patches share.
    pub shared: Vec<SharedBoundary>,
    /// The chosen loop of every patch, with its corner gaps.
    pub loops: Vec<BoundaryLoop>,
    /// False when the job was cancelled: the patches are those of the last resolution that was finished.
    pub complete: bool,
}

/// One healed patch.
#[derive(Clone, Debug)]
pub struct HealedPatch {
    /// What it is called.
    pub name: String,
    /// Bicubic, C1, weights 1, double interior knots, uniform over [0, 1]^2.
    pub surface: Surface,
    /// The samples that it interpolates, at its knots.
    pub samples: Grid<Sample>,
    /// The Coons patch that was projected.
    pub coons: Grid<glam::DVec3>,
    /// d of HJR99 (7) that was used.
    pub slab: f64,
    /// What was measured where.
    pub deviation: Deviation,
    /// What was measured.
    pub report: PatchReport,
}

/// What two neighbouring patches have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedBoundary {
    /// The two patches.
    pub patches: [usize; 2],
    /// Their sides: 0 is v = 0, 1 is u = 1, 2 is v = 1, 3 is u = 0.
    pub slots: [usize; 2],
    /// The largest distance between them along the boundary.
    pub max_gap: f64,
    /// The largest angle between their normals along it, in degrees.
    pub max_normal_angle_deg: f64,
}

/// Heals patches on those of the bodies (with their numbers) that reach into their boxes of influence.
pub fn heal(
    patches: &[PatchInput],
    bodies: &[(usize, Body)],
    options: &HealOptions,
    job: &Job,
) -> Result<Healed, HealError> {
    let plan = refine::plan(patches, options)?;
    job.phase("Tessellating");
    let set = SurfaceSet::new(slab::clip(bodies, &plan.boxes(options)), options.chord_tol, job);
    refine::run(patches, &plan, &set, options, job)
}

/// The same on a tessellation that is at hand.
pub fn heal_onto(
    patches: &[PatchInput],
    set: &SurfaceSet,
    options: &HealOptions,
    job: &Job,
) -> Result<Healed, HealError> {
    refine::run(patches, &refine::plan(patches, options)?, set, options, job)
}

/// Whether two patches have a boundary curve in common, so that they must be healed together to agree along it. An error
/// where they break the rules of HJR99 3.7, or where one of them makes no loop.
pub fn share_boundary(a: &PatchInput, b: &PatchInput, options: &HealOptions) -> Result<bool, HealError> {
    Ok(refine::plan(&[a.clone(), b.clone()], options)?.shares_an_edge())
}

impl HealOptions {
    fn check(&self) -> Result<(), HealError> {
        let option =
            |name, got: &dyn ToString, expected| Err(HealError::Option { name, got: got.to_string(), expected });
        let positive = "a positive length";
        for (name, value) in [("tol", self.tol), ("joining_tol", self.joining_tol), ("chord_tol", self.chord_tol)] {
            if !(value > 0.0 && value.is_finite()) {
                return option(name, &value, positive);
            }
        }
        if let Some(d) = self.slab.filter(|d| !(*d > 0.0 && d.is_finite())) {
            return option("slab", &d, positive);
        }
        if !(1..=64).contains(&self.hardy.neighbours) {
            return option("neighbours", &self.hardy.neighbours, "1 to 64");
        }
        if !(self.hardy.gamma > 0.0 && self.hardy.gamma.is_finite()) {
            return option("gamma", &self.hardy.gamma, "a positive number");
        }
        if let Some(r) = self.hardy.r.filter(|r| !(*r > 0.0 && r.is_finite())) {
            return option("radius", &r, "a positive number");
        }
        if !(1..=4096).contains(&self.max_resolution) {
            return option("max_resolution", &self.max_resolution, "1 to 4096");
        }
        if self.min_resolution == 0 {
            return option("min_resolution", &self.min_resolution, "at least 1");
        }
        Ok(())
    }
}
