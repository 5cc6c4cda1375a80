//! Trimmed faces of IGES files: closed forms for every way in which a file can say one.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/iges_text.rs"]
mod iges_text;

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::DVec2;
use iges_text::{Entity, File, square};
use patchwright::io::iges;
use patchwright::io::{Opened, Severity};
use patchwright::kernel::geom::trim::{Face, SurfaceKind};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::area::area;
use patchwright::model::topology::{Meets, edges};

fn read(file: &File) -> Opened {
    let opened = iges::read(file.text().as_bytes()).unwrap();
    for line in &opened.report.lines {
        println!("{line}");
    }
    opened
}

/// The areas of all surfaces and faces, in order.
fn areas(opened: &Opened) -> Vec<f64> {
    opened.document.sheets().map(|(_, s)| area(&s)).collect()
}

fn face(opened: &Opened, number: usize) -> Arc<Face> {
    Arc::clone(opened.document.faces().nth(number).unwrap().1)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 2e-4 * b.abs()
}

/// An entity that belongs to another one.
fn part(file: &mut File, kind: i64, parameters: impl Into<String>) -> usize {
    let status = Some("00010000");
    file.add_entity(Entity { kind, status, parameters: parameters.into(), ..Entity::default() })
}

fn line(file: &mut File, a: [f64; 3], b: [f64; 3]) -> usize {
    let all: Vec<String> = a.iter().chain(&b).map(|c| format!("{c:?}")).collect();
    part(file, 110, all.join(","))
}

/// A composite of straight lines through points.
fn path(file: &mut File, points: &[[f64; 3]]) -> usize {
    let members: Vec<String> = points.windows(2).map(|p| line(file, p[0], p[1]).to_string()).collect();
    part(file, 102, format!("{},{}", members.len(), members.join(",")))
}

const OUTLINE: [[f64; 3]; 5] = [[0.1, 0.1, 0.0], [0.9, 0.1, 0.0], [0.9, 0.9, 0.0], [0.1, 0.9, 0.0], [0.1, 0.1, 0.0]];

#[test]
fn a_square_with_a_round_hole_by_curves_in_space_or_in_parameters() {
    let exact = 0.64 - PI * 0.04;
    // Curves in space and parameter curves; only the former; only the latter.
    for (space, parameter) in [(true, true), (true, false), (false, true)] {
        let mut file = File::default();
        let s = part(&mut file, 128, square(0.0));
        let boundary = |file: &mut File, make: &dyn Fn(&mut File) -> usize| {
            // On this square a point and its parameters are the same numbers.
            let b = if parameter { make(file) } else { 0 };
            let c = if space { make(file) } else { 0 };
            part(file, 142, format!("0,{s},{b},{c},0"))
        };
        let outer = boundary(&mut file, &|f| path(f, &OUTLINE));
        let inner = boundary(&mut file, &|f| part(f, 100, "0.,0.5,0.5,0.7,0.5,0.7,0.5"));
        file.add(144, format!("{s},1,1,{outer},{inner}"));
        let opened = read(&file);
        let found = areas(&opened);
        assert!(found.len() == 1 && near(found[0], exact), "{space} {parameter}: {found:?} {exact}");
        let face = face(&opened, 0);
        assert_eq!(face.rings().iter().map(|r| r.edges.len()).collect::<Vec<_>>(), [4, 1]);
        assert!(face.contains(DVec2::new(0.2, 0.2)) && !face.contains(DVec2::new(0.5, 0.5)));
        assert_eq!(opened.report.count(Severity::Warning) + opened.report.count(Severity::Skipped), 0);
    }
}

