//! Reading and writing IGES: closed forms for every entity, what real files contain, and the way out and back.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/iges_text.rs"]
mod iges_text;

use std::time::SystemTime;

use glam::{DVec2, DVec3};
use iges_text::{Entity, File, bilinear, shared_files, square};
use patchwright::io::iges::{self, IgesOptions};
use patchwright::io::{Opened, Severity};
use patchwright::kernel::geom::{Curve, Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};

fn read(file: &File) -> Opened {
    iges::read(file.text().as_bytes()).unwrap()
}

fn surface(opened: &Opened, number: usize) -> &Surface {
    opened.document.surfaces().nth(number).unwrap().1
}

fn curve(opened: &Opened, number: usize) -> &Curve {
    opened.document.curves().nth(number).unwrap().1
}

fn written(document: &Document) -> String {
    let options = IgesOptions { file_name: "out.igs".into(), time: SystemTime::UNIX_EPOCH };
    iges::write(document, &options).unwrap().0
}

/// Everything that must survive the way out and back, numbers as bits.
fn fingerprint(document: &Document) -> Vec<String> {
    let bits = |values: &[f64]| values.iter().map(|v| format!("{:x}", v.to_bits())).collect::<Vec<_>>().join(" ");
    let points = |points: &[DVec3]| bits(&points.iter().flat_map(DVec3::to_array).collect::<Vec<_>>());
    let weights = |weights: Option<&[f64]>| weights.map_or("none".into(), bits);
    let entity = |e: &std::sync::Arc<patchwright::model::document::Entity>| {
        let shape = match (e.surface(), e.curve()) {
            (Some(s), _) => {
                let knots: Vec<String> = s.knots().iter().map(|k| bits(k.values())).collect();
                format!("surface {knots:?} {} {}", points(s.points()), weights(s.weights()))
            }
            (_, Some(c)) => format!("{} {} {}", bits(c.knots().values()), points(c.points()), weights(c.weights())),
            _ => unreachable!(),
        };
        format!("{} {} {:?} {shape}", e.name, e.visible, e.color.map(|c| c.map(f32::to_bits)))
    };
    std::iter::once(format!("{:?}", document.unit)).chain(document.entities().iter().map(entity)).collect()
}

#[test]
fn every_shared_file_survives_the_way_out_and_back_bit_for_bit() {
    for path in shared_files("models", "igs").into_iter().chain(shared_files("cases", "igs")) {
        let first = iges::read(&std::fs::read(&path).unwrap()).unwrap();
        let text = written(&first.document);
        let second = iges::read(text.as_bytes()).unwrap();
        assert_eq!(fingerprint(&first.document), fingerprint(&second.document), "{}", path.display());
        // Curves that bound faces are told of; nothing is lost.
        let lost: Vec<_> = second.report.lines.iter().filter(|l| l.severity > Severity::Info).collect();
        assert!(lost.is_empty(), "{lost:?}");
        // Parameter curves of faces are put onto their surface anew when they are read.
        if first.document.faces().next().is_none() {
            assert_eq!(text, written(&second.document));
        }
    }
}

/// Counts taken from the directory sections of the files by another program.
#[test]
fn real_models_open_with_every_entity_accounted_for() {
    let expected = [
        ("hyrban_headlamp_L", 80, Unit::Millimetre),
        ("hyrban_rear_screen", 66, Unit::Millimetre),
        ("igesio_input", 7, Unit::Millimetre),
        ("pocc_surf114", 4, Unit::Inch),
        ("tigl_D150_wing", 8, Unit::Millimetre),
    ];
    for path in shared_files("models", "igs") {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let opened = iges::read(&std::fs::read(&path).unwrap()).unwrap();
        let (_, surfaces, unit) = *expected.iter().find(|e| e.0 == name).unwrap();
        assert_eq!((opened.report.surfaces, opened.document.unit), (surfaces, unit), "{name}");
        assert_eq!(opened.document.curves().count(), 0, "{name} has trimming curves only");
        // Geometry, attributes and lines of the report together are all entities of the file.
        let attributes: usize =
            ["IGES 124", "IGES 314"].iter().map(|k| opened.report.found.get(*k).copied().unwrap_or(0)).sum();
        let names = opened.report.found.get("IGES 406").copied().unwrap_or(0);
        let mut entries: Vec<usize> = opened.report.lines.iter().filter_map(|l| l.at).collect();
        entries.sort_unstable();
        entries.dedup();
        let total: usize = opened.report.found.values().sum();
        let told = entries.len() + opened.document.entities().len() + attributes + names;
        assert!(told >= total, "{name}: {told} of {total} entities are accounted for");
    }
}

