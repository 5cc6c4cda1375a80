//! The patch tool at work: what the window adds to the state machine of [`crate::view::patch_tool`]. Events go in,
//! effects become jobs and commands.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use super::super::editor::{Editor, Note, Page};
use super::super::viewport::Pointer;
use super::Tool;
use crate::kernel::heal::preview::{Preview, PreviewOptions, preview};
use crate::kernel::heal::project::Status;
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::surface_set::SurfaceSet;
use crate::kernel::mesh::tessellate::{SurfaceMesh, tessellate_on};
use crate::model::command::Command;
use crate::model::document::{Document, EntityId, Patch, Shape};
use crate::model::healing::{self, Joined};
use crate::model::resolve::resolve;
use crate::model::spec::HealSpec;
use crate::view::deviation::{Deviation, deviation};
use crate::view::feature_edges::{EdgeOptions, Edges, feature_edges};
use crate::view::legend::LegendRange;
use crate::view::patch_tool::{Effect, Event, Key, PatchTool, Stage};
use crate::view::pick::PickHit;
use crate::view::snap::{Snap, SnapOptions};
use crate::view::worst::{Worst, worst};
use crate::work::{Lane, Latest, Outcome, Ticket};

/// Lines of the deviation map for each span of the patch, and at least and at most.
const LINES: [usize; 3] = [4, 32, 128];
/// Distances beyond this fraction of the diagonal are no deviations.
const FAR: f64 = 0.05;
/// Distances below this fraction of the diagonal are rounding.
const NOISE: f64 = 1e-10;
/// How long a heal may take before it stops with what it has.
const BUDGET: Duration = Duration::from_secs(60);

/// A healed patch with what the window shows of it.
#[derive(Debug)]
pub struct Shown {
    /// The patch.
    pub patch: Arc<Patch>,
    /// Patches of the document that were healed anew with it, because they share boundaries with it or with each other.
    pub neighbours: Vec<(EntityId, Arc<Patch>)>,
    /// The boundaries that it shares: with which patch, how far the two are apart, and the largest angle in degrees.
    pub seams: Vec<(String, f64, f64)>,
    /// The triangles of the deviation map.
    pub mesh: SurfaceMesh,
    /// The deviation at each of its vertices.
    pub deviation: Deviation,
    /// The worst check points, largest first.
    pub worst: Vec<Worst>,
    /// The samples: where they are and what they are.
    pub samples: Vec<(DVec3, Status)>,
    /// False when the job was cancelled and this is what was ready.
    pub complete: bool,
}

/// What is kept of the surfaces to project on, so that not every preview tessellates them again.
type Originals = Arc<Mutex<Option<(Option<Vec<usize>>, Arc<SurfaceSet>)>>>;

/// The patch tool in the window.
pub struct PatchSession {
    /// Sides, stage, options.
    pub tool: PatchTool,
    /// The coarse projection.
    pub sketch: Latest<Option<Preview>>,
    /// The heal that runs.
    pub healing: Option<Ticket<Result<Shown, String>>>,
    /// When the heal's time is used up; none when the user wants it to go on.
    deadline: Option<Instant>,
    /// Whether the last heal stopped because its time was used up.
    timed_out: bool,
    /// The heal that was cancelled and has not ended yet.
    stopping: Option<Ticket<Result<Shown, String>>>,
    /// The patch to be judged.
    pub shown: Option<Shown>,
    /// The patch of the document that is being adjusted: the result takes its place.
    pub adjusting: Option<EntityId>,
    /// The ends of the deviation scale.
    pub range: LegendRange,
    /// Shows the box of influence.
    pub show_slab: bool,
    /// Which snaps are on.
    pub snaps: [bool; 5],
    /// Changes whenever something to draw does.
    pub revision: u64,
    /// The revision of the document that was drawn last.
    document: u64,
    /// What the cursor snaps to.
    pub snap: Option<Snap>,
    /// The end of a piece that is being dragged: side, piece, end.
    pub trimming: Option<(usize, usize, usize)>,
    /// What is under the cursor, for highlighting.
    pub hover: Option<PickHit>,
    /// The edges of the model, while they are looked for and after.
    edges: Latest<Arc<Edges>>,
    originals: Originals,
}

