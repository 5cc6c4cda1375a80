//! The intersection tools at work: what the window adds to [`crate::view::intersection`]. Clicks fill the two sets, a
//! worker computes, the result is looked at, and curves of it are kept or written.

use std::sync::Arc;

use super::super::editor::{Editor, Page};
use super::super::viewport::{Pointer, hit_entity};
use super::intersect_plane::PlaneDemo;
use super::intersect_uv::UvShown;
use super::{Tool, fresh};
use crate::kernel::geom::Surface;
use crate::kernel::intersect::Engine;
use crate::kernel::ssi::{Tangency, tangency};
use crate::model::command::Command;
use crate::model::document::EntityId;
use crate::model::examples::{coaxial, cross_cap};
use crate::render::Sketch;
use crate::view::intersection::biarcs::{Biarcs, biarcs};
use crate::view::intersection::contact::{Contact, contact};
use crate::view::intersection::gap::{FieldMesh, area_elements, gaps};
use crate::view::intersection::keep::{self, Kept};
use crate::view::intersection::marks::Focus;
use crate::view::intersection::{Comparison, Found, Item, OnCurve, Picks, Request, Task, compute, cursor};
use crate::view::uv::UvMark;
use crate::work::{Lane, Latest, Outcome, Ticket};

/// How near in pixels the cursor must be to something of the result.
const RADIUS: f64 = 9.0;
/// Zooming to something never shows less than this fraction of the model.
const CLOSEST: f64 = 0.02;

/// Which field is shaded on the surfaces of the first set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FieldKind {
    /// None.
    #[default]
    None,
    /// The gap to the other set.
    Gap,
    /// |Su x Sv|.
    Area,
}

/// The engine that a result can be compared with.
pub fn other_engine(engine: Engine) -> Engine {
    match engine {
        Engine::Bvh => Engine::Mesh,
        Engine::Mesh => Engine::Bvh,
    }
}

/// A result and how it was asked for.
type Computed = Result<Found, String>;

/// An intersection tool in the window.
pub struct IntersectSession {
    /// The surfaces that go in.
    pub picks: Picks,
    /// The computation that runs.
    pub running: Option<Ticket<Computed>>,
    /// The computation that follows a slider.
    pub live: Latest<Computed>,
    /// What was found last.
    pub found: Option<Arc<Found>>,
    /// Why there is no result.
    pub error: Option<String>,
    /// What is emphasised.
    pub focus: Focus,
    /// The cursor on a curve.
    pub cursor: Option<OnCurve>,
    /// How the surfaces lie to each other there, or why that cannot be said.
    pub contact: Option<Result<Contact, &'static str>>,
    /// Which field is shaded.
    pub field: FieldKind,
    /// The shaded field.
    pub shaded: Latest<(FieldKind, Vec<FieldMesh>)>,
    /// Powers of ten that have colours.
    pub decades: usize,
    /// The decimal logarithm of the exaggeration.
    pub exaggeration: f64,
    /// Draws the tori and normals at the cursor.
    pub tori: bool,
    /// The tori's binormals and the exact collinear-normal point that they lead to, while the tori are drawn.
    pub tangency: Option<Tangency>,
    /// The chosen curve as biarcs.
    pub biarcs: Latest<Result<Biarcs, String>>,
    /// The other engine's result, laid over the one that is shown.
    pub other: Latest<Result<Comparison, String>>,
    /// Curves that are being fitted to be kept.
    pub keeping: Option<Ticket<Kept>>,
    /// Chooses the first miter point as soon as it is found.
    pub shows_miter: bool,
    /// The plane through a miter point.
    pub demo: PlaneDemo,
    /// What is shown in the uv view.
    pub uv: Option<UvShown>,
    /// The pictures of the uv view are newer than what it shows.
    pub uv_waits: bool,
    /// Changes whenever something to draw does, but for the cursor; never used twice, not even by another session.
    pub revision: u64,
    /// Changes whenever the cursor does.
    pub cursor_revision: u64,
    /// What was drawn last, but for the cursor.
    pub drawn: Option<Drawn>,
}

