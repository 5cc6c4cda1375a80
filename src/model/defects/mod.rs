//! Where a model is broken: what a mesher would stumble over, as a list that one can walk along.
//!
//! - Edges ([`edges`]): free ones, gaps between neighbours, more than two faces at one edge, loops that are open or
//!   cross themselves.
//! - Pairs of faces ([`crossings`]): faces that cross each other, and faces that lie on one another over an area. A
//!   crossing that is no deeper than the gap between edges of the same two faces is that gap and not listed again.
//! - Single faces ([`quality`]): slivers, parametrizations whose lines nearly coincide or bunch up; on request
//!   faces that run through themselves ([`crate::kernel::self_ssi`]).
//!
//! Pairs are found on triangles, near edges on strips along them ([`strips`]), and confirmed on the surfaces, so what is
//! listed is there. What the triangles miss is not listed: a crossing far from edges whose faces part by less than
//! the chord tolerance. The intersection tool decides such pairs for
//! certain. Results do not depend on the number of threads. Cost: some milliseconds a face; self-intersections more.

use std::collections::HashMap;

use glam::DVec3;
use serde::Serialize;

use super::document::{Document, EntityId};
use super::topology::EdgeAt;
use crate::kernel::geom::trim::Sheet;
use crate::kernel::job::Job;

mod crossings;
mod edges;
pub mod fix;
mod quality;
mod strips;

/// What is wrong. The order is that of the list: what meshers mind most comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DefectKind {
    /// A face runs through itself.
    SelfIntersection,
    /// Two faces cross each other.
    Crossing,
    /// Two faces lie on one another over an area.
    Overlap,
    /// A loop crosses itself or another.
    CrossingLoop,
    /// A loop does not close.
    OpenLoop,
    /// More than two faces meet at an edge.
    NonManifold,
    /// Two edges that should be one are apart.
    Gap,
    /// An edge without a neighbour, or with one along a part only.
    FreeEdge,
    /// A face much thinner than it is long.
    Sliver,
    /// Parameter lines that nearly coincide, or a surface that is a point or a curve inside.
    Parametrization,
}

impl DefectKind {
    /// All kinds, in the order of the list.
    pub const ALL: [Self; 10] = [
        Self::SelfIntersection,
        Self::Crossing,
        Self::Overlap,
        Self::CrossingLoop,
        Self::OpenLoop,
        Self::NonManifold,
        Self::Gap,
        Self::FreeEdge,
        Self::Sliver,
        Self::Parametrization,
    ];

    /// The heading for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::SelfIntersection => "Self-intersections",
            Self::Crossing => "Crossing faces",
            Self::Overlap => "Overlaps",
            Self::CrossingLoop => "Crossing loops",
            Self::OpenLoop => "Open loops",
            Self::NonManifold => "Non-manifold edges",
            Self::Gap => "Gaps",
            Self::FreeEdge => "Free edges",
            Self::Sliver => "Slivers",
            Self::Parametrization => "Bad parametrizations",
        }
    }

    /// What the size of a defect of this kind is, and whether it is a length.
    pub fn measure(self) -> (&'static str, bool) {
        match self {
            Self::SelfIntersection | Self::Crossing => ("length of the crossing", true),
            Self::Overlap => ("area that is covered twice", false),
            Self::CrossingLoop => ("places", false),
            Self::OpenLoop | Self::Gap => ("widest gap", true),
            Self::NonManifold => ("faces at the edge", false),
            Self::FreeEdge => ("length of the edge", true),
            Self::Sliver => ("width", true),
            Self::Parametrization => ("smallest angle between the parameter lines in degrees", false),
        }
    }
}

/// One defect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Defect {
    /// What is wrong.
    pub kind: DefectKind,
    /// The faces and surfaces that it concerns, by their numbers in the file.
    pub faces: Vec<usize>,
    /// The same by their ids in the document.
    #[serde(skip)]
    pub entities: Vec<EntityId>,
    /// The edges that it concerns.
    pub edges: Vec<EdgeAt>,
    /// Where to look.
    pub at: DVec3,
    /// How large the place is, for zooming: half the side of a cube around it.
    pub reach: f64,
    /// How bad it is; see [`DefectKind::measure`].
    pub size: f64,
    /// Of crossings, how far they go: the largest distance from the edges of both faces that was met.
    pub depth: Option<f64>,
}