#[test]
fn bounded_surfaces_and_edges_against_the_run() {
    let mut file = File::default();
    let s = part(&mut file, 128, square(0.0));
    // The second and the last edge run against the others.
    let o = OUTLINE;
    let lines = [(o[0], o[1]), (o[2], o[1]), (o[2], o[3]), (o[4], o[3])].map(|(a, b)| line(&mut file, a, b));
    let list: Vec<String> = lines.iter().map(|l| format!("{l},1,0")).collect();
    let boundary = part(&mut file, 141, format!("0,1,{s},4,{}", list.join(",")));
    file.add(143, format!("0,{s},1,{boundary}"));
    let found = areas(&read(&file));
    assert!(near(found[0], 0.64), "{found:?}");
}

/// A cylinder of radius 2 and height 3 with its two caps as a B-rep: planes 190, cylinder 192.
fn drum() -> File {
    let mut file = File::default();
    let point = |f: &mut File, z: f64| part(f, 116, format!("0.,0.,{z:?},0"));
    let (low, high) = (point(&mut file, 0.0), point(&mut file, 3.0));
    let z = part(&mut file, 123, "0.,0.,1.");
    let x = part(&mut file, 123, "1.,0.,0.");
    let side = part(&mut file, 192, format!("{low},{z},2."));
    let caps = [low, high].map(|p| {
        file.add_entity(Entity {
            kind: 190,
            form: 1,
            status: Some("00010000"),
            parameters: format!("{p},{z},{x}"),
            ..Entity::default()
        })
    });
    let circles = [0.0, 3.0].map(|z| part(&mut file, 100, format!("{z:?},0.,0.,2.,0.,2.,0.")));
    let seam = line(&mut file, [2.0, 0.0, 0.0], [2.0, 0.0, 3.0]);
    let vertices = part(&mut file, 502, "2,2.,0.,0.,2.,0.,3.");
    let v = vertices;
    let edges =
        part(&mut file, 504, format!("3,{},{v},1,{v},1,{},{v},2,{v},2,{seam},{v},1,{v},2", circles[0], circles[1]));
    let ring = |f: &mut File, uses: &[(usize, usize)]| {
        let list: Vec<String> = uses.iter().map(|(k, o)| format!("0,{edges},{k},{o},0")).collect();
        part(f, 508, format!("{},{}", uses.len(), list.join(",")))
    };
    let loops =
        [ring(&mut file, &[(1, 1), (3, 1), (2, 0), (3, 0)]), ring(&mut file, &[(1, 0)]), ring(&mut file, &[(2, 1)])];
    let faces: Vec<usize> =
        [side, caps[0], caps[1]].iter().zip(loops).map(|(s, l)| part(&mut file, 510, format!("{s},1,1,{l}"))).collect();
    let list: Vec<String> = faces.iter().map(|f| format!("{f},1")).collect();
    let shell = part(&mut file, 514, format!("3,{}", list.join(",")));
    file.add(186, format!("{shell},1,0"));
    file
}

#[test]
fn a_solid_shares_its_edges_and_keeps_its_kinds() {
    let opened = read(&drum());
    let found = areas(&opened);
    let exact = [TAU * 2.0 * 3.0, PI * 4.0, PI * 4.0];
    assert!(found.len() == 3 && found.iter().zip(exact).all(|(&a, b)| near(a, b)), "{found:?} {exact:?}");
    let kinds: Vec<SurfaceKind> = opened.document.faces().map(|(_, f)| f.kind).collect();
    assert_eq!(kinds, [SurfaceKind::Cylinder, SurfaceKind::Plane, SurfaceKind::Plane]);
    let joints = edges(&opened.document, 1e-6, &Job::new());
    assert!(joints.iter().all(|e| e.by_file && e.meets == Meets::Shared { gap: 0.0 }), "{joints:?}");
    assert_eq!(joints.len(), 6, "four uses on the side, one on each cap");
    assert_eq!(opened.report.count(Severity::Warning) + opened.report.count(Severity::Skipped), 0);
}