#[test]
fn parametric_splines_equal_their_polynomials() {
    // A polynomial of degree 3 in each variable, cut into 3 x 2 patches by Taylor expansion at their corners.
    let f = |u: f64, v: f64| DVec3::new(u - 0.5 * v * v, v + u * u * v, u * u * u - 2.0 * u * v * v * v + 0.25);
    let (tu, tv) = ([-1.0, 0.0, 0.5, 2.0], [1.0, 1.5, 3.0]);
    let mut parameters = format!("3,1,3,2,{:?},{:?}", tu, tv).replace(['[', ']', ' '], "");
    for i in 0..4 {
        for j in 0..3 {
            for axis in 0..3 {
                for b in 0..4 {
                    for a in 0..4 {
                        // The last row and column of patches hold arbitrary values.
                        let value = if i < 3 && j < 2 { taylor(axis, a, b, tu[i], tv[j]) } else { 77.0 };
                        parameters.push_str(&format!(",{value:?}"));
                    }
                }
            }
        }
    }
    let mut file = File::default();
    file.add(114, parameters);
    let opened = read(&file);
    assert!(opened.report.lines.is_empty(), "{:?}", opened.report.lines);
    let surface = surface(&opened, 0);
    assert_eq!(surface.domain(), [[-1.0, 2.0], [1.0, 3.0]]);
    for i in 0..=30 {
        for j in 0..=30 {
            let (u, v) = (-1.0 + 0.1 * f64::from(i), 1.0 + 2.0 / 30.0 * f64::from(j));
            assert!(surface.eval(DVec2::new(u, v)).distance(f(u, v)) < 1e-13 * 60.0, "{u} {v}");
        }
    }
}

/// The coefficient of s^a t^b of `f` of the test above, at (u, v).
fn taylor(axis: usize, a: usize, b: usize, u: f64, v: f64) -> f64 {
    match (axis, a, b) {
        (0, 0, 0) => u - 0.5 * v * v,
        (0, 1, 0) => 1.0,
        (0, 0, 1) => -v,
        (0, 0, 2) => -0.5,
        (1, 0, 0) => v + u * u * v,
        (1, 1, 0) => 2.0 * u * v,
        (1, 2, 0) => v,
        (1, 0, 1) => 1.0 + u * u,
        (1, 1, 1) => 2.0 * u,
        (1, 2, 1) => 1.0,
        (2, 0, 0) => u * u * u - 2.0 * u * v * v * v + 0.25,
        (2, 1, 0) => 3.0 * u * u - 2.0 * v * v * v,
        (2, 2, 0) => 3.0 * u,
        (2, 3, 0) => 1.0,
        (2, 0, 1) => -6.0 * u * v * v,
        (2, 1, 1) => -6.0 * v * v,
        (2, 0, 2) => -6.0 * u * v,
        (2, 1, 2) => -6.0 * v,
        (2, 0, 3) => -2.0 * u,
        (2, 1, 3) => -2.0,
        _ => 0.0,
    }
}

