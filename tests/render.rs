//! Pictures rendered off screen, checked against what geometry says must be in them.
//!
//! Without a Vulkan adapter every test reports itself as skipped; with `PATCHWRIGHT_REQUIRE_GPU=1` that is a failure.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop where its helpers fail")]

use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec3, Vec3};
use image::{Rgba, RgbaImage};
use patchwright::render::{
    CameraData, Color, ColorScale, Dash, Display, Emphasis, Field, FrameData, FrameStats, GlyphData, GlyphItem,
    GlyphShape, Gpu, Hidden, Key, LineData, LineItem, LineRole, LineStyle, MeshData, MeshItem, Offscreen, Renderer,
    Section, Viewport, VolumeData, VolumeForm, VolumeItem, srgb, to_srgb8,
};
use patchwright::view::rounded_box::RoundedBox;

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

fn render(test: &str, frame: &FrameData) -> Option<RgbaImage> {
    let mut shared = offscreen(test)?;
    let picture = shared.as_mut().unwrap().render(&Arc::new(frame.clone())).unwrap();
    if let Some(folder) = std::env::var_os("PATCHWRIGHT_PICTURES") {
        picture.save(std::path::Path::new(&folder).join(format!("{test}.png"))).unwrap();
    }
    Some(picture)
}

/// A number that no other call returns.
fn fresh() -> u64 {
    static NEXT: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(1);
    NEXT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)
}

/// A sphere as a latitude-longitude mesh.
fn sphere(center: DVec3, radius: f32) -> Arc<MeshData> {
    let (nu, nv) = (96u32, 48u32);
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..=nv {
        for i in 0..=nu {
            let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
            let (a, b) = (u * std::f32::consts::TAU, (v - 0.5) * std::f32::consts::PI);
            let n = Vec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
            positions.push((n * radius).to_array());
            normals.push(n.to_array());
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let k = j * (nu + 1) + i;
            triangles.push([k, k + 1, k + nu + 2]);
            triangles.push([k, k + nu + 2, k + nu + 1]);
        }
    }
    Arc::new(MeshData::new(center, &positions, &normals, triangles))
}

fn item(entity: u64, mesh: Arc<MeshData>, hex: u32) -> MeshItem {
    MeshItem {
        key: Key::new(entity, 0),
        revision: fresh(),
        mesh,
        color: srgb(hex),
        emphasis: Default::default(),
        field: None,
        sectioned: true,
    }
}

/// A square of side 2 in the plane z = 0, facing +z.
fn square(center: DVec3) -> Arc<MeshData> {
    facing(center, 1.0, vec![[0, 1, 2], [0, 2, 3]])
}

/// Triangles of its corners, with normals along z.
fn facing(center: DVec3, z: f32, triangles: Vec<[u32; 3]>) -> Arc<MeshData> {
    let positions = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    Arc::new(MeshData::new(center, &positions, &[[0.0, 0.0, z]; 4], triangles))
}

fn line(entity: u64, points: &[DVec3], style: LineStyle) -> LineItem {
    let mut lines = LineData::new(points[0]);
    lines.push(points.iter().copied());
    LineItem {
        key: Key::new(entity, 0),
        revision: fresh(),
        lines: Arc::new(lines),
        style,
        role: LineRole::Curve,
        emphasis: Default::default(),
        sectioned: true,
    }
}

/// Looks down -z; 100 pixels per model unit; a plain white backdrop.
fn plan_view(size: [u32; 2]) -> FrameData {
    let [w, h] = size.map(f64::from);
    let camera = CameraData::orthographic(DVec3::Z * 10.0, DVec3::ZERO, DVec3::Y, h / 100.0, w / h, 1.0, 20.0);
    let mut frame = FrameData::new(size, camera);
    frame.background.top = srgb(0xffffff);
    frame.background.bottom = srgb(0xffffff);
    frame
}

fn is_background(p: &Rgba<u8>) -> bool {
    p.0[..3].iter().all(|&c| c >= 254)
}

