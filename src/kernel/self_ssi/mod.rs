//! Self-intersection of one surface: S(p) = S(q) with p different from q, traced straight through its miter points.
//!
//! After the thesis, chapters 4.2 and 6: a ternary tree over a grid of cells, windows proved free of self-intersection
//! ahead of their subtrees, miter points represented by quadrangles, local branches from miter points and global ones
//! from pairs of cells. What differs: miter points come from the net of Su x Sv with proof instead of a failed torus
//! fit; local branches come from the divided difference F(m, phi, r) = 0, which is regular at the miter point, instead
//! of a march that creeps up to it; windows are proved injective instead of having their Gauss map in a hemisphere,
//! which proves local injectivity only; and the search certifies that no branch was missed ([`Evidence`], and
//! `unresolved` in the result). Closed directions wrap: a seam is no self-intersection, a curve through it is one curve.
//!
//! Files: `sheet` (the surface prepared), `net`, `hull`, `jets` and `rational` (bounds of derivatives), `window` and
//! `windows` (the window proofs), `miter`, `chart` and `march` (the equation and its tracing), `register` (the branches
//! found), `ternary`, `pair_test` and `cover` (the search), `coincidence`, `quad` and `leaf` (miter quadrangles), `record` (the search as data), `triple` (triple points), `cusp` (cusp edges), `touch` (sheets that touch), `degenerate` (isolated and double miter points), `region` and `outline` (coincident areas),
//! `assemble` (the result), `contour` and `section` (a miter neighbourhood cut by a plane), `model` (all surfaces).
//!
//! Cost: well under a millisecond for a cross-cap patch, then proportional to the length of the curves over the square
//! root of the tolerance. How it fails: pairs of cells in which sheets are tangent and cross as well are listed
//! as unresolved, as are those left when a cap is hit; the result then is not `complete`.

mod assemble;
mod chart;
mod coincidence;
mod contour;
mod cover;
mod cusp;
mod degenerate;
mod hull;
mod jets;
pub mod leaf;
mod march;
mod miter;
pub mod model;
mod net;
mod outline;
mod pair_test;
mod quad;
mod rational;
pub mod record;
mod region;
mod register;
pub mod section;
mod sheet;
mod ternary;
mod touch;
mod triple;
mod window;
mod windows;

use std::time::Instant;

use glam::DVec2;

use self::assemble::Assembler;
use self::cover::Search;
use self::hull::Rect;
use self::march::{End, Pace, Trace};
use self::miter::MiterKind;
use self::record::Record;
use self::sheet::Sheet;
use self::touch::Touches;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::ssi::result::{
    Counts, CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind, Miter, Region,
    Times, Unresolved,
};
use crate::kernel::tol::Tolerances;

/// What to compute, and how closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfIntersectOptions {
    /// How closely curves follow, in model units; `None`: 1e-6 of the bounding-box diagonal.
    pub tol: Option<f64>,
    /// The radius of the ball that a miter quadrangle fits into, in model units; `None`: 1e-6 of the diagonal. Where
    /// rounding forbids the radius the quadrangle shrinks to the miter point.
    pub miter_radius: Option<f64>,
    /// The least number of cells of the ternary tree in each direction; rounded up to a multiple of 8 a Bezier piece.
    pub grid: u32,
    /// The most windows and pairs that are looked at before the rest is listed as unresolved.
    pub pair_cap: usize,
    /// The most points of one curve.
    pub point_cap: usize,
    /// Whether to keep a [`Record`] of what the search did, for display.
    pub record: bool,
}

impl Default for SelfIntersectOptions {
    fn default() -> Self {
        Self { tol: None, miter_radius: None, grid: 128, pair_cap: 250_000, point_cap: 200_000, record: false }
    }
}

/// Why there is no answer at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SelfIntersectError {
    /// A tolerance is zero, negative or not finite.
    #[error("{name} is {value}, it must be positive and finite")]
    Tolerance {
        /// Which one.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// There is no miter point where one was said to be.
    #[error("there is no miter point at the parameters ({}, {}); take one from the list of miter points", at.x, at.y)]
    NoMiterPoint {
        /// The parameters that were given.
        at: DVec2,
    },
}

