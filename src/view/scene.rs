//! The document as things to draw and to pick, each kept until its geometry or its size on the screen changes.
//!
//! [`Scene::sync`] follows the document: what is the same geometry in memory keeps its triangles. [`Scene::wanted`]
//! lists what is too coarse or far too fine for a view, worst first; each [`Request`] is made in a worker or at once
//! and handed back with [`Scene::accept`], which drops what the document no longer has. Until then the old
//! triangles stay: nothing flashes empty. Tolerances are powers of four, so a model in steady view asks for nothing.

use std::sync::Arc;

use super::detail::{PIXELS, level, smallest_pixel};
use super::display::{CurveRef, Display, Extent, Geometry};
use super::viewport::View;
use crate::kernel::geom::Aabb;
use crate::model::document::{Document, Entity, EntityId, Shape};

/// The coarsest and finest chord tolerance, as fractions of the diagonal of the entity's box.
const COARSEST: f64 = 0.01;
const FINEST: f64 = 1e-7;
/// The tolerance of the first display of an entity, as a fraction of the diagonal of its box.
const FIRST: f64 = 1e-3;

/// What an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ItemKind {
    /// A surface or trimmed face of the model.
    Surface,
    /// A healed patch.
    Patch,
    /// A free curve.
    Curve,
    /// A mesh or block.
    Mesh,
}

/// One entity, ready to be drawn and picked.
#[derive(Clone, Debug)]
pub struct Item {
    /// The entity as the document has it.
    pub entity: Arc<Entity>,
    /// What it is.
    pub kind: ItemKind,
    /// Its number among the file's surfaces, curves, or meshes and blocks; none for a patch.
    pub number: Option<usize>,
    /// Its shape.
    pub geometry: Geometry,
    /// A box around its control points.
    pub bounds: Aabb,
    /// Triangles and lines; none until the first request has been accepted.
    pub display: Option<Arc<Display>>,
    /// Changes whenever `display` does and is never used twice; 0 while there is none.
    pub revision: u64,
    /// The revision at which the triangles of `display` last changed.
    pub mesh_revision: u64,
}

impl Item {
    /// Its name for programs.
    pub fn id(&self) -> EntityId {
        self.entity.id
    }

    /// Whether it is drawn.
    pub fn visible(&self) -> bool {
        self.entity.visible
    }
}

/// A display to be made.
#[derive(Clone, Debug)]
pub struct Request {
    /// Of which entity.
    pub id: EntityId,
    /// Its shape.
    pub geometry: Geometry,
    /// The chord tolerance.
    pub chord_tol: f64,
    /// How much of it.
    pub extent: Extent,
    /// The display of less extent that is to be completed.
    pub begun: Option<Arc<Display>>,
}

/// A display that was made.
#[derive(Clone, Debug)]
pub struct Made {
    id: EntityId,
    geometry: Geometry,
    display: Arc<Display>,
}

impl Made {
    /// Of which entity.
    pub fn id(&self) -> EntityId {
        self.id
    }

    /// What was made.
    pub fn display(&self) -> &Arc<Display> {
        &self.display
    }
}

impl Request {
    /// Does the work.
    pub fn run(self) -> Made {
        let (extent, id, geometry, tol) = (self.extent, self.id, &self.geometry, self.chord_tol);
        let display = match self.begun {
            Some(begun) => Display::up_to(extent, id, geometry, tol, Some(Arc::clone(&begun.mesh))),
            None => Display::first(extent, id, geometry, tol),
        };
        Made { id: self.id, geometry: self.geometry, display: Arc::new(display) }
    }
}

/// Everything that can be drawn and picked. See the module's text.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    items: Vec<Item>,
    revisions: u64,
    /// Whether faces show as the whole surfaces under them.
    whole_surfaces: bool,
    /// Whether that has changed since the last [`Scene::sync`].
    stale: bool,
    /// Whether nothing will be picked.
    only_seen: bool,
}

impl Scene {
    /// A scene that is drawn and never picked from: no trees are made.
    pub fn only_seen() -> Self {
        Self { only_seen: true, ..Self::default() }
    }

    /// How much of a display is wanted in the end.
    fn extent(&self) -> Extent {
        if self.only_seen { Extent::Lines } else { Extent::All }
    }

