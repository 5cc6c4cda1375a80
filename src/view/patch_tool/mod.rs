//! The picking tool: from a first click to a healed patch, as pure data. Events go in, effects come out; what to draw
//! and what to say is asked of it after every event. It knows no window and starts no thread.
//!
//! ```text
//! Idle -> Side(0..4) -> Review -> Running -> Result -> Side(0) of the neighbour patch
//! ```
//!
//! Nothing is refused or dropped silently: an event that changes nothing leaves a notice that says why and what to
//! do. Sides come in any order and direction; after every event the loop, its corners and the preview are made anew. A
//! click on a curve that does not carry on the current side starts the next one by itself, so a user who has not
//! met Enter still gets four sides; a side chosen by its digit keeps taking pieces until Enter.

mod actions;
pub mod arrange;
pub mod corners;
mod follow;
mod meetings;
mod picks;
pub mod piece;
pub mod preview;
mod prompt;
mod spec;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod walks;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::display::CurveRef;
use super::feature_edges::Edges;
use super::navigation::Modifiers;
use super::pick::{Filter, PickHit};
use super::scene::Scene;
use super::snap::Snap;
use crate::kernel::geom::Direction;
use crate::kernel::tol::Tolerances;
use crate::model::document::{EntityId, Patch, Unit};
use crate::model::spec::{BoundaryMode, HealSpec, PatchSpec};
use arrange::{Layout, Order, SideLine};
use corners::{Chosen, Corner, CornerFix};
use meetings::Cut;
use piece::Picked;
use preview::Preview;

pub use prompt::{HELP, HelpLine};

/// Where the tool is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// Not running.
    #[default]
    Idle,
    /// Picking a side, from 0.
    Side(usize),
    /// Four sides are there; options may be changed.
    Review,
    /// A worker heals.
    Running,
    /// A patch is there to be judged.
    Result,
}

/// What clicks mean while sides are picked.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Mode {
    /// A curve, or a surface for its iso-curves.
    #[default]
    Curves,
    /// The ends of a straight segment.
    Line(Vec<DVec3>),
    /// The points of a polyline.
    Polyline(Vec<DVec3>),
    /// The points of a curve drawn across surfaces.
    Draw(Vec<DVec3>),
    /// One of the two iso-curves through a point of a surface.
    Iso {
        /// The surface.
        entity: EntityId,
        /// The parameters of the point.
        uv: DVec2,
        /// The one that Enter takes: u or v fixed.
        fixed: Direction,
    },
}

/// A key that the tool understands. `prompt::HELP` names the keys of the keyboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// Next side, finish, run, accept.
    Enter,
    /// Undo the last pick.
    Backspace,
    /// Step back; twice leaves.
    Escape,
    /// A side, from 1.
    Digit(u8),
    /// X: the current side the other way round.
    Flip,
    /// T: add what carries on the side smoothly.
    Chain,
    /// The other loop, or the other iso-curve.
    Tab,
    /// L: a straight segment.
    Line,
    /// P: a polyline.
    Polyline,
    /// W: a curve drawn across surfaces.
    Draw,
    /// C: trim the sides where they cross.
    Trim,
    /// V: the preview on or off.
    Preview,
    /// D: the deviation map on or off.
    Deviation,
    /// K: keep what a cancelled heal had finished.
    Keep,
    /// ?: the list of keys on or off.
    Help,
}

