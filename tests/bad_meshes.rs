//! Bad STL, OBJ and Plot3D files: whatever the bytes are, reading ends with a mesh whose every index and coordinate can
//! be trusted and a report that counts what was left out, or with an error. Files that once broke a reader lie in
//! `data/bad_meshes` and are read for ever.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use patchwright::io::plot3d::{self, Encoding};
use patchwright::io::{self, ImportReport, Severity, obj, stl};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::body::Body;
use patchwright::kernel::mesh::facets::Facets;
use patchwright::kernel::mesh::grid::Grid;
use patchwright::kernel::mesh::tri_mesh::{Group, TriMesh};
use patchwright::kernel::mesh_ssi::engine::{MeshSsiOptions, intersect_bodies};
use patchwright::kernel::ssi::result::{Intersection, IntersectionCurve};

const REGRESSIONS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bad_meshes");

fn tetrahedron() -> TriMesh {
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.1, 0.25, 1.0 / 3.0)];
    let mut mesh = TriMesh::new(points, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
    mesh.groups =
        vec![Group { name: "base".into(), triangles: 0..1 }, Group { name: "rest of it".into(), triangles: 1..4 }];
    mesh
}

fn grids() -> Vec<Grid> {
    let block = |[ni, nj, nk]: [usize; 3]| {
        let n = ni * nj * nk;
        let point = |k: usize| DVec3::new(k as f64 * 0.1, (k * k) as f64 / 7.0, -(k as f64));
        Grid::new([ni, nj, nk], (0..n).map(point).collect(), Some((0..n).map(|k| i32::from(k % 5 != 0)).collect()))
            .unwrap()
    };
    vec![block([3, 3, 2]), block([4, 1, 3])]
}

/// One whole file of every kind, with what tells a writer's habits: the seeds of the mutations.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let binary = |k: u8| Encoding::Binary { records: k & 1 > 0, big_endian: k & 2 > 0, double: k & 4 > 0 };
    let mut seeds = vec![
        ("ascii.stl", stl::write_ascii(&tetrahedron()).into_bytes()),
        ("binary.stl", stl::write_binary(&tetrahedron())),
        ("a.obj", obj::write(&tetrahedron()).into_bytes()),
        (
            "b.obj",
            b"v 0 0 0\nv 1 0 0\nv 1 1 0 1.0\nv 0 1 0\ng a\nf 1/1/1 2//2 \\\n3 4\no b\nf -1 -2 -3\nvn 0 0 1\n".to_vec(),
        ),
        ("ascii.fmt", plot3d::write(&grids(), Encoding::Ascii)),
        ("fortran.fmt", b"2\n 2, 2 1\n2 1 2\n 0.0 1.0D0 2*0.5d+00\n 2*0 2*1\n 4*7.\n12*3.5\n by hand\n".to_vec()),
    ];
    seeds.extend((0..8).map(|k| ("grid.xyz", plot3d::write(&grids(), binary(k)))));
    seeds
}

/// Reads bytes by name and looks at everything that came of it.
fn survives(name: &str, bytes: &[u8]) {
    let format = io::Format::of_name(std::path::Path::new(name)).unwrap();
    let start = Instant::now();
    let opened = match format {
        io::Format::Stl => vec![stl::read(bytes, &mut ImportReport::default())],
        io::Format::Obj => vec![obj::read(bytes, &mut ImportReport::default())],
        _ => match plot3d::read(bytes, &mut ImportReport::default()) {
            Ok((_, grids)) => grids
                .into_iter()
                .filter_map(|g| Facets::of_block(g).ok())
                .map(|f| {
                    let _curves = f.curves().len();
                    f.mesh().clone()
                })
                .collect(),
            Err(_) => Vec::new(),
        },
    };
    for mesh in opened {
        assert!(mesh.points().iter().all(|p| p.is_finite()));
        assert!(mesh.triangles().iter().flatten().all(|&k| (k as usize) < mesh.points().len()));
        let mut behind = 0;
        for group in &mesh.groups {
            assert!(behind <= group.triangles.start && group.triangles.end <= mesh.triangles().len());
            behind = group.triangles.end;
        }
        let facets = Facets::of_mesh(mesh);
        let _curves = facets.curves().len();
        let _parts = facets.mesh().clone().into_parts();
    }
    assert!(start.elapsed() < Duration::from_secs(5), "{name}: {} bytes took {:?}", bytes.len(), start.elapsed());
}