impl PatchSession {
    fn new(document: &Document) -> Self {
        Self {
            tool: PatchTool::new(&document.tolerances(), document.unit),
            sketch: Latest::default(),
            healing: None,
            deadline: None,
            timed_out: false,
            stopping: None,
            shown: None,
            adjusting: None,
            range: LegendRange { low: -1.0, high: 1.0, locked: false },
            show_slab: false,
            snaps: [true; 5],
            revision: 1,
            document: 0,
            snap: None,
            trimming: None,
            hover: None,
            edges: Latest::default(),
            originals: Originals::default(),
        }
    }

    /// The edges of the model, once they are known.
    pub fn edges(&self) -> Option<&Edges> {
        self.edges.value().map(Arc::as_ref)
    }

    /// Has everything drawn anew after a change of the document: what is hidden may have changed.
    pub fn follow(&mut self, document: u64) {
        if self.document != document {
            self.document = document;
            self.revision += 1;
        }
    }

    /// How to snap.
    pub fn snap_options(&self) -> SnapOptions {
        SnapOptions { on: self.snaps, ..SnapOptions::new(self.tool.options().joining_tol) }
    }

    /// The end of a piece within ten pixels of a pixel: side, piece, end.
    fn end_at(&self, project: impl Fn(DVec3) -> Option<DVec2>, pixel: DVec2) -> Option<(usize, usize, usize)> {
        if !matches!(self.tool.stage(), Stage::Side(_)) {
            return None;
        }
        let mut best: Option<(f64, (usize, usize, usize))> = None;
        for (s, side) in self.tool.sides().iter().enumerate().filter(|(_, side)| !side.shared) {
            for (k, piece) in side.pieces.iter().enumerate() {
                for (end, p) in piece.ends().into_iter().enumerate() {
                    let Some(at) = project(p) else { continue };
                    let d = at.distance(pixel);
                    if d < 10.0 && best.is_none_or(|b| d < b.0) {
                        best = Some((d, (s, k, end)));
                    }
                }
            }
        }
        best.map(|b| b.1)
    }
}

impl Editor {
    /// Starts picking a patch.
    pub fn start_patch(&mut self) {
        if let Tool::Patch(_) = self.tool {
            return;
        }
        let mut session = PatchSession::new(self.document());
        let count = self.document().patches().count();
        let mut options = session.tool.options().clone();
        options.name = format!("Patch {}", count + 1);
        session.tool.handle(Event::Start, &self.viewport.scene);
        session.tool.handle(Event::Options(Box::new(options)), &self.viewport.scene);
        let document = self.history.document().clone();
        let look = EdgeOptions::new(session.tool.options().joining_tol);
        session
            .edges
            .request(&mut self.jobs, "Find the edges", "", move |job| Arc::new(feature_edges(&document, &look, job)));
        self.selection.clear();
        self.tool = Tool::Patch(Box::new(session));
        self.show_page(Page::Tool);
        self.note = None;
    }

    /// Goes back to the sides of the selected patch; what is healed then takes its place.
    pub fn adjust_patch(&mut self) {
        let selected = self.selection.ids().first().copied();
        let Some((id, Shape::Patch(patch))) =
            selected.and_then(|id| Some((id, self.document().get(id)?.shape.clone())))
        else {
            return;
        };
        self.leave_tool();
        self.start_patch();
        let Tool::Patch(session) = &mut self.tool else { return };
        session.adjusting = Some(id);
        self.patch_event(Event::StartWith(Box::new(patch.spec.clone()), Box::new(patch.settings.clone())));
    }

    /// Hands the tool an event and does what it asks for.
    pub fn patch_event(&mut self, event: Event) {
        let Tool::Patch(session) = &mut self.tool else { return };
        let effects = session.tool.handle(event, &self.viewport.scene);
        session.revision += 1;
        for effect in effects {
            self.patch_effect(effect);
        }
    }

