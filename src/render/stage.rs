//! The scene dressed for drawing: what `view` keeps as triangles and polylines becomes meshes and lines of a frame.
//!
//! Conversions are kept until an item's revision changes, so a steady scene costs one table look-up an entity. Parts of
//! an entity on the GPU: 0 its mesh and its borders, 1 its iso-lines, 2 its cap line.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use super::color::{Color, PALETTE, mix, srgb, with_alpha};
use super::frame::{
    CameraData, Dash, Display, Emphasis, FrameData, Hidden, Key, LineData, LineItem, LineRole, LineStyle, MeshItem,
    Section,
};
use super::mesh_data::{MeshData, Threads};
use super::theme::Theme;
use crate::kernel::mesh::tessellate::SurfaceMesh;
use crate::model::document::EntityId;
use crate::view::display::Display as Shown;
use crate::view::scene::{Item, ItemKind, Made, Scene};
use crate::view::section::SectionPlane;
use crate::view::viewport::View;

/// How surfaces come to their colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coloring {
    /// The file's colours where it has any, otherwise one for surfaces and one for patches.
    #[default]
    Plain,
    /// One after the other from the palette.
    Palette,
}

/// What one frame shows of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// What is drawn.
    pub display: Display,
    /// In which colours.
    pub theme: Theme,
    /// Which colour a surface has.
    pub coloring: Coloring,
    /// What is cut away.
    pub section: Option<SectionPlane>,
    /// Pixels per point.
    pub pixels_per_point: f32,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            display: Display::default(),
            theme: Theme::light(),
            coloring: Coloring::default(),
            section: None,
            pixels_per_point: 1.0,
        }
    }
}

/// One entity as meshes and lines.
#[derive(Clone, Debug)]
struct Dressed {
    revision: u64,
    /// The triangles that `mesh` was made from.
    shown: Arc<SurfaceMesh>,
    mesh: Option<Arc<MeshData>>,
    borders: Option<Arc<LineData>>,
    isolines: Option<Arc<LineData>>,
    /// The cap line of the plane with this number.
    cap: Option<(u64, Arc<LineData>)>,
}

/// Keeps what was converted from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    dressed: HashMap<EntityId, Dressed>,
    plane: Option<SectionPlane>,
    /// Counts the section planes; revision of cap lines.
    planes: u64,
}

impl CameraData {
    /// The camera of a view.
    pub fn of(view: &View) -> Self {
        let camera = &view.camera;
        let (right, up, back) = (camera.right(), camera.up(), -camera.forward());
        let turn = glam::DMat3::from_cols(right, up, back).transpose();
        let turn = glam::DMat4::from_mat3(turn);
        let eye = camera.eye();
        // With the eye as origin, world to clip is a turn and the projection; the turn is undone exactly.
        let projection = view.matrix_f64(eye) * turn.transpose();
        Self { view: turn * glam::DMat4::from_translation(-eye), projection }
    }
}

/// The triangles of a display, packed in a worker.
#[derive(Clone, Debug)]
pub struct Prepared {
    id: EntityId,
    shown: Arc<SurfaceMesh>,
    mesh: Option<Arc<MeshData>>,
}

impl Prepared {
    /// Packs the triangles of a display on all threads; not for the window's thread.
    pub fn new(made: &Made) -> Self {
        let shown = made.display();
        Self { id: made.id(), shown: Arc::clone(&shown.mesh), mesh: pack(shown, Threads::All) }
    }
}

impl Stage {
    /// Takes over triangles that were packed elsewhere; the next frame that shows them need not do it.
    pub fn accept(&mut self, prepared: Prepared) {
        let Prepared { id, shown, mesh } = prepared;
        if self.dressed.get(&id).is_none_or(|dressed| !Arc::ptr_eq(&dressed.shown, &shown)) {
            // No display has revision 0, so lines and cap are made when it is drawn.
            self.dressed.insert(id, Dressed { revision: 0, shown, mesh, borders: None, isolines: None, cap: None });
        }
    }