/// How much of a pixel is not background, for something black on white.
fn ink(p: &Rgba<u8>) -> f64 {
    1.0 - f64::from(srgb(u32::from(p.0[0]) << 16)[0])
}

const BLACK: Color = [0.0, 0.0, 0.0, 1.0];

#[test]
fn a_sphere_covers_the_pixels_of_its_silhouette() {
    let mut frame = plan_view([400, 400]);
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 1.0), 0x8fb3d9));
    let Some(picture) = render("sphere", &frame) else { return };
    assert_eq!(picture.dimensions(), (400, 400));
    let covered = picture.pixels().filter(|p| !is_background(p)).count() as f64;
    // Partly covered pixels of the rim count as whole: about half a pixel more of radius.
    let radius = (covered / std::f64::consts::PI).sqrt();
    assert!((100.0..101.0).contains(&radius), "{radius}");
    let row: Vec<u32> = (0..400).filter(|&x| !is_background(picture.get_pixel(x, 200))).collect();
    assert!(row[0].abs_diff(100) <= 1 && row[row.len() - 1].abs_diff(299) <= 1, "{} {}", row[0], row[row.len() - 1]);
}

#[test]
fn a_perspective_silhouette_is_where_the_tangent_cone_is() {
    let (distance, fov) = (3.0_f64, 0.9_f64);
    let camera = CameraData::perspective(DVec3::Z * distance, DVec3::ZERO, DVec3::Y, fov, 1.0, 0.01);
    let mut frame = FrameData { camera, ..plan_view([500, 500]) };
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 1.0), 0x8fb3d9));
    let Some(picture) = render("perspective", &frame) else { return };
    let expected = 250.0 / (0.5 * fov).tan() / (distance * distance - 1.0).sqrt();
    let row = (0..500).filter(|&x| !is_background(picture.get_pixel(x, 250))).count() as f64;
    assert!((row / 2.0 - expected).abs() < 1.0, "{row} {expected}");
}

#[test]
fn the_nearer_thing_is_seen_whatever_the_order() {
    // A gap of 1e-5 of the viewing distance is resolved, near the eye and far away.
    for distance in [2.0, 2e4] {
        for near_first in [true, false] {
            let eye = DVec3::Z * distance;
            let camera = CameraData::perspective(eye, DVec3::ZERO, DVec3::Y, 2.0 / distance, 1.0, 1e-3);
            let mut frame = FrameData { camera, ..plan_view([64, 64]) };
            let red = item(1, square(DVec3::Z * 1e-5 * distance), 0xff2020);
            let blue = item(2, square(DVec3::ZERO), 0x2020ff);
            frame.meshes = if near_first { vec![red, blue] } else { vec![blue, red] };
            let Some(picture) = render("depth", &frame) else { return };
            for p in [picture.get_pixel(32, 32), picture.get_pixel(20, 44)] {
                assert!(p.0[0] > p.0[2] + 50, "{p:?} at {distance}");
            }
        }
    }
}

#[test]
fn the_section_plane_removes_the_half_its_normal_points_to() {
    let mut frame = plan_view([300, 300]);
    frame.meshes.push(item(1, sphere(DVec3::new(1e3, 0.0, 0.0), 1.0), 0x8fb3d9));
    frame.camera.view *= glam::DMat4::from_translation(DVec3::new(-1e3, 0.0, 0.0));
    frame.section = Some(Section { normal: DVec3::X, offset: 1e3 + 0.25 });
    let Some(picture) = render("section", &frame) else { return };
    // x = 0.25 is pixel 175.
    for (x, y, p) in picture.enumerate_pixels() {
        let inside = (f64::from(x) + 0.5 - 150.0).hypot(f64::from(y) + 0.5 - 150.0) < 98.0;
        if x >= 176 {
            assert!(is_background(p), "{x} {y}");
        } else if x < 174 && inside {
            assert!(!is_background(p), "{x} {y}");
        }
    }
    frame.meshes[0].sectioned = false;
    let Some(whole) = render("section-off", &frame) else { return };
    assert!(!is_background(whole.get_pixel(200, 150)));
}

