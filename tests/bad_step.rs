//! Bad STEP files: cut off anywhere, damaged, in circles, unfolding without end, with units that contradict themselves.
//! Opening ends with a document and a report that says what is missing; no panic, no hang, bounded memory.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/fuzzed.rs"]
mod fuzzed;
#[path = "support/peak.rs"]
mod peak;
#[path = "support/step_text.rs"]
mod step_text;

use std::time::Instant;

use fuzzed::checked;
use patchwright::io::{Opened, Severity, step};
use patchwright::model::document::Unit;
use peak::peak;
use step_text::{File, O, X, Z, frustum};

/// Reads STEP and holds it to 30 times the file's size, and a little for the smallest files.
fn read(bytes: &[u8]) -> Opened {
    let (opened, held) = peak(|| step::open(bytes));
    assert!(held <= 30 * bytes.len() + 1_000_000, "{held} bytes for a file of {}", bytes.len());
    checked(&opened);
    opened
}

fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

fn says(opened: &Opened, part: &str) -> bool {
    opened.report.lines.iter().any(|l| l.severity >= Severity::Warning && l.reason.contains(part))
}

/// A cup at two places of an assembly, and a set of curves and surfaces of many kinds beside it.
fn assembly() -> File {
    let mut file = File::default();
    let faces = frustum(&mut file);
    let shell = file.shell(&faces);
    let part = file.shape(&[shell]);
    let origin = file.frame(O, Z, X);
    let places = [[0.0, 0.0, 10.0], [0.0, 0.0, 20.0]].map(|p| file.frame(p, Z, X));
    let (a, b) = (file.point(O), file.point([1.0, 2.0, 3.0]));
    let polyline = file.add(format!("POLYLINE('',(#{a},#{b}))"));
    let circle = file.circle(O, Z, X, 3.0);
    let off = file.direction(Z);
    let offset = file.add(format!("OFFSET_CURVE_3D('',#{circle},1.,.F.,#{off})"));
    let spline = file.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#{a},#{b}),(#{b},#{a})),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)"
    ));
    let set = file.add(format!("GEOMETRIC_SET('',(#{polyline},#{circle},#{offset},#{spline}))"));
    let context = file.context();
    let whole =
        file.add(format!("SHAPE_REPRESENTATION('',(#{origin},#{},#{},#{set}),#{context})", places[0], places[1]));
    for place in places {
        let map = file.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{origin},#{place})"));
        file.add(format!(
            "(REPRESENTATION_RELATIONSHIP('','',#{part},#{whole})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{map})\
             SHAPE_REPRESENTATION_RELATIONSHIP())"
        ));
    }
    file
}

#[test]
fn an_offset_circle_is_a_circle_nearer_to_its_centre() {
    let opened = assembly().read();
    let curves: Vec<_> = opened.document.curves().map(|(_, c)| c.clone()).collect();
    assert_eq!((curves.len(), opened.document.surfaces().count()), (3, 7), "{:?}", opened.report.lines);
    // V x T of a counter-clockwise circle points to its centre.
    assert!(curves[2].sampled(4).iter().all(|(_, p)| (p.length() - 2.0).abs() < 1e-6 && p.z == 0.0));
}

#[test]
fn a_file_cut_off_at_every_percent_opens_as_far_as_it_goes() {
    let text = assembly().text();
    let whole = step::open(text.as_bytes()).document.entities().len();
    for percent in 1..100 {
        let opened = read(&text.as_bytes()[..text.len() * percent / 100]);
        let found = opened.document.entities().len();
        assert!(found <= whole, "{percent} %");
        assert!(found == whole || !opened.report.lines.is_empty(), "{percent} %: what is missing is reported");
    }
}

#[test]
fn flipped_bits_and_bytes_do_no_harm() {
    let text = assembly().text().into_bytes();
    let mut state = 20_261_125;
    for round in 0..120 {
        let mut bad = text.clone();
        for _ in 0..=random(&mut state) % 8 {
            let at = random(&mut state) as usize % bad.len();
            match round % 3 {
                0 => bad[at] ^= 1 << (random(&mut state) % 8),
                1 => bad[at] = b"0123456789,;.#()'$*E-"[random(&mut state) as usize % 21],
                _ => drop(bad.remove(at)),
            }
        }
        read(&bad);
    }
}

#[test]
fn huge_numbers_and_counts_cost_nothing() {
    let file = assembly();
    for claim in ["1000000000", "1e300"] {
        for k in 0..file.lines.len() {
            // Every number of the statement in turn.
            let line = &file.lines[k];
            let equals = line.find('=').unwrap();
            let starts: Vec<usize> = (equals..line.len())
                .filter(|&i| line.as_bytes()[i].is_ascii_digit() && b"(,#".contains(&line.as_bytes()[i - 1]))
                .collect();
            for start in starts {
                let rest = &line[start..];
                let length = rest.find([',', ')']).unwrap_or(rest.len());
                let mut bad = file.clone();
                bad.lines[k] = format!("{}{claim}{}", &line[..start], &line[start + length..]);
                read(bad.text().as_bytes());
            }
        }
    }
}

