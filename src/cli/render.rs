//! `patchwright render FILE --out PICTURE.png`: an off-screen picture, for scripts and for the README.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;
use glam::DVec2;
use serde::Serialize;

use self::layers::{LevelReport, Show};
use super::{CliError, Common, Exit};
use crate::kernel::geom::Aabb;
use crate::kernel::mesh::surface_set::SurfaceSet;
use crate::model::document::{Document, EntityId};
use crate::render::{ColorScale, Coloring, Display, Emphasis, Field, Gpu, Key, Look, Offscreen, Sketch, Stage, Theme};
use crate::view::camera::{Axis, Camera, Projection};
use crate::view::deviation::deviation;
use crate::view::intersection::marks::Focus;
use crate::view::intersection::{Drawing, Found, Picks, Request, Task, compute};
use crate::view::scene::{ItemKind, Scene};
use crate::view::viewport::{View, Viewport};

mod layers;

/// How finely originals are tessellated to measure deviations, as a fraction of the diagonal; closest points are exact
/// whatever this is.
const MEASURE: f64 = 1e-4;
/// The part of the picture that a framed model fills.
const MARGIN: f64 = 0.86;
/// Distances beyond this fraction of the diagonal are no deviations.
const FAR: f64 = 0.05;

/// The number under which intersections are kept on the graphics card; below those of hierarchies.
const OWN: u64 = u64::MAX - 1000;

/// From where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[expect(missing_docs, reason = "each says itself where it looks from")]
pub enum From {
    Iso,
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
}

/// In which surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[expect(missing_docs, reason = "light is light")]
pub enum Surroundings {
    Light,
    Dark,
}

/// Arguments of `render`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The model
    pub file: PathBuf,
    /// Where the picture goes
    #[arg(long, value_name = "PICTURE.png")]
    pub out: PathBuf,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1600x1000", value_parser = size)]
    pub size: [u32; 2],
    /// What is drawn, all of it listed: shaded, edges, isolines, wireframe, xray, untrimmed, zebra, patches, deviation,
    /// intersections (of the surfaces with each other), self-intersections; bvh:N is level N of the hierarchies as
    /// rectangle-swept spheres, spheres:N and boxes:N as those, each coloured by error or by :level or :cone after it;
    /// tori:N is the leaf tori of height N
    #[arg(long, value_delimiter = ',', default_value = "shaded,edges", value_parser = layers::show)]
    pub show: Vec<Show>,
    /// From where
    #[arg(long, default_value = "iso")]
    pub view: From,
    /// Turn the view by these degrees: to the right, then upwards
    #[arg(long, value_name = "RIGHT,UP", value_parser = turn, allow_hyphen_values = true)]
    pub turn: Option<[f64; 2]>,
    /// Fill the picture with these surfaces only (numbers in the file; 0-3,5)
    #[arg(long, value_name = "LIST", value_parser = super::ranges::parse)]
    pub frame: Option<std::vec::Vec<usize>>,
    /// Draw these surfaces only (numbers in the file; 0-3,5)
    #[arg(long, value_name = "LIST", value_parser = super::ranges::parse)]
    pub only: Option<std::vec::Vec<usize>>,
    /// Parallel projection
    #[arg(long)]
    pub parallel: bool,
    /// Light or dark surroundings
    #[arg(long, default_value = "light")]
    pub theme: Surroundings,
    /// Measure deviations of all surfaces of FILE against this model instead of patches against surfaces
    #[arg(long, value_name = "MODEL")]
    pub against: Option<PathBuf>,
    /// The deviation at the ends of the colour scale [default: the largest one]
    #[arg(long)]
    pub range: Option<f64>,
    /// The deviation that is still drawn neutral [default: the middle step of the scale]
    #[arg(long)]
    pub tol: Option<f64>,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    match parsed {
        Some([w, h]) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok([w, h]),
        _ => Err("expected WIDTHxHEIGHT in pixels, each from 1 to 16384, such as 1600x1000".into()),
    }
}

fn turn(text: &str) -> Result<[f64; 2], String> {
    let parsed = text.split_once(',').and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    parsed
        .filter(|t: &[f64; 2]| t.iter().all(|x| x.is_finite()))
        .ok_or_else(|| "expected two angles, such as 20,-5".into())
}

/// What `--json` says.
#[derive(Debug, Serialize)]
struct Report {
    size: [u32; 2],
    adapter: String,
    triangles: usize,
    segments: usize,
    levels: Vec<LevelReport>,
    deviation: Option<DeviationReport>,
    intersections: Option<FoundReport>,
}

