//! Bad files: whatever the bytes are, opening ends with a document and a report or with an error that says what and
//! where. No panic, no hang, and no more memory than a multiple of the file.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/fuzzed.rs"]
mod fuzzed;
#[path = "support/iges_text.rs"]
mod iges_text;
#[path = "support/peak.rs"]
mod peak;

use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;

use fuzzed::checked;
use glam::DVec3;
use iges_text::{Entity, File, one_of_each, shared_files, square};
use patchwright::io::{self, Format, Opened, iges, project, step};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};
use peak::peak;

/// What a file may take beside 30 times its size: a few lines can ask for an offset surface or for curves by arc length,
/// which are followed with a bounded number of pieces each.
const OWN_PIECES: usize = 1_000_000;

/// Reads IGES and holds it to 30 times the file's size, and what a few followed curves and surfaces take.
fn read_iges(bytes: &[u8]) -> Option<Opened> {
    let (opened, peak) = peak(|| iges::read(bytes));
    assert!(peak <= 30 * bytes.len() + OWN_PIECES, "{peak} bytes for a file of {}", bytes.len());
    match opened {
        Ok(opened) => {
            checked(&opened);
            Some(opened)
        }
        Err(error) => {
            assert!(error.to_string().len() > 20, "an error says something");
            None
        }
    }
}

fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

#[test]
fn a_file_with_one_of_each_is_read_whole() {
    let opened = read_iges(one_of_each().text().as_bytes()).unwrap();
    assert_eq!((opened.report.surfaces, opened.report.curves), (12, 6), "{:?}", opened.report.lines);
}

