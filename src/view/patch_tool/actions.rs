//! What each event and key does to the tool; clicks are in `picks`, T and C in `follow`.

use super::corners::{CornerFix, same_pair};
use super::piece::Picked;
use super::{Effect, Event, Key, Mode, PatchTool, SidePick, Stage, sentence};
use crate::kernel::geom::Direction;
use crate::view::scene::Scene;

impl PatchTool {
    pub(super) fn act(&mut self, event: Event, scene: &Scene) -> Vec<Effect> {
        match event {
            Event::Start => self.start(),
            Event::StartWith(spec, settings) => {
                self.start();
                let missing = self.load(&spec, &settings, scene);
                self.stage = match (0..4).find(|&k| self.sides[k].pieces.is_empty()) {
                    Some(k) => Stage::Side(k),
                    None => Stage::Review,
                };
                if !missing.is_empty() {
                    self.refuse(format!("Left out: {}", missing.join("; ")));
                }
            }
            Event::Click { hit, snap, held } => self.click(hit, snap, held, scene),
            Event::Key(key) => return self.key(key, scene),
            Event::Trim { side, piece, end, to } => self.trim_end(side, piece, end, to, scene),
            Event::Remove { side, piece } => self.remove(side, piece),
            Event::Fix { corner, fix } => self.fix(corner, fix, scene),
            Event::Options(options) => self.options = *options,
            Event::Boundary { side, mode } => {
                if let Some(side) = self.sides.get_mut(side) {
                    side.boundary = mode;
                }
            }
            Event::Finished(outcome) => self.finished(outcome),
            Event::Cancelled(partial) => self.cancelled(partial),
            Event::Reuse { side } => self.reuse(side),
        }
        Vec::new()
    }

    pub(super) fn start(&mut self) {
        self.sides = Default::default();
        self.stage = Stage::Side(0);
        self.mode = Mode::Curves;
        self.holding = false;
        self.other_loop = false;
        self.chosen.clear();
        self.result = None;
        self.partial = None;
    }

    fn cancelled(&mut self, partial: Option<std::sync::Arc<crate::model::document::Patch>>) {
        if self.stage == Stage::Running {
            self.stage = Stage::Review;
        }
        if self.stage != Stage::Review {
            return;
        }
        match &partial {
            Some(patch) => {
                let [m, n] = patch.report.resolution;
                let error = self.length(patch.report.max_error);
                self.say(format!("Cancelled at {m} x {n} with a largest error of {error}; K keeps this patch"));
            }
            None => self.say("Cancelled before there was a patch; the sides are kept"),
        }
        self.partial = partial;
    }

    fn keep_partial(&mut self) {
        match self.partial.take().filter(|_| self.stage == Stage::Review) {
            Some(patch) => {
                self.stage = Stage::Result;
                self.result = Some(patch);
            }
            None => self.refuse("K keeps what a cancelled heal had finished; there is nothing of that kind"),
        }
    }

    pub(super) fn key(&mut self, key: Key, scene: &Scene) -> Vec<Effect> {
        match key {
            Key::Enter => return self.enter(scene),
            Key::Backspace => self.backspace(),
            Key::Escape => {}
            Key::Digit(n) => self.digit(n),
            Key::Flip => self.flip(),
            Key::Chain => self.chain(scene),
            Key::Tab => self.tab(),
            Key::Line => self.enter_mode(Mode::Line(Vec::new())),
            Key::Polyline => self.enter_mode(Mode::Polyline(Vec::new())),
            Key::Draw => self.enter_mode(Mode::Draw(Vec::new())),
            Key::Trim => self.trim_all(scene),
            Key::Preview => self.show_preview = !self.show_preview,
            Key::Deviation => self.show_deviation = !self.show_deviation,
            Key::Keep => self.keep_partial(),
            Key::Help => self.show_help = !self.show_help,
        }
        Vec::new()
    }

    pub(super) fn escape(&mut self, leaving: bool) -> Vec<Effect> {
        match self.stage {
            Stage::Idle => {}
            Stage::Side(_) if self.mode != Mode::Curves => self.mode = Mode::Curves,
            Stage::Side(_) | Stage::Review => {
                let picks = self.sides.iter().map(|s| s.pieces.len()).sum::<usize>();
                if picks > 0 && !leaving {
                    self.leaving = true;
                    let what = if picks == 1 { "the pick is".to_owned() } else { format!("the {picks} picks are") };
                    self.say(format!("Esc again leaves the tool; {what} dropped"));
                } else {
                    self.start();
                    self.last = None;
                    self.stage = Stage::Idle;
                    return vec![Effect::Leave];
                }
            }
            Stage::Running => {
                self.stage = Stage::Review;
                self.say("Cancelling; the sides are kept");
                return vec![Effect::Cancel];
            }
            Stage::Result => {
                self.result = None;
                self.stage = Stage::Review;
                self.say("Patch discarded; the sides are kept");
            }
        }
        Vec::new()
    }