#[test]
fn a_line_has_its_width_and_its_length() {
    for width in [1.0, 1.5, 3.0, 8.0] {
        let mut frame = plan_view([200, 100]);
        let style = LineStyle { width, color: BLACK, dash: Dash::Solid, hidden: Hidden::Dashed };
        frame.lines.push(line(1, &[DVec3::new(-0.503, 0.037, 0.0), DVec3::new(0.497, 0.037, 0.0)], style));
        let Some(picture) = render("width", &frame) else { return };
        let total: f64 = picture.pixels().map(ink).sum();
        let column: f64 = (0..100).map(|y| ink(picture.get_pixel(100, y))).sum();
        assert!((column - f64::from(width)).abs() < 0.06, "{column} for {width}");
        // Two round ends make one disc.
        let disc = std::f64::consts::PI * f64::from(width * width) / 4.0;
        let expected = 100.0 * f64::from(width) + disc;
        assert!((total - expected).abs() < 0.05 * expected, "{total} for {expected}");
    }
}

#[test]
fn a_translucent_polyline_is_even_at_its_joints() {
    let mut frame = plan_view([220, 220]);
    let arc: Vec<DVec3> =
        (0..=300).map(|k| f64::from(k) / 300.0 * 6.0).map(|t| DVec3::new(t.cos(), t.sin(), 0.0)).collect();
    let color = [0.0, 0.0, 0.0, 0.5];
    frame.lines.push(line(1, &arc, LineStyle { width: 6.0, color, dash: Dash::Solid, hidden: Hidden::Gone }));
    let Some(picture) = render("joints", &frame) else { return };
    let mut seen = 0;
    for (x, y, p) in picture.enumerate_pixels() {
        let (dx, dy) = (f64::from(x) + 0.5 - 110.0, 110.0 - f64::from(y) - 0.5);
        let angle = dy.atan2(dx).rem_euclid(std::f64::consts::TAU);
        if (dx.hypot(dy) - 100.0).abs() < 1.8 && (0.1..5.9).contains(&angle) {
            assert!((ink(p) - 0.5).abs() < 0.03, "{x} {y} {p:?}");
            seen += 1;
        }
    }
    assert!(seen > 1500, "{seen}");
}

/// Runs of ink along a row.
fn strokes(picture: &RgbaImage, y: u32, threshold: f64) -> usize {
    let on: Vec<bool> = (0..picture.width()).map(|x| ink(picture.get_pixel(x, y)) > threshold).collect();
    on.windows(2).filter(|w| !w[0] && w[1]).count()
}

#[test]
fn a_line_is_dashed_where_it_is_hidden() {
    // White squares on white, so that only the lines are ink. The line runs behind the square's right half.
    let mut frame = plan_view([400, 100]);
    frame.display = Display { shaded: false, ..Display::default() };
    frame.meshes.push(item(1, square(DVec3::new(1.0, 0.0, 1.0)), 0xffffff));
    let style = LineStyle { width: 3.0, color: BLACK, dash: Dash::Solid, hidden: Hidden::Dashed };
    frame.lines.push(line(2, &[DVec3::new(-1.9, 0.005, 0.0), DVec3::new(1.9, 0.005, 0.0)], style));
    let Some(picture) = render("hidden", &frame) else { return };
    let dark = |from: u32, to: u32| (from..to).map(|x| ink(picture.get_pixel(x, 49))).fold(0.0, f64::max);
    assert!((12..=195).all(|x| ink(picture.get_pixel(x, 49)) > 0.95), "the visible half is unbroken");
    assert!((dark(210, 380) - 0.4).abs() < 0.03, "hidden strokes have 40 %: {}", dark(210, 380));
    assert!(strokes(&picture, 49, 0.2) > 12);
    assert!((205..380).filter(|&x| ink(picture.get_pixel(x, 49)) < 0.02).count() > 40, "there are gaps");

    frame.lines[0].style.hidden = Hidden::Gone;
    let Some(gone) = render("hidden-gone", &frame) else { return };
    assert!((205..395).all(|x| is_background(gone.get_pixel(x, 49))));
    frame.lines[0].style.hidden = Hidden::OnTop;
    let Some(top) = render("hidden-on-top", &frame) else { return };
    assert!((12..385).all(|x| ink(top.get_pixel(x, 49)) > 0.95));
}