    /// A frame of the visible items of a scene. `emphasis` says how much each stands out.
    pub fn frame(
        &mut self,
        scene: &Scene,
        view: &View,
        look: &Look,
        emphasis: impl Fn(EntityId) -> Emphasis,
    ) -> FrameData {
        let size = [view.viewport.width, view.viewport.height].map(|s| s.round().max(1.0) as u32);
        let mut frame = FrameData::new(size, CameraData::of(view));
        frame.pixels_per_point = look.pixels_per_point;
        frame.background = look.theme.background;
        frame.accent = look.theme.accent;
        frame.display = look.display;
        frame.section =
            look.section.map(|plane| Section { normal: plane.normal(), offset: plane.normal().dot(plane.point()) });
        if self.plane != look.section {
            self.plane = look.section;
            self.planes += 1;
        }
        if self.dressed.len() > scene.items().len() {
            let there: HashSet<EntityId> = scene.items().iter().map(Item::id).collect();
            self.dressed.retain(|id, _| there.contains(id));
        }
        for (at, item) in scene.items().iter().enumerate().filter(|(_, item)| item.visible()) {
            self.add(&mut frame, at, item, look, emphasis(item.id()));
        }
        // Wide strokes last: what stands out lies on top.
        frame.lines.sort_by_key(|line| (line.emphasis, line.role != LineRole::Iso));
        frame
    }

    fn add(&mut self, frame: &mut FrameData, at: usize, item: &Item, look: &Look, emphasis: Emphasis) {
        let Some(shown) = &item.display else { return };
        let dressed = match self.dressed.entry(item.id()) {
            std::collections::hash_map::Entry::Occupied(mut slot) => {
                if slot.get().revision != item.revision {
                    let old = slot.get();
                    let mesh = if Arc::ptr_eq(&old.shown, &shown.mesh) { old.mesh.clone() } else { None };
                    slot.insert(dress(item.revision, shown, mesh));
                }
                slot.into_mut()
            }
            std::collections::hash_map::Entry::Vacant(slot) => slot.insert(dress(item.revision, shown, None)),
        };
        let color = color_of(item, at, look);
        let key = |part| Key::new(item.id().0, part);
        if let Some(mesh) = &dressed.mesh {
            frame.meshes.push(MeshItem {
                key: key(0),
                revision: item.mesh_revision,
                mesh: mesh.clone(),
                color,
                emphasis,
                field: None,
                sectioned: true,
            });
        }
        let mut line = |lines: &Arc<LineData>, part, revision, role, style| {
            let lines = lines.clone();
            frame.lines.push(LineItem { key: key(part), revision, lines, style, role, emphasis, sectioned: true });
        };
        let edge = look.theme.edge(&look.display);
        let bare = look.display.wireframe || look.display.xray;
        if let Some(borders) = &dressed.borders {
            let is_curve = item.kind == ItemKind::Curve;
            let color = if is_curve { item.entity.color.map_or(look.theme.curve, opaque) } else { edge };
            let role = if is_curve { LineRole::Curve } else { LineRole::Edge };
            let width = if is_curve { 2.0 } else { 1.4 };
            let style = LineStyle { width, color, dash: Dash::Solid, hidden: Hidden::Dashed };
            line(borders, 0, item.revision, role, style);
        }
        if let Some(isolines) = &dressed.isolines {
            let color = if bare { with_alpha(mix(color, edge, 0.35), 0.75) } else { with_alpha(edge, 0.42) };
            let hidden = if bare { Hidden::OnTop } else { Hidden::Gone };
            line(isolines, 1, item.revision, LineRole::Iso, LineStyle { width: 1.0, color, dash: Dash::Solid, hidden });
        }
        if let Some(plane) = &self.plane {
            if dressed.cap.as_ref().is_none_or(|(number, _)| *number != self.planes) {
                dressed.cap = Some((self.planes, Arc::new(cap_line(plane, shown, item))));
            }
            if let Some((number, cap)) = dressed.cap.as_ref().filter(|(_, cap)| !cap.ends.is_empty()) {
                let lines = cap.clone();
                let style = LineStyle { width: 2.2, color: look.theme.cap, dash: Dash::Solid, hidden: Hidden::Dashed };
                frame.lines.push(LineItem {
                    key: key(2),
                    revision: number ^ item.revision.rotate_left(32),
                    lines,
                    style,
                    role: LineRole::Curve,
                    emphasis: Emphasis::Normal,
                    // It lies in the plane: rounding must not cut it.
                    sectioned: false,
                });
            }
        }
    }
}

fn opaque([r, g, b]: [f32; 3]) -> Color {
    [r, g, b, 1.0]
}

/// A file's colour as paint: pure red, white and black have no room for light and shade, so it is drawn in a little from
/// all ends.
fn paint(color: [f32; 3]) -> Color {
    let luma = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    opaque(color.map(|c| 0.02 + 0.68 * (0.84 * c + 0.16 * luma).clamp(0.0, 1.0)))
}

