//! The list of defects: what is broken, how badly and where, with next and previous, zoom, isolate and "fix with a patch".

use std::sync::Arc;

use egui::{Align2, CollapsingHeader, Color32, FontId, RichText, Stroke, Ui, vec2};
use glam::DVec3;

use super::super::actions::Action;
use super::super::editor::{Editor, Page};
use super::super::status::{length, short};
use super::super::theme;
use crate::kernel::geom::Aabb;
use crate::kernel::job::Job;
use crate::model::command::Command;
use crate::model::defects::fix::patch_for;
use crate::model::defects::{self, Defect, DefectKind, DefectOptions, Defects};
use crate::model::document::{EntityId, Unit};
use crate::view::patch_tool::Event;
use crate::work::{Lane, Outcome, Ticket};

use super::super::tools::Tool;

/// Rows of one kind that are shown until more are asked for.
const ROWS: usize = 50;

/// What was looked for and found.
#[derive(Default)]
pub struct DefectSearch {
    found: Option<Arc<Defects>>,
    /// The state of the document in which it was found.
    revision: u64,
    running: Option<(u64, Ticket<Defects>)>,
    current: Option<usize>,
    /// Whether faces are intersected with themselves as well.
    own: bool,
    /// What stopped the last search.
    failed: Option<String>,
}

impl DefectSearch {
    /// The defect that is looked at.
    pub fn current(&self) -> Option<&Defect> {
        self.found.as_ref()?.list.get(self.current?)
    }
}

/// What a defect's size says, with its unit.
fn measured(defect: &Defect, unit: Unit) -> String {
    match defect.kind {
        DefectKind::Overlap if unit.symbol().is_empty() => short(defect.size),
        DefectKind::Overlap => format!("{} {}²", short(defect.size), unit.symbol()),
        DefectKind::Parametrization => format!("{}°", short(defect.size)),
        DefectKind::NonManifold | DefectKind::CrossingLoop => format!("{:.0}", defect.size),
        _ => match defect.depth {
            Some(depth) => format!("{}, {} deep", length(defect.size, unit), length(depth, unit)),
            None => length(defect.size, unit),
        },
    }
}

impl Editor {
    /// Looks for defects in the background.
    pub fn find_defects(&mut self) {
        let document = self.document().clone();
        let options = DefectOptions { self_intersections: self.defects.own, ..DefectOptions::of(&document) };
        let revision = self.history.revision();
        let input = format!("{options:?}");
        let ticket =
            self.jobs.spawn(Lane::Heavy, "Find defects", input, move |job| defects::find(&document, &options, job));
        self.defects.failed = None;
        self.defects.running = Some((revision, ticket));
        self.show_page(Page::Defects);
    }

    /// Takes over what was found.
    pub fn poll_defects(&mut self) {
        let Some((revision, outcome)) = self.defects.running.as_ref().and_then(|(r, t)| Some((*r, t.poll()?))) else {
            return;
        };
        self.defects.running = None;
        match outcome {
            Outcome::Finished { value, .. } => {
                let count = value.list.len();
                let state = if value.complete { "" } else { "; the search is incomplete" };
                self.say(format!("{count} defects found on {} faces{state}", value.faces));
                self.defects.found = Some(Arc::new(value));
                self.defects.revision = revision;
                self.defects.current = None;
            }
            Outcome::NeverRan => self.warn("The search for defects was cancelled"),
            Outcome::Panicked { message, .. } => {
                self.defects.failed = Some(format!("A bug stopped the search: {message}"))
            }
        }
    }

