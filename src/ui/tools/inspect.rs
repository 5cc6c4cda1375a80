//! The Inspect tool: looking into the hierarchies of one or two selected surfaces, or into their search for
//! self-intersections. What it shows is made by workers from [`crate::view::inspect`]; this is what the window adds: jobs,
//! the mouse, the keys. What is about the search only is in `inspect_search`.

use std::sync::Arc;

use glam::DVec2;

use super::super::editor::{Editor, Page};
use super::super::linked::From;
use super::super::panels::uv::UvPointer;
use super::super::settings::Theme;
use super::super::viewport::{Pointer, hit_entity};
use super::inspect_overlay::Dressed;
use super::inspect_search::SearchView;
use super::inspect_subject::{Polled, Subject};
use super::{Tool, fresh};
use crate::kernel::bvh::NodeId;
use crate::kernel::geom::Surface;
use crate::model::document::EntityId;
use crate::view::inspect::{Coloring, Hierarchy, Searched, VolumeForm};
use crate::view::uv::UvPicture;
use crate::work::Latest;

/// The largest height that the panel offers.
pub const MOST_HEIGHT: u32 = 9;

/// The height until another is chosen: at most this, and so many leaves.
const HEIGHT: u32 = 6;
const LEAVES: usize = 1 << 16;
/// The level until another is chosen has at most so many nodes.
const NODES: usize = 1000;

/// What is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// The bounding volume hierarchies that intersections are found with.
    #[default]
    Hierarchy,
    /// The search for self-intersections.
    Search,
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
    /// What is looked at.
    pub look: Look,
    /// What is shown of the search for self-intersections.
    pub search: SearchView,
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
            look: Look::default(),
            search: SearchView::default(),
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

    /// Whether every subject has what is looked at.
    pub fn is_built(&self) -> bool {
        !self.subjects.is_empty()
            && self.subjects.iter().all(|s| match self.look {
                Look::Hierarchy => s.hierarchy.value().is_some(),
                Look::Search => s.searched.value().is_some(),
            })
    }

    /// Whether something is being computed for it.
    pub fn is_busy(&self) -> bool {
        self.dressed.is_stale() || self.search.dressed.is_stale() || self.subjects.iter().any(Subject::is_busy)
    }

    /// Changes the height; the hierarchies are built anew.
    pub fn set_height(&mut self, height: u32) {
        let height = height.clamp(1, MOST_HEIGHT);
        if height != self.height {
            self.chosen = true;
            self.height = height;
            self.options.level = self.options.level.min(height);
            self.forget_hierarchies();
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
            self.forget_hierarchies();
        }
        self.options.level = most(height, NODES);
    }

    /// Looks at something else.
    pub fn look_at(&mut self, look: Look) {
        if look != self.look {
            self.look = look;
            (self.hovered, self.search.hovered) = (None, None);
            self.moved = true;
            self.revision += 1;
        }
    }

    /// The error of a subject, about what is looked at.
    pub fn error_of<'a>(&self, subject: &'a Subject) -> Option<&'a str> {
        match self.look {
            Look::Hierarchy => subject.hierarchy.error(),
            Look::Search => subject.searched.error(),
        }
    }

    /// Drops what is looked at, so that it is made again.
    pub fn forget(&mut self) {
        match self.look {
            Look::Hierarchy => self.forget_hierarchies(),
            Look::Search => {
                self.subjects.iter_mut().for_each(|s| s.searched.forget());
                self.search.forget();
            }
        }
        self.revision += 1;
    }

    fn forget_hierarchies(&mut self) {
        self.subjects.iter_mut().for_each(|s| s.hierarchy.forget());
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
        let tree = &self.subjects[subject].hierarchy.value()?.tree;
        Some(Focus { subject, node: tree.node_over(self.options.level, uv) })
    }
}

impl Drop for InspectSession {
    fn drop(&mut self) {
        self.dressed.clear();
    }
}