/// What counts as a defect. Lengths in model units.
#[derive(Clone, Debug, PartialEq)]
pub struct DefectOptions {
    /// Edges further apart than this are a gap. Default 1e-6 of the diagonal.
    pub tolerance: f64,
    /// What two edges may be apart and still be meant to be one. Default 1e-3 of the diagonal.
    pub joining: f64,
    /// Faces that are nearer than this over an area overlap. Default 1e-4 of the diagonal.
    pub overlap: f64,
    /// Parameter lines at a smaller angle than this, in degrees, are bad. Default 3.
    pub angle_deg: f64,
    /// Whether faces are intersected with themselves, which takes longest. Default no.
    pub self_intersections: bool,
}

impl DefectOptions {
    /// The defaults for a document.
    pub fn of(document: &Document) -> Self {
        let tolerances = document.tolerances();
        Self {
            tolerance: tolerances.follow,
            joining: tolerances.joining,
            overlap: 0.1 * tolerances.joining,
            angle_deg: 3.0,
            self_intersections: false,
        }
    }
}

/// All that was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Defects {
    /// The defects, sorted by kind, the worst of each kind first.
    pub list: Vec<Defect>,
    /// How many faces and surfaces were looked at.
    pub faces: usize,
    /// Whether everything was looked at; not when the job was cancelled or something was left undecided.
    pub complete: bool,
    /// What was left undecided, one line each.
    pub notes: Vec<String>,
}

impl Defects {
    /// The defects of one kind.
    pub fn of(&self, kind: DefectKind) -> impl Iterator<Item = &Defect> {
        self.list.iter().filter(move |d| d.kind == kind)
    }
}

/// Looks for defects of a document's faces and surfaces. Patches are not looked at: they have their own reports.
pub fn find(document: &Document, options: &DefectOptions, job: &Job) -> Defects {
    let (ids, sheets): (Vec<EntityId>, Vec<Sheet>) = document.sheets().unzip();
    let mut out = Defects { faces: sheets.len(), complete: true, ..Defects::default() };
    out.list.extend(edges::find(document, &sheets, options, &job.part(0.0, 0.2)));
    out.list.extend(quality::find(&sheets, options, &job.part(0.2, 0.4)));
    out.list.extend(crossings::find(&sheets, options, &job.part(0.4, 0.7)));
    if options.self_intersections {
        let (found, notes) = quality::self_intersections(&sheets, &job.part(0.7, 1.0));
        out.complete &= notes.is_empty();
        out.list.extend(found);
        out.notes = notes;
    }
    out.complete &= !job.is_cancelled();
    job.progress(1.0);
    // The two sides of a strip are near each other and were never meant to be one edge.
    let strips: Vec<usize> = out.of(DefectKind::Sliver).flat_map(|d| d.faces.iter().copied()).collect();
    let side = |d: &Defect| d.kind == DefectKind::Gap && matches!(d.faces.as_slice(), [f] if strips.contains(f));
    out.list.retain(|d| !side(d));
    // Edges that weave around each other by their gap make faces cross no deeper than that: one defect, not two.
    let mut gaps: HashMap<[usize; 2], f64> = HashMap::new();
    for gap in out.of(DefectKind::Gap) {
        for (k, &a) in gap.faces.iter().enumerate() {
            for &b in &gap.faces[k + 1..] {
                let widest = gaps.entry([a.min(b), a.max(b)]).or_default();
                *widest = widest.max(gap.size);
            }
        }
    }
    let woven = |d: &Defect| match (d.depth, d.faces.as_slice()) {
        (Some(depth), &[a, b]) => gaps.get(&[a.min(b), a.max(b)]).is_some_and(|&gap| depth <= gap),
        _ => false,
    };
    out.list.retain(|d| !woven(d));
    for defect in &mut out.list {
        defect.entities = defect.faces.iter().filter_map(|&f| ids.get(f).copied()).collect();
    }
    let worse =
        |d: &Defect| if matches!(d.kind, DefectKind::Sliver | DefectKind::Parametrization) { -d.size } else { d.size };
    out.list.sort_by(|a, b| {
        (a.kind.cmp(&b.kind))
            .then(worse(b).total_cmp(&worse(a)))
            .then(a.faces.cmp(&b.faces))
            .then(a.edges.cmp(&b.edges))
    });
    out
}

#[cfg(test)]
mod tests;
