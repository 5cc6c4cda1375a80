//! Trimmed faces of STEP files: closed forms for the kinds of surfaces and loops, assemblies, units, colours.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/step_text.rs"]
mod step_text;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use patchwright::io::{Opened, Severity};
use patchwright::kernel::geom::trim::SurfaceKind;
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::area::area;
use patchwright::model::document::Unit;
use patchwright::model::topology::{Meets, edges};
use step_text::{File, O, X, Z, frustum};

fn areas(opened: &Opened) -> Vec<f64> {
    opened.document.sheets().map(|(_, s)| area(&s)).collect()
}

fn agree(found: &[f64], exact: &[f64]) -> bool {
    found.len() == exact.len() && found.iter().zip(exact).all(|(a, b)| (a - b).abs() <= 2e-4 * b)
}

#[test]
fn a_frustum_in_degrees_is_closed_whichever_way_its_loops_are_written() {
    for turned in [false, true] {
        let mut file = File { bound_sense: turned, ..File::default() };
        let faces = frustum(&mut file);
        let shell = file.shell(&faces);
        let solid = file.add(format!("MANIFOLD_SOLID_BREP('Frustum',#{shell})"));
        let rgb = file.add("COLOUR_RGB('',1.,0.5,0.)");
        let fill = file.add(format!("FILL_AREA_STYLE_COLOUR('',#{rgb})"));
        let fill = file.add(format!("FILL_AREA_STYLE('',(#{fill}))"));
        let fill = file.add(format!("SURFACE_STYLE_FILL_AREA(#{fill})"));
        let side = file.add(format!("SURFACE_SIDE_STYLE('',(#{fill}))"));
        let usage = file.add(format!("SURFACE_STYLE_USAGE(.BOTH.,#{side})"));
        let style = file.add(format!("PRESENTATION_STYLE_ASSIGNMENT((#{usage}))"));
        file.add(format!("STYLED_ITEM('',(#{style}),#{solid})"));
        let blue = file.add("DRAUGHTING_PRE_DEFINED_COLOUR('blue')");
        let blue = file.add(format!("FILL_AREA_STYLE_COLOUR('',#{blue})"));
        file.add(format!("OVER_RIDING_STYLED_ITEM('',(#{blue}),#{},$)", faces[2]));
        file.shape(&[solid]);
        let opened = file.read();
        let found = areas(&opened);
        assert!(agree(&found, &[PI * 3.0 * 2f64.sqrt(), PI, 4.0 * PI]), "{turned}: {found:?}");
        let kinds: Vec<SurfaceKind> = opened.document.faces().map(|(_, f)| f.kind).collect();
        assert_eq!(kinds, [SurfaceKind::Cone, SurfaceKind::Plane, SurfaceKind::Plane]);
        assert!(edges(&opened.document, 1e-6, &Job::new()).iter().all(|e| e.meets == Meets::Shared { gap: 0.0 }));
        let e = opened.document.entities();
        assert_eq!((e[0].name.as_str(), opened.document.unit), ("Frustum", Unit::Millimetre));
        assert!(e[0].color.is_some_and(|c| c[0] == 1.0 && (c[1] - 0.214).abs() < 1e-3), "{:?}", e[0].color);
        assert_eq!(e[2].color, Some([0.0, 0.0, 1.0]), "a face's own colour goes before its solid's");
        assert_eq!(opened.report.count(Severity::Warning) + opened.report.count(Severity::Skipped), 0);
    }
}

#[test]
fn spheres_and_tori_with_and_without_seams() {
    let mut file = File::default();
    let f = file.frame(O, Z, X);
    let sphere = file.add(format!("SPHERICAL_SURFACE('',#{f},1.)"));
    // A whole sphere along a seam; a cap; the rest of it; a whole sphere with nothing but a vertex.
    let (south, north) = (file.vertex([0.0, 0.0, -1.0]), file.vertex(Z));
    let meridian = file.circle(O, [0.0, -1.0, 0.0], X, 1.0);
    let seam = file.edge(south, north, meridian);
    let whole = file.bound(&[(seam, true), (seam, false)]);
    let rim = file.circle([0.0, 0.0, 0.6], Z, X, 0.8);
    let v = file.vertex([0.8, 0.0, 0.6]);
    let rim = file.edge(v, v, rim);
    let (cap, rest) = (file.bound(&[(rim, true)]), file.bound(&[(rim, false)]));
    let bare = file.add(format!("VERTEX_LOOP('',#{south})"));
    let bare = file.add(format!("FACE_BOUND('',#{bare},.T.)"));
    let torus = file.add(format!("TOROIDAL_SURFACE('',#{f},3.,1.)"));
    // A half of a torus between two tubes.
    let tubes = [1.0, -1.0].map(|s| {
        let c = file.circle([3.0 * s, 0.0, 0.0], [0.0, -s, 0.0], [s, 0.0, 0.0], 1.0);
        let v = file.vertex([4.0 * s, 0.0, 0.0]);
        file.edge(v, v, c)
    });
    let half = [file.bound(&[(tubes[0], false)]), file.bound(&[(tubes[1], true)])];
    let faces = [
        file.face(sphere, &[whole], true),
        file.face(sphere, &[cap], true),
        file.face(sphere, &[rest], true),
        file.face(sphere, &[bare], true),
        file.face(torus, &half, true),
    ];
    let shell = file.shell(&faces);
    file.shape(&[shell]);
    let found = areas(&file.read());
    let exact = [4.0 * PI, TAU * 0.4, TAU * 1.6, 4.0 * PI, 6.0 * PI * PI];
    assert!(agree(&found, &exact), "{found:?} {exact:?}");
}