impl Editor {
    /// Starts looking into what is selected.
    pub fn start_inspect(&mut self, look: Look) {
        if let Tool::Inspect(session) = &mut self.tool {
            session.look_at(look);
            self.show_page(Page::Tool);
            return;
        }
        if let Tool::Intersect(session) = &self.tool {
            // What is being intersected is looked into.
            let picked: Vec<EntityId> = session.picks.sides.iter().flatten().copied().take(2).collect();
            self.selection.set(picked);
        }
        self.leave_tool();
        if self.selection.ids().iter().all(|&id| self.surface_of(id).is_none()) {
            // One surface in the model needs no choosing.
            let mut surfaces = self.document().entities().iter().filter(|e| e.surface().is_some() && e.visible);
            if let (Some(only), None) = (surfaces.next().map(|e| e.id), surfaces.next()) {
                self.selection.set([only]);
            }
        }
        let mut session = InspectSession::new();
        session.look = look;
        self.tool = Tool::Inspect(Box::new(session));
        self.settings.uv_view = true;
        self.show_page(Page::Tool);
    }

    /// What the Inspect tool looks at, while it is on.
    pub fn inspects(&self) -> Option<Look> {
        match &self.tool {
            Tool::Inspect(session) => Some(session.look),
            _ => None,
        }
    }

    fn surface_of(&self, id: EntityId) -> Option<Arc<Surface>> {
        self.document().get(id)?.surface().cloned()
    }