/// A generator of numbers that is the same everywhere (xorshift, Marsaglia 2003).
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % below.max(1) as u64) as usize
    }
}

const WORDS: [&[u8]; 22] = [
    b"solid",
    b"endsolid",
    b"facet normal 0 0 1",
    b"vertex 1e999 nan -0",
    b"endloop\n",
    b"endfacet\n",
    b"f ",
    b"v ",
    b"-1",
    b"4294967295",
    b"9999999999999",
    b"0*1",
    b"1000000*2.5",
    b"1D400",
    b"\n",
    b"\0\0\0\0",
    b"\xff\xff\xff\x7f",
    b"\xff\xff\xff\xff",
    b"1 1 1",
    b"2147483647",
    b"/",
    b"\\\n",
];

/// One to four changes of a file: bits, bytes, words, cuts, repeats, and parts of another file.
fn mutated(seed: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=random.next(4) {
        let at = random.next(bytes.len());
        match random.next(9) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.next(8),
            1 if !bytes.is_empty() => bytes[at] = random.next(256) as u8,
            2 => bytes.truncate(at),
            3 => {
                let word = WORDS[random.next(WORDS.len())];
                bytes.splice(at..at, word.iter().copied());
            }
            4 => {
                let word = WORDS[random.next(WORDS.len())];
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            5 => {
                let end = (at + random.next(40)).min(bytes.len());
                bytes.drain(at..end);
            }
            6 => {
                let end = (at + random.next(60)).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
            7 => {
                let from = random.next(other.len());
                let end = (from + random.next(80)).min(other.len());
                bytes.splice(at..at, other[from..end].iter().copied());
            }
            _ if bytes.len() > at + 4 => {
                let value =
                    [0_u32, 1, 2, 255, 65_536, i32::MAX as u32, u32::MAX, 0x7fc0_0000, 0x7f80_0000][random.next(9)];
                let four = if random.next(2) == 0 { value.to_le_bytes() } else { value.to_be_bytes() };
                bytes[at..at + 4].copy_from_slice(&four);
            }
            _ => {}
        }
    }
    bytes
}

fn mutate(rounds: usize, seed: u64) {
    let seeds = seeds();
    let mut random = Random(seed);
    for round in 0..rounds {
        let (name, bytes) = &seeds[round % seeds.len()];
        let other = &seeds[random.next(seeds.len())].1;
        let bytes = mutated(bytes, other, &mut random);
        let outcome = std::panic::catch_unwind(|| survives(name, &bytes));
        if let Err(panic) = outcome {
            let path = std::env::temp_dir().join(format!("broken-{seed}-{round}-{name}"));
            std::fs::write(&path, &bytes).unwrap();
            println!("round {round} of seed {seed}: the file is kept as {}", path.display());
            std::panic::resume_unwind(panic);
        }
    }
}

#[test]
fn mutated_files_are_survived() {
    mutate(4000, 0x9E37_79B9_7F4A_7C15);
}

/// `cargo test --release --test bad_meshes -- --ignored` for a longer look; `PATCHWRIGHT_ROUNDS` and `PATCHWRIGHT_SEED`
/// say how long and where to begin.
#[test]
#[ignore = "minutes"]
fn many_mutated_files_are_survived() {
    let number = |name: &str| std::env::var(name).ok().and_then(|v| v.parse().ok());
    mutate(number("PATCHWRIGHT_ROUNDS").unwrap_or(2_000_000) as usize, number("PATCHWRIGHT_SEED").unwrap_or(12_345));
}

#[test]
fn files_that_once_broke_a_reader_are_survived() {
    for entry in std::fs::read_dir(REGRESSIONS).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if io::Format::of_name(&path).is_some() {
            survives(&name, &std::fs::read(&path).unwrap());
        }
    }
}

