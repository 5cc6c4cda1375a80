//! The CPU's share of one frame in a scene of a million triangles and a hundred thousand line segments: dressing the
//! scene, culling, uniforms and command encoding (phases: medians of wall time; "CPU": mean of this thread's time), and
//! the panels around it (the whole application driven by a mouse that turns the model: layout, picking, dressing,
//! tessellation of the user interface), against 4 ms for all of it. On a real GPU the time until the picture is there is
//! shown as well.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken scene")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Event, Modifiers, PointerButton, Pos2, pos2};
use glam::{DVec2, DVec3};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::job::Job;
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::history::History;
use patchwright::render::{Display, Emphasis, Gpu, Key, Look, Offscreen, Stage, VolumeItem};
use patchwright::ui::{App, Options};
use patchwright::view::camera::{Axis, Camera};
use patchwright::view::display::Extent;
use patchwright::view::inspect::{Coloring, Hierarchy, Shown, VolumeForm};
use patchwright::view::scene::{Request, Scene};
use patchwright::view::viewport::{View, Viewport};

/// Hills of `n` x `n` wavy patches with 12 x 12 spans.
fn hills(n: usize) -> Document {
    let mut document = Document::new(Unit::Metre);
    let breaks: Vec<f64> = (0..=12).map(f64::from).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let count = knots.control_count();
    let step = 10.0 / n as f64;
    for b in 0..n {
        for a in 0..n {
            let height = |k: usize| {
                let (i, j) = ((k % count) as f64 / (count - 1) as f64, (k / count) as f64 / (count - 1) as f64);
                let (x, y) = ((a as f64 + i) * step, (b as f64 + j) * step);
                DVec3::new(x, y, 0.2 * (3.0 * x).sin() * (2.0 * y).cos() + 0.05 * (17.0 * x + 11.0 * y).sin())
            };
            let points = (0..count * count).map(height).collect();
            let surface = Surface::new(knots.clone(), knots.clone(), points, None).unwrap();
            document.add(format!("{a} {b}"), Shape::Surface(Arc::new(surface)), None);
        }
    }
    document
}

/// A scene of at least a million triangles.
fn scene(n: usize) -> Scene {
    let document = hills(n);
    let mut chord_tol = 1e-2;
    loop {
        let mut scene = Scene::default();
        scene.sync(&document);
        for item in scene.items().to_vec() {
            scene.accept(
                Request { id: item.id(), geometry: item.geometry.clone(), chord_tol, extent: Extent::All, begun: None }
                    .run(),
            );
        }
        if scene.counts().0 >= 1_000_000 {
            return scene;
        }
        chord_tol /= 1.2;
    }
}

/// Frames measured.
const ROUNDS: u32 = 200;

/// CPU time of this thread: what other programs do meanwhile does not count. Coarse, so it is read around many frames.
/// Wall time where the system does not say.
fn cpu() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let scheduled = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanos = scheduled.and_then(|text| text.split(' ').next()?.parse().ok());
    nanos.map_or_else(|| START.get_or_init(Instant::now).elapsed(), Duration::from_nanos)
}

fn median(times: &mut [Duration]) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return println!("skipped: {e}"),
    };
    println!("{}", gpu.name);
    println!(
        "{:>9} {:>10} {:>9} {:>7}  {:>9} {:>9} {:>9} {:>9}  target 4 ms in all",
        "surfaces", "triangles", "segments", "draws", "dress ms", "encode ms", "submit ms", "CPU ms"
    );
    let screen = Viewport::new(1920.0, 1080.0);
    let mut offscreen = Offscreen::new(gpu);
    for (n, close) in [(10, false), (10, true), (30, false)] {
        let scene = scene(n);
        let mut camera = Camera::default();
        camera.look_along(Axis::Oblique);
        camera.frame(&scene.bounds(), screen);
        if close {
            camera.distance *= 0.3;
        }
        let look = Look { display: Display { isolines: true, ..Display::default() }, ..Look::default() };
        let mut stage = Stage::default();
        let mut frame = |camera: &mut Camera| {
            // The camera moves every frame, as it does under the hand.
            camera.orbit(camera.target, DVec2::new(3.0, 0.4), screen);
            let view = View::new(camera, screen, &scene.bounds());
            Arc::new(stage.frame(&scene, &view, &look, |_| Emphasis::Normal))
        };
        // The first frames build buffers.
        let software = offscreen.gpu().software;
        let mut picture = Vec::new();
        for _ in 0..if software { 2 } else { 40 } {
            let begun = Instant::now();
            offscreen.submit(&frame(&mut camera));
            offscreen.wait();
            picture.push(begun.elapsed());
        }
        let (mut dress, mut encode) = (Vec::new(), Vec::new());
        let before = cpu();
        for _ in 0..ROUNDS {
            let start = Instant::now();
            let frame = frame(&mut camera);
            dress.push(start.elapsed());
            let start = Instant::now();
            // Thrown away: a software adapter would draw it on the same cores.
            drop(offscreen.encode(&frame));
            encode.push(start.elapsed());
        }
        let all = (cpu() - before).as_secs_f64() * 1e3 / f64::from(ROUNDS);
        let start = Instant::now();
        let commands = offscreen.encode(&frame(&mut camera));
        let encoded = start.elapsed();
        offscreen.gpu().queue.submit(commands);
        let submit = (start.elapsed() - encoded).as_secs_f64() * 1e3;
        offscreen.wait();
        let (triangles, segments) = scene.counts();
        println!(
            "{:>9} {triangles:>10} {segments:>9} {:>7}  {:>9.3} {:>9.3} {submit:>9.3} {all:>9.3}  {}",
            n * n,
            offscreen.stats().draws,
            median(&mut dress),
            median(&mut encode),
            if all + submit < 4.0 { "met" } else { "missed" }
        );
        if !software {
            println!("          until the picture is there: {:.3} ms", median(&mut picture));
        }
    }
    level(&mut offscreen, screen);
    println!("the whole window up to encoding, CPU ms a frame (mean of this thread's time):");
    println!("{:>9} {:>10} {:>9}  {:>9} {:>9}", "surfaces", "triangles", "segments", "turning", "hovering");
    for n in [10, 30] {
        window(n);
    }
}