    fn patch_effect(&mut self, effect: Effect) {
        let Tool::Patch(session) = &mut self.tool else { return };
        match effect {
            Effect::Project(spec) => {
                let document = self.history.document().clone();
                let originals = Arc::clone(&session.originals);
                session.sketch.request(&mut self.jobs, "Preview the patch", written(&spec), move |job| {
                    sketch(&document, &spec, &originals, job)
                });
            }
            Effect::Run(spec) => {
                let document = self.history.document().clone();
                let originals = Arc::clone(&session.originals);
                let replacing = session.adjusting;
                let input = written(&spec);
                let name = format!("Heal {}", spec.patches.first().map_or("patch", |p| p.name.as_str()));
                let work = move |job: &Job| heal(&document, &spec, replacing, &originals, job);
                session.stopping = None;
                session.shown = None;
                // After a heal that took too long the next one may take as long as it likes.
                session.deadline = (!session.timed_out).then(|| Instant::now() + BUDGET);
                session.timed_out = false;
                session.healing = Some(self.jobs.spawn(Lane::Heavy, name, input, work));
            }
            Effect::Cancel => {
                session.stopping = session.healing.take();
                if let Some(ticket) = &session.stopping {
                    ticket.cancel();
                }
            }
            Effect::Accept { name, patch } => self.accept_patch(name, &patch),
            Effect::Leave => self.leave_tool(),
        }
    }

    /// Takes over what the tool's workers have made. True when a heal has ended.
    pub fn poll_patch(&mut self) -> bool {
        let Tool::Patch(session) = &mut self.tool else { return false };
        if session.sketch.poll() {
            session.revision += 1;
        }
        if session.edges.poll()
            && let Some(edges) = session.edges.value()
        {
            session.tool.set_edges(Arc::clone(edges));
            session.revision += 1;
        }
        if let Some(ticket) = &session.healing
            && session.deadline.is_some_and(|at| Instant::now() >= at)
        {
            ticket.cancel();
            (session.deadline, session.timed_out) = (None, true);
            let text = format!("The heal used up its {} s; Enter goes on without a limit", BUDGET.as_secs());
            self.note = Some(Note { text, warning: true, since: Instant::now() });
        }
        let slot = if session.healing.is_some() { &mut session.healing } else { &mut session.stopping };
        let Some(outcome) = slot.as_ref().and_then(Ticket::poll) else { return false };
        *slot = None;
        session.revision += 1;
        let event = match outcome {
            Outcome::Finished { value: Ok(shown), cancelled } => {
                session.range = session.range.updated(fitting(&shown, session.tool.options().tol));
                let patch = Arc::clone(&shown.patch);
                session.shown = Some(shown);
                if cancelled { Event::Cancelled(Some(patch)) } else { Event::Finished(Ok(patch)) }
            }
            Outcome::Finished { cancelled: true, .. } | Outcome::NeverRan => Event::Cancelled(None),
            Outcome::Finished { value: Err(why), .. } => Event::Finished(Err(why)),
            Outcome::Panicked { message, input } => {
                self.died("Healing the patch", &message, input);
                Event::Cancelled(None)
            }
        };
        self.patch_event(event);
        true
    }

    fn accept_patch(&mut self, name: String, patch: &Arc<Patch>) {
        let Tool::Patch(session) = &mut self.tool else { return };
        let mut replaced = session.shown.take().map(|shown| shown.neighbours).unwrap_or_default();
        let (added, text) = match session.adjusting.take() {
            Some(id) => {
                replaced.insert(0, (id, Arc::clone(patch)));
                (Vec::new(), format!("{name} adjusted; pick its neighbour, or leave with Esc"))
            }
            None => {
                let text = format!("{name} added; pick its neighbour, or leave with Esc");
                (vec![(name, (**patch).clone())], text)
            }
        };
        if self.command(&Command::Heal { added, replaced }) {
            self.say(text);
        }
    }