#[test]
fn an_edge_on_its_own_surface_is_not_eaten_by_it() {
    // The border of a tilted square, seen at angles up to nearly edge on, in both projections.
    for perspective in [true, false] {
        for degrees in [0.0_f64, 45.0, 75.0, 85.0] {
            let tilt = degrees.to_radians();
            let eye = DVec3::new(0.0, -tilt.sin(), tilt.cos()) * 10.0;
            let camera = if perspective {
                CameraData::perspective(eye, DVec3::ZERO, DVec3::Y, 0.4, 1.0, 0.1)
            } else {
                CameraData::orthographic(eye, DVec3::ZERO, DVec3::Y, 4.0, 1.0, 0.1, 20.0)
            };
            let mut frame = FrameData { camera, ..plan_view([400, 400]) };
            frame.meshes.push(item(1, square(DVec3::ZERO), 0xffffff));
            let points = [DVec3::new(-0.9, 0.0, 0.0), DVec3::new(0.9, 0.0, 0.0)];
            let style = LineStyle { width: 2.0, color: [1.0, 0.0, 0.0, 1.0], dash: Dash::Solid, hidden: Hidden::Gone };
            frame.lines.push(line(2, &points, style));
            let Some(picture) = render("edge", &frame) else { return };
            let red = picture.pixels().filter(|p| p.0[0] > 200 && p.0[1] < 60).count();
            assert!(red >= 300, "{red} pixels of 2 x 180 at {degrees} degrees, perspective {perspective}");
        }
    }
}

#[test]
fn two_renderings_are_the_same_to_the_bit() {
    let mut frame = plan_view([300, 200]);
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 0.8), 0x8fb3d9));
    let arc: Vec<DVec3> = (0..50).map(|k| DVec3::new((f64::from(k) * 0.2).cos(), f64::from(k) * 0.02, 1.0)).collect();
    frame.lines.push(line(2, &arc, LineStyle::default()));
    let Some(first) = render("twice", &frame) else { return };
    let Some(again) = render("twice", &frame) else { return };
    assert_eq!(first, again);
    // A second device, with nothing left over from other frames.
    let mut other = Offscreen::new(Gpu::headless().unwrap());
    assert_eq!(first, other.render(&Arc::new(frame)).unwrap());
}

#[test]
fn a_model_far_from_the_origin_looks_as_it_does_at_the_origin() {
    let picture = |at: DVec3| {
        let mut frame = plan_view([200, 200]);
        let eye = DVec3::new(3.0, 2.0, 5.0);
        frame.camera = CameraData::perspective(at + eye, at, DVec3::Y, 0.5, 1.0, 0.1);
        frame.meshes.push(item(1, sphere(at, 1.0), 0x8fb3d9));
        let ring: Vec<DVec3> = (0..=60)
            .map(|k| f64::from(k) / 30.0 * std::f64::consts::PI)
            .map(|t| at + DVec3::new(t.cos(), t.sin(), 0.0) * 1.3)
            .collect();
        frame.lines.push(line(2, &ring, LineStyle::default()));
        render("far", &frame)
    };
    let (Some(here), Some(far)) = (picture(DVec3::ZERO), picture(DVec3::new(1e6, -3e6, 2e6))) else { return };
    // Rounding of the eye's position by 1e-9 may tip a sample that lies exactly on an edge, here and there.
    let differ = |(a, b): &(&Rgba<u8>, &Rgba<u8>)| (0..3).any(|k| a.0[k].abs_diff(b.0[k]) > 2);
    let count = here.pixels().zip(far.pixels()).filter(differ).count();
    assert!(count <= 12, "{count} of 40000 pixels differ");
}