    pub(super) fn enter(&mut self, scene: &Scene) -> Vec<Effect> {
        match self.stage {
            Stage::Idle => {}
            Stage::Side(side) => match &self.mode {
                Mode::Line(_) => self.refuse("Pick the end of the segment first; Esc goes back to curves"),
                Mode::Polyline(points) | Mode::Draw(points) if points.len() < 2 => {
                    self.refuse("At least two points are needed; Esc goes back to curves");
                }
                Mode::Polyline(_) | Mode::Draw(_) => self.finish_points(scene),
                Mode::Iso { fixed, .. } => self.take_iso(None, *fixed, scene),
                Mode::Curves if self.sides[side].pieces.is_empty() => {
                    self.refuse(format!(
                        "Side {} has no curve yet; click one, or a surface for its iso-curves",
                        side + 1
                    ));
                }
                Mode::Curves => {
                    self.holding = false;
                    self.stage = self.next_empty(side).map_or(Stage::Review, Stage::Side);
                }
            },
            Stage::Review => return self.run(scene),
            Stage::Running => self.refuse("Still healing; Esc cancels"),
            Stage::Result => return self.accept(),
        }
        Vec::new()
    }

    pub(super) fn run(&mut self, scene: &Scene) -> Vec<Effect> {
        let tol = self.options.joining_tol;
        let apart =
            self.lines.iter().enumerate().find_map(|(k, l)| Some((k, l.as_ref()?.gap)).filter(|(_, g)| *g > tol));
        if let Some((side, gap)) = apart {
            let (gap, tol) = (self.length(gap), self.length(tol));
            self.refuse(format!(
                "Pieces of side {} are {gap} apart, the joining tolerance is {tol}; add a segment (L) between them",
                side + 1
            ));
            return Vec::new();
        }
        if let Some(corner) = self.corners.iter().find(|c| !c.is_settled()) {
            let [a, b] = corner.sides;
            let (gap, tol) = (self.length(corner.gap), self.length(tol));
            self.refuse(format!(
                "Sides {} and {} are {gap} apart, the joining tolerance is {tol}; choose average, move a side or bridge",
                a + 1,
                b + 1
            ));
            return Vec::new();
        }
        match self.heal_spec(scene) {
            Ok(spec) => {
                self.stage = Stage::Running;
                self.partial = None;
                vec![Effect::Run(Box::new(spec))]
            }
            Err(error) => {
                self.refuse(sentence(&error.to_string()));
                Vec::new()
            }
        }
    }

    pub(super) fn finished(&mut self, outcome: Result<std::sync::Arc<crate::model::document::Patch>, String>) {
        if self.stage != Stage::Running {
            self.say("A heal that was cancelled has ended; its patch was dropped");
            return;
        }
        match outcome {
            Ok(patch) => {
                self.stage = Stage::Result;
                self.result = Some(patch);
            }
            Err(text) => {
                self.stage = Stage::Review;
                self.refuse(sentence(&text));
            }
        }
    }

    pub(super) fn accept(&mut self) -> Vec<Effect> {
        let Some(patch) = self.result.take() else { return Vec::new() };
        let name = self.options.name.clone();
        self.last = Some(Box::new(self.sides.clone()));
        self.start();
        self.options.name = next_name(&name);
        self.say(format!(
            "Accepted {name}; click one of its sides to share it with the neighbour patch, or Esc to leave"
        ));
        vec![Effect::Accept { name, patch }]
    }

    pub(super) fn backspace(&mut self) {
        match (self.stage, &mut self.mode) {
            (Stage::Idle, _) => {}
            (Stage::Side(_), Mode::Line(points) | Mode::Polyline(points) | Mode::Draw(points)) => {
                if points.pop().is_none() {
                    self.mode = Mode::Curves;
                }
            }
            (Stage::Side(_), Mode::Iso { .. }) => self.mode = Mode::Curves,
            (Stage::Side(side), Mode::Curves) => {
                let count = self.sides[side].pieces.len();
                if count > 0 {
                    self.remove(side, count - 1);
                } else {
                    match (1..4).map(|k| (side + 4 - k) % 4).find(|&k| !self.sides[k].pieces.is_empty()) {
                        Some(back) => {
                            self.stage = Stage::Side(back);
                            self.say(format!("Back to side {}; Backspace undoes its last pick", back + 1));
                        }
                        None => self.refuse("Nothing to undo yet"),
                    }
                }
            }
            (Stage::Review, _) => {
                self.stage = Stage::Side(3);
                self.say("Back to side 4");
            }
            (Stage::Running, _) => self.refuse("Still healing; Esc cancels"),
            (Stage::Result, _) => {
                self.stage = Stage::Review;
                self.say("Back to the review; Enter heals again");
            }
        }
    }