    /// Keys of the patch tool.
    pub fn patch_keys(&mut self, ctx: &egui::Context) {
        use egui::{Key as K, Modifiers};
        const KEYS: [(K, Key); 19] = [
            (K::Enter, Key::Enter),
            (K::Backspace, Key::Backspace),
            (K::Escape, Key::Escape),
            (K::Num1, Key::Digit(1)),
            (K::Num2, Key::Digit(2)),
            (K::Num3, Key::Digit(3)),
            (K::Num4, Key::Digit(4)),
            (K::X, Key::Flip),
            (K::T, Key::Chain),
            (K::Tab, Key::Tab),
            (K::L, Key::Line),
            (K::P, Key::Polyline),
            (K::W, Key::Draw),
            (K::C, Key::Trim),
            (K::V, Key::Preview),
            (K::D, Key::Deviation),
            (K::K, Key::Keep),
            (K::Questionmark, Key::Help),
            (K::Slash, Key::Help),
        ];
        let mut pressed = Vec::new();
        let mut snaps = false;
        ctx.input_mut(|input| {
            for (k, key) in KEYS {
                let held = if k == K::Questionmark || k == K::Slash { Modifiers::SHIFT } else { Modifiers::NONE };
                if super::super::app::take_key(input, held, k) {
                    pressed.push(key);
                }
            }
            snaps = super::super::app::take_key(input, Modifiers::NONE, K::S);
        });
        for key in pressed {
            self.patch_event(Event::Key(key));
        }
        if let (true, Tool::Patch(session)) = (snaps, &mut self.tool) {
            let on = session.snaps.iter().any(|on| *on);
            session.snaps = [!on; 5];
            self.say(if on { "Snapping is off" } else { "Snapping is on" });
        }
    }

    /// What the mouse did, for the patch tool.
    pub fn patch_pointer(&mut self, pointer: &Pointer) {
        let viewport = &self.viewport;
        let Tool::Patch(session) = &mut self.tool else { return };
        let project = |p: DVec3| viewport.view().project(p).map(|at| at.pixel);
        if pointer.drag_started
            && let Some((start, _)) = pointer.drag
        {
            session.trimming = session.end_at(project, start);
        }
        let ctrl = pointer.held.ctrl;
        let wants = session.tool.wants_point() || session.trimming.is_some();
        let snap = pointer.pixel.filter(|_| wants).and_then(|pixel| {
            let filter = session.tool.filter().and(self.pickable);
            viewport.snap(pixel, filter, &session.snap_options(), ctrl)
        });
        if session.snap != snap || session.hover != pointer.hover {
            session.revision += 1;
        }
        (session.snap, session.hover) = (snap.clone(), pointer.hover);
        if let Some((side, piece, end)) = session.trimming {
            if pointer.drag_ended {
                session.trimming = None;
                let at = snap.map(|s| s.point).or(pointer.hover.map(|h| h.point)).or_else(|| {
                    let (_, now) = pointer.drag?;
                    let p = session.tool.sides().get(side)?.pieces.get(piece)?.ends()[end];
                    let view = viewport.view();
                    Some(view.unproject(now, view.depth(p)))
                });
                if let Some(to) = at {
                    self.patch_event(Event::Trim { side, piece, end, to });
                }
            }
            return;
        }
        if let Some((hit, held)) = pointer.click {
            // Shift splits what is highlighted: a click that has just picked it there does not make it the next thing.
            let hit = if held.shift { pointer.hover } else { hit };
            self.patch_event(Event::Click { hit, snap, held });
        }
    }

    /// Puts the camera on a place of the result.
    pub fn zoom_to(&mut self, p: DVec3) {
        let Tool::Patch(session) = &self.tool else { return };
        let size = session.shown.as_ref().map_or(1.0, |s| s.patch.surface.bounds().diagonal());
        let bounds = crate::kernel::geom::Aabb { min: p, max: p }.grown(0.06 * size);
        self.viewport.frame(&bounds);
    }
}

/// The specification as text, for the record of jobs and for bug reports.
fn written(spec: &HealSpec) -> String {
    ron::ser::to_string_pretty(spec, ron::ser::PrettyConfig::default()).unwrap_or_default()
}