#[derive(Debug, Serialize)]
struct FoundReport {
    complete: bool,
    curves: usize,
    points: usize,
    unresolved: usize,
}

#[derive(Debug, Serialize)]
struct DeviationReport {
    max: f64,
    rms: f64,
    measured: usize,
    no_data: usize,
    range: f64,
    tol: f64,
}

/// Runs `render`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let mut document = crate::io::open(&args.file)?.document;
    if let Some(only) = &args.only {
        keep_only(&mut document, only)?;
    }
    let gpu = Gpu::headless()?;
    let mut scene = Scene::only_seen();
    scene.show_whole_surfaces(args.show.contains(&Show::Untrimmed));
    scene.sync(&document);
    let view = view(args, &document, &mut scene)?;

    let shows = |what| args.show.contains(&what);
    let bare = shows(Show::Wireframe) || shows(Show::Xray);
    let look = Look {
        display: Display {
            shaded: shows(Show::Shaded)
                || args.show.iter().any(|s| matches!(s, Show::Tori(_)))
                || shows(Show::Deviation)
                || (shows(Show::Patches) && !bare),
            edges: shows(Show::Edges),
            isolines: shows(Show::Isolines),
            wireframe: shows(Show::Wireframe),
            xray: shows(Show::Xray),
            zebra: shows(Show::Zebra),
        },
        theme: match args.theme {
            Surroundings::Light => Theme::light(),
            Surroundings::Dark => Theme::dark(),
        },
        coloring: if shows(Show::Patches) { Coloring::Palette } else { Coloring::Plain },
        pixels_per_point: (args.size[1] as f32 / 1000.0).max(1.0),
        ..Look::default()
    };
    let measured = if shows(Show::Deviation) { Some(measure(args, &document, &scene)?) } else { None };
    let emphasis = |id: EntityId| match &measured {
        Some((fields, _)) if !fields.iter().any(|(k, _)| k.entity == id.0) => Emphasis::Muted,
        _ => Emphasis::Normal,
    };
    let mut frame = Stage::default().frame(&scene, &view, &look, emphasis);
    if let Some((fields, _)) = &measured {
        for mesh in &mut frame.meshes {
            mesh.field = fields.iter().find(|(key, _)| *key == mesh.key).map(|(_, field)| field.clone());
        }
    }

    let levels = layers::add(&mut frame, &scene, &args.show, &super::job())?;
    let found = intersections(args, &document)?;
    for (at, found) in found.iter().enumerate() {
        let mut sketch = Sketch::new(OWN - at as u64, 1, scene.bounds().center());
        let dark = args.theme == Surroundings::Dark;
        sketch.intersection(&Drawing::new(found, Focus::default(), dark), 1.0, dark);
        sketch.into_frame(&mut frame);
    }

    let mut offscreen = Offscreen::new(gpu);
    let picture = offscreen.render(&Arc::new(frame))?;
    save(&picture, &args.out)?;
    let (triangles, segments) = scene.counts();
    let [width, height] = args.size;
    common.say(format!("{}: {width} x {height} pixels, {triangles} triangles", args.out.display()));
    if let Some((_, d)) = &measured {
        common.say(format!(
            "deviation: {:.3e} at most, {:.3e} rms over {} points; {} without data; colours from {:.3e} to {:.3e}, \
             neutral within {:.3e}",
            d.max, d.rms, d.measured, d.no_data, -d.range, d.range, d.tol
        ));
    }
    for level in &levels {
        common.say(format!(
            "level {}: {} nodes; viridis from {:.3e} to {:.3e}{} is {}",
            level.level,
            level.nodes,
            level.low,
            level.high,
            if level.logarithmic { " (logarithmic)" } else { "" },
            level.colors
        ));
    }
    let intersections = (!found.is_empty()).then(|| FoundReport {
        complete: found.iter().all(|f| f.result.complete),
        curves: found.iter().map(|f| f.result.curves.len()).sum(),
        points: found.iter().map(|f| f.result.junctions.len() + f.result.miters.len()).sum(),
        unresolved: found.iter().map(|f| f.result.unresolved.len()).sum(),
    });
    if let Some(f) = &intersections {
        let s = |n: usize| if n == 1 { "" } else { "s" };
        let (curves, points) = (f.curves, f.points);
        common.say(format!(
            "{curves} intersection curve{}, {points} point{}, {} unresolved",
            s(curves),
            s(points),
            f.unresolved
        ));
    }
    let complete = intersections.as_ref().is_none_or(|f| f.complete);
    let adapter = offscreen.gpu().name.clone();
    let deviation = measured.map(|(_, d)| d);
    common.json(&Report { size: args.size, adapter, triangles, segments, levels, deviation, intersections })?;
    Ok(if complete { Exit::Done } else { Exit::Incomplete })
}