#[test]
fn a_field_shows_its_steps_and_hatches_what_it_does_not_know() {
    let scale = Arc::new(ColorScale::deviation(1.0, 0.1));
    let picture = |value: f32| {
        let mut frame = plan_view([100, 100]);
        let mut square = item(1, square(DVec3::ZERO), 0x00ff00);
        square.field = Some(Field { revision: fresh(), values: Arc::new(vec![value; 4]), scale: scale.clone() });
        frame.meshes.push(square);
        render("field", &frame)
    };
    // Light keeps the hue: red over green over blue order of the step survives.
    for value in [-2.0, -0.95, -0.5, 0.5, 0.95, 2.0, f32::INFINITY] {
        let Some(picture) = picture(value) else { return };
        let got = picture.get_pixel(50, 50).0;
        let want = to_srgb8(scale.color(value));
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            if want[a].abs_diff(want[b]) > 20 {
                assert_eq!(got[a] > got[b], want[a] > want[b], "{value}: {got:?} for {want:?}");
            }
        }
    }
    let Some(hatched) = picture(f32::NAN) else { return };
    let row: Vec<u8> = (20..80).map(|x| hatched.get_pixel(x, 50).0[0]).collect();
    let grey = hatched.get_pixel(50, 50).0;
    assert!(grey[0].abs_diff(grey[1]) < 12 && grey[1].abs_diff(grey[2]) < 12, "{grey:?}");
    assert!(row.iter().max().unwrap() - row.iter().min().unwrap() > 30, "hatching has contrast");
}

#[test]
fn the_back_of_a_surface_is_told_from_its_front() {
    let mut frame = plan_view([100, 100]);
    frame.meshes.push(item(1, square(DVec3::ZERO), 0x8fb3d9));
    let Some(front) = render("front", &frame) else { return };
    frame.meshes[0] = item(1, facing(DVec3::ZERO, -1.0, vec![[0, 2, 1], [0, 3, 2]]), 0x8fb3d9);
    let Some(back) = render("back", &frame) else { return };
    let (f, b) = (front.get_pixel(50, 50).0, back.get_pixel(50, 50).0);
    assert!(f[2] > b[2].saturating_add(25), "{f:?} {b:?}");
    assert!(b[..3].iter().all(|&c| c > 40), "a back is muted, not black: {b:?}");
}

#[test]
fn glyphs_keep_their_size_on_screen() {
    for (shape, area) in [
        (GlyphShape::Round, std::f64::consts::PI * 100.0),
        (GlyphShape::Diamond, 200.0),
        (GlyphShape::Square, 4.0 * 8.2 * 8.2),
    ] {
        for distance in [5.0, 50.0] {
            let camera = CameraData::perspective(DVec3::Z * distance, DVec3::ZERO, DVec3::Y, 0.5, 1.0, 0.1);
            let mut frame = FrameData { camera, ..plan_view([100, 100]) };
            let mut glyphs = GlyphData::new(DVec3::ZERO);
            glyphs.push(DVec3::ZERO, shape, 20.0, [1.0, 0.0, 0.0, 1.0]);
            frame.glyphs.push(GlyphItem {
                key: Key::new(1, 0),
                revision: fresh(),
                glyphs: Arc::new(glyphs),
                hidden: Hidden::Dashed,
                sectioned: true,
            });
            let Some(picture) = render("glyph", &frame) else { return };
            // The rim around something this dark is white, as the backdrop is: what lacks green is the glyph.
            let red: f64 = picture.pixels().map(|p| 1.0 - f64::from(srgb(u32::from(p.0[1]))[2])).sum();
            assert!((red - area).abs() < 0.03 * area, "{shape:?} covers {red} of {area} at {distance}");
        }
    }
}