#[test]
fn swept_offset_and_bounded_surfaces() {
    let mut file = File::default();
    let f = file.frame(O, Z, X);
    let circle = file.add(format!("CIRCLE('',#{f},1.)"));
    let up = file.direction(Z);
    let up = file.add(format!("VECTOR('',#{up},1.)"));
    let extruded = file.add(format!("SURFACE_OF_LINEAR_EXTRUSION('',#{circle},#{up})"));
    // Half of a cylinder of radius 1 and height 2.
    let at = |a: f64, z: f64| [a.cos(), a.sin(), z];
    let corners = [at(0.0, 0.0), at(PI, 0.0), at(PI, 2.0), at(0.0, 2.0)];
    let v = corners.map(|p| file.vertex(p));
    let arcs = [file.circle(O, Z, X, 1.0), file.circle([0.0, 0.0, 2.0], Z, X, 1.0)];
    let sides = [file.line(corners[1], corners[2]), file.line(corners[0], corners[3])];
    let e = [
        file.edge(v[0], v[1], arcs[0]),
        file.edge(v[1], v[2], sides[0]),
        file.edge(v[3], v[2], arcs[1]),
        file.edge(v[0], v[3], sides[1]),
    ];
    let ring = [(e[0], true), (e[1], true), (e[2], false), (e[3], false)];
    let bounds = [file.bound(&ring), file.bound(&ring)];
    // The same by turning a line about the axis, and by going 1 out from a cylinder of radius 2 that faces inwards.
    let line = file.line(X, [1.0, 0.0, 1.0]);
    let (o, z) = (file.point(O), file.direction(Z));
    let axis = file.add(format!("AXIS1_PLACEMENT('',#{o},#{z})"));
    let turned = file.add(format!("SURFACE_OF_REVOLUTION('',#{line},#{axis})"));
    let wide = file.add(format!("CYLINDRICAL_SURFACE('',#{f},2.)"));
    let offset = file.add(format!("OFFSET_SURFACE('',#{wide},-1.,.F.)"));
    let third = file.bound(&ring);
    let faces = [
        file.face(extruded, &[bounds[0]], true),
        file.face(turned, &[bounds[1]], true),
        file.face(offset, &[third], true),
    ];
    // A rectangle of a cylinder, in degrees, and a triangle on a plane without a topology.
    let patch = file.add(format!("RECTANGULAR_TRIMMED_SURFACE('',#{wide},30.,75.,1.,4.,.T.,.T.)"));
    let plane = file.add(format!("PLANE('',#{f})"));
    let corners = [O, [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let pieces: Vec<String> = (0..3)
        .map(|k| {
            let points = [file.point(corners[k]), file.point(corners[(k + 1) % 3])];
            let line = file.add(format!("POLYLINE('',(#{},#{}))", points[0], points[1]));
            format!("#{}", file.add(format!("COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{line})")))
        })
        .collect();
    let boundary = file.add(format!("OUTER_BOUNDARY_CURVE('',({}),.F.)", pieces.join(",")));
    let bounded = file.add(format!("CURVE_BOUNDED_SURFACE('',#{plane},(#{boundary}),.F.)"));
    let shell = file.shell(&faces);
    file.shape(&[shell, patch, bounded]);
    let opened = file.read();
    let found = areas(&opened);
    let exact = [TAU, TAU, TAU, 2.0 * FRAC_PI_2 / 2.0 * 3.0, 6.0];
    assert!(agree(&found, &exact), "{found:?} {exact:?}");
    assert_eq!(opened.document.faces().count(), 4);
    assert_eq!(opened.report.count(Severity::Warning) + opened.report.count(Severity::Skipped), 0);
}

#[test]
fn conics_that_go_on_for_ever_are_bounded_by_their_vertices() {
    let mut file = File::default();
    let f = file.frame(O, Z, X);
    let parabola = file.add(format!("PARABOLA('',#{f},0.5)"));
    let hyperbola = file.add(format!("HYPERBOLA('',#{f},1.,1.)"));
    let (t0, t1) = (-1.0f64, 2.0f64);
    let p = [t0, t1].map(|t| file.point([0.5 * t * t, t, 0.0]));
    let h = [t0, t1].map(|t| file.point([t.cosh(), t.sinh(), 0.0]));
    let a = file.add(format!("TRIMMED_CURVE('',#{parabola},(#{}),(#{}),.T.,.CARTESIAN.)", p[0], p[1]));
    let b = file.add(format!("TRIMMED_CURVE('',#{hyperbola},(#{}),(#{}),.F.,.CARTESIAN.)", h[1], h[0]));
    let circle = file.add(format!("CIRCLE('',#{f},2.)"));
    let c =
        file.add(format!("TRIMMED_CURVE('',#{circle},(PARAMETER_VALUE(30.)),(PARAMETER_VALUE(120.)),.T.,.PARAMETER.)"));
    let set = file.add(format!("GEOMETRIC_CURVE_SET('',(#{a},#{b},#{c}))"));
    file.shape(&[set]);
    let opened = file.read();
    let curves: Vec<_> = opened.document.curves().map(|(_, c)| c.as_ref().clone()).collect();
    assert_eq!(curves.len(), 3);
    for (_, p) in curves[0].sampled(10) {
        assert!((p.y * p.y - 2.0 * p.x).abs() < 1e-12);
    }
    for (_, p) in curves[1].sampled(10) {
        assert!((p.x * p.x - p.y * p.y - 1.0).abs() < 1e-12);
    }
    assert!(curves[1].ends()[0].y > 3.0, "from the second point to the first");
    let [start, end] = curves[2].ends();
    assert!((start.y - 1.0).abs() < 1e-12 && (end.x + 1.0).abs() < 1e-12, "30 and 120 degrees: {start} {end}");
}

#[test]
fn parts_of_an_assembly_stand_at_their_places_with_their_names() {
    let mut file = File::default();
    let faces = frustum(&mut file);
    let shell = file.shell(&faces);
    let part = file.shape(&[shell]);
    let product = file.add("PRODUCT('id','Cup','',())");
    let formation = file.add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
    let definition = file.add(format!("PRODUCT_DEFINITION('','',#{formation},$)"));
    let shape = file.add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
    file.add(format!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{part})"));
    let origin = file.frame(O, Z, X);
    let places = [[0.0, 0.0, 10.0], [0.0, 0.0, 20.0]].map(|p| file.frame(p, Z, X));
    let context = file.context();
    let whole = file.add(format!("SHAPE_REPRESENTATION('',(#{origin},#{},#{}),#{context})", places[0], places[1]));
    for place in places {
        let map = file.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{origin},#{place})"));
        file.add(format!(
            "(REPRESENTATION_RELATIONSHIP('','',#{part},#{whole})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{map})\
             SHAPE_REPRESENTATION_RELATIONSHIP())"
        ));
    }
    let opened = file.read();
    assert_eq!(opened.document.faces().count(), 6);
    assert!(opened.document.entities().iter().all(|e| e.name == "Cup"));
    let b = opened.document.faces().fold(patchwright::kernel::geom::Aabb::EMPTY, |b, (_, f)| b.union(&f.bounds()));
    assert!(b.min.z > 9.9 && b.min.z < 10.1 && b.max.z > 20.9 && b.max.z < 21.1, "{b:?}");
    // Two places do not share edges with one another.
    assert!(edges(&opened.document, 1e-6, &Job::new()).iter().all(|e| e.by_file && e.with.len() <= 1));
}

#[test]
fn a_bad_statement_loses_that_statement_only() {
    let mut file = File::default();
    let faces = frustum(&mut file);
    let shell = file.shell(&faces);
    file.shape(&[shell]);
    let mut lost = 0;
    for k in 0..file.lines.len() {
        let mut broken = File { lines: file.lines.clone(), ..File::default() };
        broken.lines[k] = format!("#{}=WRONG((;", k + 1);
        let opened = broken.read();
        assert!(!opened.report.lines.is_empty());
        lost += usize::from(opened.document.entities().is_empty());
    }
    // Only the shell and the representation hold everything.
    assert!(lost <= 2, "{lost}");
}