/// What happens to the tool.
#[derive(Clone, Debug)]
pub enum Event {
    /// Start picking.
    Start,
    /// Start with sides filled in (from a defect, a replay, or an accepted patch) and with the settings of that heal.
    StartWith(Box<PatchSpec>, Box<HealSpec>),
    /// A click of the left button.
    Click {
        /// What was picked with [`PatchTool::filter`]; nothing on the background.
        hit: Option<PickHit>,
        /// What it snapped to.
        snap: Option<Snap>,
        /// The keys held.
        held: Modifiers,
    },
    /// A key.
    Key(Key),
    /// The end (0 start, 1 end) of a piece was dragged to a point.
    Trim {
        /// Which side.
        side: usize,
        /// Which of its pieces.
        piece: usize,
        /// Which end of the piece's polyline.
        end: usize,
        /// Where to; the nearest place of its curve is taken.
        to: DVec3,
    },
    /// A piece was taken away in the panel.
    Remove {
        /// Which side.
        side: usize,
        /// Which of its pieces.
        piece: usize,
    },
    /// A button of the corner card.
    Fix {
        /// Which corner of [`PatchTool::corners`].
        corner: usize,
        /// What to do.
        fix: CornerFix,
    },
    /// The options of the review were changed.
    Options(Box<Options>),
    /// What becomes of a side's curve.
    Boundary {
        /// Which side.
        side: usize,
        /// Keep or project.
        mode: BoundaryMode,
    },
    /// The worker is done: a patch, or why there is none.
    Finished(Result<Arc<Patch>, String>),
    /// The worker was cancelled; with the patch of the last resolution that it had finished, if any.
    Cancelled(Option<Arc<Patch>>),
    /// A side of the patch that was accepted last is shared with the one being picked.
    Reuse {
        /// Which side of that patch.
        side: usize,
    },
}

/// What the surroundings have to do.
#[derive(Clone, Debug)]
pub enum Effect {
    /// Project the preview coarsely in a worker; a newer request replaces an older one.
    Project(Box<HealSpec>),
    /// Heal in a worker.
    Run(Box<HealSpec>),
    /// Cancel the worker.
    Cancel,
    /// Add the patch to the document.
    Accept {
        /// What it is called.
        name: String,
        /// The patch.
        patch: Arc<Patch>,
    },
    /// The tool has been left.
    Leave,
}

/// What the review can change. Lengths in model units.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What the patch will be called.
    pub name: String,
    /// What two ends may be apart and still be joined.
    pub joining_tol: f64,
    /// The largest error wanted.
    pub tol: f64,
    /// The number of spans along each side to start with.
    pub min_resolution: usize,
    /// The largest number of spans along one side.
    pub max_resolution: usize,
    /// The surfaces to project on, by number; all when `None`.
    pub onto: Option<Vec<usize>>,
    /// Half the thickness of the box of influence; from the corners when `None`.
    pub slab: Option<f64>,
    /// How many known projections an artificial one is made from.
    pub neighbours: usize,
    /// The exponent of Hardy's method.
    pub gamma: f64,
    /// R of Hardy's method; from the parameter spacings when `None`.
    pub radius: Option<f64>,
    /// How far the triangles may be off the surfaces; by the model's size when `None`.
    pub chord_tol: Option<f64>,
}

impl Options {
    /// The defaults for a model.
    pub fn of(tolerances: &Tolerances) -> Self {
        Self::with("Patch 1".to_owned(), [tolerances.joining, 0.1 * tolerances.joining], &HealSpec::default())
    }

    /// Takes over the settings of a heal; tolerances that it leaves out stay.
    pub fn take(&mut self, settings: &HealSpec) {
        *self = Self::with(std::mem::take(&mut self.name), [self.joining_tol, self.tol], settings);
    }

    /// `defaults` are the joining tolerance and the largest error of settings that have none.
    fn with(name: String, defaults: [f64; 2], settings: &HealSpec) -> Self {
        Self {
            name,
            joining_tol: settings.joining_tol.unwrap_or(defaults[0]),
            tol: settings.tol.unwrap_or(defaults[1]),
            min_resolution: settings.min_resolution,
            max_resolution: settings.max_resolution,
            onto: settings.onto.clone(),
            slab: settings.slab,
            neighbours: settings.neighbours,
            gamma: settings.gamma,
            radius: settings.radius,
            chord_tol: settings.chord_tol,
        }
    }