/// The originals of a heal, tessellated once for a choice of surfaces.
fn originals_of(
    kept: &Originals,
    onto: Option<&Vec<usize>>,
    surfaces: &[(usize, Body)],
    tol: f64,
    job: &Job,
) -> Arc<SurfaceSet> {
    let mut slot = kept.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, set)) = &*slot
        && of.as_ref() == onto
    {
        return Arc::clone(set);
    }
    let set = Arc::new(SurfaceSet::new(surfaces.to_vec(), tol, job));
    // A set that a cancelled job left unfinished is not worth keeping.
    if !job.is_cancelled() {
        *slot = Some((onto.cloned(), Arc::clone(&set)));
    }
    set
}

fn sketch(document: &Document, spec: &HealSpec, kept: &Originals, job: &Job) -> Option<Preview> {
    let resolved = resolve(spec, document, job).ok()?;
    let patch = resolved.patches.first()?;
    let set = originals_of(kept, spec.onto.as_ref(), &resolved.surfaces, resolved.options.chord_tol, job);
    let options = PreviewOptions { slab: spec.slab, choice: patch.choice, ..PreviewOptions::default() };
    preview(&patch.sides, Some(&set), &options, job)
}

fn heal(
    document: &Document,
    spec: &HealSpec,
    replacing: Option<EntityId>,
    kept: &Originals,
    job: &Job,
) -> Result<Shown, String> {
    let Joined { healing, new, neighbours } =
        healing::with_neighbours(document, spec, replacing, &job.part(0.0, 0.9)).map_err(|e| e.to_string())?;
    let (Some(healed), Some((_, patch))) = (healing.healed.patches.get(new), healing.patches.get(new)) else {
        return Err("The heal was cancelled before there was a patch".to_owned());
    };
    // The map is measured even for a partial result, coarsely: its evidence matters as much, but nobody waits for it.
    let measure = Job::new();
    let complete = healing.healed.complete;
    job.phase("Measuring deviations");
    let resolved = resolve(spec, document, &measure).map_err(|e| e.to_string())?;
    let set = originals_of(kept, spec.onto.as_ref(), &resolved.surfaces, resolved.options.chord_tol, &measure);
    let surface = Arc::clone(&patch.surface);
    let [per_span, least, most] = LINES;
    let most = if complete { most } else { least };
    let lines = [0, 1].map(|k| {
        let [a, b] = surface.domain()[k];
        let n = (per_span * patch.report.resolution[k]).clamp(least, most);
        (0..=n).map(|i| if i == n { b } else { a + (b - a) * i as f64 / n as f64 }).collect()
    });
    let mesh = tessellate_on(&surface, lines, false);
    let diagonal = document.bounds().diagonal();
    let deviation = deviation(&mesh, &set, FAR * diagonal, NOISE * diagonal, &measure);
    let others = healing.patches.iter().enumerate().filter(|(k, _)| *k != new).map(|(_, (_, p))| Arc::new(p.clone()));
    let shared = healing.healed.shared.iter().filter(|s| s.patches.contains(&new));
    let name = |k: usize| healing.patches.get(k).map_or(String::new(), |p| p.0.clone());
    Ok(Shown {
        patch: Arc::new(patch.clone()),
        neighbours: neighbours.into_iter().zip(others).collect(),
        seams: shared
            .map(|s| {
                let other = if s.patches[0] == new { s.patches[1] } else { s.patches[0] };
                (name(other), s.max_gap, s.max_normal_angle_deg)
            })
            .collect(),
        mesh,
        deviation,
        // One patch only, so its id is of no account.
        worst: worst([(EntityId(0), &healed.deviation)], 3, 0.05 * surface.bounds().diagonal()),
        samples: healed.samples.values().iter().map(|s| (s.point, s.status)).collect(),
        complete,
    })
}

/// The range that holds what was measured.
pub fn fitting(shown: &Shown, tol: f64) -> LegendRange {
    LegendRange::symmetric(shown.deviation.values.iter().map(|&v| f64::from(v)), tol)
}
