//! What Gmsh makes of a file. Skipped by name where there is none; `PATCHWRIGHT_REQUIRE_GMSH=1` makes that a failure, and
//! `PATCHWRIGHT_PYTHON` names the interpreter that has it.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Meshes the surfaces of a file as they are and prints counts: faces, curves, curves of one face, triangles, mesh edges of
/// one triangle, line elements on curves of one face, mesh edges of more than two triangles, and nodes that coincide.
const MESH: &str = "
import sys, gmsh
from collections import Counter
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
gmsh.option.setNumber('Geometry.OCCFixDegenerated', 0)
gmsh.option.setNumber('Geometry.OCCFixSmallEdges', 0)
gmsh.option.setNumber('Geometry.OCCFixSmallFaces', 0)
gmsh.option.setNumber('Geometry.OCCSewFaces', 0)
gmsh.model.occ.importShapes(sys.argv[1], False)
gmsh.model.occ.synchronize()
box = gmsh.model.getBoundingBox(-1, -1)
size = sum((box[k + 3] - box[k]) ** 2 for k in range(3)) ** 0.5
gmsh.option.setNumber('Mesh.MeshSizeMax', size / 15)
gmsh.model.mesh.generate(2)
curves = gmsh.model.getEntities(1)
free = [t for d, t in curves if len(gmsh.model.getAdjacencies(1, t)[0]) == 1]
faces = gmsh.model.getEntities(2)
sides, triangles = Counter(), 0
for d, t in faces:
    kinds, tags, nodes = gmsh.model.mesh.getElements(2, t)
    for kind, of in zip(kinds, nodes):
        if kind != 2: continue
        for k in range(0, len(of), 3):
            triangles += 1
            for a, b in ((0, 1), (1, 2), (2, 0)):
                sides[tuple(sorted((of[k + a], of[k + b])))] += 1
lines = sum(len(x) for t in free for x in gmsh.model.mesh.getElements(1, t)[1])
tags, xyz, _ = gmsh.model.mesh.getNodes()
at = Counter(tuple(round(c / size * 1e9) for c in xyz[3 * k:3 * k + 3]) for k in range(len(tags)))
print('faces', len(faces)); print('curves', len(curves)); print('free', len(free)); print('triangles', triangles)
print('border', sum(1 for n in sides.values() if n == 1)); print('lines', lines)
print('crowded', sum(1 for n in sides.values() if n > 2)); print('twins', sum(n - 1 for n in at.values()))
";

/// The interpreter that has Gmsh, if there is one.
pub fn python() -> Option<String> {
    let python = std::env::var("PATCHWRIGHT_PYTHON").unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import gmsh"]).output();
    if !there.is_ok_and(|o| o.status.success()) {
        assert!(std::env::var_os("PATCHWRIGHT_REQUIRE_GMSH").is_none(), "no Gmsh for {python}, and it is required");
        println!("skipped: no Gmsh for {python}");
        return None;
    }
    Some(python)
}

/// What Gmsh makes of a file, or nothing where there is no Gmsh.
pub fn meshed(path: &Path) -> Option<BTreeMap<String, usize>> {
    let output = Command::new(python()?).args(["-c", MESH]).arg(path).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let numbers: BTreeMap<String, usize> = text
        .lines()
        .filter_map(|l| l.split_once(' '))
        .filter_map(|(name, number)| Some((name.to_owned(), number.parse().ok()?)))
        .collect();
    assert_eq!(numbers.len(), 8, "{text} {}", String::from_utf8_lossy(&output.stderr));
    println!("{}: {numbers:?}", path.display());
    Some(numbers)
}

/// The mesh of a file conforms across its patches: neighbours share nodes and edges.
pub fn conforms(path: &Path, faces: usize, edges: usize, free: usize) {
    let Some(mesh) = meshed(path) else { return };
    assert_eq!((mesh["faces"], mesh["curves"], mesh["free"]), (faces, edges, free));
    assert!(mesh["triangles"] > 50);
    assert_eq!((mesh["crowded"], mesh["twins"]), (0, 0), "no duplicate edges or nodes");
    assert_eq!(mesh["border"], mesh["lines"], "no edge of the mesh dangles inside");
}