    /// The settings of a heal with these options.
    pub fn settings(&self) -> HealSpec {
        HealSpec {
            joining_tol: Some(self.joining_tol),
            tol: Some(self.tol),
            min_resolution: self.min_resolution,
            max_resolution: self.max_resolution,
            onto: self.onto.clone(),
            slab: self.slab,
            neighbours: self.neighbours,
            gamma: self.gamma,
            radius: self.radius,
            chord_tol: self.chord_tol,
            ..HealSpec::default()
        }
    }
}

/// What the last event had to say, for the line above the prompt.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// The words.
    pub text: String,
    /// Whether something did not happen that the user asked for.
    pub refused: bool,
}

/// One side as it is being picked.
#[derive(Clone, Debug, Default)]
pub struct SidePick {
    /// Its pieces in the order of picking.
    pub pieces: Vec<Picked>,
    /// Whether the user turned it by hand.
    pub flipped: bool,
    /// What becomes of its curve.
    pub boundary: BoundaryMode,
    /// Whether it is shared with the patch that was accepted before: such a side is shared whole.
    pub shared: bool,
}

/// What a heal depends on: pieces, turned sides with what becomes of them, the loop, corners, options.
type Signature = (Vec<Vec<Picked>>, [(bool, BoundaryMode); 4], bool, Vec<Chosen>, Options);

/// The tool. See the module's text.
#[derive(Clone, Debug)]
pub struct PatchTool {
    stage: Stage,
    mode: Mode,
    sides: [SidePick; 4],
    /// A side chosen by its digit takes every piece until Enter.
    holding: bool,
    /// Whether the second best loop is wanted.
    other_loop: bool,
    chosen: Vec<Chosen>,
    options: Options,
    unit: Unit,
    leaving: bool,
    notice: Option<Notice>,
    show_preview: bool,
    show_deviation: bool,
    show_help: bool,
    result: Option<Arc<Patch>>,
    partial: Option<Arc<Patch>>,
    last: Option<Box<[SidePick; 4]>>,
    edges: Arc<Edges>,
    // Made from the above after every event.
    lines: [Option<SideLine>; 4],
    layout: Layout,
    /// How the loop closes when its sides are cut where they meet; none where their ends meet.
    cut: Option<Cut>,
    corners: Vec<Corner>,
    preview: Option<Preview>,
}

impl PatchTool {
    /// A tool for a model with these tolerances and unit.
    pub fn new(tolerances: &Tolerances, unit: Unit) -> Self {
        Self {
            stage: Stage::Idle,
            mode: Mode::Curves,
            sides: Default::default(),
            holding: false,
            other_loop: false,
            chosen: Vec::new(),
            options: Options::of(tolerances),
            unit,
            leaving: false,
            notice: None,
            show_preview: true,
            show_deviation: true,
            show_help: false,
            result: None,
            partial: None,
            last: None,
            edges: Arc::default(),
            lines: [None, None, None, None],
            layout: Layout::Nothing,
            cut: None,
            corners: Vec::new(),
            preview: None,
        }
    }

    /// Tells it the edges of the model once they are known: a click then takes the stretch of a border that is of one
    /// kind, and T follows free edges where the side is one.
    pub fn set_edges(&mut self, edges: Arc<Edges>) {
        self.edges = edges;
    }

    /// Where it is.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// What clicks mean.
    pub fn mode(&self) -> &Mode {
        &self.mode
    }

