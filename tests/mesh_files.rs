//! Real STL, OBJ and Plot3D files.

use patchwright::io::plot3d::{self, Encoding};
use patchwright::io::{ImportReport, obj, stl};

const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/models");

fn model(name: &str) -> Option<Vec<u8>> {
    let bytes = std::fs::read(format!("{MODELS}/{name}")).ok();
    if bytes.is_none() {
        println!("skipped: no shared data ({name})");
    }
    bytes
}

#[test]
fn plot3d_layouts_are_found_out() {
    let raw = |records| Encoding::Binary { records, big_endian: false, double: true };
    let single = |records| Encoding::Binary { records, big_endian: false, double: false };
    for (name, encodings, blocks, dimension) in [
        ("pyhyp_sphere.fmt", vec![Encoding::Ascii], 6, 3),
        ("vtk_multi_bin.xyz", vec![raw(true), single(true)], 2, 3),
        ("vtk_multi_bin_2D.xyz", vec![raw(false), single(false)], 2, 2),
    ] {
        let Some(bytes) = model(name) else { continue };
        let mut report = ImportReport::default();
        let (layout, grids) = plot3d::read(&bytes, &mut report).unwrap();
        println!("{name}: {layout}, {:?}", grids.iter().map(|g| g.counts()).collect::<Vec<_>>());
        assert!(encodings.contains(&layout.encoding), "{name}: {layout}");
        assert_eq!((grids.len(), layout.dimension), (blocks, dimension), "{name}");
        for face in grids.iter().flat_map(|g| g.surfaces()) {
            assert!(face.triangulated().unwrap().area() > 0.0);
        }
    }
}

#[test]
fn the_sphere_of_pyhyp_is_a_unit_sphere() {
    let Some(bytes) = model("pyhyp_sphere.fmt") else { return };
    let (_, grids) = plot3d::read(&bytes, &mut ImportReport::default()).unwrap();
    let radii: Vec<f64> = grids.iter().flat_map(|g| g.points()).map(|p| p.length()).collect();
    let (low, high) = radii.iter().fold((f64::MAX, 0.0_f64), |(l, h), &r| (l.min(r), h.max(r)));
    // The file's own points are on the sphere to 6e-6.
    assert!(high - low < 1e-5 * high, "radii {low}..{high}");
}

#[test]
fn broken_triangles_of_real_files_are_counted() {
    if let Some(bytes) = model("bladex_tip.stl") {
        let mut report = ImportReport::default();
        let mesh = stl::read(&bytes, &mut report);
        let facets = bytes.windows(8).filter(|w| w == b"endfacet").count();
        let skipped: usize =
            report.lines.iter().filter_map(|l| l.reason.split(' ').next()?.parse::<usize>().ok()).sum();
        println!("bladex_tip.stl: {:?}, {:?}", mesh.defects(), report.lines);
        assert_eq!(mesh.triangles().len() + skipped, facets);
        assert!(skipped > 0);
    }
    if let Some(bytes) = model("bladex_prop_shaft.obj") {
        let mut report = ImportReport::default();
        let mesh = obj::read(&bytes, &mut report);
        println!("bladex_prop_shaft.obj: {:?}, {:?}", mesh.defects(), report.lines);
        assert_eq!((mesh.points().len(), mesh.groups.len()), (2844, 2));
        assert!(mesh.triangles().len() <= 5668 && mesh.triangles().len() > 5600);
    }
}