    /// Whether faces show as the whole surfaces under them.
    pub fn shows_whole_surfaces(&self) -> bool {
        self.whole_surfaces
    }

    /// Shows the whole surfaces under faces, or the faces; the next [`Scene::sync`] follows.
    pub fn show_whole_surfaces(&mut self, whole: bool) {
        if self.whole_surfaces != whole {
            self.whole_surfaces = whole;
            self.stale = true;
        }
    }

    /// Follows the document. Returns whether anything changed.
    pub fn sync(&mut self, document: &Document) -> bool {
        let stale = std::mem::take(&mut self.stale);
        let same = self.items.len() == document.entities().len()
            && self.items.iter().zip(document.entities()).all(|(item, e)| Arc::ptr_eq(&item.entity, e));
        if same && !stale {
            return false;
        }
        let mut old: std::collections::HashMap<EntityId, Item> = self.items.drain(..).map(|i| (i.id(), i)).collect();
        let mut numbers = [0; 3];
        for entity in document.entities() {
            let mut counted = |k: usize| {
                numbers[k] += 1;
                Some(numbers[k] - 1)
            };
            let (kind, number, geometry) = match &entity.shape {
                Shape::Surface(s) => (ItemKind::Surface, counted(0), Geometry::Surface(Arc::clone(s))),
                Shape::Face(f) => {
                    let geometry = Geometry::Face { face: Arc::clone(f), whole: self.whole_surfaces };
                    (ItemKind::Surface, counted(0), geometry)
                }
                Shape::Patch(p) => (ItemKind::Patch, None, Geometry::Surface(Arc::clone(&p.surface))),
                Shape::Curve(c) => (ItemKind::Curve, counted(1), Geometry::Curve(Arc::clone(c))),
                Shape::Mesh(f) | Shape::Block(f) => (ItemKind::Mesh, counted(2), Geometry::Facets(Arc::clone(f))),
            };
            let kept = old.remove(&entity.id).filter(|item| item.geometry.same(&geometry));
            let (bounds, display, revision, mesh_revision) = match kept {
                Some(item) => (item.bounds, item.display, item.revision, item.mesh_revision),
                None => (geometry.bounds(), None, 0, 0),
            };
            let entity = Arc::clone(entity);
            self.items.push(Item { entity, kind, number, geometry, bounds, display, revision, mesh_revision });
        }
        true
    }

    /// All items, in the order of the document.
    pub fn items(&self) -> &[Item] {
        &self.items
    }

    /// The item of an entity.
    pub fn item(&self, id: EntityId) -> Option<&Item> {
        // Ids grow along the document except after edits that reorder it, of which there are none today; the search
        // falls back to looking at all.
        match self.items.binary_search_by_key(&id, Item::id) {
            Ok(at) => Some(&self.items[at]),
            Err(_) => self.items.iter().find(|item| item.id() == id),
        }
    }

    /// The item of a surface by its number in the file.
    pub fn surface(&self, number: usize) -> Option<&Item> {
        self.items.iter().find(|i| i.kind == ItemKind::Surface && i.number == Some(number))
    }

    /// The item that a curve belongs to.
    pub fn curve_item(&self, curve: &CurveRef) -> Option<&Item> {
        self.item(curve.entity())
    }

    /// A box around what is visible; around everything when nothing is.
    pub fn bounds(&self) -> Aabb {
        let visible = self.bounds_of(|item| item.visible());
        if visible.is_empty() { self.bounds_of(|_| true) } else { visible }
    }

    /// A box around the items for which `which` is true. Displays give a tight one, control points a wide one.
    pub fn bounds_of(&self, which: impl Fn(&Item) -> bool) -> Aabb {
        self.items.iter().filter(|item| which(item)).fold(Aabb::EMPTY, |all, item| {
            let tight = item.display.as_ref().map(|d| d.bounds).filter(|b| !b.is_empty());
            all.union(&tight.unwrap_or(item.bounds))
        })
    }