#[test]
fn files_that_are_none_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let garbage: Vec<u8> = {
        let mut state = 1;
        (0..100_000).map(|_| random(&mut state) as u8).collect()
    };
    let contents: [&[u8]; 8] = [b"", b"\n\n\n", b"hello", &garbage, b"\0\0\0\0", b"(", b"(version: 1", &[b' '; 5000]];
    for (i, content) in contents.iter().enumerate() {
        for name in ["x.igs", "x.iges", "x.patchwright.ron", "x.ron", "x.dat", "x"] {
            let path = folder.path().join(format!("{i}{name}"));
            std::fs::File::create(&path).unwrap().write_all(content).unwrap();
            let error = io::open(&path).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
    let error = io::open(&folder.path().join("none.igs")).unwrap_err().to_string();
    assert!(error.contains("none.igs") && error.contains("exists"), "{error}");
    assert!(io::open(folder.path()).is_err());
}

#[test]
fn files_cut_off_anywhere_open_as_far_as_they_go() {
    let mut files: Vec<Vec<u8>> = vec![one_of_each().text().into_bytes()];
    files.extend(shared_files("models", "igs").iter().map(|path| std::fs::read(path).unwrap()));
    for bytes in files {
        let whole = read_iges(&bytes).unwrap().report.surfaces;
        let mut last = 0;
        for percent in 1..100 {
            let Some(opened) = read_iges(&bytes[..bytes.len() * percent / 100]) else { continue };
            assert!(!opened.report.lines.is_empty(), "a file that is cut off is reported");
            let now = opened.report.surfaces;
            // A subfigure whose instances are cut off stands nowhere: its one face is gone until they come.
            assert!(now + 1 >= last && now <= whole, "{now} surfaces at {percent} %, {last} before, {whole} in all");
            last = opened.report.surfaces;
        }
    }
}

/// One of each, the same without those that are followed with many pieces (offset surfaces and curves), and the sequence
/// numbers of these and of what they refer to. Following them takes most of the time, and comes to the same whatever is
/// changed elsewhere. Their kinds become one that is not read and is as long, so that no byte moves.
struct Followed {
    whole: File,
    without: File,
    numbers: BTreeSet<usize>,
}

impl Followed {
    fn new() -> Self {
        let whole = one_of_each();
        let mut without = whole.clone();
        let mut numbers = BTreeSet::new();
        for (k, entity) in without.entities.iter_mut().enumerate().filter(|(_, e)| matches!(e.kind, 130 | 140)) {
            entity.kind = 999;
            numbers.insert(2 * k + 1);
        }
        let mut open: Vec<usize> = numbers.iter().copied().collect();
        while let Some(number) = open.pop() {
            // Every whole number may be a reference.
            let values = whole.entities[number / 2].parameters.split(',').filter_map(|v| v.trim().parse().ok());
            open.extend(values.filter(|&n: &usize| n % 2 == 1 && n < 2 * whole.entities.len() && numbers.insert(n)));
        }
        Self { whole, without, numbers }
    }

    /// Whether they may come out otherwise when a byte of the file's text changes.
    fn depend_on(&self, text: &[u8], at: usize) -> bool {
        // Lines of 80 columns and a line end; what is in neither list concerns all.
        let line = &text[at / 81 * 81..];
        let column =
            |from: usize, to: usize| std::str::from_utf8(line.get(from..to)?).ok()?.trim().parse::<usize>().ok();
        let number = match line.get(72) {
            Some(b'D') => column(73, 80).map(|n| n - (n + 1) % 2),
            Some(b'P') => column(64, 72),
            _ => None,
        };
        number.is_none_or(|n| self.numbers.contains(&n))
    }
}

#[test]
fn what_is_followed_is_told_from_the_rest_of_the_file() {
    let followed = Followed::new();
    let [whole, without] = [&followed.whole, &followed.without].map(|f| f.text().into_bytes());
    assert_eq!(whole.len(), without.len());
    assert!(followed.numbers.len() > 4 && 2 * followed.numbers.len() < followed.whole.entities.len());
    let differ: Vec<usize> = (0..whole.len()).filter(|&k| whole[k] != without[k]).collect();
    assert!(differ.len() > 9 && differ.iter().all(|&k| followed.depend_on(&whole, k)));
    let dependent = (0..whole.len()).filter(|&k| followed.depend_on(&whole, k)).count();
    assert!(dependent > 1000 && 2 * dependent < whole.len(), "{dependent} of {}", whole.len());
}

#[test]
fn flipped_bits_and_bytes_do_no_harm() {
    let followed = Followed::new();
    let [whole, without] = [&followed.whole, &followed.without].map(|f| f.text().into_bytes());
    let mut files: Vec<Vec<u8>> = vec![whole.clone()];
    files.extend(shared_files("models", "igs").iter().map(|p| std::fs::read(p).unwrap()).filter(|b| b.len() < 200_000));
    let mut state = 20_261_122;
    for bytes in files {
        for round in 0..if bytes.len() < 20_000 { 600 } else { 60 } {
            let mut bad = bytes.clone();
            if bytes == whole {
                // The same places as below, looked at beforehand. A byte that is gone moves all behind it.
                let mut ahead = state;
                let places: Vec<usize> = (0..=random(&mut ahead) % 8)
                    .map(|_| {
                        let at = random(&mut ahead) as usize % whole.len();
                        if round % 3 < 2 {
                            random(&mut ahead);
                        }
                        at
                    })
                    .collect();
                if round % 3 < 2 && !places.iter().any(|&at| followed.depend_on(&whole, at)) {
                    bad = without.clone();
                }
            }
            for _ in 0..=random(&mut state) % 8 {
                let at = random(&mut state) as usize % bad.len();
                match round % 3 {
                    0 => bad[at] ^= 1 << (random(&mut state) % 8),
                    1 => bad[at] = b"0123456789,;.-EDH "[random(&mut state) as usize % 18],
                    _ => drop(bad.remove(at)),
                }
            }
            read_iges(&bad);
        }
    }
}

#[test]
fn claims_of_huge_counts_cost_nothing() {
    let huge = ["1000000000", "999999999999", "-1", "-1000000000", "1e9", "NaN", "inf", "30000", "4000000000000000000"];
    let followed = Followed::new();
    for at in 0..followed.whole.entities.len() {
        let base = if followed.numbers.contains(&(2 * at + 1)) { &followed.whole } else { &followed.without };
        let values: Vec<String> = base.entities[at].parameters.split(',').map(str::to_owned).collect();
        for position in 0..values.len().min(8) {
            for claim in huge {
                let mut file = base.clone();
                let mut values = values.clone();
                claim.clone_into(&mut values[position]);
                file.entities[at].parameters = values.join(",");
                read_iges(file.text().as_bytes());
            }
        }
    }
    // Two counts that only overflow together.
    let mut file = File::default();
    file.add(128, "4294967295,4294967295,1,1,0,0,1,0,0,0.,0.");
    file.add(114, "3,1,4294967296,4294967296,0.,0.");
    assert_eq!(read_iges(file.text().as_bytes()).unwrap().report.surfaces, 0);
}

#[test]
fn numbers_that_are_none_lose_their_entity_only() {
    for bad in ["NaN", "inf", "-inf", "1e999", "abc", "", "3Habc", "1.2.3", "--1"] {
        let mut file = File::default();
        file.add(128, square(0.0).replacen("1.,1.,1.,1.,", &format!("1.,{bad},1.,1.,"), 1));
        file.add(128, square(0.0).replace("0.0,0.0,0.0", &format!("0.0,{bad},0.0")));
        file.add(110, format!("{bad},0.,0.,1.,1.,{bad}"));
        file.add(128, square(3.0));
        let opened = read_iges(file.text().as_bytes()).unwrap();
        assert!(opened.document.surfaces().any(|(_, s)| s.points()[0].z == 3.0), "{bad}");
        assert_eq!(opened.report.surfaces, 1, "{bad}: {:?}", opened.report.lines);
        assert!(opened.report.lines.len() >= 2, "{bad}: {:?}", opened.report.lines);
    }
}

#[test]
fn references_in_circles_and_cascades_end() {
    let identity = "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.";
    // A chain of 5000 transforms, each below the next, with an entity on each.
    let mut file = File::default();
    for i in 0..5000 {
        let transform = 2 * i + 3;
        file.add_entity(Entity { kind: 124, transform, parameters: identity.into(), ..Entity::default() });
    }
    for i in 0..5000 {
        file.add_entity(Entity {
            kind: 110,
            transform: 2 * i + 1,
            parameters: "0.,0.,0.,1.,1.,1.".into(),
            ..Entity::default()
        });
    }
    assert_eq!(read_iges(file.text().as_bytes()).unwrap().report.curves, 5000);
    // Composites that contain themselves, and composites that double forty times.
    let mut file = File::default();
    file.add(102, "2,1,1");
    file.add(102, "1,5");
    file.add(102, "1,3");
    let mut last = file.add(110, "0.,0.,0.,1.,0.,0.");
    for _ in 0..40 {
        last = file.add(102, format!("2,{last},{last}"));
    }
    let opened = read_iges(file.text().as_bytes()).unwrap();
    assert_eq!(opened.report.curves, 0);
    assert!(opened.report.lines.iter().any(|l| l.reason.contains("nested more than 16 deep")));
    // One long curve as the member of many composites, and one large surface at many places.
    let mut file = File::default();
    let n = 2000;
    let values = |count: usize| (0..count).map(|i| format!("{i}.")).collect::<Vec<_>>().join(",");
    let knots = format!("0.,0.,{},{n}.,{n}.", values(n - 1).replacen("0.", ".5", 1));
    let line =
        file.add(126, format!("{n},1,0,0,1,0,{knots},{},{},0.,{n}.", vec!["1."; n + 1].join(","), values(3 * n + 3)));
    for _ in 0..300 {
        file.add(102, format!("10,{}", vec![line.to_string(); 10].join(",")));
    }
    read_iges(file.text().as_bytes()).unwrap();
    let mut file = File::default();
    let side = 60;
    let knots = format!("0.,{},{}.", values(side), side - 1);
    let ones = vec!["1."; side * side].join(",");
    let s = file.add(
        128,
        format!("{0},{0},1,1,0,0,1,0,0,{knots},{knots},{ones},{1},0.,{0}.,0.,{0}.", side - 1, values(3 * side * side)),
    );
    for i in 0..1000 {
        let map = file.add(124, format!("1.,0.,0.,{i}.,0.,1.,0.,0.,0.,0.,1.,0."));
        file.add_entity(Entity { kind: 144, transform: map, parameters: format!("{s},0,0,0"), ..Entity::default() });
    }
    let opened = read_iges(file.text().as_bytes()).unwrap();
    assert!(opened.report.surfaces > 1 && opened.report.surfaces < 1000);
    assert!(opened.report.lines.iter().any(|l| l.reason.contains("not opened at all of its places")));
}

#[test]
fn damaged_step_files_do_no_harm() {
    let mut state = 11;
    let files = shared_files("models", "stp").into_iter().chain(shared_files("models", "step"));
    for bytes in files.map(|path| std::fs::read(path).unwrap()) {
        for percent in (1..100).step_by(3) {
            checked(&step::open(&bytes[..bytes.len() * percent / 100]));
        }
        for round in 0..20 {
            let mut bad = bytes.clone();
            for _ in 0..=random(&mut state) % 50 {
                let at = random(&mut state) as usize % bad.len();
                match round % 3 {
                    0 => bad[at] ^= 1 << (random(&mut state) % 8),
                    1 => bad[at] = b"0123456789,;.#()'$*E-"[random(&mut state) as usize % 21],
                    _ => drop(bad.remove(at)),
                }
            }
            let (opened, peak) = peak(|| step::open(&bad));
            checked(&opened);
            assert!(peak <= 30 * bad.len() + 100_000, "{peak} bytes for a file of {}", bad.len());
        }
    }
}

fn project_text() -> String {
    let mut document = Document::new(Unit::Millimetre);
    for k in 0..20 {
        let knots = || Knots::clamped(3, &[0.0, 0.5, 1.0], 2).unwrap();
        let count = knots().control_count();
        let points = (0..count * count)
            .map(|i| DVec3::new((i % count) as f64, (i / count) as f64, f64::from(k) + (i as f64).sin()))
            .collect();
        let surface = Surface::new(knots(), knots(), points, None).unwrap();
        document.add(format!("surface {k}"), Shape::Surface(Arc::new(surface)), Some([0.1, 0.2, 0.3]));
    }
    project::write(&document).unwrap()
}

fn read_project(bytes: &[u8]) {
    let (opened, peak) = peak(|| project::read(bytes));
    assert!(peak <= 30 * bytes.len() + OWN_PIECES, "{peak} bytes for a file of {}", bytes.len());
    match opened {
        Ok(opened) => checked(&opened),
        Err(error) => assert!(error.to_string().len() > 10),
    }
}

#[test]
fn damaged_projects_say_where() {
    let text = project_text();
    for percent in 0..100 {
        let cut = &text.as_bytes()[..text.len() * percent / 100];
        let error = project::read(cut).unwrap_err().to_string();
        assert!(error.contains("line"), "{error}");
    }
    let mut state = 7;
    for round in 0..400 {
        let mut bad = text.clone().into_bytes();
        let at = random(&mut state) as usize % bad.len();
        match round % 3 {
            0 => bad[at] ^= 1 << (random(&mut state) % 8),
            1 => bad[at] = b"0123456789,():[]-e\" "[random(&mut state) as usize % 20],
            _ => drop(bad.remove(at)),
        }
        read_project(&bad);
    }
    for bad in ["NaN", "inf", "-inf", "1e999", "\"text\"", "[]", "99999999999999999999999999"] {
        read_project(text.replacen("0.5", bad, 1).as_bytes());
        read_project(text.replacen("degree:3", &format!("degree:{bad}"), 1).as_bytes());
        read_project(text.replacen("id: 3", &format!("id: {bad}"), 1).as_bytes());
    }
    for deep in ["(", "[", "{", "Some(", "(entities:[", "\"", "/*"] {
        read_project(deep.repeat(100_000).as_bytes());
    }
    read_project(text.replacen("degree:3", "degree:18446744073709551615", 1).as_bytes());
}

/// What the fuzz targets (tests/fuzz) found, and what was kept with it.
#[test]
fn findings_are_survived() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data"));
    let formats = [
        ("iges", Some(Format::Iges)),
        ("step", Some(Format::Step)),
        ("project", Some(Format::Project)),
        ("spec", None),
        ("stl", Some(Format::Stl)),
        ("obj", Some(Format::Obj)),
        ("plot3d", Some(Format::Plot3d)),
    ];
    for (name, format) in formats {
        let Ok(files) = std::fs::read_dir(folder.join(format!("{name}_findings"))) else { continue };
        for path in files.map(|f| f.unwrap().path()) {
            let bytes = std::fs::read(&path).unwrap();
            println!("{}", path.display());
            match format {
                Some(format) => fuzzed::read(&bytes, format),
                None => fuzzed::read_spec(&bytes),
            }
        }
    }
}
