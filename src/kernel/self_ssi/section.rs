//! A miter neighbourhood cut by a plane: the three types of thesis Fig. 8.8, as the plane sweeps through the point.
//!
//! At a miter point the surface has one tangent line, along S_x with x across the null direction e. A plane through the
//! point that does not contain it cuts the surface in a curve that is smooth in the domain and has a cusp in space. A
//! plane that contains it is tangent: the section's type is that of the form n . D^2 S in the domain (Fig. 8.8 and 6.3):
//! *hyperbolic* - two branches on either side of the point, an X through it; *elliptic* - a closed loop in the domain,
//! a figure-8 in space, that shrinks to the point and vanishes; *parabolic* - a loop with a tail, one curve that crosses
//! itself once, or not at all. With S = m + x S_x + b (e^2 + c x^2) + x e a + ... the planes that contain the
//! tangent form a pencil, and the definite ones are those whose normals lie in a cone around that of the branch's direction
//! when c > 0. The loop's crossing in space is where the plane cuts the local self-intersection branch.
//!
//! The section is a level set of a height ([`super::contour`]); its double points are found on the branch, by Newton on
//! F = 0 with the plane as fourth equation. Cost: 1 to 3 ms, for a slider.

use glam::{DVec2, DVec3};

use super::SelfIntersectError;
use super::assemble::Assembler;
use super::chart::Chart;
use super::contour::{self, ContourEnd, Height};
use super::hull::Rect;
use super::march::{self, Pace};
use super::miter::{self, MiterPoint};
use super::sheet::Sheet;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::ssi::result::CurvePoint;
use crate::kernel::tol::Tolerances;

/// The type of a section through a miter point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SectionType {
    /// The plane contains the tangent; two branches, or an X through the point.
    Hyperbolic,
    /// The plane contains the tangent; a figure-8, the point, or nothing.
    Elliptic,
    /// The plane contains the tangent; a loop with a tail.
    Parabolic,
    /// The plane cuts the tangent: one curve, with a cusp where it meets the point.
    Transversal,
}

/// Which plane, and how much of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionOptions {
    /// The plane's normal; `None`: the plane of the pencil through the tangent given by `tilt`.
    pub normal: Option<DVec3>,
    /// The angle, in radians about the tangent, from the plane across the branch's direction in the miter point.
    pub tilt: f64,
    /// How far the plane is from the miter point along its normal, in model units. Positive: the branch's side at tilt 0.
    pub offset: f64,
    /// How far the neighbourhood reaches on every side of the miter point, as a part of the domain.
    pub reach: f64,
    /// How far chords may be from the section, in model units; `None`: 1e-5 of the diagonal.
    pub tol: Option<f64>,
}

impl Default for SectionOptions {
    fn default() -> Self {
        Self { normal: None, tilt: 0.0, offset: 0.0, reach: 0.1, tol: None }
    }
}

/// How a curve of a section ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SectionEnd {
    /// On the border of the neighbourhood.
    Border,
    /// In the miter point.
    Miter,
    /// In another point in which the plane touches the surface.
    Contact,
    /// Nowhere: closed in the domain.
    Loop,
    /// Where the march had to give up.
    Unresolved,
}

/// One curve of a section.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionCurve {
    /// Its points in the surface's parameters.
    pub uv: Vec<DVec2>,
    /// The same points in space.
    pub xyz: Vec<DVec3>,
    /// How it starts and ends.
    pub ends: [SectionEnd; 2],
}

/// A miter neighbourhood cut by a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct MiterSection {
    /// The type, from the second derivatives in the miter point.
    pub kind: SectionType,
    /// The miter point, polished.
    pub uv: DVec2,
    /// The miter point in space.
    pub xyz: DVec3,
    /// The unit normal of the plane.
    pub normal: DVec3,
    /// The unit tangent of the surface in the miter point.
    pub tangent: DVec3,
    /// The curves of the section, split at points of contact.
    pub curves: Vec<SectionCurve>,
    /// Where the plane cuts the self-intersection branch: the double points of the section in space.
    pub crossings: Vec<CurvePoint>,
    /// The branch within the neighbourhood.
    pub branch: Vec<CurvePoint>,
    /// The rectangle that was cut, `[[u0, u1], [v0, v1]]`.
    pub uv_box: [[f64; 2]; 2],
    /// The tilts at which the type changes: parabolic planes of the pencil.
    pub parabolic_tilts: Vec<f64>,
    /// Whether everything in the rectangle was found.
    pub complete: bool,
}