#[test]
fn wireframe_fills_nothing_and_xray_hides_nothing() {
    let mut frame = plan_view([100, 100]);
    frame.meshes.push(item(1, square(DVec3::Z), 0x204080));
    frame.lines.push(line(
        2,
        &[DVec3::new(-0.4, 0.0, 0.0), DVec3::new(0.4, 0.0, 0.0)],
        LineStyle { width: 4.0, color: BLACK, ..LineStyle::default() },
    ));
    frame.display = Display { wireframe: true, ..Display::default() };
    let Some(wire) = render("wireframe", &frame) else { return };
    assert!(is_background(wire.get_pixel(50, 20)) && ink(wire.get_pixel(50, 50)) > 0.95);
    frame.display = Display { xray: true, ..Display::default() };
    let Some(xray) = render("xray", &frame) else { return };
    let (fill, line) = (ink(xray.get_pixel(50, 20)), ink(xray.get_pixel(50, 50)));
    assert!(fill > 0.05 && fill < 0.7 && line > fill + 0.2, "{fill} {line}");
}

fn stats(test: &str, frame: &FrameData) -> Option<FrameStats> {
    let mut shared = offscreen(test)?;
    shared.as_mut().unwrap().submit(&Arc::new(frame.clone()));
    Some(shared.as_ref().unwrap().stats())
}

#[test]
fn buffers_are_rebuilt_only_when_a_revision_changes() {
    // Keys of its own: the viewport is shared with tests that run at the same time.
    let mut frame = plan_view([64, 64]);
    frame.meshes.push(item(1001, sphere(DVec3::ZERO, 1.0), 0x8fb3d9));
    frame.lines.push(line(1002, &[DVec3::ZERO, DVec3::X], LineStyle::default()));
    let Some(first) = stats("revisions", &frame) else { return };
    assert_eq!(first.rebuilt, 2);
    frame.camera.view *= glam::DMat4::from_rotation_z(0.1);
    assert_eq!(stats("revisions", &frame).map(|s| s.rebuilt), Some(0));
    frame.meshes[0].revision = fresh();
    assert_eq!(stats("revisions", &frame).map(|s| s.rebuilt), Some(1));
}

#[test]
fn what_is_outside_the_picture_is_not_drawn() {
    let mut frame = plan_view([64, 64]);
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 0.1), 0x8fb3d9));
    frame.meshes.push(item(2, sphere(DVec3::X * 5.0, 0.1), 0x8fb3d9));
    let Some(stats) = stats("culling", &frame) else { return };
    assert_eq!(stats.triangles * 2, stats.triangles_total);
}

#[test]
fn the_window_shows_the_same_colours_as_the_picture() {
    let Some(mut shared) = offscreen("blit") else { return };
    let mut frame = plan_view([64, 48]);
    frame.background = patchwright::render::Background::dark();
    frame.meshes.push(item(1, sphere(DVec3::ZERO, 0.2), 0xd0a060));
    let frame = Arc::new(frame);
    let offscreen = shared.as_mut().unwrap();
    let expected = offscreen.render(&frame).unwrap();
    let Gpu { device, queue, .. } = offscreen.gpu().clone();
    // A window's format: bytes are sRGB, the format does not say so.
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut viewport = Viewport::new(&device, Arc::new(Renderer::new(&device, format)));
    let first = viewport.prepare(&device, &queue, &frame);
    assert!(first.is_some());
    assert!(viewport.prepare(&device, &queue, &frame).is_none(), "the same frame is not drawn twice");
    queue.submit(first);
    let size = wgpu::Extent3d { width: 64, height: 48, depth_or_array_layers: 1 };
    let window = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = window.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    });
    viewport.paint(&mut pass);
    drop(pass);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 256 * 48,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(256), rows_per_image: None };
    let into = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(window.as_image_copy(), into, size);
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |r| r.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.slice(..).get_mapped_range().unwrap();
    let worst = bytes.iter().zip(expected.as_raw()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst <= 1, "{worst}");
}