#[test]
fn a_count_beyond_the_file_and_beyond_memory_costs_nothing() {
    let mut binary = stl::write_binary(&tetrahedron());
    binary[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut report = ImportReport::default();
    assert_eq!(stl::read(&binary, &mut report).triangles().len(), 4);
    assert_eq!(report.count(Severity::Warning), 1);
    for text in ["1000000000 1000000000 1000000000\n0 1 2", "99999\n", "2000000000\n1 1 1\n0 0 0\n", "3\n9999999*7\n"] {
        survives("huge.fmt", text.as_bytes());
    }
    for big_endian in [false, true] {
        let int = |v: i32| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
        let bytes: Vec<u8> = [i32::MAX, i32::MAX, i32::MAX, i32::MAX].into_iter().flat_map(int).collect();
        survives("huge.xyz", &bytes);
    }
}

#[test]
fn solid_in_a_binary_header_and_binary_bytes_behind_solid_are_told_apart() {
    // Binary with a header that begins like ASCII: whole, cut, and with a wrong count.
    let mut bytes = stl::write_binary(&tetrahedron());
    bytes[..12].copy_from_slice(b"solid facet ");
    let read = |bytes: &[u8]| {
        let mut report = ImportReport::default();
        let mesh = stl::read(bytes, &mut report);
        (mesh.triangles().len(), report.lines.len())
    };
    assert_eq!(read(&bytes), (4, 0));
    assert_eq!(read(&bytes[..bytes.len() - 10]), (3, 1), "a cut binary file is still binary");
    let mut more = bytes.clone();
    more[80] = 200;
    assert_eq!(read(&more), (4, 1), "a count field larger than the file");
    // ASCII that does not begin with solid.
    let text = stl::write_ascii(&tetrahedron());
    let without = text.replacen("solid base\n", "; made by hand\n", 1);
    assert_eq!(read(without.as_bytes()).0, 4);
    let shouting = text.to_uppercase().replace("E", "e").replace("\n", "\r\n");
    assert_eq!(read(shouting.as_bytes()).0, 4);
}

#[test]
fn wrong_record_marks_are_named_and_the_grid_is_read_without_them() {
    let grids = grids();
    for big_endian in [false, true] {
        for double in [false, true] {
            let bytes = plot3d::write(&grids, Encoding::Binary { records: true, big_endian, double });
            // The mark behind the first block's coordinates.
            for at in [bytes.len() - 4, bytes.len() - 1] {
                let mut wrong = bytes.clone();
                wrong[at] ^= 0x55;
                let mut report = ImportReport::default();
                let (layout, found) = plot3d::read(&wrong, &mut report).unwrap();
                assert_eq!((found.len(), layout.dimension), (2, 3), "{big_endian} {double} {at}");
                assert_eq!(report.count(Severity::Warning), 1, "{:?}", report.lines);
            }
        }
    }
}

type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

fn body((points, triangles): Soup) -> Body {
    Body::from(Arc::new(Facets::of_mesh(TriMesh::new(points, triangles).unwrap())))
}

fn meet(a: &Soup, b: &Soup) -> Intersection {
    let result =
        intersect_bodies(&[(0, body(a.clone()))], &[(1, body(b.clone()))], &MeshSsiOptions::default(), &Job::new());
    let result = result.unwrap();
    assert!(result.complete);
    result
}

/// A box of 12 triangles, outward.
fn cube(low: DVec3, high: DVec3) -> Soup {
    let corner = |k: usize| DVec3::new([low.x, high.x][k & 1], [low.y, high.y][k >> 1 & 1], [low.z, high.z][k >> 2]);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

/// One rectangle across x = 0.3, standing on the plane z = 0.
fn wall() -> Soup {
    let at = |y: f64, z: f64| DVec3::new(0.3, y, z);
    (vec![at(-9.0, -1.0), at(9.0, -1.0), at(9.0, 1.0), at(-9.0, 1.0)], vec![[0, 1, 2], [0, 2, 3]])
}

fn length(curve: &IntersectionCurve) -> f64 {
    curve.points.windows(2).map(|p| p[0].xyz.distance(p[1].xyz)).sum()
}

/// Two halves of the square [0, 1]^2 at z = 0: the lower one has its upper edge in one piece, the upper one has a vertex in
/// the middle of it, at x = `joint`.
fn t_junction(joint: f64) -> Soup {
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let points =
        vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 0.5), at(0.0, 0.5), at(joint, 0.5), at(0.0, 1.0), at(1.0, 1.0)];
    (points, vec![[0, 1, 2], [0, 2, 3], [3, 4, 5], [4, 6, 5], [4, 2, 6]])
}