#[test]
fn references_in_circles_end() {
    let file = assembly();
    // Every reference turned to its own statement, and to the last one.
    for k in 0..file.lines.len() {
        for to in [k + 1, file.lines.len()] {
            let mut bad = file.clone();
            let (number, rest) = file.lines[k].split_once('=').unwrap();
            let mut parts = rest.split('#');
            let mut text = format!("{number}={}", parts.next().unwrap());
            for part in parts {
                let digits = part.bytes().take_while(u8::is_ascii_digit).count();
                text += &format!("#{to}{}", &part[digits..]);
            }
            bad.lines[k] = text;
            // What contains itself may unfold to a fixed size, however small the file.
            let (opened, held) = peak(|| step::open(bad.text().as_bytes()));
            checked(&opened);
            assert!(held < 20_000_000, "{held} bytes");
        }
    }
    // Two assemblies that contain one another, below one that contains both.
    let mut file = File::default();
    let faces = frustum(&mut file);
    let shell = file.shell(&faces);
    let parts = [file.shape(&[shell]), file.shape(&[shell]), file.shape(&[shell])];
    let (a, b) = (file.frame(O, Z, X), file.frame([0.0, 0.0, 1.0], Z, X));
    let map = file.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{a},#{b})"));
    for [child, parent] in [[1, 0], [2, 1], [1, 2], [2, 1]] {
        file.add(format!(
            "(REPRESENTATION_RELATIONSHIP('','',#{},#{})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{map})\
             SHAPE_REPRESENTATION_RELATIONSHIP())",
            parts[child], parts[parent]
        ));
    }
    let start = Instant::now();
    let opened = step::open(file.text().as_bytes());
    checked(&opened);
    assert!(says(&opened, "lead back to themselves"), "{:?}", opened.report.grouped());
    assert!(start.elapsed().as_secs() < 60);
}

#[test]
fn what_unfolds_without_end_is_cut_and_says_so() {
    // A curve of two curves of two curves ..., and sets of sets likewise.
    let mut file = File::default();
    let (a, b) = (file.point(O), file.point(X));
    let mut curve = file.add(format!("POLYLINE('',(#{a},#{b}))"));
    for _ in 0..14 {
        let piece = file.add(format!("COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{curve})"));
        curve = file.add(format!("COMPOSITE_CURVE('',({}),.F.)", vec![format!("#{piece}"); 20].join(",")));
    }
    let mut set = file.add(format!("GEOMETRIC_SET('',(#{curve}))"));
    for _ in 0..12 {
        set = file.add(format!("GEOMETRIC_SET('',({}))", vec![format!("#{set}"); 10].join(",")));
    }
    file.shape(&[set]);
    let (opened, held) = peak(|| step::open(file.text().as_bytes()));
    assert!(says(&opened, "too often"), "{:?}", opened.report.grouped());
    assert!(held < 40_000_000, "{held}");
    // A long list of one large surface.
    let mut file = File::default();
    let points: Vec<String> =
        (0..1600).map(|k| format!("#{}", file.point([f64::from(k / 40), f64::from(k % 40), 0.0]))).collect();
    let rows: Vec<String> = points.chunks(40).map(|row| format!("({})", row.join(","))).collect();
    let knots: Vec<String> = (0..40).map(|k| format!("{k}.")).collect();
    let counts = format!("2{},2", ",1".repeat(38));
    let surface = file.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,({}),.U.,.F.,.F.,.F.,({counts}),({counts}),({knots}),({knots}),.U.)",
        rows.join(","),
        knots = knots.join(",")
    ));
    let set = file.add(format!("GEOMETRIC_SET('',({}))", vec![format!("#{surface}"); 20_000].join(",")));
    file.shape(&[set]);
    let text = file.text();
    let (opened, held) = peak(|| step::open(text.as_bytes()));
    assert!(says(&opened, "too often"), "{:?}", opened.report.grouped());
    assert!(opened.report.surfaces > 10 && held < 100 * text.len(), "{} {held}", opened.report.surfaces);
}

#[test]
fn deep_nesting_is_survived() {
    for (open, close) in [("(", ")"), ("A(", ")"), ("/*", ""), ("'", ""), ("#1=A(", "")] {
        let deep = format!("{}{}", open.repeat(100_000), close.repeat(100_000));
        let text = format!("ISO-10303-21;\nDATA;\n#1=A({deep});\n#2=CARTESIAN_POINT('',(0.,0.,0.));\nENDSEC;\n");
        read(text.as_bytes());
    }
}

