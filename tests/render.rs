//! Pictures rendered off screen, checked against what geometry says must be in them.
//!
//! Without a Vulkan adapter every test reports itself as skipped; with `PATCHWRIGHT_REQUIRE_GPU=1` that is a failure.
#![cfg(feature = "editor")]

use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec3, Vec3};
use image::RgbaImage;
use patchwright::render::{CameraData, FrameData, Gpu, Key, MeshData, MeshItem, Offscreen, srgb};

/// One GPU for all tests of this file: software drivers compile pipelines slowly.
static SHARED: Mutex<Option<Offscreen>> = Mutex::new(None);

fn offscreen(test: &str) -> Option<MutexGuard<'static, Option<Offscreen>>> {
    let mut shared = SHARED.lock().unwrap_or_else(|e| e.into_inner());
    if shared.is_none() {
        match Gpu::headless() {
            Ok(gpu) => *shared = Some(Offscreen::new(gpu)),
            Err(e) if std::env::var_os("PATCHWRIGHT_REQUIRE_GPU").is_some_and(|v| v == "1") => panic!("{test}: {e}"),
            Err(_) => {
                eprintln!("skipped: no Vulkan adapter: {test}");
                return None;
            }
        }
    }
    Some(shared)
}

fn render(test: &str, frame: FrameData) -> Option<RgbaImage> {
    let mut shared = offscreen(test)?;
    let picture = shared.as_mut().unwrap().render(&Arc::new(frame)).unwrap();
    if let Some(folder) = std::env::var_os("PATCHWRIGHT_PICTURES") {
        picture.save(std::path::Path::new(&folder).join(format!("{test}.png"))).unwrap();
    }
    Some(picture)
}

/// A sphere as a latitude-longitude mesh.
fn sphere(center: DVec3, radius: f32) -> Arc<MeshData> {
    let (nu, nv) = (96u32, 48u32);
    let mut mesh = MeshData { origin: center, ..MeshData::default() };
    for j in 0..=nv {
        for i in 0..=nu {
            let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
            let (a, b) = (u * std::f32::consts::TAU, (v - 0.5) * std::f32::consts::PI);
            let n = Vec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
            mesh.positions.push((n * radius).to_array());
            mesh.normals.push(n.to_array());
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let k = j * (nu + 1) + i;
            mesh.triangles.push([k, k + 1, k + nu + 2]);
            mesh.triangles.push([k, k + nu + 2, k + nu + 1]);
        }
    }
    Arc::new(mesh)
}

fn item(entity: u64, mesh: Arc<MeshData>, hex: u32) -> MeshItem {
    MeshItem {
        key: Key::new(entity, 0),
        revision: 0,
        mesh,
        color: srgb(hex),
        emphasis: Default::default(),
        field: None,
        sectioned: true,
    }
}

#[test]
fn a_sphere_covers_the_pixels_of_its_silhouette() {
    let camera = CameraData::orthographic(DVec3::Z * 10.0, DVec3::ZERO, DVec3::Y, 4.0, 1.0, 1.0, 20.0);
    let mut frame = FrameData::new([400, 400], camera);
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 1.0), 0x8fb3d9));
    let Some(picture) = render("sphere", frame) else { return };
    assert_eq!(picture.dimensions(), (400, 400));
}
