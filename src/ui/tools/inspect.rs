//! The Inspect tool: looking into the hierarchies of one or two selected surfaces. What it shows is made by workers from
//! [`crate::view::inspect`]; this is what the window adds: jobs, the mouse, the keys.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec2;

use super::super::editor::{Editor, Page};
use super::super::linked::From;
use super::super::panels::uv::UvPointer;
use super::super::viewport::{Pointer, hit_entity};
use super::Tool;
use super::inspect_overlay::Dressed;
use crate::kernel::bvh::NodeId;
use crate::kernel::geom::Surface;
use crate::model::document::EntityId;
use crate::view::inspect::{Coloring, Hierarchy, VolumeForm};
use crate::view::uv::UvPicture;
use crate::work::{Lane, Latest, Outcome, Ticket};

/// The largest height that the panel offers.
pub const MOST_HEIGHT: u32 = 9;

/// The height until another is chosen: at most this, and so many leaves.
const HEIGHT: u32 = 6;
const LEAVES: usize = 1 << 16;
/// The level until another is chosen has at most so many nodes.
const NODES: usize = 1000;

/// A number that no other call returns: buffers and textures of one session must not pass for those of the next.
fn fresh() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// What is shown of the hierarchies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The quadtree level.
    pub level: u32,
    /// The levels above and below as faint outlines.
    pub ghosts: bool,
    /// The kind of volume.
    pub form: VolumeForm,
    /// What decides the colours.
    pub coloring: Coloring,
    /// The used patches of the leaf tori.
    pub tori: bool,
    /// Only the nodes that overlap nodes of the other surface.
    pub pairs: bool,
}

/// A surface that is looked into.
pub struct Subject {
    /// Which entity.
    pub entity: EntityId,
    /// Its name.
    pub name: String,
    /// Its surface.
    pub surface: Arc<Surface>,
    /// Its hierarchy, once it is built.
    pub hierarchy: Option<Arc<Hierarchy>>,
    /// Why there is none.
    pub error: Option<String>,
    building: Option<Ticket<Result<Hierarchy, String>>>,
}

/// A node of one of the subjects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Focus {
    /// Of the first or the second subject.
    pub subject: usize,
    /// Which node.
    pub node: NodeId,
}

/// The tool at work.
pub struct InspectSession {
    /// Levels below the Bezier patches that are built.
    pub height: u32,
    /// What is shown.
    pub options: Options,
    /// The whole torus of the node in focus.
    pub whole_torus: bool,
    /// One or two surfaces.
    pub subjects: Vec<Subject>,
    /// The node under the cursor.
    pub hovered: Option<Focus>,
    /// The node that stays.
    pub pinned: Option<Focus>,
    /// What is drawn.
    pub dressed: Latest<Result<Dressed, String>>,
    /// Changes whenever something to draw does.
    pub revision: u64,
    /// The pictures of the uv view.
    pub pictures: Vec<Arc<UvPicture>>,
    /// Set when the node in focus has changed after the panels were drawn.
    pub moved: bool,
    /// Whether the height and the level were chosen by hand.
    chosen: bool,
    asked: Option<(Vec<usize>, Options)>,
    pictured: u64,
}

impl InspectSession {
    fn new() -> Self {
        Self {
            height: HEIGHT,
            options: Options {
                level: 3,
                ghosts: false,
                form: VolumeForm::default(),
                coloring: Coloring::default(),
                tori: false,
                pairs: false,
            },
            whole_torus: false,
            subjects: Vec::new(),
            hovered: None,
            pinned: None,
            dressed: Latest::default(),
            revision: fresh() << 24,
            pictures: Vec::new(),
            moved: false,
            chosen: false,
            asked: None,
            pictured: 0,
        }
    }

    /// The node in focus: what is under the cursor, otherwise what is pinned.
    pub fn focus(&self) -> Option<Focus> {
        self.hovered.or(self.pinned)
    }

    /// Whether every subject has its hierarchy.
    pub fn is_built(&self) -> bool {
        !self.subjects.is_empty() && self.subjects.iter().all(|s| s.hierarchy.is_some())
    }

