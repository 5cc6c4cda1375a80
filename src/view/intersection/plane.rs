//! A plane swept through a miter point: the section it cuts from the neighbourhood, ready to be drawn (thesis Fig. 8.8).

use glam::{DVec2, DVec3};

use super::Found;
use crate::kernel::job::Job;
use crate::kernel::self_ssi::section::{MiterSection, SectionEnd, SectionOptions, SectionType, miter_section};

/// How far the neighbourhood reaches, as a part of the domain.
const REACH: f64 = 0.3;
/// The largest offset, as a fraction of the size of the model.
const FARTHEST: f64 = 0.04;

/// Where the plane is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The miter point's number.
    pub miter: usize,
    /// The angle about the tangent, in degrees.
    pub tilt: f64,
    /// The distance from the miter point, -1 to 1 over the range that makes sense.
    pub offset: f64,
}

/// The section.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// What the kernel found.
    pub section: MiterSection,
    /// The corners of the part of the plane that is drawn.
    pub corners: [DVec3; 4],
    /// The offset in model units.
    pub offset: f64,
}

/// Cuts with the plane. An error is one line for people.
pub fn cut(found: &Found, plane: Plane, job: &Job) -> Result<Cut, String> {
    let miter = found.result.miters.get(plane.miter).ok_or("the miter point is gone")?;
    let surface = found.surface(miter.a).ok_or("the surface is gone")?;
    let offset = plane.offset.clamp(-1.0, 1.0) * FARTHEST * surface.bounds().diagonal();
    let options = SectionOptions { tilt: plane.tilt.to_radians(), offset, reach: REACH, ..SectionOptions::default() };
    let section = miter_section(surface, miter.a, miter.uv, &options, job).map_err(|e| e.to_string())?;
    // As large as the neighbourhood, measured along the plane.
    let (x, y) = (section.tangent, section.normal.cross(section.tangent));
    let [u, v] = section.uv_box;
    let on_border = (0..=16).flat_map(|i| {
        let f = f64::from(i) / 16.0;
        let (s, t) = (u[0] + (u[1] - u[0]) * f, v[0] + (v[1] - v[0]) * f);
        [DVec2::new(s, v[0]), DVec2::new(s, v[1]), DVec2::new(u[0], t), DVec2::new(u[1], t)]
    });
    let middle = section.xyz + section.normal * offset;
    let (mut low, mut high) = (DVec2::ZERO, DVec2::ZERO);
    for p in on_border.map(|uv| surface.eval(surface.clamped(uv)) - middle) {
        let at = DVec2::new(p.dot(x), p.dot(y));
        (low, high) = (low.min(at), high.max(at));
    }
    let at = |a: f64, b: f64| middle + x * a + y * b;
    let corners = [at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y)];
    Ok(Cut { section, corners, offset })
}

/// What one sees, in words.
pub fn words(cut: &Cut) -> String {
    let (curves, crossings) = (cut.section.curves.len(), cut.section.crossings.len());
    // What leaves the neighbourhood is not the whole of it.
    let whole = cut.section.curves.iter().all(|c| c.ends == [SectionEnd::Loop; 2]);
    let shape = match (cut.section.kind, curves, crossings) {
        (SectionType::Elliptic, 0, _) if cut.offset == 0.0 => "the point alone",
        (SectionType::Elliptic, 0, _) => "nothing",
        (SectionType::Elliptic, ..) if !whole => "a figure-8 that leaves the neighbourhood",
        (SectionType::Elliptic, _, 0) => "a closed loop",
        (SectionType::Elliptic, ..) => "a figure-8",
        (SectionType::Hyperbolic, _, 0) if cut.offset == 0.0 => "an X through the point",
        (SectionType::Hyperbolic, _, 0) => "two branches that pass each other",
        (SectionType::Hyperbolic, ..) => "two branches that cross",
        (SectionType::Parabolic, 0, 0) if !cut.section.complete => "a curve that counts twice",
        (SectionType::Parabolic, _, 0) if cut.offset == 0.0 => "a cusp",
        (SectionType::Parabolic, _, 0) => "one curve without a loop",
        (SectionType::Parabolic, ..) => "a loop with a tail",
        (SectionType::Transversal, ..) => "one curve with a cusp",
    };
    let kind = match cut.section.kind {
        SectionType::Elliptic => "Elliptic",
        SectionType::Hyperbolic => "Hyperbolic",
        SectionType::Parabolic => "Parabolic",
        SectionType::Transversal => "Transversal",
    };
    let open = if cut.section.complete { "" } else { ", incomplete" };
    format!("{kind}: {shape}{open}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::examples::cross_cap;
    use crate::view::intersection::{Picks, Request, Task, compute};

    fn found() -> Found {
        let document = cross_cap::document();
        let picks = Picks::new(Task::Itself, &[document.entities()[0].id]);
        compute(&Request::new(&picks, &document).unwrap(), &Job::new()).unwrap()
    }

    #[test]
    fn the_cross_cap_shows_all_types() {
        let found = found();
        assert_eq!((found.result.curves.len(), found.result.miters.len()), (1, 1));
        let see = |tilt, offset| words(&cut(&found, Plane { miter: 0, tilt, offset }, &Job::new()).unwrap());
        assert_eq!(see(0.0, 0.5), "Elliptic: a figure-8");
        assert_eq!(see(0.0, 1.0), "Elliptic: a figure-8 that leaves the neighbourhood");
        assert_eq!(see(0.0, -0.5), "Elliptic: nothing");
        assert_eq!(see(0.0, 0.0), "Elliptic: the point alone");
        assert_eq!(see(70.0, 0.0), "Hyperbolic: an X through the point");
        assert!(see(70.0, 0.5).starts_with("Hyperbolic: two branches"));
        let tilt =
            cut(&found, Plane { miter: 0, tilt: 0.0, offset: 0.0 }, &Job::new()).unwrap().section.parabolic_tilts[1]
                .to_degrees();
        assert_eq!(see(tilt, 0.0), "Parabolic: a cusp");
        assert_eq!(see(tilt, 0.1), "Parabolic: a loop with a tail");
    }

    #[test]
    fn the_section_lies_in_the_plane_that_is_drawn() {
        let found = found();
        let cut = cut(&found, Plane { miter: 0, tilt: 20.0, offset: 0.4 }, &Job::new()).unwrap();
        let n = cut.section.normal;
        for p in cut.section.curves.iter().flat_map(|c| &c.xyz).chain(&cut.corners) {
            assert!((*p - cut.corners[0]).dot(n).abs() < 1e-7, "{p}");
        }
        assert!(super::cut(&found, Plane { miter: 5, tilt: 0.0, offset: 0.0 }, &Job::new()).is_err());
    }
}