/// One triangle in a context with these units.
fn with_units(units: &[&str]) -> Opened {
    let mut file = File::default();
    let corners = [O, X, [0.0, 1.0, 0.0]].map(|p| format!("#{}", file.point(p)));
    let polyline = file.add(format!("POLYLINE('',({}))", corners.join(",")));
    let set = file.add(format!("GEOMETRIC_CURVE_SET('',(#{polyline}))"));
    let list: Vec<String> = units
        .iter()
        .map(|unit| {
            let measure = |value: &str, file: &mut File, base: &str| {
                let base = file.add(format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({base},.METRE.))"));
                file.add(format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#{base})"))
            };
            let number = match *unit {
                "mm" => file.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"),
                "second" => file.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.SECOND.))"),
                "inch" | "inch of a metre" => {
                    let (value, base) = if *unit == "inch" { ("25.4", ".MILLI.") } else { ("1.", "$") };
                    let measure = measure(value, &mut file, base);
                    file.add(format!("(CONVERSION_BASED_UNIT('INCH',#{measure})LENGTH_UNIT()NAMED_UNIT(*))"))
                }
                _ => {
                    // A unit that is converted by itself.
                    let own = file.lines.len() + 2;
                    let measure = file.add(format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.),#{own})"));
                    file.add(format!("(CONVERSION_BASED_UNIT('X',#{measure})LENGTH_UNIT()NAMED_UNIT(*))"))
                }
            };
            format!("#{number}")
        })
        .collect();
    let context = file.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT(({}))REPRESENTATION_CONTEXT('',''))",
        list.join(",")
    ));
    file.add(format!("SHAPE_REPRESENTATION('',(#{set}),#{context})"));
    file.read()
}

#[test]
fn units_that_contradict_themselves_have_one_answer_and_a_line() {
    let size = |opened: &Opened| opened.document.bounds().max.x;
    for (units, unit, length, part) in [
        (&["mm"][..], Unit::Millimetre, 1.0, None),
        (&["inch"][..], Unit::Inch, 1.0, None),
        // The first of two counts.
        (&["mm", "inch"][..], Unit::Millimetre, 1.0, Some("the first counts")),
        (&["inch", "mm"][..], Unit::Inch, 1.0, Some("the first counts")),
        (&["mm", "mm"][..], Unit::Millimetre, 1.0, None),
        // The conversion counts, not the name.
        (&["inch of a metre"][..], Unit::Metre, 1.0, Some("the conversion counts")),
        // None, or none of lengths, or one in a circle.
        (&[][..], Unit::Unknown, 1.0, Some("no length unit")),
        (&["second"][..], Unit::Unknown, 1.0, Some("no length unit")),
        (&["itself"][..], Unit::Unknown, 1.0, Some("no length unit")),
    ] {
        let opened = with_units(units);
        assert_eq!((opened.document.unit, size(&opened)), (unit, length), "{units:?}");
        match part {
            Some(part) => assert!(says(&opened, part), "{units:?}: {:?}", opened.report.lines),
            None => assert_eq!(opened.report.count(Severity::Warning), 0, "{units:?}: {:?}", opened.report.lines),
        }
    }
    // A file without any context.
    let mut file = File::default();
    let (a, b) = (file.point(O), file.point(X));
    let polyline = file.add(format!("POLYLINE('',(#{a},#{b}))"));
    file.add(format!("SHAPE_REPRESENTATION('',(#{polyline}),$)"));
    let opened = file.read();
    assert_eq!((opened.document.unit, opened.report.curves), (Unit::Unknown, 1));
    assert!(says(&opened, "names no length unit"));
    // Two contexts: lengths of the second are converted to the unit of the first; one without a unit is said.
    let mut file = File::default();
    let (a, b) = (file.point(O), file.point(X));
    let polyline = file.add(format!("POLYLINE('',(#{a},#{b}))"));
    let mm = file.context();
    let metre = file.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))");
    let m = file.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{metre}))REPRESENTATION_CONTEXT('',''))"
    ));
    let bare = file.add("(GEOMETRIC_REPRESENTATION_CONTEXT(3)REPRESENTATION_CONTEXT('',''))");
    for context in [mm, m, bare] {
        file.add(format!("SHAPE_REPRESENTATION('',(#{polyline}),#{context})"));
    }
    let opened = file.read();
    let ends: Vec<f64> = opened.document.curves().map(|(_, c)| c.ends()[1].x).collect();
    assert_eq!((opened.document.unit, ends), (Unit::Millimetre, vec![1.0, 1000.0, 1.0]));
    assert!(says(&opened, "its context names no unit"));
}