/// What the search did, for the Inspect panel and tests.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Windows tested for injectivity.
    pub windows: usize,
    /// Windows that were not proved injective when first tested.
    pub failed_windows: usize,
    /// Pairs of cells looked at.
    pub pairs: usize,
    /// Cells looked at while finding miter points.
    pub miter_cells: usize,
}

/// The answer with its evidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SelfIntersection {
    /// Curves, miter points, regions, and what could not be resolved.
    pub result: Intersection,
    /// Triple points, in the order of the junctions: the three parameter points in which three sheets meet.
    pub triple_points: Vec<[DVec2; 3]>,
    /// What the search did.
    pub evidence: Evidence,
    /// The same as data to look at; `None` where it was not asked for.
    pub record: Option<Record>,
}

/// Computes where a surface meets itself. `number` is the surface's number in the result. Cancelled: what was found so
/// far, marked incomplete.
pub fn self_intersect(
    surface: &Surface,
    number: usize,
    options: &SelfIntersectOptions,
    job: &Job,
) -> Result<SelfIntersection, SelfIntersectError> {
    for (name, value) in [("the tolerance", options.tol), ("the miter radius", options.miter_radius)] {
        if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(SelfIntersectError::Tolerance { name, value });
        }
    }
    let started = Instant::now();
    let tolerances = Tolerances::of(&surface.bounds());
    let sheet = Sheet::new(surface, tolerances.gap);
    let tol = options.tol.unwrap_or(tolerances.follow);
    let radius = options.miter_radius.unwrap_or(tolerances.follow) / sheet.scale;
    let mut result = Intersection { tol, ..Intersection::default() };
    let open = |[a, b]: [Rect; 2], reason: &str| {
        let (uv_box, st_box) = (sheet.in_surface(&a), sheet.in_surface(&b));
        Unresolved { a: number, uv_box, b: number, st_box, reason: reason.to_owned() }
    };
    if collapsed(&sheet) {
        let whole = Rect::new(DVec2::ZERO, DVec2::ONE);
        result.unresolved.push(open([whole; 2], "the surface is collapsed to a curve or a point"));
        return Ok(SelfIntersection { result, ..SelfIntersection::default() });
    }

    job.phase("Finding miter points");
    let miters = miter::find(&sheet, job);
    let built = started.elapsed();
    let pace = Pace { tol: 0.5 * tol / sheet.scale, near: 0.2, cap: options.point_cap };

    job.phase("Tracing and proving");
    let mut search = Search::new(&sheet, &miters.points, &miters.cusps, options.grid, pace, options.pair_cap, job);
    search.touches = Some(Touches::new(surface, &sheet, number, tol, tolerances.gap));
    search.record = options.record.then(Record::default);
    for miter in &miters.points {
        for trace in branches(&sheet, miter, &search.register.traces, &pace, job) {
            // On the border of the domain the branch may have one of its preimages outside: there is none.
            let [p, q] = trace.nodes.last().copied().unwrap_or([miter.at; 2]);
            if trace.nodes.len() > 2 || p.distance(q) > 1e-9 || p.distance(miter.at) > 1e-9 {
                search.register.add(trace);
            }
        }
    }
    job.progress(0.2);
    search.run();
    let contacts = search.touches.take().map(|t| {
        let known = |[p, q]: [DVec2; 2]| search.register.contains([p.x, p.y, q.x, q.y]);
        (t.contacts(known, job), t.open)
    });
    let Search { found, windows, register, mut record, lines, .. } = search;
    let mut traces = register.traces;
    let traversed = started.elapsed();
    job.progress(0.8);

    job.phase("Assembling curves");
    let mut assembler = Assembler::new(&sheet, number);
    let (triples, missing) = triple::cut(&sheet, &mut traces);
    if missing > 0 {
        job.warn(format!(
            "{missing} crossings of self-intersection curves are no triple points that could be resolved"
        ));
    }
    for &[p, q, _] in &triples {
        let CurvePoint { xyz, uv, st, .. } = assembler.point([p, q].map(|p| sheet.wrapped(p)));
        let kind = JunctionKind::HigherOrder;
        result.junctions.push(Junction { xyz, a: number, uv, b: number, st, gap: 0.0, kind });
    }
    let (mut contacts, touching) = contacts.unwrap_or_default();
    for junction in std::mem::take(&mut contacts.crossings) {
        let at = [junction.uv, junction.st].map(|p| sheet.in_unit(p));
        while triple::split(&sheet, &mut traces, at, result.junctions.len()) {}
        result.junctions.push(junction);
    }
    for trace in &mut traces {
        let bound = assembler.refine(trace, tol / sheet.scale) * sheet.scale;
        let mut ends = [CurveEnd::Unresolved; 2];
        let mut end_ids = [None; 2];
        for k in 0..2 {
            ends[k] = match trace.ends[k] {
                End::Border => CurveEnd::Boundary,
                End::Loop => CurveEnd::Loop,
                End::Lost => CurveEnd::Unresolved,
                End::Triple(at) => {
                    end_ids[k] = Some(at);
                    CurveEnd::Junction
                }
                End::Miter(at) => {
                    end_ids[k] = miters.points.iter().position(|m| same(&sheet, m.at, at));
                    if end_ids[k].is_some() { CurveEnd::Miter } else { CurveEnd::Unresolved }
                }
            };
            if ends[k] == CurveEnd::Unresolved {
                let node = if k == 0 { trace.nodes.first() } else { trace.nodes.last() };
                if let Some([p, q]) = node {
                    let at = |p: DVec2| Rect::new(sheet.wrapped(p), sheet.wrapped(p));
                    result.unresolved.push(open([at(*p), at(*q)], "a curve could not be followed further"));
                }
            }
        }
        let points = assembler.points(trace);
        let closed = ends == [CurveEnd::Loop; 2];
        let kind = CurveKind::SelfIntersection;
        result.curves.push(IntersectionCurve { kind, closed, ends, end_ids, error_bound: bound, region: None, points });
    }
    for cusp in &miters.cusps {
        let nodes = cusp.nodes();
        let points = nodes.iter().map(|c| assembler.point([sheet.wrapped(c.at); 2])).collect();
        let bound = nodes.windows(2).map(|s| assembler.bound([s[0].at; 2], [s[1].at; 2])).fold(0.0, f64::max);
        let ends = [nodes.first(), nodes.last()].map(|c| {
            let on_border = c.is_some_and(|c| sheet.on_open_border(c.at));
            match (cusp.closed, c) {
                (true, _) => CurveEnd::Loop,
                (false, Some(c)) if !on_border => {
                    let around = Rect::new(c.at, c.at);
                    result.unresolved.push(open([around; 2], "a cusp edge could not be followed further"));
                    CurveEnd::Unresolved
                }
                _ => CurveEnd::Boundary,
            }
        });
        let bound = bound * sheet.scale;
        result.curves.push(IntersectionCurve {
            kind: CurveKind::CuspEdge,
            closed: cusp.closed,
            ends,
            end_ids: [None; 2],
            error_bound: bound,
            region: None,
            points,
        });
    }
    for (at, miter) in miters.points.iter().enumerate() {
        let quad = quad::quadrangle(&sheet, miter, radius);
        if let (Some(record), Some(quad)) = (&mut record, quad) {
            record.leaves.push(leaf::convert(&sheet, &lines, at, miter.at, quad, radius));
        }
        result.miters.push(Miter {
            xyz: sheet.to_model(sheet.point(miter.at)),
            a: number,
            uv: sheet.to_surface(sheet.wrapped(miter.at)),
            quad: quad.unwrap_or([miter.at; 4]).map(|c| sheet.to_surface(c)),
            radius: if quad.is_some() { radius * sheet.scale } else { sheet.rounding * sheet.scale },
            isolated: !traces
                .iter()
                .flat_map(|t| t.ends)
                .any(|e| matches!(e, End::Miter(at) if same(&sheet, at, miter.at))),
        });
    }
    let reason = "a miter point could not be separated from its surroundings";
    for (pair, reason) in cover::merged(miters.open.iter().map(|&r| ([r; 2], reason)).collect()) {
        result.unresolved.push(open(pair, reason));
    }
    result.unresolved.extend(found.open.iter().map(|(pair, reason)| open(*pair, reason)));
    result.unresolved.extend(touching.iter().chain(&contacts.open).map(|(pair, reason)| open(*pair, reason)));
    result.junctions.extend(contacts.points);
    result.curves.extend(contacts.curves);
    for area in region::regions(&sheet, &found.coincident, &windows.folds, &miters.cusps) {
        let number = result.regions.len();
        let loops: Vec<Vec<CurvePoint>> =
            area.loops.iter().map(|l| l.iter().map(|&pair| assembler.point(pair)).collect()).collect();
        let distance = 2.0 * (area.distance + sheet.rounding) * sheet.scale;
        for points in &loops {
            result.curves.push(IntersectionCurve {
                kind: CurveKind::CoincidentBoundary,
                closed: true,
                ends: [CurveEnd::Loop; 2],
                end_ids: [None; 2],
                error_bound: distance,
                region: Some(number),
                points: points.clone(),
            });
        }
        if !loops.is_empty() {
            result.regions.push(Region { boundary: loops, max_distance: distance });
        }
        if let (true, Some(boxes)) = (area.rough, area.boxes) {
            result.unresolved.push(open(boxes, "the outline of a coincident region is known to within one cell only"));
        }
    }
    result.complete = result.unresolved.is_empty() && !found.capped && !job.is_cancelled();
    result.counts = Counts { leaf_pairs: found.leaf_pairs, nodes_built: found.hulls + miters.cells };
    let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
    result.time_ms =
        Times { build: ms(built), traverse: ms(traversed - built), curves: ms(started.elapsed() - traversed) };
    let evidence = Evidence {
        windows: windows.tested,
        failed_windows: windows.failed,
        pairs: found.pairs,
        miter_cells: miters.cells,
    };
    job.progress(1.0);
    let triple_points = triples.iter().map(|t| t.map(|p| sheet.to_surface(sheet.wrapped(p)))).collect();
    Ok(SelfIntersection { result, triple_points, evidence, record })
}