/// Cuts the neighbourhood of the miter point closest to the parameters `at`.
pub fn miter_section(
    surface: &Surface,
    number: usize,
    at: DVec2,
    options: &SectionOptions,
    job: &Job,
) -> Result<MiterSection, SelfIntersectError> {
    let positive = [("the reach", Some(options.reach)), ("the tolerance", options.tol)];
    for (name, value) in positive {
        if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(SelfIntersectError::Tolerance { name, value });
        }
    }
    for (name, value) in [("the tilt", options.tilt), ("the offset", options.offset)] {
        if !value.is_finite() {
            return Err(SelfIntersectError::Tolerance { name, value });
        }
    }
    let tolerances = Tolerances::of(&surface.bounds());
    let sheet = Sheet::new(surface, tolerances.gap);
    let miter = miter::polished(&sheet, sheet.in_unit(at)).ok_or(SelfIntersectError::NoMiterPoint { at })?;
    let frame = Frame::of(&miter);
    let normal = match options.normal {
        None => frame.normal(options.tilt),
        Some(n) => n.try_normalize().ok_or(SelfIntersectError::Tolerance { name: "the plane's normal", value: 0.0 })?,
    };
    let m = sheet.wrapped(miter.at);
    let window = window(&sheet, m, options.reach);
    let s = sheet.point(m);
    let height = Height { sheet: &sheet, normal, level: normal.dot(s) + options.offset / sheet.scale };
    let tol = options.tol.unwrap_or(10.0 * tolerances.follow) / sheet.scale;
    let contour = contour::trace(&height, &window, m, tol, job);

    let pace = Pace { tol: 0.5 * tol, near: 0.2, cap: 20_000 };
    let trace = march::from_miter(&sheet, m, miter.phi, &pace, job);
    let inside = |p: DVec2| window.contains(p + march::turns(&sheet, window.center(), p));
    let within = trace.nodes.iter().take_while(|[p, q]| inside(*p) && inside(*q)).count();
    let branch = &trace.nodes[..within];
    let assembler = Assembler::new(&sheet, number);
    let crossings = crossings(&height, branch, pace.near);

    let ends = |end: ContourEnd| match end {
        ContourEnd::Border => SectionEnd::Border,
        ContourEnd::Loop => SectionEnd::Loop,
        ContourEnd::Lost => SectionEnd::Unresolved,
        ContourEnd::Critical(k) if contour.critical[k].distance(m) < 1e-7 => SectionEnd::Miter,
        ContourEnd::Critical(_) => SectionEnd::Contact,
    };
    let curves = contour
        .curves
        .iter()
        .map(|(line, e)| SectionCurve {
            uv: line.iter().map(|&p| sheet.to_surface(sheet.wrapped(p))).collect(),
            xyz: line.iter().map(|&p| sheet.to_model(sheet.point(p))).collect(),
            ends: e.map(ends),
        })
        .collect();
    let (low, high) = (sheet.to_surface(window.low), sheet.to_surface(window.high));
    Ok(MiterSection {
        kind: frame.kind(normal),
        uv: sheet.to_surface(m),
        xyz: sheet.to_model(s),
        normal,
        tangent: frame.tangent,
        curves,
        crossings: crossings.into_iter().map(|pair| assembler.point(pair.map(|p| sheet.wrapped(p)))).collect(),
        branch: branch.iter().map(|pair| assembler.point(pair.map(|p| sheet.wrapped(p)))).collect(),
        uv_box: [[low.x, high.x], [low.y, high.y]],
        parabolic_tilts: frame.parabolic_tilts(),
        complete: contour.open == 0 && !job.is_cancelled(),
    })
}

/// The neighbourhood: a square around the point, clipped by open borders.
fn window(sheet: &Sheet, m: DVec2, reach: f64) -> Rect {
    let reach = reach.min(0.5);
    let one = |d: usize, t: f64| if sheet.periodic[d] { t } else { t.clamp(0.0, 1.0) };
    let corner = |by: f64| DVec2::new(one(0, m.x + by), one(1, m.y + by));
    Rect::new(corner(-reach), corner(reach))
}