    /// The displays that a view is in want of, the worst first: visible items that have none, then those that are
    /// too coarse, then those that are over sixteen times too fine. Items out of the picture want a coarse display
    /// only, and only when they have none.
    pub fn wanted(&self, view: &View) -> Vec<Request> {
        let mut out: Vec<(f64, Request)> = Vec::new();
        for item in self.items.iter().filter(|item| item.visible()) {
            let diagonal = item.bounds.diagonal();
            if item.geometry.is_fixed() || !(diagonal > 0.0 && diagonal.is_finite()) {
                // A shape that is a point, or that is as it is: one display, whatever the view.
                let begun = item.display.as_ref().map(|d| d.extent);
                if begun.is_none_or(|extent| extent < self.extent()) {
                    let exact = FINEST * 1e-2 * if diagonal.is_finite() { diagonal } else { 1.0 };
                    // What is not seen at all comes before what cannot be picked yet.
                    let rank = if begun.is_some() { 1.0 } else { f64::INFINITY };
                    out.push((rank, self.request(item, exact.max(f64::MIN_POSITIVE))));
                }
                continue;
            }
            let pixel = smallest_pixel(item, view);
            let tol = level((PIXELS * pixel).clamp(FINEST * diagonal, COARSEST * diagonal));
            match &item.display {
                // The first one says where the surface really is; only then is it worth being fine.
                None => out.push((f64::INFINITY, self.request(item, tol.max(level(FIRST * diagonal))))),
                Some(_) if pixel == f64::INFINITY => {}
                Some(display) => {
                    let ratio = display.chord_tol / tol;
                    let too_coarse = ratio > 1.0 && !display.capped;
                    if too_coarse || ratio < 1.0 / 16.0 {
                        out.push((ratio, self.request(item, tol)));
                    }
                }
            }
        }
        out.sort_by(|a, b| b.0.total_cmp(&a.0));
        out.into_iter().map(|(_, request)| request).collect()
    }

    fn request(&self, item: &Item, chord_tol: f64) -> Request {
        let extent = self.extent();
        let begun = item.display.clone().filter(|d| d.extent < extent);
        Request { id: item.id(), geometry: item.geometry.clone(), chord_tol, extent, begun }
    }

    /// Takes a display over; false when the document no longer has that shape.
    pub fn accept(&mut self, made: Made) -> bool {
        let Some(item) = self.items.iter_mut().find(|item| item.id() == made.id) else { return false };
        if !item.geometry.same(&made.geometry) {
            return false;
        }
        self.revisions += 1;
        let same = item.display.as_ref().is_some_and(|d| Arc::ptr_eq(&d.mesh, &made.display.mesh));
        item.revision = self.revisions;
        if !same {
            item.mesh_revision = self.revisions;
        }
        item.display = Some(made.display);
        true
    }

    /// Makes everything that a view wants at once, on all threads. For pictures without a window and for tests.
    pub fn refine(&mut self, view: &View) {
        use rayon::prelude::*;
        // A first display, then a fine one, then perhaps one more where the fine one came nearer to the eye.
        for _ in 0..4 {
            let made: Vec<Made> = self.wanted(view).into_par_iter().map(Request::run).collect();
            if made.is_empty() {
                return;
            }
            for made in made {
                self.accept(made);
            }
        }
    }