#[test]
fn emphases_strokes_and_glyphs_are_told_apart() {
    let mut frame = FrameData { background: patchwright::render::Background::light(), ..plan_view([700, 420]) };
    let emphases = [Emphasis::Muted, Emphasis::Normal, Emphasis::Hovered, Emphasis::Selected];
    for (k, &emphasis) in emphases.iter().enumerate() {
        let at = DVec3::new(-2.7 + 1.6 * k as f64, 1.2, -1.0);
        frame.meshes.push(MeshItem { emphasis, ..item(10 + k as u64, sphere(at, 0.7), 0xb4c0cc) });
        let arc: Vec<DVec3> = (0..=40)
            .map(|i| f64::from(i) / 40.0 * 2.0)
            .map(|t| at + DVec3::new(0.5 * t.cos(), 0.5 * t.sin(), 0.55))
            .collect();
        frame.lines.push(LineItem { emphasis, ..line(10 + k as u64, &arc, LineStyle::default()) });
    }
    let strokes = [Dash::Solid, Dash::LONG, Dash::SHORT, Dash::Double];
    for (k, &dash) in strokes.iter().enumerate() {
        let y = 0.1 - 0.25 * k as f64;
        let wave: Vec<DVec3> = (0..=100)
            .map(|i| f64::from(i) * 0.06)
            .map(|x| DVec3::new(x - 3.0, y + 0.08 * (3.0 * x).sin(), 0.0))
            .collect();
        frame.lines.push(line(
            20 + k as u64,
            &wave,
            LineStyle { width: 1.0 + 0.5 * k as f32, dash, ..LineStyle::default() },
        ));
    }
    let mut glyphs = GlyphData::new(DVec3::ZERO);
    let shapes = [
        GlyphShape::Round,
        GlyphShape::Ring,
        GlyphShape::Cross,
        GlyphShape::Diamond,
        GlyphShape::Square,
        GlyphShape::Triangle,
    ];
    let place = |k: usize| DVec3::new(-3.0 + k as f64, -1.2, 0.0);
    let ink = srgb(0x1f5fa8);
    for (k, &shape) in shapes.iter().enumerate() {
        glyphs.push(place(k), shape, 18.0, ink);
        glyphs.push(place(k) - DVec3::Y * 0.45, shape, 9.0, srgb(0xf07f13));
    }
    glyphs.push_arrow(place(6), DVec3::new(1.0, 1.0, 0.0), 18.0, ink);
    glyphs.push_arrow(place(6) - DVec3::Y * 0.45, DVec3::X, 12.0, srgb(0xf07f13));
    frame.glyphs.push(GlyphItem {
        key: Key::new(30, 0),
        revision: fresh(),
        glyphs: Arc::new(glyphs),
        hidden: Hidden::OnTop,
        sectioned: false,
    });
    let Some(picture) = render("styles", &frame) else { return };
    let pixel = |at: DVec3| {
        let (x, y) = (350.0 + 100.0 * at.x, 210.0 - 100.0 * at.y);
        picture.get_pixel(x as u32, y as u32).0
    };
    let crop = |at: DVec3| -> Vec<u8> {
        let (x, y) = ((350.0 + 100.0 * at.x) as u32, (210.0 - 100.0 * at.y) as u32);
        (0..24)
            .flat_map(|j| (0..24).map(move |i| (i, j)))
            .map(|(i, j)| picture.get_pixel(x + i - 12, y + j - 12).0[0])
            .collect()
    };
    for a in 0..7 {
        for b in 0..a {
            let differ = crop(place(a)).iter().zip(&crop(place(b))).filter(|(p, q)| p.abs_diff(**q) > 60).count();
            assert!(differ > 25, "glyphs {a} and {b} differ in {differ} pixels");
        }
    }
    let sphere = |k: usize| pixel(DVec3::new(-2.7 + 1.6 * k as f64, 1.1, 0.0));
    let warmth = |p: [u8; 4]| i32::from(p[0]) - i32::from(p[2]);
    let luma = |p: [u8; 4]| p[..3].iter().map(|&c| i32::from(c)).sum::<i32>();
    assert!(luma(sphere(0)) > luma(sphere(1)) + 15, "muted is paler on a pale ground");
    assert!(luma(sphere(2)) > luma(sphere(1)) + 15, "hovered is brighter");
    assert!(warmth(sphere(3)) > warmth(sphere(1)) + 40, "selected takes the accent");
}