    /// Why one cannot go to a defect now, if one cannot.
    pub fn can_step_defects(&self) -> Result<(), &'static str> {
        match &self.defects.found {
            None => Err("look for defects first"),
            Some(found) if found.list.is_empty() => Err("there are no defects"),
            Some(_) => Ok(()),
        }
    }

    /// Goes to the next (1) or previous (-1) defect.
    pub fn step_defect(&mut self, step: isize) {
        let count = self.defects.found.as_ref().map_or(0, |f| f.list.len());
        if count == 0 {
            return;
        }
        let next = match self.defects.current {
            None if step > 0 => 0,
            None => count - 1,
            Some(at) => (at + count).saturating_add_signed(step) % count,
        };
        self.look_at_defect(next);
    }

    fn look_at_defect(&mut self, index: usize) {
        let Some(defect) = self.defects.found.as_ref().and_then(|f| f.list.get(index)).cloned() else { return };
        self.defects.current = Some(index);
        let there: Vec<EntityId> =
            defect.entities.iter().copied().filter(|&id| self.document().get(id).is_some()).collect();
        if matches!(self.tool, Tool::Select) {
            self.selection.set(there);
        }
        let least = 0.01 * self.document().bounds().diagonal();
        let half = DVec3::splat(defect.reach.max(least));
        self.viewport.frame(&Aabb { min: defect.at - half, max: defect.at + half });
        self.show_page(Page::Defects);
    }

    /// Why the current defect cannot be mended by a patch, if it cannot.
    pub fn can_fix_defect(&self) -> Result<(), &'static str> {
        match self.defects.current() {
            None => Err("choose a defect in the list first"),
            Some(d) if !matches!(d.kind, DefectKind::Gap | DefectKind::FreeEdge) => {
                Err("no sides follow from this kind of defect; start a patch and pick them around the place")
            }
            Some(_) => Ok(()),
        }
    }

    /// Starts the patch tool with the sides that mend the current defect.
    pub fn fix_defect(&mut self) {
        let Some(defect) = self.defects.current().cloned() else { return };
        let options = DefectOptions::of(self.document());
        // Edges of one model are compared in milliseconds to a second; the tool cannot start before.
        match patch_for(self.document(), &defect, &options, &Job::new()) {
            Err(error) => self.warn(format!("Fix with patch: {error}")),
            Ok(mut patch) => {
                patch.name = format!("Mend {}", self.document().patches().count() + 1);
                self.leave_tool();
                self.start_patch();
                let Tool::Patch(session) = &self.tool else { return };
                let settings = session.tool.options().settings();
                self.patch_event(Event::StartWith(Box::new(patch), Box::new(settings)));
            }
        }
    }

    /// Marks of the defects in the picture, while their list is shown.
    pub fn defect_marks(&self, ui: &Ui) {
        if self.page != Page::Defects {
            return;
        }
        let Some(found) = &self.defects.found else { return };
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.viewport.rect);
        for (k, defect) in found.list.iter().enumerate() {
            let Some(at) = self.viewport.project(defect.at) else { continue };
            let here = self.defects.current == Some(k);
            let (radius, color) = if here { (8.0, t.accent) } else { (3.5, color_of(ui, defect.kind)) };
            painter.circle_stroke(at, radius, Stroke::new(if here { 2.5 } else { 1.5 }, color));
            if here {
                let text = measured(defect, self.document().unit);
                painter.text(
                    at + vec2(12.0, 0.0),
                    Align2::LEFT_CENTER,
                    text,
                    FontId::proportional(theme::TEXT),
                    t.label,
                );
            }
        }
    }
}

fn color_of(ui: &Ui, kind: DefectKind) -> Color32 {
    let t = theme::of(ui);
    match kind {
        DefectKind::Gap | DefectKind::Sliver | DefectKind::Parametrization => t.warn,
        _ => t.bad,
    }
}