fn same(sheet: &Sheet, a: DVec2, b: DVec2) -> bool {
    let d = a - b;
    (d - march::turns(sheet, a, b)).length() < 1e-6
}

/// The branches of a miter point that are not traced yet.
fn branches(sheet: &Sheet, miter: &miter::MiterPoint, known: &[Trace], pace: &Pace, job: &Job) -> Vec<Trace> {
    let ended = known.iter().flat_map(|t| t.ends).any(|e| matches!(e, End::Miter(at) if same(sheet, at, miter.at)));
    match miter.kind {
        _ if ended => Vec::new(),
        MiterKind::CrossCap => vec![march::from_miter(sheet, miter.at, miter.phi, pace, job)],
        MiterKind::Degenerate(along, sides) => march::from_degenerate(sheet, miter, along, sides, pace, job),
        MiterKind::Isolated => Vec::new(),
    }
}

/// Whether Su x Sv vanishes all over.
fn collapsed(sheet: &Sheet) -> bool {
    (0..sheet.pieces.len()).all(|piece| {
        let p = &sheet.pieces[piece];
        (0..25).all(|k| {
            let local = DVec2::new(f64::from(k % 5) * 0.25, f64::from(k / 5) * 0.25);
            let jet = sheet.jet_on(piece, p.low + p.size() * local, 1);
            jet.d[0].cross(jet.d[1]).length() <= 1e-13 * (jet.d[0].length_squared() + jet.d[1].length_squared())
        })
    })
}