fn color_of(item: &Item, at: usize, look: &Look) -> Color {
    let own = item.entity.color.map(paint);
    match (look.coloring, item.kind) {
        (Coloring::Palette, _) => srgb(PALETTE[at % PALETTE.len()]),
        (Coloring::Plain, ItemKind::Patch) => own.unwrap_or(look.theme.patch),
        (Coloring::Plain, _) => own.unwrap_or(look.theme.surface),
    }
}

/// The point that the vertices and lines of a display are given from.
fn origin(shown: &Shown) -> DVec3 {
    if shown.bounds.is_empty() { DVec3::ZERO } else { shown.bounds.center() }
}

fn pack(shown: &Shown, threads: Threads) -> Option<Arc<MeshData>> {
    let there = !shown.mesh.triangles.is_empty();
    there.then(|| Arc::new(MeshData::of_surface(origin(shown), &shown.mesh, threads)))
}

/// Triangles and lines for a frame; `mesh` where the triangles are those of before.
fn dress(revision: u64, shown: &Shown, mesh: Option<Arc<MeshData>>) -> Dressed {
    let origin = origin(shown);
    let mesh = mesh.or_else(|| pack(shown, Threads::One));
    let lines = |iso: bool| {
        let mut lines = LineData::new(origin);
        for curve in shown.curves.iter().filter(|c| c.curve.is_iso() == iso) {
            lines.push(curve.points.iter().copied());
        }
        (!lines.ends.is_empty()).then(|| Arc::new(lines))
    };
    Dressed { revision, shown: Arc::clone(&shown.mesh), mesh, borders: lines(false), isolines: lines(true), cap: None }
}

fn cap_line(plane: &SectionPlane, shown: &Shown, item: &Item) -> LineData {
    let mut lines = LineData::new(if item.bounds.is_empty() { DVec3::ZERO } else { item.bounds.center() });
    for segment in plane.cap_line(&shown.mesh) {
        lines.push(segment);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Aabb;
    use crate::view::camera::{Axis, Camera, Projection};
    use crate::view::viewport::Viewport;

    #[test]
    fn the_camera_of_a_view_projects_as_the_view_does() {
        let bounds = Aabb { min: DVec3::new(9.0, 1.0, -1.0), max: DVec3::new(12.0, 3.0, 2.0) };
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let viewport = Viewport::new(800.0, 500.0);
            let mut camera = Camera { projection, ..Camera::default() };
            camera.look_along(Axis::Oblique);
            camera.frame(&bounds, viewport);
            let view = View::new(&camera, viewport, &bounds);
            let data = CameraData::of(&view);
            assert_eq!(data.is_orthographic(), projection == Projection::Orthographic);
            for p in [bounds.min, bounds.max, bounds.center()] {
                let expected = view.matrix_f64(DVec3::ZERO) * p.extend(1.0);
                let got = data.projection * (data.view * p.extend(1.0));
                assert!(got.distance(expected) < 1e-9 * expected.length(), "{got} {expected}");
            }
        }
    }

    #[test]
    fn a_steady_scene_keeps_its_buffers() {
        use crate::kernel::geom::Surface;
        use crate::model::document::{Document, Shape, Unit};
        let mut document = Document::new(Unit::Millimetre);
        let plane = Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]).unwrap();
        document.add("plane", Shape::Surface(Arc::new(plane)), None);
        let mut scene = Scene::default();
        scene.sync(&document);
        let camera = Camera::default();
        let view = View::new(&camera, Viewport::new(100.0, 100.0), &scene.bounds());
        scene.refine(&view);
        let mut stage = Stage::default();
        let section = SectionPlane::new(DVec3::new(0.5, 0.0, 0.0), DVec3::X);
        let look = Look { section, ..Look::default() };
        let first = stage.frame(&scene, &view, &look, |_| Emphasis::Normal);
        let again = stage.frame(&scene, &view, &look, |_| Emphasis::Normal);
        assert!(Arc::ptr_eq(&first.meshes[0].mesh, &again.meshes[0].mesh));
        assert_eq!(first.lines.len(), 3, "borders, iso-lines and the cap line");
        for (a, b) in first.lines.iter().zip(&again.lines) {
            assert!(Arc::ptr_eq(&a.lines, &b.lines) && a.revision == b.revision);
        }
        let moved = Look { section: section.map(|s| s.moved(0.1)), ..look };
        let moved = stage.frame(&scene, &view, &moved, |_| Emphasis::Normal);
        let cap = |frame: &FrameData| frame.lines.iter().find(|l| l.key.part == 2).unwrap().revision;
        assert_ne!(cap(&first), cap(&moved));
    }
}