/// The differential geometry of a miter point.
struct Frame {
    tangent: DVec3,
    /// The part of S_ee across the tangent: the direction in which the branch leaves.
    branch: DVec3,
    /// S_ee, S_ex, S_xx.
    second: [DVec3; 3],
    /// |S_x|.
    speed: f64,
}

impl Frame {
    fn of(miter: &MiterPoint) -> Self {
        let (e, x) = (miter.null(), miter.null().perp());
        let s_x = miter.first[0] * x.x + miter.first[1] * x.y;
        let mix = |a: DVec2, b: DVec2| {
            miter.second[0] * (a.x * b.x) + miter.second[1] * (a.x * b.y + a.y * b.x) + miter.second[2] * (a.y * b.y)
        };
        let second = [mix(e, e), mix(e, x), mix(x, x)];
        let tangent = s_x.normalize_or_zero();
        let branch = (second[0] - tangent * tangent.dot(second[0])).normalize_or_zero();
        Self { tangent, branch, second, speed: s_x.length() }
    }

    fn normal(&self, tilt: f64) -> DVec3 {
        self.branch * tilt.cos() + self.tangent.cross(self.branch) * tilt.sin()
    }

    /// Minus the determinant of n . D^2 S, and the size of its terms.
    fn discriminant(&self, n: DVec3) -> (f64, f64) {
        let [a, b, c] = self.second.map(|x| n.dot(x));
        (b * b - a * c, b * b + (a * c).abs())
    }

    fn kind(&self, n: DVec3) -> SectionType {
        let size = self.second.iter().map(|x| x.length()).fold(0.0, f64::max);
        if n.dot(self.tangent).abs() * self.speed > 1e-9 * (self.speed + size) {
            return SectionType::Transversal;
        }
        let (d, terms) = self.discriminant(n);
        if d.abs() <= 1e-9 * terms.max(1e-3 * size * size) {
            SectionType::Parabolic
        } else if d > 0.0 {
            SectionType::Hyperbolic
        } else {
            SectionType::Elliptic
        }
    }

    /// The zeros of the discriminant, a quadratic form in (cos, sin), in (-pi/2, pi/2].
    fn parabolic_tilts(&self) -> Vec<f64> {
        let (p, q) = (self.normal(0.0), self.normal(std::f64::consts::FRAC_PI_2));
        let [ap, bp, cp] = self.second.map(|x| p.dot(x));
        let [aq, bq, cq] = self.second.map(|x| q.dot(x));
        // k0 cos^2 + 2 k1 cos sin + k2 sin^2; S_ee has no part along q.
        let (k0, k1, k2) = (bp * bp - ap * cp, bp * bq - 0.5 * (ap * cq + aq * cp), bq * bq - aq * cq);
        let root = k1 * k1 - k0 * k2;
        if root.is_nan() || root < 0.0 {
            return Vec::new();
        }
        let fold = |t: f64| {
            let half = std::f64::consts::FRAC_PI_2;
            if t > half {
                t - 2.0 * half
            } else if t <= -half {
                t + 2.0 * half
            } else {
                t
            }
        };
        let root = root.sqrt();
        // k2 t^2 + 2 k1 t + k0 = 0 for t = tan.
        let mut out = vec![fold((-k1 + root).atan2(k2)), fold((-k1 - root).atan2(k2))];
        out.sort_by(f64::total_cmp);
        out.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        out
    }
}

/// Where the plane cuts the branch: pairs of parameter points.
fn crossings(height: &Height, branch: &[[DVec2; 2]], near: f64) -> Vec<[DVec2; 2]> {
    let sheet = height.sheet;
    let over = |[p, q]: [DVec2; 2]| 0.5 * height.normal.dot(sheet.point(p) + sheet.point(q)) - height.level;
    let mut out: Vec<[DVec2; 2]> = Vec::new();
    for pair in branch.windows(2) {
        let (a, b) = (over(pair[0]), over(pair[1]));
        // The miter point itself is no crossing: nothing passes through it.
        if a * b > 0.0 || (pair[0][0] == pair[0][1] && a.abs() < 1e-12) || a == b {
            continue;
        }
        let at = a / (a - b);
        let [p, q] = [0, 1].map(|k| pair[0][k] + (pair[1][k] - pair[0][k]) * at);
        let turn = march::turns(sheet, p, q);
        let found = march::on_plane(sheet, Chart::of(p, q + turn, near), height.normal, height.level);
        out.extend(found.map(|chart| chart.points()));
    }
    out
}