/// A drawing and what it was made for.
pub struct Drawn {
    /// Revision, theme, and the revisions of the scene.
    pub of: (u64, bool, u64),
    /// The drawing.
    pub sketch: Sketch,
    /// Whether a field is shaded.
    pub shaded: bool,
}

impl IntersectSession {
    /// Starts with what is selected.
    pub fn new(task: Task, selected: &[EntityId]) -> Self {
        Self {
            picks: Picks::new(task, selected),
            running: None,
            live: Latest::default(),
            found: None,
            error: None,
            focus: Focus::default(),
            cursor: None,
            contact: None,
            field: FieldKind::None,
            shaded: Latest::default(),
            decades: 6,
            exaggeration: 0.0,
            tori: false,
            tangency: None,
            biarcs: Latest::default(),
            other: Latest::default(),
            keeping: None,
            shows_miter: false,
            demo: PlaneDemo::default(),
            uv: None,
            uv_waits: false,
            revision: fresh(),
            cursor_revision: fresh(),
            drawn: None,
        }
    }

    /// Something to draw has changed.
    pub fn changed(&mut self) {
        self.revision = fresh();
    }

    /// Whether what is shown is about to be replaced.
    pub fn is_stale(&self) -> bool {
        self.live.is_stale()
    }

    /// The item that is chosen.
    pub fn chosen(&self) -> Option<Item> {
        self.focus.chosen
    }

    /// The curve that is chosen.
    pub fn chosen_curve(&self) -> Option<usize> {
        match self.focus.chosen {
            Some(Item::Curve(k)) => Some(k),
            _ => None,
        }
    }

    /// Chooses an item; the cursor goes to the middle of a curve unless it is on it.
    pub fn choose(&mut self, item: Option<Item>, on: Option<OnCurve>) {
        self.focus.chosen = item;
        let Some(found) = self.found.clone() else { return };
        let cursor = match item {
            Some(Item::Curve(k)) => {
                on.or(self.cursor.filter(|c| c.curve == k)).or(OnCurve::at_fraction(&found, k, 0.5))
            }
            _ => None,
        };
        self.put_cursor(cursor);
        self.changed();
    }

    /// Moves the cursor.
    pub fn put_cursor(&mut self, cursor: Option<OnCurve>) {
        self.cursor = cursor;
        self.contact = None;
        if let Some(found) = &self.found {
            let r = &found.result;
            let at = match (self.focus.chosen, cursor.and_then(|c| c.point(found))) {
                (_, Some(p)) => Some((p.a, p.uv, p.b, p.st)),
                (Some(Item::Junction(k)), _) => r.junctions.get(k).map(|j| (j.a, j.uv, j.b, j.st)),
                _ => None,
            };
            self.contact = at.map(|(a, uv, b, st)| contact(found, a, uv, b, st));
        }
        self.look_at_tangency();
        self.cursor_revision = fresh();
    }

    /// Looks for the binormals at the cursor, while they are drawn.
    pub fn look_at_tangency(&mut self) {
        let (Some(found), Some(Ok(c)), true) = (&self.found, &self.contact, self.tori) else {
            self.tangency = None;
            return;
        };
        let surfaces = found.surface(c.a.number).zip(found.surface(c.b.number));
        self.tangency = surfaces.and_then(|(a, b)| tangency(a, b, c.a.uv, c.b.uv));
    }

    /// Takes a result over. What was chosen is looked for no longer: numbers mean something else now.
    fn take(&mut self, computed: Computed) {
        match computed {
            Ok(found) => {
                self.found = Some(Arc::new(found));
                self.error = None;
            }
            Err(why) => {
                self.found = None;
                self.error = Some(why);
            }
        }
        self.focus = Focus::default();
        self.biarcs.clear();
        self.other.clear();
        self.demo = PlaneDemo::default();
        self.put_cursor(None);
        self.changed();
    }