#[test]
fn parametric_curves_equal_their_polynomials_and_split_where_they_jump() {
    // (u, u^2, u^3) over 0..1..3, then the same moved by 5 over 3..4.
    let piece = |at: f64, shift: f64| {
        let z = [at * at * at, 3.0 * at * at, 3.0 * at, 1.0];
        format!(
            "{:?},1.,0.,0.,{:?},{:?},1.,0.,{:?},{:?},{:?},{:?}",
            at + shift,
            at * at,
            2.0 * at,
            z[0],
            z[1],
            z[2],
            z[3]
        )
    };
    let mut file = File::default();
    let pieces = [piece(0.0, 0.0), piece(1.0, 0.0), piece(3.0, 5.0)].join(",");
    file.add(112, format!("3,2,3,3,0.,1.,3.,4.,{pieces},{}", ["0."; 12].join(",")));
    let opened = read(&file);
    assert_eq!(opened.document.curves().count(), 2);
    assert_eq!(opened.report.count(Severity::Warning), 1);
    for (number, t, shift) in [(0, 0.25, 0.0), (0, 1.0, 0.0), (0, 2.9, 0.0), (1, 3.5, 5.0)] {
        let expected = DVec3::new(t + shift, t * t, t * t * t);
        assert!(curve(&opened, number).eval(t).distance(expected) < 1e-13, "{t}");
    }
}

#[test]
fn lines_arcs_and_composites_take_their_places() {
    let mut file = File::default();
    // A quarter turn about z, then (outer) a shift by (10, 0, 0): nested transforms, the inner one first.
    let outer = file.add(124, "1.,0.,0.,10.,0.,1.,0.,0.,0.,0.,1.,0.");
    let turn = "0.,-1.,0.,0.,1.,0.,0.,0.,0.,0.,1.,0.".to_owned();
    let inner = file.add_entity(Entity { kind: 124, transform: outer, parameters: turn, ..Entity::default() });
    let at =
        |kind, parameters: &str| Entity { kind, transform: inner, parameters: parameters.into(), ..Entity::default() };
    file.add_entity(at(110, "1.,2.,3.,4.,5.,6."));
    file.add_entity(at(100, "5.,0.,0.,2.,0.,0.,2."));
    let a = file.add(110, "0.,0.,0.,1.,0.,0.");
    let b = file.add_entity(at(110, "0.,-10.,0.,0.,-9.,0.")); // moved to (20,0,0)..(19,0,0): meets nothing
    file.add(102, format!("2,{a},{b}"));
    let opened = read(&file);
    assert_eq!(curve(&opened, 0).ends(), [DVec3::new(8.0, 1.0, 3.0), DVec3::new(5.0, 4.0, 6.0)]);
    let arc = curve(&opened, 1);
    assert_eq!(arc.ends(), [DVec3::new(10.0, 2.0, 5.0), DVec3::new(8.0, 0.0, 5.0)]);
    let [start, end] = arc.domain();
    for i in 0..=20 {
        let p = arc.eval(start + (end - start) * f64::from(i) / 20.0);
        assert!((p.distance(DVec3::new(10.0, 0.0, 5.0)) - 2.0).abs() < 1e-14);
    }
    assert_eq!(opened.document.curves().count(), 4, "two of the composite, which do not meet");
    assert_eq!(curve(&opened, 3).ends(), [DVec3::new(20.0, 0.0, 0.0), DVec3::new(19.0, 0.0, 0.0)]);
}