/// The application in its window while a hand turns the model, and while it only points: everything that runs on the
/// CPU before commands are encoded.
fn window(n: usize) {
    let ctx = egui::Context::default();
    let mut app = App::new(&eframe::CreationContext::_new_kittest(ctx.clone()), Options::default());
    app.editor.history = History::new(hills(n), true);
    let mut host = eframe::Frame::_new_kittest();
    let screen = egui::Rect::from_min_size(Pos2::ZERO, egui::vec2(1920.0, 1080.0));
    let mut time = 0.0;
    let mut frame = |app: &mut App, events: Vec<Event>| {
        time += 1.0 / 60.0;
        let input = egui::RawInput { screen_rect: Some(screen), time: Some(time), events, ..Default::default() };
        let output = ctx.run_ui(input, |ui| {
            eframe::App::logic(app, ui.ctx(), &mut host);
            eframe::App::ui(app, ui, &mut host);
        });
        ctx.tessellate(output.shapes, output.pixels_per_point);
    };
    let mut calm = 0;
    while calm < 5 {
        frame(&mut app, Vec::new());
        let busy = app.editor.viewport.is_moving() || app.editor.files.is_opening();
        calm = if busy { 0 } else { calm + 1 };
        std::thread::sleep(Duration::from_millis(2));
    }
    app.editor.viewport.scene = scene(n);
    let at = |k: u32| pos2(960.0 + 3.0 * (k % 60) as f32, 540.0 + 0.4 * (k % 60) as f32);
    let mut measured = |app: &mut App, first: Vec<Event>| {
        frame(app, first);
        let before = cpu();
        for k in 0..ROUNDS {
            frame(app, vec![Event::PointerMoved(at(k))]);
        }
        (cpu() - before).as_secs_f64() * 1e3 / f64::from(ROUNDS)
    };
    let hovering = measured(&mut app, Vec::new());
    let press =
        Event::PointerButton { pos: at(0), button: PointerButton::Middle, pressed: true, modifiers: Modifiers::NONE };
    let turning = measured(&mut app, vec![press]);
    let (triangles, segments) = app.editor.viewport.scene.counts();
    println!("{:>9} {triangles:>10} {segments:>9}  {turning:>9.3} {hovering:>9.3}", n * n);
}

/// A level of 512 x 512 nodes as silhouettes: what the worker takes to dress it, and the frame's share of the CPU
/// while the camera turns, seen as a whole and from nearby.
fn level(offscreen: &mut Offscreen, screen: Viewport) {
    let document = hills(1);
    let (id, surface) = document.surfaces().next().unwrap();
    let patch = surface.restricted([0.0, 1.0], [0.0, 1.0]).unwrap();
    let job = Job::new();
    let begun = Instant::now();
    let hierarchy = Hierarchy::build(id, Arc::new(patch), 9, &job).unwrap();
    let built = begun.elapsed();
    let begun = Instant::now();
    let (form, coloring) = (VolumeForm::Swept, Coloring::Error);
    let shown = Shown::new(&hierarchy.tree, &hierarchy.surface, 9, form, coloring, &job).unwrap();
    let bounds = hierarchy.surface.bounds();
    let item = VolumeItem::of_level(Key::new(1, 0), 1, &shown, bounds.center()).unwrap();
    println!(
        "level 9 of one Bezier patch: {} nodes, built and counted in {:.1} ms, dressed in {:.1} ms",
        shown.nodes.len(),
        built.as_secs_f64() * 1e3,
        begun.elapsed().as_secs_f64() * 1e3
    );
    for (name, closer) in [("whole", 1.0), ("near", 0.15)] {
        let mut camera = Camera::default();
        camera.look_along(Axis::Oblique);
        camera.frame(&bounds, screen);
        camera.distance *= closer;
        let scene = Scene::default();
        let mut stage = Stage::default();
        let mut frame = || {
            camera.orbit(camera.target, DVec2::new(3.0, 0.4), screen);
            let view = View::new(&camera, screen, &bounds);
            let mut frame = stage.frame(&scene, &view, &Look::default(), |_| Emphasis::Normal);
            frame.volumes.push(item.clone());
            Arc::new(frame)
        };
        let mut picture = Vec::new();
        for _ in 0..if offscreen.gpu().software { 3 } else { 40 } {
            let begun = Instant::now();
            offscreen.submit(&frame());
            offscreen.wait();
            picture.push(begun.elapsed());
        }
        let mut encode = Vec::new();
        let before = cpu();
        for _ in 0..ROUNDS {
            let frame = frame();
            let start = Instant::now();
            drop(offscreen.encode(&frame));
            encode.push(start.elapsed());
        }
        let all = (cpu() - before).as_secs_f64() * 1e3 / f64::from(ROUNDS);
        let stats = offscreen.stats();
        println!(
            "  {name}: {} of {} volumes after culling, {} draws, encode {:.3} ms, CPU {all:.3} ms, picture {:.1} ms",
            stats.volumes,
            stats.volumes_total,
            stats.draws,
            median(&mut encode),
            median(&mut picture)
        );
    }
}