    /// Back to picking.
    pub fn forget(&mut self) {
        self.found = None;
        self.error = None;
        self.live.clear();
        self.shaded.clear();
        self.field = FieldKind::None;
        self.focus = Focus::default();
        self.biarcs.clear();
        self.other.clear();
        self.demo = PlaneDemo::default();
        self.put_cursor(None);
        self.changed();
    }
}

impl Editor {
    /// Starts an intersection tool with what is selected.
    pub fn start_intersect(&mut self, task: Task) {
        let bodies: Vec<EntityId> = {
            let document = self.document();
            let takes = |id: &&EntityId| document.get(**id).is_some_and(|e| Picks::takes(task, e));
            self.selection.ids().iter().filter(takes).copied().collect()
        };
        self.leave_tool();
        self.selection.clear();
        self.tool = Tool::Intersect(Box::new(IntersectSession::new(task, &bodies)));
        self.show_page(Page::Tool);
        self.note = None;
        if task == Task::Pairs {
            self.run_intersect();
        }
    }

    /// Searches every visible surface for self-intersections.
    pub fn search_self_intersections(&mut self) {
        let visible: Vec<EntityId> =
            self.document().entities().iter().filter(|e| e.visible && e.surface().is_some()).map(|e| e.id).collect();
        self.leave_tool();
        self.selection.clear();
        self.tool = Tool::Intersect(Box::new(IntersectSession::new(Task::Itself, &visible)));
        self.show_page(Page::Tool);
        self.run_intersect();
    }

    /// Computes what was picked, or says what is missing.
    pub fn run_intersect(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        if session.running.is_some() {
            return;
        }
        match Request::new(&session.picks, self.history.document()) {
            Ok(request) => {
                session.forget();
                let (name, input) = (request.name(), request.to_string());
                session.running = Some(self.jobs.spawn(Lane::Heavy, name, input, move |job| compute(&request, job)));
                session.changed();
            }
            Err(missing) => {
                let mut text = missing.to_owned();
                if let Some(first) = text.get_mut(..1) {
                    first.make_ascii_uppercase();
                }
                self.warn(text);
            }
        }
    }

    /// Takes over what the tool's workers have made.
    pub fn poll_intersect(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        if session.shaded.poll() | session.demo.section.poll() | session.biarcs.poll() | session.other.poll() {
            session.changed();
        }
        if session.live.poll() {
            match session.live.value().cloned() {
                Some(computed) => session.take(computed),
                None => session.changed(),
            }
        }
        self.poll_kept();
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(outcome) = session.running.as_ref().and_then(Ticket::poll) else { return };
        session.running = None;
        session.changed();
        match outcome {
            Outcome::Finished { value, .. } => {
                session.take(value);
                session.picks.notice = None;
                if std::mem::take(&mut session.shows_miter)
                    && session.found.as_ref().is_some_and(|f| !f.result.miters.is_empty())
                {
                    session.choose(Some(Item::Miter(0)), None);
                }
            }
            Outcome::NeverRan => session.error = Some("It was cancelled before it began".to_owned()),
            Outcome::Panicked { message, input } => self.died("The intersection", &message, input),
        }
    }

    /// The prompt of the tool.
    pub fn intersect_prompt(session: &IntersectSession) -> (String, String, String) {
        let tool = if session.picks.task == Task::Itself { "Self-intersection" } else { "Intersect" };
        let (prompt, keys) = match (&session.running, &session.found) {
            (Some(_), _) => ("Computing".to_owned(), "Esc stop and keep what is ready"),
            (None, Some(found)) => {
                let text = match session.focus.chosen {
                    _ if found.is_empty() => "Nothing was found".to_owned(),
                    Some(Item::Curve(k)) => format!("Curve {} chosen", k + 1),
                    Some(Item::Junction(k)) => format!("Point of contact {} chosen", k + 1),
                    Some(Item::Miter(k)) => format!("Miter point {} chosen", k + 1),
                    Some(Item::Region(k)) => format!("Overlap {} chosen", k + 1),
                    Some(Item::Unresolved(k)) => format!("Unresolved place {} chosen", k + 1),
                    None => "Click a curve or a point".to_owned(),
                };
                (text, "N next · Z zoom to it · K keep curves · G gap colours · Backspace other surfaces · Esc leave")
            }
            _ => (session.picks.prompt().to_owned(), session.picks.keys()),
        };
        (tool.to_owned(), prompt, keys.to_owned())
    }