#[test]
fn swept_surfaces_are_exact() {
    let mut file = File::default();
    let axis = file.add(110, "1.,0.,0.,1.,0.,5.");
    let generatrix = file.add(110, "3.,0.,0.,2.,0.,4.");
    file.add(120, format!("{axis},{generatrix},0.,1.5"));
    let arc = file.add(100, "0.,0.,0.,2.,0.,0.,2.");
    file.add(122, format!("{arc},2.,1.,3."));
    let opened = read(&file);
    assert_eq!((opened.report.surfaces, opened.report.curves), (2, 0));
    let (cone, cylinder) = (surface(&opened, 0), surface(&opened, 1));
    let [u, v] = cone.domain();
    assert_eq!(v, [0.0, 1.5]);
    for i in 0..=10 {
        for j in 0..=10 {
            let (a, b) = (f64::from(i) / 10.0, f64::from(j) / 10.0);
            let p = cone.eval(DVec2::new(u[0] + (u[1] - u[0]) * a, 1.5 * b));
            assert!(((p - DVec3::X).truncate().length() - (2.0 - p.z / 4.0)).abs() < 1e-14);
            let [c, d] = cylinder.domain();
            let p = cylinder.eval(DVec2::new(c[0] + (c[1] - c[0]) * a, d[0] + (d[1] - d[0]) * b));
            assert!((DVec2::new(p.x, p.y - p.z / 3.0).length() - 2.0).abs() < 1e-14);
        }
    }
}

#[test]
fn a_transform_that_leads_nowhere_is_reported_and_the_entity_kept() {
    let mut file = File::default();
    let identity = || "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.".to_owned();
    file.add_entity(Entity { kind: 124, transform: 3, parameters: identity(), ..Entity::default() });
    file.add_entity(Entity { kind: 124, transform: 1, parameters: identity(), ..Entity::default() });
    for transform in [1, 3, 99, 5] {
        file.add_entity(Entity { kind: 128, transform, parameters: square(0.0), ..Entity::default() });
    }
    let opened = read(&file);
    assert_eq!(opened.report.surfaces, 4);
    assert_eq!(opened.report.count(Severity::Warning), 4);
    assert!(opened.report.lines[0].reason.contains("leads back to itself"), "{}", opened.report.lines[0]);
    assert!(opened.report.lines[2].reason.contains("99 does not exist"), "{}", opened.report.lines[2]);
    assert!(opened.report.lines[3].reason.contains("type 128"), "{}", opened.report.lines[3]);
}

#[test]
fn units_and_scale_are_those_of_the_header() {
    for (unit, scale, expected, width) in [
        ("1,2HIN", "1.", Unit::Inch, 1.0),
        ("4,2HFT", "", Unit::Foot, 1.0),
        ("6,1HM", "0.5", Unit::Metre, 2.0),
        ("3,2HCM", "1.", Unit::Centimetre, 1.0),
    ] {
        let mut file = File::with_unit(unit, scale);
        file.add(128, square(0.0));
        let opened = read(&file);
        assert_eq!(opened.document.unit, expected);
        assert_eq!(surface(&opened, 0).bounds().size().x, width);
        assert_eq!(opened.report.lines.is_empty(), width == 1.0);
    }
}

#[test]
fn other_delimiters_line_ends_exponents_and_column_65_are_read() {
    let mut plain = File::default();
    let numbers = "2,2,0,0,1,0,0.,0.,0.,1.,1.,1.,1.,1.,1.,1.25D-01,+2.5E+00,-.5,1.0E2,.25,3D0,7.,8.,9.,0.,1.,0.,0.,1.";
    plain.add(126, numbers);
    plain.add(128, square(0.125));
    let expected = fingerprint(&read(&plain).document);
    let other = File { value_delimiter: '/', record_delimiter: '#', ..plain.clone() };
    let wide = File { width: 65, ..plain.clone() };
    let crlf = File { line_end: "\r\n", ..plain.clone() };
    let cr = File { line_end: "\r", ..plain.clone() };
    let none = File { line_end: "", ..plain.clone() };
    for file in [other, wide, crlf, cr, none] {
        let opened = read(&file);
        assert_eq!(fingerprint(&opened.document), expected, "{:?}", file.line_end);
        assert!(opened.report.lines.is_empty());
    }
    let p = curve(&read(&plain), 0).points().to_vec();
    assert_eq!(p[0], DVec3::new(0.125, 2.5, -0.5));
    assert_eq!(p[1], DVec3::new(100.0, 0.25, 3.0));
}