#[test]
fn a_t_junction_is_a_border_in_the_mesh_and_no_gap_in_the_curve() {
    for joint in [0.5, 0.3] {
        let mesh = t_junction(joint);
        let defects = TriMesh::new(mesh.0.clone(), mesh.1.clone()).unwrap().defects();
        // Six around the square (the left and right side have two each), and one and two along the crack.
        assert_eq!((defects.border_edges, defects.non_manifold_edges, defects.degenerate), (9, 0, 0));
        let found = meet(&mesh, &wall());
        // The wall passes the crack beside its vertex, or through it: two pieces meet there in one point.
        let total: f64 = found.curves.iter().map(length).sum();
        assert!((total - 1.0).abs() < 1e-12, "joint at {joint}: {total} in {} curves", found.curves.len());
        assert_eq!(
            (found.curves.len(), found.curves[0].closed),
            (1, false),
            "joint at {joint}: joined across the crack"
        );
    }
}

#[test]
fn an_edge_through_vertices_and_along_edges_is_met_once() {
    // A fan around the origin; the wall's plane holds its middle vertex, then two of its edges as well.
    let fan = |turn: f64| -> Soup {
        let rim = |k: usize| {
            let a = turn + std::f64::consts::TAU * k as f64 / 8.0;
            DVec3::new(0.3 + a.cos(), a.sin(), 0.0)
        };
        let mut points = vec![DVec3::new(0.3, 0.0, 0.0)];
        points.extend((0..8).map(rim));
        (points, (0..8).map(|k| [0, 1 + k, 1 + (k + 1) % 8]).collect())
    };
    for turn in [0.1, std::f64::consts::FRAC_PI_4, 0.0] {
        let found = meet(&fan(turn), &wall());
        assert_eq!((found.curves.len(), found.curves[0].closed), (1, false), "turned by {turn}");
        // Across the octagon: its width through the middle at this angle.
        let a = (std::f64::consts::FRAC_PI_2 - turn).rem_euclid(std::f64::consts::FRAC_PI_4);
        let (half, middle) = (std::f64::consts::FRAC_PI_8, (a - std::f64::consts::FRAC_PI_8).cos());
        assert!((length(&found.curves[0]) - 2.0 * half.cos() / middle).abs() < 1e-12, "turned by {turn}");
    }
}