    /// Keys of the tool.
    pub fn intersect_keys(&mut self, ctx: &egui::Context) {
        use egui::{Key as K, Modifiers};
        let keys = [K::Enter, K::Escape, K::Backspace, K::Tab, K::X, K::N, K::Z, K::G];
        let pressed: Vec<K> = ctx.input_mut(|input| {
            keys.into_iter().filter(|k| super::super::app::take_key(input, Modifiers::NONE, *k)).collect()
        });
        for key in pressed {
            let Tool::Intersect(session) = &mut self.tool else { return };
            let has_result = session.found.is_some() || session.error.is_some();
            match key {
                K::Enter => self.run_intersect(),
                K::Escape => match &session.running {
                    Some(ticket) => ticket.cancel(),
                    None if session.focus.chosen.is_some() => session.choose(None, None),
                    None => self.leave_tool(),
                },
                K::Backspace if has_result => session.forget(),
                K::Backspace => {
                    session.picks.back();
                    session.changed();
                }
                K::Tab => session.picks.fill(1 - session.picks.filling),
                K::X if !has_result => session.picks.swap(),
                K::N => self.next_item(),
                K::Z => {
                    if let Some(item) = session.focus.chosen {
                        self.zoom_to_item(item);
                    }
                }
                K::G => {
                    let next = if session.field == FieldKind::None { FieldKind::Gap } else { FieldKind::None };
                    self.shade_intersect(next);
                }
                _ => {}
            }
        }
    }

    /// Picks an entity for the current set, in the view or in the outliner; false when nothing can be picked now.
    pub fn intersect_pick(&mut self, id: EntityId, more: bool) -> bool {
        let Tool::Intersect(session) = &mut self.tool else { return false };
        let entity = self.history.document().get(id).filter(|e| e.curve().is_none());
        let Some(entity) = entity.filter(|_| session.found.is_none() && session.running.is_none()) else {
            return false;
        };
        if Picks::takes(session.picks.task, entity) {
            session.picks.click(id, more);
            session.error = None;
        } else {
            let text = "A mesh has no parameters in which it could be searched for self-intersections";
            session.picks.notice = Some(text.to_owned());
        }
        session.changed();
        true
    }

    /// What the mouse did, for the tool.
    pub fn intersect_pointer(&mut self, pointer: &Pointer) {
        let view = self.viewport.view();
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = session.found.clone() else {
            if let Some((hit, held)) = &pointer.click
                && let Some(id) = hit.as_ref().and_then(hit_entity)
            {
                self.intersect_pick(id, held.shift || held.ctrl);
            }
            return;
        };
        let under = pointer.pixel.and_then(|pixel| cursor::under(&found, &view, pixel, RADIUS));
        let hovered = under.map(|(item, _)| item);
        // The uv view has its own say while the mouse is there.
        let here = pointer.pixel.is_some() || self.uv.pointer.is_none();
        if here && session.focus.hovered != hovered {
            session.focus.hovered = hovered;
            session.changed();
        }
        if pointer.click.is_some() {
            let (item, on) = under.map_or((None, None), |(item, on)| (Some(item), on));
            session.choose(item, on);
        } else if let (Some(chosen), Some((Item::Curve(k), Some(on)))) = (session.chosen_curve(), under)
            && chosen == k
            && session.cursor != Some(on)
        {
            // The cursor follows the mouse along the chosen curve and stays where it left it.
            session.put_cursor(Some(on));
        }
    }

    /// Chooses the next item of the list, unresolved ones first, and shows it.
    pub fn next_item(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = &session.found else { return };
        let all: Vec<Item> = crate::view::intersection::list::groups(found, &|_| String::new())
            .into_iter()
            .flat_map(|g| g.rows)
            .map(|r| r.item)
            .collect();
        let at = session.focus.chosen.and_then(|c| all.iter().position(|i| *i == c)).map_or(0, |k| k + 1);
        let Some(&item) = all.get(at % all.len().max(1)) else { return };
        session.choose(Some(item), None);
        self.zoom_to_item(item);
    }