    /// Whether it is running.
    pub fn is_active(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// The sides with their pieces.
    pub fn sides(&self) -> &[SidePick; 4] {
        &self.sides
    }

    /// The sides as lines, for drawing: in the direction that the loop gives them, so that arrows can be put on.
    pub fn line(&self, side: usize) -> Option<Vec<DVec3>> {
        let mut points = self.lines.get(side)?.as_ref()?.points.clone();
        let order = self.order();
        if order.is_some_and(|o| o.sides.iter().zip(&o.reversed).any(|(s, r)| *s == side && *r)) {
            points.reverse();
        }
        Some(points)
    }

    /// The sides in loop order with their directions, as far as there is one.
    pub fn order(&self) -> Option<&Order> {
        match &self.layout {
            Layout::Nothing => None,
            Layout::Loop(_, Some(other)) if self.other_loop => Some(other),
            Layout::Facing(order) | Layout::Meeting(order) | Layout::Open(order) | Layout::Loop(order, _) => {
                Some(order)
            }
        }
    }

    /// Whether a second loop fits nearly as well.
    pub fn is_ambiguous(&self) -> bool {
        matches!(self.layout, Layout::Loop(_, Some(_)))
    }

    /// The corners, for the corner card; four of them once all sides have pieces.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// The live preview, when it is on and there are two sides.
    pub fn preview(&self) -> Option<&Preview> {
        self.preview.as_ref().filter(|_| self.show_preview && self.stage != Stage::Result)
    }

    /// Whether the deviation map is wanted.
    pub fn shows_deviation(&self) -> bool {
        self.show_deviation
    }

    /// Whether the list of keys is wanted.
    pub fn shows_help(&self) -> bool {
        self.show_help
    }

    /// The options of the review.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The patch to be judged.
    pub fn result(&self) -> Option<&Arc<Patch>> {
        self.result.as_ref().filter(|_| self.stage == Stage::Result)
    }

    /// What a cancelled heal had finished, as long as the sides and options are still those that it was made from.
    pub fn partial(&self) -> Option<&Arc<Patch>> {
        self.partial.as_ref().filter(|_| self.stage == Stage::Review)
    }

    /// What the last event had to say.
    pub fn notice(&self) -> Option<&Notice> {
        self.notice.as_ref()
    }

    /// The sides of the patch accepted before, as lines: a click near one shares it.
    pub fn reusable(&self) -> Vec<(usize, Vec<DVec3>)> {
        let Some(last) = &self.last else { return Vec::new() };
        let lines = last.iter().enumerate().filter_map(|(k, side)| Some((k, arrange::chain(&side.pieces)?.points)));
        lines.filter(|_| matches!(self.stage, Stage::Side(_))).collect()
    }

    /// What may be picked now.
    pub fn filter(&self) -> Filter {
        match (self.stage, &self.mode) {
            (Stage::Side(_), Mode::Curves) => Filter::CURVES.or(Filter::SURFACES),
            (Stage::Side(_), Mode::Iso { .. }) => Filter::SURFACES,
            (Stage::Side(_), _) => Filter::CURVES.or(Filter::SURFACES),
            (Stage::Idle, _) => Filter::ALL,
            _ => Filter::NONE,
        }
    }

    /// Whether clicks want a point, so that snapping counts.
    pub fn wants_point(&self) -> bool {
        matches!(self.stage, Stage::Side(_)) && matches!(self.mode, Mode::Line(_) | Mode::Polyline(_) | Mode::Draw(_))
    }

    /// The two iso-curves of which one is to be chosen: first the one that Enter takes.
    pub fn iso_choice(&self, scene: &Scene) -> Option<[Picked; 2]> {
        let Mode::Iso { entity, uv, fixed } = self.mode else { return None };
        let other = if fixed == Direction::U { Direction::V } else { Direction::U };
        let of = |fixed: Direction| {
            let (c, t) = if fixed == Direction::U { (uv.x, uv.y) } else { (uv.y, uv.x) };
            Picked::of_curve(scene, CurveRef::Iso(entity, fixed, c), None, t).ok()
        };
        Some([of(fixed)?, of(other)?])
    }

    /// Handles an event.
    pub fn handle(&mut self, event: Event, scene: &Scene) -> Vec<Effect> {
        let before = self.signature();
        self.notice = None;
        let leaving = std::mem::take(&mut self.leaving);
        let mut effects = match event {
            Event::Key(Key::Escape) => self.escape(leaving),
            event => self.act(event, scene),
        };
        self.refresh();
        if self.signature() != before {
            self.partial = None;
        }
        // Four sides that changed are worth a new look at what they would meet.
        if self.is_loop() && matches!(self.stage, Stage::Side(_) | Stage::Review) && self.signature() != before {
            match self.heal_spec(scene) {
                Ok(spec) => effects.push(Effect::Project(Box::new(spec))),
                Err(error) => self.refuse(sentence(&error.to_string())),
            }
        }
        effects
    }

    /// Makes lines, layout, corners and preview anew.
    fn refresh(&mut self) {
        self.lines = [0, 1, 2, 3].map(|k: usize| arrange::chain(&self.sides[k].pieces));
        let ends = [0, 1, 2, 3].map(|k: usize| self.lines[k].as_ref().map(SideLine::ends));
        self.layout = arrange::layout(&ends, [0, 1, 2, 3].map(|k: usize| self.sides[k].flipped));
        if !self.is_ambiguous() {
            self.other_loop = false;
        }
        // Whether to cut is decided by the corners as they are without a cut.
        self.cut = None;
        self.corners = self.corners_now();
        self.cut = self.find_cut();
        if let Some(cut) = &self.cut {
            self.layout = Layout::Loop(cut.order.clone(), None);
            self.corners = self.corners_now();
        }
        let drawn = match (&self.layout, self.order()) {
            (Layout::Loop(..), Some(order)) => Layout::Loop(order.clone(), None),
            (layout, _) => layout.clone(),
        };
        self.preview = match &self.cut {
            Some(cut) => {
                let left = |side: usize, line: &SideLine| SideLine { points: cut.of(side, line), ..line.clone() };
                let lines = [0, 1, 2, 3].map(|k: usize| self.lines[k].as_ref().map(|line| left(k, line)));
                preview::preview(&drawn, &lines, &[])
            }
            None => preview::preview(&drawn, &self.lines, &self.corners),
        };
    }

    fn corners_now(&self) -> Vec<Corner> {
        match self.order() {
            Some(order) if self.is_loop() => {
                corners::corners(order, &self.lines, self.cut.as_ref(), self.options.joining_tol, &self.chosen)
            }
            _ => Vec::new(),
        }
    }

    /// How the sides close a loop when they are cut, where they do not close one as they are and nobody has said how.
    fn find_cut(&self) -> Option<Cut> {
        let tol = self.options.joining_tol;
        let decided = self.other_loop || !self.chosen.is_empty() || self.sides.iter().any(|s| s.flipped);
        if decided || self.corners.iter().all(|c| c.gap <= tol) {
            return None;
        }
        let [Some(a), Some(b), Some(c), Some(d)] = &self.lines else { return None };
        let lines = [a, b, c, d];
        let clicked = [0, 1, 2, 3].map(|k: usize| {
            self.sides[k].pieces.iter().filter_map(|p| Some(lines[k].along(p.clicked()?))).collect::<Vec<f64>>()
        });
        meetings::close_by_cutting(lines, &clicked, tol)
    }

    /// Whether all four sides have pieces.
    pub fn is_loop(&self) -> bool {
        matches!(self.layout, Layout::Loop(..))
    }

    /// What the preview depends on, to see whether it changed.
    fn signature(&self) -> Signature {
        (
            self.sides.iter().map(|s| s.pieces.clone()).collect(),
            [0, 1, 2, 3].map(|k: usize| (self.sides[k].flipped, self.sides[k].boundary)),
            self.other_loop,
            self.chosen.clone(),
            self.options.clone(),
        )
    }

    fn say(&mut self, text: impl Into<String>) {
        self.notice = Some(Notice { text: text.into(), refused: false });
    }

    fn refuse(&mut self, text: impl Into<String>) {
        self.notice = Some(Notice { text: text.into(), refused: true });
    }
}

/// An error's text as a sentence of the status line.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