/// Draws the list.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let t = theme::of(ui);
    let ctx = ui.ctx().clone();
    ui.horizontal_wrapped(|ui| {
        for action in [Action::FindDefects, Action::PreviousDefect, Action::NextDefect] {
            button(ui, editor, action);
        }
        ui.checkbox(&mut editor.defects.own, "Self-intersections too")
            .on_hover_text("Intersect every face with itself as well; this takes longest");
    });
    ui.add_space(4.0);
    if let Some((_, ticket)) = &editor.defects.running {
        let job = ticket.job();
        ui.add(egui::ProgressBar::new(job.done() as f32).desired_height(6.0));
        ui.small(job.current_phase());
        ctx.request_repaint_after(std::time::Duration::from_millis(60));
    }
    if let Some(why) = &editor.defects.failed {
        ui.label(RichText::new(why).color(t.bad));
    }
    let Some(found) = editor.defects.found.clone() else {
        let text = "Free edges, gaps, overlaps, crossing faces, slivers and bad parametrizations are listed here. \
                    Find defects looks for them in the background.";
        return super::empty(ui, text);
    };
    if editor.defects.revision != editor.history.revision() {
        ui.label(RichText::new("The model has changed since; look again for what is true now").color(t.warn));
    }
    if !found.complete {
        ui.label(RichText::new("Not everything was looked at").color(t.warn));
    }
    found.notes.iter().for_each(|note| {
        ui.label(RichText::new(note).color(t.warn));
    });
    if found.list.is_empty() {
        return super::empty(ui, "No defects were found.");
    }
    rows(ui, editor, &found);
    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        button(ui, editor, Action::FixDefect);
        let there = editor.defects.current().map(|d| d.entities.clone()).unwrap_or_default();
        let isolate = ui.add_enabled(!there.is_empty(), egui::Button::new("Isolate"));
        if isolate.on_hover_text("Hide everything but the faces of the defect").clicked() {
            editor.command(&Command::Isolate { ids: there });
        }
        button(ui, editor, Action::ShowAll);
    });
}

fn button(ui: &mut Ui, editor: &mut Editor, action: Action) {
    let info = super::super::actions::info(action);
    let enabled = editor.enabled(action);
    let why = enabled.err().unwrap_or_default();
    let response = ui.add_enabled(enabled.is_ok(), egui::Button::new(info.name));
    if response.on_hover_text(info.help).on_disabled_hover_text(why).clicked() {
        let ctx = ui.ctx().clone();
        editor.perform(&ctx, action);
    }
}

fn rows(ui: &mut Ui, editor: &mut Editor, found: &Defects) {
    let unit = editor.document().unit;
    let (mut chosen, mut isolate) = (None, false);
    for kind in DefectKind::ALL {
        let of_kind: Vec<usize> = (0..found.list.len()).filter(|&k| found.list[k].kind == kind).collect();
        let Some(&first) = of_kind.first() else { continue };
        let title = format!("{} ({})", kind.name(), of_kind.len());
        let here = editor.defects.current.is_some_and(|k| of_kind.contains(&k));
        let header = CollapsingHeader::new(RichText::new(title).color(color_of(ui, kind))).id_salt(kind.name());
        let header = if here { header.open(Some(true)) } else { header.default_open(first == 0) };
        header.show(ui, |ui| {
            ui.small(kind.measure().0);
            let id = ui.scope_id().with("all");
            let all = ui.data(|d| d.get_temp::<bool>(id)).unwrap_or(false);
            let shown = if all { of_kind.len() } else { of_kind.len().min(ROWS) };
            for &k in of_kind
                .iter()
                .take(shown)
                .chain(of_kind.iter().skip(shown).filter(|k| editor.defects.current == Some(**k)))
            {
                let defect = &found.list[k];
                let names: Vec<String> = defect
                    .entities
                    .iter()
                    .map(|&id| editor.document().get(id).map_or("(deleted)".to_owned(), |e| e.name.clone()))
                    .collect();
                let text = format!("{}   {}", measured(defect, unit), names.join(" · "));
                let row = ui.selectable_label(editor.defects.current == Some(k), text);
                let row = row.on_hover_text("Click looks at it, double-click also hides everything else");
                if row.clicked() {
                    chosen = Some(k);
                }
                isolate |= row.double_clicked();
            }
            if shown < of_kind.len() && ui.small_button(format!("Show all {}", of_kind.len())).clicked() {
                ui.data_mut(|d| d.insert_temp(id, true));
            }
        });
    }
    if let Some(k) = chosen {
        editor.look_at_defect(k);
        let ids = found.list[k].entities.clone();
        if isolate && !ids.is_empty() {
            editor.command(&Command::Isolate { ids });
        }
    }
}