/// What is to be drawn of intersections.
fn intersections(args: &Args, document: &Document) -> Result<Vec<Found>, CliError> {
    let mut out = Vec::new();
    let all: Vec<EntityId> = document.entities().iter().filter(|e| e.surface().is_some()).map(|e| e.id).collect();
    let tasks = [(Show::Intersections, Task::Pairs), (Show::SelfIntersections, Task::Itself)];
    for (_, task) in tasks.into_iter().filter(|(show, _)| args.show.contains(show)) {
        let request = Request::new(&Picks::new(task, &all), document).map_err(|e| CliError::BadArguments(e.into()))?;
        let job = super::job();
        out.push(compute(&request, &job).map_err(CliError::BadArguments)?);
    }
    Ok(out)
}

fn keep_only(document: &mut Document, only: &[usize]) -> Result<(), CliError> {
    let ids = numbered(document, only, "--only")?;
    document.retain(|entity| ids.contains(&entity.id));
    Ok(())
}

/// The surfaces, meshes and blocks with these numbers.
fn numbered(document: &Document, numbers: &[usize], option: &str) -> Result<Vec<EntityId>, CliError> {
    let all: Vec<EntityId> = document.bodies().map(|(id, _)| id).collect();
    let pick = |&n: &usize| {
        let none = || format!("{option}: there is no surface {n}, the file has {} (from 0)", all.len());
        all.get(n).copied().ok_or_else(|| CliError::BadArguments(none()))
    };
    numbers.iter().map(pick).collect()
}

/// The view, with the scene refined for it.
fn view(args: &Args, document: &Document, scene: &mut Scene) -> Result<View, CliError> {
    let framed = args.frame.as_ref().map(|list| numbered(document, list, "--frame")).transpose()?;
    let projection = if args.parallel { Projection::Orthographic } else { Projection::Perspective };
    let mut camera = Camera { projection, ..Camera::default() };
    camera.look_along(match args.view {
        From::Iso => Axis::Oblique,
        From::Front => Axis::Front,
        From::Back => Axis::Back,
        From::Left => Axis::Left,
        From::Right => Axis::Right,
        From::Top => Axis::Top,
        From::Bottom => Axis::Bottom,
    });
    let viewport = Viewport::new(f64::from(args.size[0]), f64::from(args.size[1]));
    if let Some([right, up]) = args.turn {
        // Half a turn for the height of the picture; the eye goes where the turn says.
        let pixels = viewport.height / 180.0;
        camera.orbit(camera.target, DVec2::new(-right, up) * pixels, viewport);
    }
    // The first displays say where things really are, the second ones are as fine as that view needs.
    let mut view = View::new(&camera, viewport, &scene.bounds());
    for _ in 0..2 {
        let bounds = match &framed {
            Some(ids) => scene.bounds_of(|item| ids.contains(&item.id())),
            None => scene.bounds(),
        };
        camera.frame(&bounds, viewport);
        fill(&mut camera, viewport, scene, &bounds, |id| framed.as_ref().is_none_or(|ids| ids.contains(&id)));
        view = View::new(&camera, viewport, &scene.bounds());
        scene.refine(&view);
    }
    Ok(view)
}

/// Moves the camera so that what is framed fills the picture but for a margin: `Camera::frame` makes room for a model
/// that is turned, a picture stands still.
fn fill(camera: &mut Camera, viewport: Viewport, scene: &Scene, bounds: &Aabb, framed: impl Fn(EntityId) -> bool) {
    let shown = scene.items().iter().filter(|item| item.visible() && framed(item.id()));
    let points: Vec<_> = shown
        .filter_map(|item| item.display.as_ref())
        .flat_map(|d| d.curves.iter().flat_map(|c| &c.points).chain(d.mesh.points.iter()))
        .collect();
    // Coming closer changes the perspective, which changes what fills the picture. Half steps (in powers) settle for
    // models that are deep along the line of sight too, where whole ones would overshoot.
    for _ in 0..24 {
        let view = View::new(camera, viewport, bounds);
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for at in points.iter().filter_map(|p| view.project(**p)) {
            low = low.min(at.pixel);
            high = high.max(at.pixel);
        }
        if !(low.is_finite() && high.is_finite()) {
            return;
        }
        let size = DVec2::new(viewport.width, viewport.height);
        let part = ((high - low) / (MARGIN * size)).max_element();
        let middle = viewport.center().lerp(0.5 * (low + high), 0.5);
        camera.pan(viewport, camera.distance, middle, viewport.center());
        if part > 1e-6 {
            camera.distance *= part.sqrt();
        }
    }
}