fn volumes(list: Vec<RoundedBox>, form: VolumeForm) -> VolumeItem {
    let colors = vec![[30, 60, 120, 255]; list.len()];
    let data = VolumeData { origin: DVec3::ZERO, volumes: Arc::new(list), colors };
    VolumeItem { key: Key::new(1, 0), revision: fresh(), volumes: Arc::new(data), form, opacity: 0.9, sectioned: true }
}

#[test]
fn swept_volumes_cover_what_steiner_says() {
    let turned = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0)]
    };
    // Seen from above: area of the box, its edges times the radius, the corners' disc.
    for (half, radius) in [
        (DVec3::ZERO, 1.2),
        (DVec3::new(1.0, 0.0, 0.0), 0.5),
        (DVec3::new(1.2, 0.7, 0.0), 0.4),
        (DVec3::new(1.2, 0.7, 0.9), 0.0),
    ] {
        let volume = RoundedBox { center: DVec3::new(0.1, -0.2, 0.3), axes: turned(27.0), half, radius };
        let area = 4.0 * half.x * half.y + 4.0 * (half.x + half.y) * radius + std::f64::consts::PI * radius * radius;
        for form in [VolumeForm::Solid, VolumeForm::Outline { width: 1.0, fill: 1.0 }] {
            let mut frame = plan_view([500, 500]);
            frame.volumes.push(volumes(vec![volume], form));
            let Some(picture) = render("volume_area", &frame) else { return };
            let covered = picture.pixels().filter(|p| !is_background(p)).count() as f64 / 1e4;
            assert!((covered - area).abs() < 0.02 * area, "{half} {radius} {form:?}: {covered} instead of {area}");
        }
    }
}

#[test]
fn an_outline_is_hollow_and_stays_thin_at_any_size() {
    for radius in [0.2, 1.0, 2.2] {
        let volume = RoundedBox { center: DVec3::ZERO, axes: [DVec3::X, DVec3::Y], half: DVec3::ZERO, radius };
        let mut frame = plan_view([500, 500]);
        frame.volumes.push(volumes(vec![volume], VolumeForm::Outline { width: 2.0, fill: 0.0 }));
        let Some(picture) = render("volume_outline", &frame) else { return };
        let covered = picture.pixels().filter(|p| !is_background(p)).count() as f64;
        // A ring two pixels wide, with soft rims.
        let ring = std::f64::consts::TAU * radius * 100.0;
        assert!(covered > 1.5 * ring && covered < 4.5 * ring, "{radius}: {covered} pixels on {ring}");
    }
}

#[test]
fn volumes_out_of_the_picture_are_not_sent() {
    let at = |x: f64| RoundedBox {
        center: DVec3::new(x, 0.0, 0.0),
        axes: [DVec3::X, DVec3::Y],
        half: DVec3::new(0.01, 0.01, 0.0),
        radius: 0.001,
    };
    // A strip of sixteen runs, of which the picture shows the first few.
    let list: Vec<RoundedBox> = (0..16 * 1024).map(|k| at(f64::from(k) * 40.0 / 16384.0)).collect();
    let mut frame = plan_view([500, 500]);
    frame.volumes.push(volumes(list, VolumeForm::Outline { width: 1.0, fill: 0.2 }));
    let Some(mut shared) = offscreen("volume_culling") else { return };
    let offscreen = shared.as_mut().unwrap();
    offscreen.render(&Arc::new(frame)).unwrap();
    let stats = offscreen.stats();
    assert_eq!(stats.volumes_total, 16 * 1024);
    assert!(stats.volumes >= 1024 && stats.volumes <= 3 * 1024, "{stats:?}");
}
