//! Bad files: whatever the bytes are, opening ends with a document and a report or with an error that says what and
//! where. No panic, no hang, and no more memory than a multiple of the file.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]
#![allow(unsafe_code, reason = "measuring memory needs an allocator, which is an unsafe trait")]

#[path = "support/iges_text.rs"]
mod iges_text;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write;
use std::sync::Arc;

use glam::DVec3;
use iges_text::{Entity, File, shared_files, square};
use patchwright::io::{self, Opened, iges, project, step};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};

/// Counts the bytes that the current thread holds, so that tests can run side by side.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

fn count(change: isize) {
    // During the end of a thread there is nothing left to count in.
    let _ = HELD.try_with(|held| {
        held.set(held.get() + change);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(held.get())));
    });
}

// SAFETY: every call is passed on unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the pointer came from `alloc` above, hence from the system.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs `f` and gives the most bytes that it held at once.
fn peak<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.with(Cell::get);
    PEAK.with(|peak| peak.set(before));
    let result = f();
    (result, usize::try_from(PEAK.with(Cell::get) - before).unwrap())
}

/// Reads IGES and holds it to 30 times the file's size, and a little for the smallest files.
fn read_iges(bytes: &[u8]) -> Option<Opened> {
    let (opened, peak) = peak(|| iges::read(bytes));
    assert!(peak <= 30 * bytes.len() + 100_000, "{peak} bytes for a file of {}", bytes.len());
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

/// What holds of every document: it is finite, and evaluating it is too.
fn checked(opened: &Opened) {
    for entity in opened.document.entities() {
        assert!(entity.bounds().max_abs().is_finite());
        if let Some(surface) = entity.surface() {
            let [u, v] = surface.domain();
            let _ = surface.eval(glam::DVec2::new(u[0], v[1]));
        }
        if let Some(curve) = entity.curve() {
            let _ = curve.ends();
        }
    }
}

fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

/// A file with every kind of entity that the reader knows.
fn one_of_each() -> File {
    let mut file = File::default();
    let name = file.add_entity(Entity { kind: 406, form: 15, parameters: "1,4Hname".into(), ..Entity::default() });
    let color = file.add(314, "10.,20.,30.") as i64;
    let map = file.add(124, "1.,0.,0.,1.,0.,1.,0.,2.,0.,0.,1.,3.");
    let parameters = format!("{},0,1,{name}", square(1.0));
    let s = file.add_entity(Entity { kind: 128, transform: map, color: -color, parameters, ..Entity::default() });
    let line = file.add(110, "0.,0.,0.,1.,0.,0.");
    let arc = file.add(100, "0.,0.,0.,1.,0.,0.,1.");
    let chain = file.add(102, format!("2,{line},{arc}"));
    let on = file.add(142, format!("0,{s},{chain},{chain},3"));
    file.add(144, format!("{s},1,1,{on},{on}"));
    let boundary = file.add(141, format!("0,3,{s},1,{line},1,1,{arc}"));
    file.add(143, format!("0,{s},1,{boundary}"));
    file.add(126, "2,2,0,0,1,0,0.,0.,0.,1.,1.,1.,1.,.5,1.,0.,0.,0.,1.,0.,0.,1.,1.,0.,0.,1.");
    let row = |n: usize| vec!["0.5"; n].join(",");
    file.add(112, format!("3,2,3,1,0.,1.,{}", row(24)));
    file.add(114, format!("3,1,1,1,0.,1.,0.,1.,{}", row(192)));
    file.add(120, format!("{line},{arc},0.,1."));
    file.add(122, format!("{arc},0.,0.,1."));
    file.add(502, "1,0.,0.,0.");
    let edges = file.add(504, format!("1,{line},1,1,1,1"));
    let ring = file.add(508, format!("1,0,{edges},1,1,1,0,{arc}"));
    let face = file.add(510, format!("{s},1,1,{ring}"));
    let shell = file.add(514, format!("1,{face},1"));
    file.add(186, format!("{shell},1,0"));
    file.add(402, format!("2,{line},{arc}"));
    // A real outline, a plane, quadrics, ruled and offset surfaces, conics, polylines, a subfigure.
    let outline: Vec<String> = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.1]]
        .windows(2)
        .map(|p| file.add(110, format!("{:?},{:?},1.,{:?},{:?},1.", p[0][0], p[0][1], p[1][0], p[1][1])).to_string())
        .collect();
    let outline = file.add(102, format!("3,{}", outline.join(",")));
    let point = file.add(116, "0.,0.,1.,0");
    let axis = file.add(123, "0.,0.,1.");
    let plane = file.add(190, format!("{point},{axis}"));
    let on = file.add(142, format!("0,{plane},0,{outline},2"));
    let trimmed = file.add(144, format!("{plane},1,0,{on}"));
    let drum = file.add(192, format!("{point},{axis},2."));
    let rims = [0.0, 1.0].map(|z| file.add(100, format!("{z:?},0.,0.,2.,0.,2.,0.")));
    let rims = rims.map(|c| file.add(142, format!("0,{drum},0,{c},2")));
    file.add(144, format!("{drum},1,1,{},{}", rims[0], rims[1]));
    file.add(196, format!("{point},2."));
    file.add(198, format!("{point},{axis},3.,1."));
    let ruled = file.add(118, format!("{line},{arc},0,0"));
    file.add(140, format!("0.,0.,1.,.5,{ruled}"));
    file.add_entity(Entity {
        kind: 104,
        form: 1,
        parameters: "1.,0.,4.,0.,0.,-4.,0.,2.,0.,0.,1.".into(),
        ..Entity::default()
    });
    file.add_entity(Entity { kind: 106, form: 12, parameters: "2,2,0.,0.,0.,1.,1.,1.".into(), ..Entity::default() });
    let subfigure = file.add(308, format!("0,1Hs,1,{trimmed}"));
    for place in ["0.,0.,9.,1.", "0.,0.,9.,2."] {
        file.add(408, format!("{subfigure},{place}"));
    }
    file.add(110, "5.,0.,0.,1.,0.,0.");
    file
}

#[test]
fn a_file_with_one_of_each_is_read_whole() {
    let opened = read_iges(one_of_each().text().as_bytes()).unwrap();
    assert_eq!((opened.report.surfaces, opened.report.curves), (12, 5), "{:?}", opened.report.lines);
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

#[test]
fn flipped_bits_and_bytes_do_no_harm() {
    let mut files: Vec<Vec<u8>> = vec![one_of_each().text().into_bytes()];
    files.extend(shared_files("models", "igs").iter().map(|p| std::fs::read(p).unwrap()).filter(|b| b.len() < 200_000));
    let mut state = 20_261_122;
    for bytes in files {
        for round in 0..if bytes.len() < 20_000 { 600 } else { 60 } {
            let mut bad = bytes.clone();
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
    let base = one_of_each();
    for at in 0..base.entities.len() {
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
    assert!(peak <= 30 * bytes.len() + 100_000, "{peak} bytes for a file of {}", bytes.len());
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