#[test]
fn unbounded_and_closed_analytic_surfaces() {
    let mut file = File::default();
    let origin = part(&mut file, 116, "1.,2.,3.,0");
    let z = part(&mut file, 123, "0.,0.,2.");
    file.add(196, format!("{origin},2."));
    file.add(198, format!("{origin},{z},3.,1."));
    // A cone between two circles, without a seam: z = 0 (radius 1) and z = 1 (radius 2).
    let apex = part(&mut file, 116, "0.,0.,0.,0");
    let cone = part(&mut file, 194, format!("{apex},{z},1.,45."));
    let rings = [(0.0, 1.0), (1.0, 2.0)].map(|(z, r)| {
        let c = part(&mut file, 100, format!("{z:?},0.,0.,{r:?},0.,{r:?},0."));
        part(&mut file, 142, format!("0,{cone},0,{c},2"))
    });
    file.add(144, format!("{cone},1,1,{},{}", rings[1], rings[0]));
    // The plane 2 z = 6 in a triangle, by 108.
    let corners = [[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [0.0, 1.0, 3.0], [0.0, 0.0, 3.0]];
    let plane = part(&mut file, 108, "0.,0.,2.,6.,0,0.,0.,0.,0.");
    let c = path(&mut file, &corners);
    let on = part(&mut file, 142, format!("0,{plane},0,{c},2"));
    file.add(144, format!("{plane},1,0,{on}"));
    let found = areas(&read(&file));
    let exact = [16.0 * PI, 12.0 * PI * PI, PI * 3.0 * 2f64.sqrt(), 0.5];
    assert!(found.len() == 4 && found.iter().zip(exact).all(|(&a, b)| near(a, b)), "{found:?} {exact:?}");
}

#[test]
fn ruled_offset_conic_and_polyline() {
    let mut file = File::default();
    // A quarter of a cylinder, ruled between two arcs, and the surface 1 outside of it.
    let arcs = [0.0, 2.0].map(|z| part(&mut file, 100, format!("{z:?},0.,0.,1.,0.,0.,1.")));
    let ruled = file.add_entity(Entity {
        kind: 118,
        form: 1,
        parameters: format!("{},{},0,0", arcs[0], arcs[1]),
        ..Entity::default()
    });
    file.add(140, format!("1.,1.,0.,1.,{ruled}"));
    // An ellipse with the half axes 2 and 1, a parabola, a polyline.
    file.add_entity(Entity {
        kind: 104,
        form: 1,
        parameters: "0.25,0.,1.,0.,0.,-1.,5.,2.,0.,0.,1.".into(),
        ..Entity::default()
    });
    file.add_entity(Entity {
        kind: 104,
        form: 3,
        parameters: "1.,0.,0.,0.,-1.,0.,0.,-1.,1.,2.,4.".into(),
        ..Entity::default()
    });
    file.add_entity(Entity {
        kind: 106,
        form: 12,
        parameters: "2,3,0.,0.,0.,3.,0.,0.,3.,4.,0.".into(),
        ..Entity::default()
    });
    file.add_entity(Entity { kind: 106, form: 63, parameters: "1,3,7.,0.,0.,3.,0.,3.,4.".into(), ..Entity::default() });
    let opened = read(&file);
    let found = areas(&opened);
    // The offset describes the ruled surface away: it stays as the offset only.
    assert!(found.len() == 1 && near(found[0], PI * 2.0), "{found:?}");
    let curves: Vec<_> = opened.document.curves().map(|(_, c)| Arc::clone(c)).collect();
    assert_eq!(curves.len(), 4);
    for (_, p) in curves[0].sampled(20) {
        assert!((p.x * p.x / 4.0 + p.y * p.y - 1.0).abs() < 1e-12 && (p.z - 5.0).abs() < 1e-14);
    }
    for (_, p) in curves[1].sampled(20) {
        assert!((p.x * p.x - p.y).abs() < 1e-12);
    }
    let lengths: Vec<f64> =
        curves[2..].iter().map(|c| c.sampled(1).windows(2).map(|w| w[0].1.distance(w[1].1)).sum()).collect();
    assert!(near(lengths[0], 7.0) && near(lengths[1], 12.0), "{lengths:?}");
    assert_eq!(opened.report.count(Severity::Skipped), 0);
}

#[test]
fn subfigures_stand_where_their_instances_put_them() {
    let mut file = File::default();
    let s = part(&mut file, 128, square(0.0));
    let c = path(&mut file, &OUTLINE);
    let on = part(&mut file, 142, format!("0,{s},0,{c},2"));
    let f = part(&mut file, 144, format!("{s},1,0,{on}"));
    let l = line(&mut file, [0.0; 3], [1.0, 0.0, 0.0]);
    let inner = part(&mut file, 308, format!("0,4Hpart,2,{f},{l}"));
    let placed = part(&mut file, 408, format!("{inner},0.,0.,10.,2."));
    let outer = part(&mut file, 308, format!("1,8Hassembly,1,{placed}"));
    file.add(408, format!("{outer},5.,0.,0.,1."));
    file.add(408, format!("{outer},0.,0.,0.,3."));
    let opened = read(&file);
    let found = areas(&opened);
    assert!(found.len() == 2 && near(found[0], 0.64 * 4.0) && near(found[1], 0.64 * 36.0), "{found:?}");
    assert_eq!(opened.document.curves().count(), 2);
    let low: Vec<f64> = opened.document.faces().map(|(_, f)| f.rings()[0].edges[0].curve.points()[0].z).collect();
    assert_eq!(low, [10.0, 30.0]);
}

#[test]
fn a_face_whose_loop_is_broken_is_opened_whole_and_says_so() {
    let mut file = File::default();
    let s = part(&mut file, 128, square(0.0));
    let away = path(&mut file, &OUTLINE.map(|p| [p[0], p[1], 5.0]));
    let on = part(&mut file, 142, format!("0,{s},0,{away},2"));
    file.add(144, format!("{s},1,0,{on}"));
    file.add(144, format!("{s},1,0,9999"));
    file.add(144, format!("{s},0,0,0"));
    let opened = read(&file);
    let found = areas(&opened);
    assert!(found.len() == 3 && found.iter().all(|&a| near(a, 1.0)), "{found:?}");
    let warnings: Vec<&str> =
        opened.report.lines.iter().filter(|l| l.severity == Severity::Warning).map(|l| l.reason.as_str()).collect();
    assert!(warnings.len() == 2 && warnings[0].contains("off its surface"), "{warnings:?}");
    assert!(warnings.iter().all(|w| w.contains("opened as its whole surface")));
}

#[test]
fn a_face_goes_through_a_project_and_keeps_its_shared_edges() {
    let opened = read(&drum());
    let text = patchwright::io::project::write(&opened.document).unwrap();
    let back = patchwright::io::project::read(text.as_bytes()).unwrap();
    assert!(back.report.lines.is_empty(), "{:?}", back.report.lines);
    assert_eq!(patchwright::io::project::write(&back.document).unwrap(), text);
    let faces = |d: &patchwright::model::document::Document| d.faces().map(|(_, f)| Arc::clone(f)).collect::<Vec<_>>();
    let (a, b) = (faces(&opened.document), faces(&back.document));
    assert!(a.iter().zip(&b).all(|(a, b)| a == b));
    assert!(Arc::ptr_eq(&b[0].rings()[0].edges[0].curve, &b[0].rings()[0].edges[0].curve));
    let curve_of =
        |f: &Face, id: u64| f.rings().iter().flat_map(|r| &r.edges).find(|e| e.id == id).map(|e| Arc::clone(&e.curve));
    let id = b[1].rings()[0].edges[0].id;
    assert!(Arc::ptr_eq(&curve_of(&b[0], id).unwrap(), &curve_of(&b[1], id).unwrap()), "the rim is one curve");
}