/// Deviations of the patches from the surfaces, or of everything from another model.
fn measure(args: &Args, document: &Document, scene: &Scene) -> Result<(Vec<(Key, Field)>, DeviationReport), CliError> {
    let other = args.against.as_deref().map(crate::io::open).transpose()?;
    let originals = other.as_ref().map_or(document, |opened| &opened.document);
    let surfaces: Vec<_> = originals.bodies().map(|(_, body)| body).enumerate().collect();
    let subjects: Vec<_> = scene
        .items()
        .iter()
        .filter(|i| {
            i.visible()
                && (i.kind == ItemKind::Patch
                    || (other.is_some() && matches!(i.kind, ItemKind::Surface | ItemKind::Mesh)))
        })
        .collect();
    if subjects.is_empty() || surfaces.is_empty() {
        return Err(CliError::BadArguments(
            "--show deviation needs a project with healed patches and their surfaces, or --against MODEL".into(),
        ));
    }
    let diagonal = originals.bounds().diagonal();
    let job = super::job();
    let set = SurfaceSet::new(surfaces, MEASURE * diagonal, &job);
    let noise = originals.tolerances().follow;
    let found: Vec<_> = subjects
        .iter()
        .filter_map(|item| Some((item, item.display.as_ref()?)))
        .map(|(item, shown)| (item, deviation(&shown.mesh, &set, FAR * diagonal, noise, &job)))
        .collect();
    let max = found.iter().fold(0.0_f64, |m, (_, d)| m.max(d.max));
    let measured: usize = found.iter().map(|(_, d)| d.measured).sum();
    let total: usize = found.iter().map(|(_, d)| d.values.len()).sum();
    let squares: f64 = found.iter().map(|(_, d)| d.rms * d.rms * d.measured as f64).sum();
    let range = args.range.unwrap_or(max).max(f64::MIN_POSITIVE);
    let tol = args.tol.unwrap_or(range / 11.0);
    let scale = Arc::new(ColorScale::deviation(range as f32, tol as f32));
    let field = |values| Field { revision: 1, values: Arc::new(values), scale: scale.clone() };
    let fields = found.into_iter().map(|(item, d)| (Key::new(item.id().0, 0), field(d.values))).collect();
    let rms = (squares / measured.max(1) as f64).sqrt();
    Ok((fields, DeviationReport { max, rms, measured, no_data: total - measured, range, tol }))
}

fn save(picture: &image::RgbaImage, path: &Path) -> Result<(), CliError> {
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png)?;
    crate::io::atomic::write(path, png.get_ref())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A car part that is long along the line of sight stood as a dot in its picture.
    #[test]
    fn a_model_that_is_deep_along_the_line_of_sight_fills_its_picture() {
        let mut camera = Camera::default();
        let viewport = Viewport::new(700.0, 500.0);
        let view = View::new(&camera, viewport, &Aabb::of([glam::DVec3::ZERO, glam::DVec3::ONE]));
        let ray = view.ray(viewport.center());
        let (along, across) = (ray.direction.normalize(), ray.direction.any_orthonormal_vector());
        let corner = |x: f64, y: f64| 100.0 * along * x + 20.0 * across * y + 500.0 * glam::DVec3::X;
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        let strip = crate::kernel::geom::Surface::bilinear(corners).unwrap();
        let mut document = Document::new(crate::model::document::Unit::Millimetre);
        document.add("strip", crate::model::document::Shape::Surface(Arc::new(strip)), None);
        let mut scene = Scene::default();
        scene.sync(&document);
        for _ in 0..2 {
            let bounds = scene.bounds();
            camera.frame(&bounds, viewport);
            fill(&mut camera, viewport, &scene, &bounds, |_| true);
            scene.refine(&View::new(&camera, viewport, &scene.bounds()));
        }
        let view = View::new(&camera, viewport, &scene.bounds());
        let size = DVec2::new(viewport.width, viewport.height);
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in scene.items()[0].display.as_ref().unwrap().mesh.points.iter() {
            let at = view.project(*p).unwrap().pixel / size;
            (low, high) = (low.min(at), high.max(at));
        }
        let part = (high - low).max_element();
        assert!(low.min_element() > 0.0 && high.max_element() < 1.0 && part > 0.7, "{low} {high}");
    }

    #[test]
    fn sizes_and_turns_are_read_or_refused() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "x480", "0x10", "10x0", "99999x10", "-1x5", "axb"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(turn("20,-5.5"), Ok([20.0, -5.5]));
        assert!(turn("20").is_err() && turn("NaN,1").is_err());
    }
}