    /// Shows an item as large as makes sense.
    pub fn zoom_to_item(&mut self, item: Item) {
        let Tool::Intersect(session) = &self.tool else { return };
        let Some(found) = &session.found else { return };
        if let Some(bounds) = found.bounds(item, CLOSEST * found.size()) {
            self.viewport.frame(&bounds);
        }
    }

    /// Shows a miter point's ball as large as it is, and its quadrangle in the uv view.
    pub fn zoom_to_true_scale(&mut self, miter: usize) {
        let Tool::Intersect(session) = &self.tool else { return };
        let Some(found) = &session.found else { return };
        if let Some(m) = found.result.miters.get(miter) {
            let bounds = crate::kernel::geom::Aabb { min: m.xyz, max: m.xyz }.grown(2.0 * m.radius);
            self.viewport.frame(&bounds);
            if let (Some(entity), Some(surface)) = (found.id(m.a), found.surface(m.a)) {
                let quad = UvMark::quad(m.quad).bounds();
                self.uv.go_to(entity, surface.domain(), quad);
            }
        }
    }

    /// Shades a field on the surfaces of the first set, or none.
    pub fn shade_intersect(&mut self, kind: FieldKind) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = session.found.clone() else { return };
        if session.field != kind {
            // |Su x Sv| matters down to a thousandth of its largest value, gaps much further.
            session.decades = if kind == FieldKind::Area { 3 } else { 6 };
        }
        session.field = kind;
        session.changed();
        if kind == FieldKind::None {
            session.shaded.clear();
            return;
        }
        let numbered = |n: usize| Some((n, Arc::clone(found.surface(n)?)));
        let side = |ids: &[EntityId]| -> Vec<(usize, Arc<Surface>)> {
            ids.iter().filter_map(|id| found.number(*id)).filter_map(numbered).collect()
        };
        let (of, to) = match session.picks.task {
            Task::Sets => (side(&session.picks.sides[0]), side(&session.picks.sides[1])),
            // Of all pairs, the first surface that meets another is shaded against the rest.
            Task::Pairs => {
                let numbers = found.numbers();
                let first = numbers.first().copied();
                let rest = numbers.iter().skip(1).copied().filter_map(numbered).collect();
                (first.and_then(numbered).into_iter().collect(), rest)
            }
            Task::Itself => (side(&session.picks.sides[0]), Vec::new()),
        };
        let size = found.size();
        let name = if kind == FieldKind::Gap { "Measure the gap" } else { "Measure |Su x Sv|" };
        session.shaded.request(&mut self.jobs, name, "", move |job| match kind {
            FieldKind::Gap => (kind, gaps(&of, &to, size, job)),
            _ => (kind, area_elements(&of, job)),
        });
    }

    /// Makes curves of the result free curves of the document: the chosen one, or all. They are fitted by a worker.
    pub fn keep_curves(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = session.found.clone() else { return };
        let which: Vec<usize> = match session.chosen_curve() {
            Some(k) => vec![k],
            None => (0..found.result.curves.len()).collect(),
        };
        let name = format!("Fit {} curves", which.len());
        session.keeping = Some(self.jobs.spawn(Lane::Preview, name, "", move |_| keep::curves(&found, which)));
    }

    /// Adds the curves that a worker has fitted.
    fn poll_kept(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(outcome) = session.keeping.as_ref().and_then(Ticket::poll) else { return };
        session.keeping = None;
        let kept = match outcome {
            Outcome::Finished { value, .. } => value,
            Outcome::NeverRan => return,
            Outcome::Panicked { message, input } => return self.died("Fitting the curves", &message, input),
        };
        let Kept { curves, notes } = kept;
        let count = curves.len();
        if count > 0 && !self.command(&Command::AddCurves { curves }) {
            return;
        }
        let text = match count {
            0 => "No curve was kept".to_owned(),
            1 => "1 curve kept; it can be picked as a side of a patch".to_owned(),
            n => format!("{n} curves kept; they can be picked as sides of patches"),
        };
        match notes.as_slice() {
            [] if count > 0 => self.say(text),
            notes => self.warn(format!("{text}; {}", notes.join("; "))),
        }
    }

    /// Fits biarcs to the chosen curve, or forgets them.
    pub fn fit_biarcs(&mut self, on: bool) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let (Some(found), Some(k)) = (session.found.clone(), session.chosen_curve()) else { return };
        if on {
            session.biarcs.request(&mut self.jobs, "Fit biarcs", "", move |_| biarcs(&found, k));
        } else {
            session.biarcs.clear();
        }
        session.changed();
    }

    /// Lays the other engine's result over the one that is shown, or takes it away.
    pub fn lay_over(&mut self, on: bool) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(found) = session.found.clone() else { return };
        session.changed();
        if !on {
            session.other.clear();
            return;
        }
        let request = match Request::new(&session.picks, self.history.document()) {
            Ok(request) => Request { engine: Some(other_engine(found.engine)), ..request },
            Err(missing) => return self.warn(format!("The other engine cannot run: {missing}")),
        };
        let (name, input) = (request.name(), request.to_string());
        session.other.request(&mut self.jobs, &name, input, move |job| {
            compute(&request, job).map(|other| Comparison::new(&found, other))
        });
    }

    /// Whether there are curves to keep or to write.
    pub fn has_found_curves(&self) -> bool {
        matches!(&self.tool, Tool::Intersect(s) if s.found.as_ref().is_some_and(|f| !f.result.curves.is_empty()))
    }

    /// What the intersection tool has found, while it is on.
    pub fn found_intersection(&self) -> Option<&Arc<Found>> {
        match &self.tool {
            Tool::Intersect(session) => session.found.as_ref(),
            _ => None,
        }
    }

    /// Puts the cursor at a fraction of the length of the chosen curve.
    pub fn put_intersection_cursor(&mut self, fraction: f64) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let (Some(found), Some(k)) = (session.found.clone(), session.chosen_curve()) else { return };
        session.put_cursor(OnCurve::at_fraction(&found, k, fraction));
    }

    /// Starts the tool that a demonstration is about.
    pub fn begin_demo(&mut self, name: &str) {
        let ids: Vec<EntityId> = self.document().surfaces().map(|(id, _)| id).collect();
        let mut session = IntersectSession::new(if name == coaxial::NAME { Task::Sets } else { Task::Itself }, &ids);
        session.shows_miter = name == cross_cap::NAME;
        self.leave_tool();
        self.tool = Tool::Intersect(Box::new(session));
        self.show_page(Page::Tool);
        if name == coaxial::NAME {
            self.recompute_live();
        } else {
            self.run_intersect();
        }
    }

    /// Opens the cylinders, after asking when there are unsaved changes; what is open already stays as it is.
    pub fn start_coaxial_demo(&mut self) {
        if coaxial::is_demo(self.document()) {
            self.begin_demo(coaxial::NAME);
        } else {
            self.open_example(coaxial::NAME);
        }
    }

    /// Turns the second cylinder of the demo; the result follows, and the old one stays greyed until it is there.
    pub fn turn_cylinder(&mut self, degrees: f64) {
        let Some((id, surface)) = coaxial::turned(self.document(), degrees) else { return };
        let surface = Arc::new(surface);
        if let Err(error) = self.history.apply_merged(&Command::ReplaceSurface { id, surface }) {
            self.warn(error.to_string());
            return;
        }
        self.recompute_live();
    }

    fn recompute_live(&mut self) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Ok(request) = Request::new(&session.picks, self.history.document()) else { return };
        let (name, input) = (request.name(), request.to_string());
        session.live.request(&mut self.jobs, &name, input, move |job| compute(&request, job));
        session.shaded.clear();
        session.field = FieldKind::None;
        session.changed();
    }
}