    /// How many triangles and line segments its displays have.
    pub fn counts(&self) -> (usize, usize) {
        self.items
            .iter()
            .filter_map(|item| item.display.as_ref())
            .fold((0, 0), |(t, s), d| (t + d.triangle_count(), s + d.segment_count()))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::kernel::geom::Curve;
    use crate::model::command::Command;
    use crate::model::document::Unit;
    use crate::view::camera::Camera;
    use crate::view::display::tests::sphere;
    use crate::view::viewport::Viewport;

    fn document() -> Document {
        let mut document = Document::new(Unit::Millimetre);
        document.add("ball", Shape::Surface(Arc::new(sphere())), None);
        let curve = Curve::segment(DVec3::X * 2.0, DVec3::Y * 2.0).unwrap();
        document.add("line", Shape::Curve(Arc::new(curve)), None);
        document.add("ball again", Shape::Surface(Arc::new(sphere())), None);
        document
    }

    fn view(scene: &Scene) -> View {
        let viewport = Viewport::new(800.0, 600.0);
        let mut camera = Camera::default();
        camera.frame(&scene.bounds(), viewport);
        View::new(&camera, viewport, &scene.bounds())
    }

    /// `patchwright render` built the whole pick tree of a model that it only drew.
    #[test]
    fn what_is_only_seen_looks_the_same_and_has_no_trees() {
        let mut pair = [Scene::default(), Scene::only_seen()];
        for scene in &mut pair {
            scene.sync(&document());
            // Near enough for a finer display than the first one, by lines of sight.
            let mut close = view(scene).camera;
            close.distance *= 0.5;
            let view = View::new(&close, Viewport::new(160.0, 120.0), &scene.bounds());
            scene.refine(&view);
            assert!(scene.wanted(&view).is_empty());
        }
        assert_eq!(pair[0].counts(), pair[1].counts());
        for (picked, seen) in pair[0].items().iter().zip(pair[1].items()) {
            let [picked, seen] = [picked, seen].map(|item| item.display.as_ref().unwrap());
            assert_eq!((picked.mesh.points.len(), picked.chord_tol), (seen.mesh.points.len(), seen.chord_tol));
            assert!(seen.tree.is_empty() && seen.segments.is_empty());
            assert_eq!(picked.segments.len(), seen.segment_count());
        }
    }

    #[test]
    fn only_what_changed_is_made_again() {
        let document = document();
        let mut scene = Scene::default();
        assert!(scene.sync(&document));
        assert!(!scene.sync(&document));
        let view = view(&scene);
        scene.refine(&view);
        assert!(scene.wanted(&view).is_empty(), "a steady view wants nothing");
        let before: Vec<u64> = scene.items().iter().map(|i| i.revision).collect();
        let ids: Vec<EntityId> = document.entities().iter().map(|e| e.id).collect();
        let hidden = Command::SetVisible { ids: vec![ids[0]], visible: false }.apply(&document).unwrap();
        assert!(scene.sync(&hidden));
        assert_eq!(scene.items().iter().map(|i| i.revision).collect::<Vec<_>>(), before);
        assert!(!scene.items()[0].visible());
        let deleted = Command::Delete { ids: vec![ids[1]] }.apply(&hidden).unwrap();
        scene.sync(&deleted);
        assert_eq!(scene.items().len(), 2);
        assert_eq!(scene.surface(1).map(Item::id), Some(ids[2]));
        assert_eq!(scene.item(ids[2]).unwrap().revision, before[2]);
    }

    #[test]
    fn a_display_of_what_is_gone_is_dropped() {
        let document = document();
        let mut scene = Scene::default();
        scene.sync(&document);
        let view = view(&scene);
        let made: Vec<Made> = scene.wanted(&view).into_iter().map(Request::run).collect();
        assert_eq!(made.len(), 3);
        scene.sync(&Document::default());
        assert!(made.into_iter().all(|m| !scene.accept(m)));
    }

    #[test]
    fn coming_closer_refines_and_going_away_coarsens() {
        let mut scene = Scene::default();
        scene.sync(&document());
        let far = view(&scene);
        scene.refine(&far);
        let (coarse, _) = scene.counts();
        let mut camera = far.camera;
        camera.distance /= 8.0;
        camera.target = DVec3::new(0.0, 0.0, 1.0);
        let near = View::new(&camera, far.viewport, &scene.bounds());
        assert!(!scene.wanted(&near).is_empty());
        scene.refine(&near);
        let (fine, _) = scene.counts();
        assert!(fine > 4 * coarse, "{fine} {coarse}");
        assert!(scene.wanted(&near).is_empty());
        camera.distance *= 400.0;
        let away = View::new(&camera, far.viewport, &scene.bounds());
        scene.refine(&away);
        assert!(scene.counts().0 < fine / 4);
    }

    #[test]
    fn triangles_are_within_a_pixel_of_the_truth() {
        let mut scene = Scene::default();
        scene.sync(&document());
        let view = view(&scene);
        scene.refine(&view);
        let display = scene.items()[0].display.clone().unwrap();
        for t in display.mesh.triangles.iter() {
            let center: DVec3 = t.iter().map(|&k| display.mesh.points[k as usize]).sum::<DVec3>() / 3.0;
            let pixel = view.pixel_size_at(view.depth(center));
            assert!(1.0 - center.length() < PIXELS * pixel);
        }
    }
}