    /// Whether something is being computed for it.
    pub fn is_busy(&self) -> bool {
        self.dressed.is_stale() || self.subjects.iter().any(|s| s.building.is_some())
    }

    /// Changes the height; the hierarchies are built anew.
    pub fn set_height(&mut self, height: u32) {
        let height = height.clamp(1, MOST_HEIGHT);
        if height != self.height {
            self.chosen = true;
            self.height = height;
            self.options.level = self.options.level.min(height);
            self.forget();
        }
    }

    /// Changes the level.
    pub fn set_level(&mut self, level: u32) {
        let level = level.min(self.height);
        if level != self.options.level {
            self.chosen = true;
            self.options.level = level;
        }
    }

    /// A height and a level that are quick to build and easy to read, until others are chosen by hand.
    fn fit(&mut self) {
        if self.chosen || self.subjects.is_empty() {
            return;
        }
        let spans = |s: &Subject| s.surface.knots().each_ref().map(|k| k.breaks().len() - 1).iter().product::<usize>();
        let patches: usize = self.subjects.iter().map(spans).sum();
        let most = |levels: u32, nodes: usize| (0..=levels).rev().find(|l| patches << (2 * l) <= nodes).unwrap_or(0);
        let height = most(HEIGHT, LEAVES).max(1);
        if height != self.height {
            self.height = height;
            self.forget();
        }
        self.options.level = most(height, NODES);
    }

    /// Drops the hierarchies, so that they are built again.
    pub fn forget(&mut self) {
        for subject in &mut self.subjects {
            subject.stop();
            subject.hierarchy = None;
            subject.error = None;
        }
        (self.hovered, self.pinned) = (None, None);
        self.asked = None;
        self.revision += 1;
    }

    fn hover(&mut self, focus: Option<Focus>) {
        if focus != self.hovered {
            self.hovered = focus;
            self.moved = true;
            self.revision += 1;
        }
    }

    /// Pins a node, or lets go of it when it was pinned.
    pub fn pin(&mut self, focus: Option<Focus>) {
        self.pinned = if focus == self.pinned { None } else { focus };
        self.moved = true;
        self.revision += 1;
    }

    fn over(&self, entity: EntityId, uv: DVec2) -> Option<Focus> {
        let subject = self.subjects.iter().position(|s| s.entity == entity)?;
        let tree = &self.subjects[subject].hierarchy.as_ref()?.tree;
        Some(Focus { subject, node: tree.node_over(self.options.level, uv) })
    }
}

impl Drop for InspectSession {
    fn drop(&mut self) {
        self.dressed.clear();
    }
}

impl Drop for Subject {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Subject {
    fn stop(&mut self) {
        if let Some(ticket) = self.building.take() {
            ticket.cancel();
        }
    }
}

impl Editor {
    /// Starts looking into what is selected.
    pub fn start_inspect(&mut self) {
        if matches!(self.tool, Tool::Inspect(_)) {
            self.show_page(Page::Tool);
            return;
        }
        self.leave_tool();
        if self.selection.ids().iter().all(|&id| self.surface_of(id).is_none()) {
            // One surface in the model needs no choosing.
            let mut surfaces = self.document().entities().iter().filter(|e| e.surface().is_some() && e.visible);
            if let (Some(only), None) = (surfaces.next().map(|e| e.id), surfaces.next()) {
                self.selection.set([only]);
            }
        }
        self.tool = Tool::Inspect(Box::new(InspectSession::new()));
        self.settings.uv_view = true;
        self.show_page(Page::Tool);
    }

    fn surface_of(&self, id: EntityId) -> Option<Arc<Surface>> {
        self.document().get(id)?.surface().cloned()
    }