    pub(super) fn remove(&mut self, side: usize, piece: usize) {
        if self.sides.get(side).is_none_or(|s| piece >= s.pieces.len()) {
            return;
        }
        if matches!(self.stage, Stage::Running | Stage::Idle) {
            self.refuse("Sides cannot be changed now; Esc cancels the heal first");
            return;
        }
        self.touch(side);
        if self.sides[side].shared {
            self.sides[side] = SidePick::default();
        } else {
            self.sides[side].pieces.remove(piece);
        }
        if self.sides[side].pieces.is_empty() {
            self.sides[side].flipped = false;
        }
        self.stage = Stage::Side(side);
        self.mode = Mode::Curves;
    }

    pub(super) fn digit(&mut self, n: u8) {
        let side = match (n, self.stage) {
            (_, Stage::Idle) => return,
            (_, Stage::Running) => {
                self.refuse("Still healing; Esc cancels");
                return;
            }
            (1..=4, _) => usize::from(n - 1),
            _ => {
                self.refuse("A patch has four sides, 1 to 4");
                return;
            }
        };
        self.stage = Stage::Side(side);
        self.mode = Mode::Curves;
        self.holding = !self.sides[side].pieces.is_empty();
        if self.holding {
            self.say(format!("Clicks add to side {} until Enter", side + 1));
        }
    }

    pub(super) fn flip(&mut self) {
        match self.stage {
            Stage::Side(side) if !self.sides[side].pieces.is_empty() => {
                self.touch(side);
                self.sides[side].flipped = !self.sides[side].flipped;
            }
            Stage::Side(side) => self.refuse(format!("Side {} has no curve to turn round yet", side + 1)),
            Stage::Review | Stage::Result => self.refuse("Choose the side to turn round first, 1-4"),
            Stage::Idle | Stage::Running => {}
        }
    }

    pub(super) fn tab(&mut self) {
        if let Mode::Iso { fixed, .. } = &mut self.mode {
            *fixed = if *fixed == Direction::U { Direction::V } else { Direction::U };
        } else if self.is_ambiguous() && matches!(self.stage, Stage::Side(_) | Stage::Review) {
            self.other_loop = !self.other_loop;
            self.chosen.clear();
        } else {
            self.refuse("Tab switches between two loops, or two iso-curves; there is only one now");
        }
    }

    pub(super) fn enter_mode(&mut self, mode: Mode) {
        match self.stage {
            Stage::Side(_) => self.mode = mode,
            Stage::Review | Stage::Result => self.refuse("Choose the side to add to first, 1-4"),
            Stage::Idle | Stage::Running => {}
        }
    }

    pub(super) fn fix(&mut self, corner: usize, fix: CornerFix, scene: &Scene) {
        let Some(corner) = self.corners.get(corner).cloned() else { return };
        let [a, b] = corner.sides;
        match fix {
            CornerFix::Average | CornerFix::MoveSide(_) => {
                self.chosen.retain(|(pair, _)| !same_pair(*pair, corner.sides));
                self.chosen.push((corner.sides, fix));
            }
            CornerFix::Bridge => {
                let side = if self.sides[a].shared { b } else { a };
                match Picked::line(corner.ends[0], corner.ends[1]) {
                    Ok(bridge) => {
                        self.touch(side);
                        self.sides[side].pieces.push(bridge);
                        self.say(format!(
                            "A straight piece of {} now belongs to side {}",
                            self.length(corner.gap),
                            side + 1
                        ));
                    }
                    Err(error) => self.refuse(sentence(&error.to_string())),
                }
            }
            CornerFix::Trim => match corner.crossing {
                Some(at) => {
                    for side in corner.sides {
                        self.trim_side(side, at, scene);
                    }
                }
                None => self.refuse("These two sides do not cross within the joining tolerance"),
            },
        }
    }
}

/// The name after a name: its number one higher, or a number behind it.
fn next_name(name: &str) -> String {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    match name[stem.len()..].parse::<u64>() {
        Ok(number) => format!("{stem}{}", number.saturating_add(1)),
        Err(_) => format!("{} 2", name.trim_end()),
    }
}