#[test]
fn parameter_data_is_found_by_its_owner_where_the_directory_points_elsewhere() {
    let mut file = File::default();
    file.add(128, square(1.0));
    file.add(128, square(2.0));
    let text = file.text();
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().position(|l| l.as_bytes()[72] == b'P').unwrap();
    let middle = first + (lines.len() - 1 - first) / 2;
    let swapped: Vec<&str> = [&lines[..first], &lines[middle..lines.len() - 1], &lines[first..middle]].concat();
    let opened = iges::read((swapped.join("\n") + "\n").as_bytes()).unwrap();
    assert_eq!(surface(&opened, 0).points()[0].z, 1.0);
    assert_eq!(surface(&opened, 1).points()[0].z, 2.0);
}

#[test]
fn names_colours_and_visibility_are_taken_over() {
    let mut file = File::default();
    let name = file.add_entity(Entity { kind: 406, form: 15, parameters: "1,4HHood".into(), ..Entity::default() });
    let color = file.add(314, "100.,50.,0.,6Horange");
    let named = Entity {
        kind: 128,
        color: -(color as i64),
        parameters: format!("{},0,1,{name}", square(0.0)),
        ..Entity::default()
    };
    file.add_entity(named);
    file.add_entity(Entity { kind: 128, color: 3, label: "DOOR", parameters: square(1.0), ..Entity::default() });
    file.add_entity(Entity { kind: 128, status: Some("01000000"), parameters: square(2.0), ..Entity::default() });
    let opened = read(&file);
    let e = opened.document.entities();
    assert_eq!([&e[0].name, &e[1].name, &e[2].name], ["Hood", "DOOR", "Surface 2"]);
    assert_eq!([e[0].visible, e[1].visible, e[2].visible], [true, true, false]);
    assert_eq!(e[1].color, Some([0.0, 1.0, 0.0]));
    let [r, g, b] = e[0].color.unwrap();
    assert!(r == 1.0 && b == 0.0 && (g - 0.214).abs() < 1e-3, "half of the display range is 0.214 linear");
}

#[test]
fn a_file_with_everything_hidden_opens_visible_and_says_so() {
    let mut file = File::default();
    for z in [0.0, 1.0] {
        file.add_entity(Entity { kind: 128, status: Some("01010000"), parameters: square(z), ..Entity::default() });
    }
    let opened = read(&file);
    assert!(opened.document.entities().iter().all(|e| e.visible));
    assert_eq!(opened.report.count(Severity::Warning), 1);
}

#[test]
fn faces_open_as_their_surfaces_and_trimming_curves_are_no_free_curves() {
    let mut file = File::default();
    let s =
        file.add_entity(Entity { kind: 128, status: Some("01010000"), parameters: square(0.0), ..Entity::default() });
    let uv = file.add_entity(Entity {
        kind: 110,
        status: Some("00010500"),
        parameters: "0.,0.,0.,1.,0.,0.".into(),
        ..Entity::default()
    });
    let line = file.add_entity(Entity {
        kind: 110,
        status: Some("00010000"),
        parameters: "0.,0.,0.,1.,0.,0.".into(),
        ..Entity::default()
    });
    let on = file.add(142, format!("0,{s},{uv},{line},3"));
    let shift = file.add(124, "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,7.");
    file.add(144, format!("{s},1,0,{on}"));
    file.add_entity(Entity { kind: 144, transform: shift, parameters: format!("{s},1,0,{on}"), ..Entity::default() });
    file.add(110, "0.,0.,0.,1.,1.,1.");
    // A curve of an owner that is not read is not the model's either.
    file.add_entity(Entity {
        kind: 110,
        status: Some("00010000"),
        parameters: "0.,0.,0.,1.,0.,0.".into(),
        ..Entity::default()
    });
    let opened = read(&file);
    assert_eq!((opened.report.surfaces, opened.report.curves), (2, 1), "one surface at two places, one free curve");
    assert_eq!(surface(&opened, 1).points()[0].z, 7.0);
    assert!(opened.document.entities().iter().all(|e| e.visible), "the faces are not hidden, only their surface is");
    // A loop of one line bounds nothing.
    assert_eq!(opened.report.lines.iter().filter(|l| l.reason.contains("opened as its whole surface")).count(), 2);
    assert_eq!(opened.report.count(Severity::Skipped), 1);
}