    /// Follows the selection, the workers and the options.
    pub fn poll_inspect(&mut self) {
        let chosen = self.chosen_surfaces();
        let dark = self.settings.theme == Theme::Dark;
        let Tool::Inspect(session) = &mut self.tool else { return };
        let same = chosen.len() == session.subjects.len()
            && chosen
                .iter()
                .zip(&session.subjects)
                .all(|((id, _, s), old)| *id == old.entity && Arc::ptr_eq(s, &old.surface));
        if !same {
            let mut old = std::mem::take(&mut session.subjects);
            for (entity, name, surface) in chosen {
                // What is made stays as long as its surface is selected.
                let kept = old.iter().position(|o| o.entity == entity && Arc::ptr_eq(&o.surface, &surface));
                session.subjects.push(match kept {
                    Some(at) => old.swap_remove(at),
                    None => Subject::new(entity, name, surface),
                });
            }
            // What is no longer looked into stops being built.
            drop(old);
            (session.hovered, session.pinned, session.asked) = (None, None, None);
            session.search.forget();
            session.options.pairs &= session.subjects.len() == 2;
            session.fit();
            session.revision += 1;
        }
        let (height, look) = (session.height, session.look);
        let mut died = None;
        for subject in &mut session.subjects {
            let (entity, surface) = (subject.entity, Arc::clone(&subject.surface));
            match look {
                Look::Hierarchy => {
                    let input = format!("height {height}, entity {}", entity.0);
                    let name = format!("Hierarchy of {}", subject.name);
                    subject.hierarchy.want(&mut self.jobs, &name, input, move |job| {
                        Hierarchy::build(entity, surface, height, job).map_err(|e| e.to_string())
                    });
                }
                Look::Search => {
                    let input = format!("entity {}", entity.0);
                    let name = format!("Self-intersection search of {}", subject.name);
                    let of = subject.name.clone();
                    subject.searched.want(&mut self.jobs, &name, input, move |job| {
                        Searched::search(entity, &of, &surface, job).map_err(|e| e.to_string())
                    });
                }
            }
            let polled = [
                subject.hierarchy.poll("Building the hierarchy", false),
                subject.searched.poll("The search for self-intersections", true),
            ];
            for (polled, what) in polled.into_iter().zip(["Building the hierarchy", "The self-intersection search"]) {
                match polled {
                    Polled::Same => continue,
                    Polled::Changed => {}
                    Polled::Died(message, input) => died = Some((what, message, input)),
                }
                session.revision += 1;
            }
        }
        session.dress(&mut self.jobs, dark);
        if let Some((what, message, input)) = died {
            self.died(what, &message, input);
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
        let searching = session.look == Look::Search;
        let mut level = if searching { session.search.options.level } else { session.options.level };
        for (digit, key) in (0..).zip(DIGITS) {
            if taken(key) {
                level = digit;
            }
        }
        if taken(Key::PageUp) {
            level = level.saturating_sub(1);
        }
        if taken(Key::PageDown) {
            level += 1;
        }
        if searching {
            session.set_search_level(level);
        } else {
            session.set_level(level);
        }
        if taken(Key::S) {
            session.look_at(if searching { Look::Hierarchy } else { Look::Search });
        }
        if !searching && taken(Key::T) {
            session.options.tori ^= true;
        }
        if !searching && taken(Key::V) {
            let all = VolumeForm::ALL;
            let at = all.iter().position(|(form, _)| *form == session.options.form).unwrap_or(0);
            session.options.form = all[(at + 1) % all.len()].0;
        }
        if !searching && taken(Key::G) {
            session.options.ghosts ^= true;
        }
        if searching && taken(Key::W) {
            session.toggle_windows();
        }
        if taken(Key::Escape) {
            if session.subjects.iter().any(Subject::is_busy) {
                session.subjects.iter().for_each(Subject::cancel);
            } else if searching && session.search.pinned.is_some() {
                session.pin_search(None);
            } else if !searching && session.pinned.is_some() {
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
        let searching = session.look == Look::Search;
        let search_focus = linked.filter(|_| searching).and_then(|l| session.search_over(l.entity, l.uv));
        session.hover_search(search_focus);
        let focus = match (&pointer.hover, ray) {
            _ if searching => None,
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
            _ if searching => session.pin_search(search_focus),
            _ => session.pin(focus),
        }
    }

    /// What the mouse does in the uv view: a click pins the node under it.
    pub fn inspect_uv_pointer(&mut self, pointer: Option<&UvPointer>) {
        let Tool::Inspect(session) = &mut self.tool else { return };
        let Some(pointer) = pointer.filter(|p| p.click.is_some()) else { return };
        match session.look {
            Look::Hierarchy => {
                let focus = session.over(pointer.entity, pointer.uv);
                session.pin(focus);
            }
            Look::Search => {
                let focus = session.search_over(pointer.entity, pointer.uv);
                session.pin_search(focus);
            }
        }
    }

    /// The status line while the tool is on.
    pub fn inspect_prompt(&self) -> (String, String, String) {
        let Tool::Inspect(session) = &self.tool else { return Default::default() };
        let searching = session.look == Look::Search;
        let keys = if searching {
            "0-9 PgUp PgDn level · W failed windows · S hierarchy · Shift+click second surface · Esc leave"
        } else {
            "0-9 PgUp PgDn level · V volumes · G ghosts · T tori · S search · Shift+click second surface · Esc leave"
        };
        let pinned = if searching { session.search.pinned.is_some() } else { session.pinned.is_some() };
        let level = if searching { session.search.options.level } else { session.options.level };
        let prompt = if session.subjects.is_empty() {
            "Click a surface to look into it".to_owned()
        } else if let Some(error) = session.subjects.iter().find_map(|s| session.error_of(s)) {
            error.to_owned()
        } else if !session.is_built() {
            if searching { "Searching for self-intersections" } else { "Building the hierarchy" }.to_owned()
        } else if pinned {
            "A node is pinned; click it again or press Esc to let go".to_owned()
        } else {
            let from = if self.linked.is_some_and(|l| l.from == From::Domain) { "the uv view" } else { "either view" };
            format!("Level {level}: hover a node in {from}, click to pin it")
        };
        ("Inspect".to_owned(), prompt, keys.to_owned())
    }
}

impl InspectSession {
    /// Asks a worker for what is to be drawn, when that has changed.
    fn dress(&mut self, jobs: &mut crate::work::Jobs, dark: bool) {
        if self.dressed.poll() | self.search.dressed.poll() {
            self.revision += 1;
        }
        if self.look == Look::Search {
            self.dress_search(jobs, dark);
        } else if self.is_built() {
            let trees: Vec<Arc<Hierarchy>> =
                self.subjects.iter().filter_map(|s| s.hierarchy.value().cloned()).collect();
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
            self.pictures = match self.look {
                Look::Hierarchy => self.draw_pictures(),
                Look::Search => self.search_pictures(),
            };
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
