//! One file for each kind of bad STL and Plot3D input, with what the import report has to say of it.

/// A bad file.
#[allow(dead_code, reason = "not every test looks at all")]
pub struct Bad {
    /// Its name.
    pub name: &'static str,
    /// What is in it.
    pub bytes: Vec<u8>,
    /// What lines of the report say, one each; nothing else stands there but how a grid was read.
    pub said: &'static [&'static str],
    /// Whether one of these lines counts something that was left out.
    pub skipped: bool,
    /// The triangles that are read.
    pub triangles: usize,
    /// Of the edges: those of one triangle, and those of more than two.
    pub edges: [usize; 2],
}

type Corner = [f32; 3];

const O: Corner = [0.0, 0.0, 0.0];
const X: Corner = [1.0, 0.0, 0.0];
const Y: Corner = [0.0, 1.0, 0.0];
const Z: Corner = [0.0, 0.0, 1.0];
const XY: Corner = [1.0, 1.0, 0.0];
const TETRAHEDRON: [[Corner; 3]; 4] = [[O, Y, X], [O, X, Z], [X, Y, Z], [Y, O, Z]];

fn ascii(triangles: &[[Corner; 3]]) -> Vec<u8> {
    let mut text = "solid part\n".to_owned();
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in corners {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid part\n").into_bytes()
}

fn binary(header: &str, triangles: &[[Corner; 3]], count: u32) -> Vec<u8> {
    let mut bytes = format!("{header:80}").into_bytes();
    bytes.extend(count.to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        bytes.extend(corners.iter().flatten().flat_map(|c| c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A sheet of 2 x 2 points with Fortran record marks, of which the last is wrong.
fn wrong_marks() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut record = |payload: Vec<u8>, behind: u32| {
        bytes.extend((payload.len() as u32).to_le_bytes());
        let mark = payload.len() as u32 ^ behind;
        bytes.extend(payload);
        bytes.extend(mark.to_le_bytes());
    };
    record([2_i32, 2, 1].iter().flat_map(|k| k.to_le_bytes()).collect(), 0);
    let coordinates = [0.0_f64, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    record(coordinates.iter().flat_map(|c| c.to_le_bytes()).collect(), 0x55);
    bytes
}

/// All of them.
pub fn bad_bodies() -> Vec<Bad> {
    let with = |more: &[[Corner; 3]]| [&TETRAHEDRON[..], more].concat();
    let far = [2.0, 0.0, 0.0];
    let closed = [0, 0];
    let bad = |name, bytes, said, skipped, triangles, edges| Bad { name, bytes, said, skipped, triangles, edges };
    vec![
        bad(
            "degenerate.stl",
            ascii(&with(&[[O, X, far]])),
            &["1 triangle without area, kept as it is", "1 edge of more than two triangles, kept as it is"],
            false,
            5,
            [2, 1],
        ),
        bad("collapsed.stl", ascii(&with(&[[O, X, X]])), &["1 triangle with two equal corners"], true, 4, closed),
        bad(
            "duplicate.stl",
            ascii(&with(&[[O, X, Z], [O, X, Z]])),
            &[
                "2 triangles with the corners of another one, kept as they are",
                "3 edges of more than two triangles, kept as they are",
            ],
            false,
            6,
            [0, 3],
        ),
        bad(
            "nonmanifold.stl",
            ascii(&[[O, X, Y], [O, X, Z], [O, X, [0.0, -1.0, 0.0]]]),
            &["1 edge of more than two triangles, kept as it is"],
            false,
            3,
            [6, 1],
        ),
        // They overlap in the plane z = 0 and have no corner in common: nothing is wrong with either.
        bad("coplanar.stl", ascii(&[[O, X, Y], [[0.1, 0.1, 0.0], far, XY]]), &[], false, 2, [6, 0]),
        // The long edge O-X has a corner of the two triangles below it in its middle.
        bad(
            "tjunction.stl",
            ascii(&[[O, X, Y], [O, [0.5, -1.0, 0.0], [0.5, 0.0, 0.0]], [[0.5, 0.0, 0.0], [0.5, -1.0, 0.0], X]]),
            &[],
            false,
            3,
            [7, 0],
        ),
        bad(
            "nan.stl",
            binary("part", &with(&[[O, X, [0.0, f32::NAN, 0.0]], [O, X, [f32::INFINITY, 0.0, 0.0]]]), 6),
            &["2 triangles with a coordinate that is not a finite number"],
            true,
            4,
            closed,
        ),
        bad(
            "count.stl",
            binary("part", &TETRAHEDRON, 200),
            &["the file declares 200 triangles and holds 4; those that are there were read"],
            false,
            4,
            closed,
        ),
        bad("solid_binary.stl", binary("solid facet vertex", &TETRAHEDRON, 4), &[], false, 4, closed),
        bad("ascii_without_solid.stl", ascii(&TETRAHEDRON)["solid part\n".len()..].to_vec(), &[], false, 4, closed),
        bad(
            "marks.xyz",
            wrong_marks(),
            &["record marks do not fit the records; the counts were followed instead"],
            false,
            2,
            [4, 0],
        ),
        bad(
            "trailing.xyz",
            b"2 2 1\n0 1 0 1\n0 0 1 1\n4*0.0\nmade by hand\n".to_vec(),
            &["text behind the numbers was passed over"],
            false,
            2,
            [4, 0],
        ),
    ]
}