#[test]
fn stated_parameter_ranges_cut_curves_and_surfaces() {
    let mut file = File::default();
    file.add(126, "1,1,0,0,1,0,0.,0.,4.,4.,1.,1.,0.,0.,0.,8.,0.,0.,1.,2.,0.,0.,1.");
    let whole = bilinear([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]]);
    file.add(128, whole.strip_suffix("0.,1.,0.,1.").unwrap().to_owned() + "0.25,0.5,0.,1.");
    let opened = read(&file);
    assert_eq!(curve(&opened, 0).ends(), [DVec3::new(2.0, 0.0, 0.0), DVec3::new(4.0, 0.0, 0.0)]);
    assert_eq!(surface(&opened, 0).domain(), [[0.25, 0.5], [0.0, 1.0]]);
    assert_eq!(surface(&opened, 0).eval(DVec2::new(0.5, 1.0)), DVec3::new(0.5, 1.0, 0.5));
    assert_eq!(opened.report.count(Severity::Warning), 2);
}

#[test]
fn written_files_keep_to_the_columns() {
    let mut document = Document::new(Unit::Foot);
    let knots = |degree| Knots::clamped(degree, &[0.0, 1.0 / 3.0, 1.0], 2).unwrap();
    let (u, v) = (knots(3), knots(2));
    let count = u.control_count() * v.control_count();
    let points = (0..count).map(|i| DVec3::new((i as f64).sqrt(), -1e-17 * i as f64, 1e22 / (i + 1) as f64)).collect();
    let weights = Some((1..=count).map(|i| (i as f64).ln_1p()).collect());
    let s = Surface::new(u, v, points, weights).unwrap();
    let id = document.add(
        "a long name; with, delimiters ".repeat(5).trim(),
        Shape::Surface(s.into()),
        Some([0.2, 0.3, 0.4]),
    );
    document.edit(id, |e| e.visible = false);
    let c = Curve::segment(DVec3::ZERO, DVec3::splat(1.0 / 7.0)).unwrap();
    document.add("c", Shape::Curve(c.into()), Some([0.2, 0.3, 0.4]));
    let text = written(&document);
    let mut counts = std::collections::BTreeMap::<char, usize>::new();
    for line in text.lines() {
        assert_eq!(line.len(), 80, "{line}");
        let letter = line.as_bytes()[72] as char;
        let number: usize = line[73..].trim().parse().unwrap();
        let count = counts.entry(letter).or_default();
        *count += 1;
        assert_eq!(number, *count, "{line}");
        if letter == 'P' {
            assert_eq!(&line[64..65], " ");
            assert!(line[65..72].trim().parse::<usize>().unwrap() % 2 == 1);
        }
    }
    let last = text.lines().last().unwrap();
    assert!(last.starts_with(&format!("S{:7}G{:7}D{:7}P{:7}", 1, counts[&'G'], counts[&'D'], counts[&'P'])), "{last}");
    let back = iges::read(text.as_bytes()).unwrap();
    assert!(back.report.lines.is_empty(), "{:?}", back.report.lines);
    assert_eq!(fingerprint(&back.document), fingerprint(&document));
}