    /// Follows the selection, the workers and the options.
    pub fn poll_inspect(&mut self) {
        let chosen: Vec<(EntityId, String, Arc<Surface>)> = {
            let document = self.document();
            let entities = self.selection.ids().iter().filter_map(|&id| document.get(id));
            entities.filter_map(|e| Some((e.id, e.name.clone(), Arc::clone(e.surface()?)))).take(2).collect()
        };
        let Tool::Inspect(session) = &mut self.tool else { return };
        let same = chosen.len() == session.subjects.len()
            && chosen
                .iter()
                .zip(&session.subjects)
                .all(|((id, _, s), old)| *id == old.entity && Arc::ptr_eq(s, &old.surface));
        if !same {
            let mut old = std::mem::take(&mut session.subjects);
            for (entity, name, surface) in chosen {
                // A hierarchy that is built stays as long as its surface is selected.
                let kept = old.iter().position(|o| o.entity == entity && Arc::ptr_eq(&o.surface, &surface));
                session.subjects.push(match kept {
                    Some(at) => old.swap_remove(at),
                    None => Subject { entity, name, surface, hierarchy: None, error: None, building: None },
                });
            }
            // What is no longer looked into stops being built.
            drop(old);
            (session.hovered, session.pinned, session.asked) = (None, None, None);
            session.options.pairs &= session.subjects.len() == 2;
            session.fit();
            session.revision += 1;
        }
        let height = session.height;
        let mut died = None;
        for subject in &mut session.subjects {
            if let Some(outcome) = subject.building.as_ref().and_then(Ticket::poll) {
                subject.building = None;
                match outcome {
                    Outcome::Finished { cancelled: true, .. } | Outcome::NeverRan => {
                        subject.error = Some("Building the hierarchy was cancelled".to_owned());
                    }
                    Outcome::Finished { value: Ok(hierarchy), .. } => subject.hierarchy = Some(Arc::new(hierarchy)),
                    Outcome::Finished { value: Err(why), .. } => subject.error = Some(why),
                    Outcome::Panicked { message, input } => {
                        subject.error = Some(format!("Building the hierarchy failed: {message}"));
                        died = Some((message, input));
                    }
                }
                session.revision += 1;
            } else if subject.hierarchy.is_none() && subject.building.is_none() && subject.error.is_none() {
                let (entity, surface) = (subject.entity, Arc::clone(&subject.surface));
                let name = format!("Hierarchy of {}", subject.name);
                let input = format!("height {height}, entity {}", entity.0);
                subject.building = Some(self.jobs.spawn(Lane::Heavy, name, input, move |job| {
                    Hierarchy::build(entity, surface, height, job).map_err(|e| e.to_string())
                }));
            }
        }
        session.dress(&mut self.jobs);
        if let Some((message, input)) = died {
            self.died("Building the hierarchy", &message, input);
        }
    }

    /// Keys of the tool: digits are levels.
    pub fn inspect_keys(&mut self, ctx: &egui::Context) {
        use egui::{Key, Modifiers};
        const DIGITS: [Key; 10] = [
            Key::Num0,
            Key::Num1,
            Key::Num2,
            Key::Num3,
            Key::Num4,
            Key::Num5,
            Key::Num6,
            Key::Num7,
            Key::Num8,
            Key::Num9,
        ];
        let taken = |key| ctx.input_mut(|i| super::super::app::take_key(i, Modifiers::NONE, key));
        let Tool::Inspect(session) = &mut self.tool else { return };
        for (level, key) in (0..).zip(DIGITS) {
            if taken(key) {
                session.set_level(level);
            }
        }
        if taken(Key::T) {
            session.options.tori ^= true;
        }
        if taken(Key::V) {
            let all = VolumeForm::ALL;
            let at = all.iter().position(|(form, _)| *form == session.options.form).unwrap_or(0);
            session.options.form = all[(at + 1) % all.len()].0;
        }
        if taken(Key::G) {
            session.options.ghosts ^= true;
        }
        if taken(Key::Escape) {
            if session.subjects.iter().any(|s| s.building.is_some()) {
                session.subjects.iter().filter_map(|s| s.building.as_ref()).for_each(Ticket::cancel);
            } else if session.pinned.is_some() {
                session.pin(None);
            } else {
                self.leave_tool();
            }
        }
    }