#[test]
fn a_duplicate_triangle_gives_its_part_of_the_curve_twice() {
    let a = cube(DVec3::ZERO, DVec3::splat(2.0));
    let b = cube(DVec3::splat(1.0), DVec3::splat(3.0));
    let plain = meet(&a, &b);
    assert_eq!((plain.curves.len(), plain.curves[0].closed), (1, true));
    let loop_length = length(&plain.curves[0]);
    // The corner that is cut off: six edges of length 1.
    assert!((loop_length - 6.0).abs() < 1e-12);
    // Triangle [1, 3, 7] of the side x = 2 is where z <= y: it holds the line z = 1 from y = 1 to 2.
    let mut twice = a.clone();
    twice.1.push([1, 3, 7]);
    let counted = TriMesh::new(twice.0.clone(), twice.1.clone()).unwrap().defects();
    assert_eq!((counted.duplicate, counted.non_manifold_edges), (1, 3));
    let total: f64 = meet(&twice, &b).curves.iter().map(length).sum();
    assert!((total - 7.0).abs() < 1e-12, "{total}");
}

#[test]
fn triangles_without_area_change_nothing() {
    let a = cube(DVec3::ZERO, DVec3::splat(2.0));
    let b = cube(DVec3::splat(1.0), DVec3::splat(3.0));
    let mut spoiled = a.clone();
    spoiled.1.extend([[0, 0, 1], [2, 2, 2]]);
    let found = meet(&spoiled, &b);
    assert_eq!((found.curves.len(), found.curves[0].closed), (1, true));
    assert!((length(&found.curves[0]) - 6.0).abs() < 1e-12);
}

#[test]
fn coplanar_faces_meet_as_if_one_body_were_shifted_by_less_than_any_number() {
    // Floors and roofs lie in common planes; b is shifted up and out by nothing that can be measured. Its floor is then
    // inside a and its roof outside, so that the curve is one loop around where b leaves a: on the common roof.
    let a = cube(DVec3::ZERO, DVec3::splat(2.0));
    let b = cube(DVec3::new(0.5, 0.5, 0.0), DVec3::new(1.5, 1.5, 2.0));
    let found = meet(&a, &b);
    assert!(found.curves.iter().all(|c| c.closed), "no curve may end on a closed body");
    let roof: f64 = found.curves.iter().map(length).sum();
    assert!((roof - 4.0).abs() < 1e-12, "{roof}");
    assert!(found.curves.iter().flat_map(|c| &c.points).all(|p| p.xyz.z == 2.0));
    // The same body twice: the answer is closed, too.
    assert!(meet(&a, &a).curves.iter().all(|c| c.closed));
}

#[test]
fn a_non_manifold_edge_is_a_junction_of_as_many_curves_as_it_has_sheets() {
    for sheets in [3_u32, 4, 5] {
        let mut mesh: Soup = (vec![DVec3::new(0.3, 0.0, -2.0), DVec3::new(0.3, 0.0, 2.0)], vec![]);
        for k in 0..sheets {
            let (s, c) = (0.4 + std::f64::consts::TAU * f64::from(k) / f64::from(sheets)).sin_cos();
            mesh.0.push(DVec3::new(0.3 + c, s, 0.0));
            mesh.1.push([0, 1, 2 + k]);
        }
        let defects = TriMesh::new(mesh.0.clone(), mesh.1.clone()).unwrap().defects();
        assert_eq!((defects.non_manifold_edges, defects.border_edges), (1, 2 * sheets as usize));
        let floor: Soup =
            ([[-9.0, -9.0, 0.1], [9.0, -9.0, 0.1], [0.0, 19.0, 0.1]].map(DVec3::from_array).to_vec(), vec![[0, 1, 2]]);
        let found = meet(&mesh, &floor);
        assert_eq!(found.curves.len(), sheets as usize);
        assert_eq!(found.junctions.len(), 1);
        assert!(found.junctions[0].xyz.distance(DVec3::new(0.3, 0.0, 0.1)) < 1e-15);
        for curve in &found.curves {
            assert!(curve.end_ids.contains(&Some(0)), "every curve ends in the junction");
            assert!((length(curve) - 0.95).abs() < 1e-12, "{}", length(curve));
        }
    }
}