#[test]
fn polynomial_surfaces_are_written_as_such_and_unclamped_knots_clamped() {
    let knots = Knots::new(2, vec![-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
    let points: Vec<DVec3> =
        (0..16).map(|i| DVec3::new(f64::from(i % 4), f64::from(i / 4), f64::from(i * i % 7))).collect();
    let s = Surface::new(knots.clone(), knots, points, None).unwrap();
    let mut document = Document::default();
    document.add("s", Shape::Surface(s.clone().into()), None);
    let text = written(&document);
    let record: String = text.lines().filter(|l| l.as_bytes()[72] == b'P').map(|l| l[..64].trim_end()).collect();
    let record = &record[record.find("128,").unwrap()..];
    let values: Vec<&str> = record.split(',').collect();
    assert_eq!(values[..10], ["128", "3", "3", "2", "2", "0", "0", "1", "0", "0"]);
    assert_eq!(values[10..17], ["0.", "0.", "0.", "1.", "2.", "2.", "2."]);
    assert!(values[24..40].iter().all(|w| *w == "1."));
    let back = iges::read(text.as_bytes()).unwrap();
    for i in 0..=20 {
        for j in 0..=20 {
            let uv = DVec2::new(0.1 * f64::from(i), 0.1 * f64::from(j));
            assert!(surface(&back, 0).eval(uv).distance(s.eval(uv)) < 1e-14);
        }
    }
}

#[test]
fn offset_curves_are_as_far_off_as_they_say_and_on_their_side() {
    let mut file = File::default();
    let part = |file: &mut File, kind: i64, parameters: &str| {
        let parameters = parameters.to_owned();
        file.add_entity(Entity { kind, status: Some("00010000"), parameters, ..Entity::default() })
    };
    // A quarter of a circle of radius 2 at z = 1, counter-clockwise: V x T points to its centre.
    let arc = part(&mut file, 100, "1.,0.,0.,2.,0.,0.,2.");
    let line = part(&mut file, 110, "0.,0.,0.,4.,0.,0.");
    // The distance as y of a curve: 1 at parameter 0, 3 at parameter 1.
    let height = part(&mut file, 110, "0.,1.,0.,0.,3.,0.");
    let quarter = std::f64::consts::FRAC_PI_2;
    file.add(130, format!("{arc},1,0,0,0,0.5,0.,0.,0.,0.,0.,1.,0.,{quarter}"));
    file.add(130, format!("{arc},1,0,0,0,0.5,0.,0.,0.,0.,0.,-1.,0.,{quarter}"));
    // Linear in the arc length, linear in the parameter, along a half of the line, by a function.
    file.add(130, format!("{line},2,0,0,1,1.,0.,3.,4.,0.,0.,1.,0.,1."));
    file.add(130, format!("{line},2,0,0,2,1.,0.,3.,1.,0.,0.,1.,0.,1."));
    file.add(130, format!("{line},1,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,0.5"));
    file.add(130, format!("{line},3,{height},2,2,0.,0.,0.,0.,0.,0.,1.,0.,1."));
    let opened = read(&file);
    assert_eq!(opened.report.curves, 6, "{:?}", opened.report.lines);
    for (number, radius) in [(0, 1.5), (1, 2.5)] {
        for (_, p) in curve(&opened, number).sampled(7) {
            assert!((p.truncate().length() - radius).abs() < 1e-6 && (p.z - 1.0).abs() < 1e-12, "{p}");
        }
    }
    for number in [2, 3, 5] {
        for (_, p) in curve(&opened, number).sampled(7) {
            assert!((p.y - (1.0 + 0.5 * p.x)).abs() < 1e-12, "{number}: {p}");
        }
        assert!((curve(&opened, number).ends()[1].x - 4.0).abs() < 1e-12);
    }
    assert_eq!(curve(&opened, 4).ends(), [DVec3::new(0.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0)]);
    // What has no offset has a line in the report.
    let mut file = File::default();
    let line = part(&mut file, 110, "0.,0.,0.,4.,0.,0.");
    let bend = part(&mut file, 106, "1,3,0.,0.,0.,1.,0.,1.,1.");
    file.entities[bend / 2].form = 11;
    for bad in [
        format!("{line},1,0,0,0,1.,0.,0.,0.,1.,0.,0.,0.,1."),
        format!("{line},7,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,1."),
        format!("{line},2,0,0,1,1.,2.,3.,2.,0.,0.,1.,0.,1."),
        format!("{line},3,0,9,1,1.,2.,3.,2.,0.,0.,1.,0.,1."),
        format!("{line},1,0,0,0,1.,0.,0.,0.,0.,0.,1.,5.,6."),
        format!("{bend},1,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,0."),
    ] {
        file.add(130, bad);
    }
    let own = 2 * file.entities.len() + 1;
    file.add(130, format!("{own},1,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,1."));
    let opened = read(&file);
    assert_eq!(opened.report.curves, 0);
    assert_eq!(opened.report.count(Severity::Skipped), 6, "{:?}", opened.report.lines);
    // The one that is its own base only describes an entity.
    assert!(opened.report.lines.iter().any(|l| l.at == Some(own)), "{:?}", opened.report.lines);
}

#[test]
fn ruled_surfaces_join_equal_arc_lengths_or_equal_parameters_by_their_form() {
    // A parabola that starts slowly, and a straight line of even speed above it.
    let uneven = "2,2,0,0,1,0,0.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,0.1,0.,0.,1.,0.,0.,0.,1.";
    for form in [0, 1] {
        let mut file = File::default();
        let parts = [(126, uneven), (110, "0.,0.,1.,1.,0.,1.")].map(|(kind, parameters)| {
            let parameters = parameters.to_owned();
            file.add_entity(Entity { kind, status: Some("00010000"), parameters, ..Entity::default() })
        });
        let parameters = format!("{},{},0,0", parts[0], parts[1]);
        file.add_entity(Entity { kind: 118, form, parameters, ..Entity::default() });
        let opened = read(&file);
        let made = surface(&opened, 0);
        for k in 0..=20 {
            let u = f64::from(k) / 20.0;
            let [low, high] = [0.0, 1.0].map(|v| made.eval(DVec2::new(u, v)));
            let x = 0.2 * u * (1.0 - u) + u * u;
            assert!((low.x - x).abs() < 1e-12, "the curve itself is kept: {low} {x}");
            let above = if form == 0 { x } else { u };
            assert!((high.x - above).abs() < 1e-8, "form {form} at {u}: {high}, expected {above}");
        }
    }
}

#[test]
fn members_of_groups_bear_the_names_of_their_groups() {
    let mut file = File::default();
    let names: Vec<usize> = ["4Hwing", "3Hrib"]
        .iter()
        .map(|n| file.add_entity(Entity { kind: 406, form: 15, parameters: format!("1,{n}"), ..Entity::default() }))
        .collect();
    let s: Vec<usize> = (0..4).map(|k| file.add(128, square(f64::from(k)))).collect();
    let group = |file: &mut File, form, parameters: String| {
        file.add_entity(Entity { kind: 402, form, parameters, ..Entity::default() })
    };
    let rib = group(&mut file, 14, format!("2,{},{},0,1,{}", s[1], s[2], names[1]));
    group(&mut file, 7, format!("2,{},{rib},0,1,{}", s[0], names[0]));
    group(&mut file, 1, format!("2,{},999", s[3]));
    // Two groups that contain one another.
    let next = 2 * file.entities.len() + 1;
    group(&mut file, 15, format!("1,{}", next + 2));
    group(&mut file, 15, format!("1,{next}"));
    let opened = read(&file);
    let found: Vec<&str> = opened.document.entities().iter().map(|e| e.name.as_str()).collect();
    assert_eq!(found, ["wing / Surface 0", "wing / rib / Surface 1", "wing / rib / Surface 2", "Surface 3"]);
    let says = |severity: Severity, part: &str| {
        opened.report.lines.iter().any(|l| l.severity == severity && l.reason.contains(part))
    };
    assert!(says(Severity::Info, "begin with `wing`") && says(Severity::Info, "without a name"));
    assert!(says(Severity::Warning, "1 of its 2 members do not exist"), "{:?}", opened.report.lines);
}