    /// What the mouse does in the 3D view: hovering looks at a node, a click pins it, a click on another surface looks
    /// into that one, Shift adds a second.
    pub fn inspect_pointer(&mut self, pointer: &Pointer) {
        let ray = pointer.pixel.map(|pixel| self.viewport.view().ray(pixel));
        let linked = self.linked;
        let Tool::Inspect(session) = &mut self.tool else { return };
        // While the camera is dragged what was under the cursor stays.
        if pointer.pixel.is_some() && self.viewport.drag_anchor().is_some() {
            return;
        }
        let focus = match (&pointer.hover, ray) {
            // Off the surface a volume that sticks out is met by its own form.
            (None, Some(ray)) => session.on_ray(&ray),
            _ => linked.and_then(|l| session.over(l.entity, l.uv)),
        };
        session.hover(focus);
        let Some((hit, held)) = &pointer.click else { return };
        let clicked = hit.as_ref().and_then(hit_entity);
        let known = clicked.is_some_and(|id| session.subjects.iter().any(|s| s.entity == id));
        match clicked {
            Some(id) if held.shift || held.ctrl => self.selection.toggle(id),
            Some(id) if !known => self.selection.set([id]),
            _ => session.pin(focus),
        }
    }

    /// What the mouse does in the uv view: a click pins the node under it.
    pub fn inspect_uv_pointer(&mut self, pointer: Option<&UvPointer>) {
        let Tool::Inspect(session) = &mut self.tool else { return };
        if let Some(pointer) = pointer.filter(|p| p.click.is_some()) {
            let focus = session.over(pointer.entity, pointer.uv);
            session.pin(focus);
        }
    }

    /// The status line while the tool is on.
    pub fn inspect_prompt(&self) -> (String, String, String) {
        let Tool::Inspect(session) = &self.tool else { return Default::default() };
        let keys = "0-9 level · V volumes · G ghosts · T tori · Shift+click second surface · Esc leave";
        let prompt = if session.subjects.is_empty() {
            "Click a surface to look into its hierarchy".to_owned()
        } else if let Some(error) = session.subjects.iter().find_map(|s| s.error.as_ref()) {
            error.clone()
        } else if !session.is_built() {
            "Building the hierarchy".to_owned()
        } else if session.pinned.is_some() {
            "A node is pinned; click it again or press Esc to let go".to_owned()
        } else {
            let from = if self.linked.is_some_and(|l| l.from == From::Domain) { "the uv view" } else { "either view" };
            format!("Level {}: hover a node in {from}, click to pin it", session.options.level)
        };
        ("Inspect".to_owned(), prompt, keys.to_owned())
    }
}

impl InspectSession {
    /// Asks a worker for what is to be drawn, when that has changed.
    fn dress(&mut self, jobs: &mut crate::work::Jobs) {
        if self.dressed.poll() {
            self.revision += 1;
        }
        if self.is_built() {
            let trees: Vec<Arc<Hierarchy>> = self.subjects.iter().filter_map(|s| s.hierarchy.clone()).collect();
            let stamp = (trees.iter().map(|t| Arc::as_ptr(t) as usize).collect(), self.options);
            if self.asked.as_ref() != Some(&stamp) {
                self.asked = Some(stamp);
                let (options, number) = (self.options, fresh());
                let names: Vec<String> = self.subjects.iter().map(|s| s.name.clone()).collect();
                let input = format!("{options:?}");
                self.dressed.request(jobs, "Draw the hierarchy", input, move |job| {
                    Dressed::new(&trees, &names, &options, number, job)
                });
            }
        } else if self.subjects.is_empty() && self.dressed.value().is_some() {
            self.dressed.clear();
            self.revision += 1;
        }
        if self.pictured != self.revision {
            self.pictured = self.revision;
            self.pictures = self.draw_pictures();
        }
    }

    /// The drawn level, when it is that of the present subjects.
    pub fn current(&self) -> Option<&Dressed> {
        let dressed = self.dressed.value()?.as_ref().ok()?;
        let same = dressed.entities.len() == self.subjects.len()
            && dressed.entities.iter().zip(&self.subjects).all(|(e, s)| *e == s.entity);
        same.then_some(dressed)
    }

    fn on_ray(&self, ray: &crate::view::viewport::Ray) -> Option<Focus> {
        let dressed = self.current()?;
        let hits = dressed.shown.iter().enumerate().filter_map(|(subject, shown)| {
            let (at, t) = shown.on_ray(ray)?;
            Some((t, Focus { subject, node: shown.nodes[at] }))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, focus)| focus)
    }
}
