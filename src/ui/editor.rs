//! The state of the editor and what each action does to it. No drawing here.

use std::path::PathBuf;
use std::time::Instant;

use super::actions::Action;
use super::autosave::Autosave;
use super::dialogs::{Dialog, PathField, Problem, SaveWhat, Then};
use super::files::Files;
use super::linked::Linked;
use super::palette::Palette;
use super::panels::defects::DefectSearch;
use super::panels::uv::UvView;
use super::settings::{Settings, Theme};
use super::tools::{Look, PickList, Tool};
use super::viewport::Viewport;
use crate::io::autosave::Recovery;
use crate::model::command::Command;
use crate::model::document::{Document, EntityId, Shape};
use crate::model::history::History;
use crate::model::selection::Selection;
use crate::model::topology::{self, SeamGaps};
use crate::view::camera::{Axis, Projection};
use crate::view::intersection::Task;
use crate::view::pick::Filter;
use crate::view::visibility::{self, VisibilityKey};
use crate::work::Jobs;

/// The pages of the right panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Page {
    /// The active tool.
    #[default]
    Tool,
    /// The table of patches.
    Patches,
    /// What is broken.
    Defects,
    /// The list of changes.
    History,
    /// The list of computations.
    Jobs,
    /// What happened to the last file.
    Report,
}

impl Page {
    /// All pages with their titles.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Tool, "Tool"),
        (Self::Patches, "Patches"),
        (Self::Defects, "Defects"),
        (Self::History, "History"),
        (Self::Jobs, "Jobs"),
        (Self::Report, "Report"),
    ];
}

/// A message in the status line that goes away by itself.
#[derive(Clone, Debug)]
pub struct Note {
    /// What it says.
    pub text: String,
    /// Whether it needs a look.
    pub warning: bool,
    /// When it came.
    pub since: Instant,
}

/// The editor.
pub struct Editor {
    /// The document and its past.
    pub history: History,
    /// What is selected.
    pub selection: Selection,
    /// Where the document came from and goes to.
    pub files: Files,
    /// The workers.
    pub jobs: Jobs,
    /// What is remembered between sessions.
    pub settings: Settings,
    /// Where that is kept.
    pub settings_path: Option<PathBuf>,
    /// The 3D view.
    pub viewport: Viewport,
    /// The active tool.
    pub tool: Tool,
    /// What the user lets a click pick, of what the tool can.
    pub pickable: Filter,
    /// The list of everything under the cursor, when it is open.
    pub pick_list: Option<PickList>,
    /// What is broken.
    pub defects: DefectSearch,
    /// The page of the right panel.
    pub page: Page,
    /// The dialog in front of everything.
    pub dialog: Option<Dialog>,
    /// The command palette.
    pub palette: Option<Palette>,
    /// The last message.
    pub note: Option<Note>,
    /// The text that the outliner is searched for.
    pub filter: String,
    /// A patch passes when its largest error is within this; by the model's size when not set.
    pub checking: Option<f64>,
    /// How far patches are from those next to them, for one revision of the document.
    pub seams: Option<(u64, SeamGaps)>,
    /// What crashed sessions left behind.
    pub recoveries: Vec<Recovery>,
    /// Puts changes aside.
    pub autosave: Autosave,
    /// The uv view.
    pub uv: UvView,
    /// The point that the 3D view and the uv view show together.
    pub linked: Option<Linked>,
    /// Set when the window may close.
    pub may_close: bool,
}

impl Editor {
    /// The current document.
    pub fn document(&self) -> &Document {
        self.history.document()
    }

    /// Shows a message in the status line.
    pub fn say(&mut self, text: impl Into<String>) {
        self.note = Some(Note { text: text.into(), warning: false, since: Instant::now() });
    }

    /// Shows a message that needs a look in the status line.
    pub fn warn(&mut self, text: impl Into<String>) {
        self.note = Some(Note { text: text.into(), warning: true, since: Instant::now() });
    }

    /// Shows a problem in front of everything; an open dialog gives way.
    pub fn problem(&mut self, problem: Problem) {
        log::warn!("{}: {}", problem.what, problem.why);
        self.dialog = Some(Dialog::Problem(problem));
    }

    /// Applies a command to the document, or says why it could not be.
    pub fn command(&mut self, command: &Command) -> bool {
        match self.history.apply(command) {
            Ok(()) => {
                self.selection.prune(self.history.document());
                true
            }
            Err(error) => {
                self.problem(Problem {
                    what: format!("{} did not work", command.label()),
                    why: error.to_string(),
                    ..Problem::default()
                });
                false
            }
        }
    }

    /// Keeps the settings; a failure is only worth a note.
    pub fn store_settings(&mut self) {
        if let Some(path) = &self.settings_path
            && let Err(error) = self.settings.store(path)
        {
            let text = format!("The settings could not be kept in {}: {error}", path.display());
            self.warn(text);
        }
    }

    /// Whether an action can be done now, or why not.
    pub fn enabled(&self, action: Action) -> Result<(), &'static str> {
        let need = |ok: bool, why: &'static str| if ok { Ok(()) } else { Err(why) };
        let selected = !self.selection.is_empty();
        match action {
            Action::Undo => need(self.history.undo_label().is_some(), "nothing to undo"),
            Action::Redo => need(self.history.redo_label().is_some(), "nothing to redo"),
            Action::Save | Action::SaveAs => need(!self.document().entities().is_empty(), "the model is empty"),
            Action::Export => need(
                self.document().entities().iter().any(|e| e.curve().is_none()),
                "there is no surface, patch, mesh or block",
            ),
            Action::SaveSpec => need(self.document().patches().next().is_some(), "there are no patches yet"),
            Action::Delete | Action::Deselect => need(selected, "nothing is selected"),
            Action::Rename => need(self.selection.ids().len() == 1, "select one entity"),
            Action::SelectAll => need(self.document().entities().iter().any(|e| e.visible), "nothing is visible"),
            Action::Hide => self.visibility(VisibilityKey::Hide).map(|_| ()),
            Action::Isolate => self.visibility(VisibilityKey::Isolate).map(|_| ()),
            Action::ShowAll => self.visibility(VisibilityKey::ShowAll).map(|_| ()),
            Action::WholeSurfaces => need(self.document().faces().next().is_some(), "there is no trimmed face"),
            Action::PatchTool => need(self.document().bodies().next().is_some(), "there is nothing to heal"),
            Action::AdjustPatch => {
                let one = match self.selection.ids() {
                    [id] => self.document().get(*id),
                    _ => None,
                };
                need(one.is_some_and(|e| matches!(e.shape, Shape::Patch(_))), "select one healed patch")
            }
            Action::Inspect | Action::InspectSearch => need(
                self.document().entities().iter().any(|e| e.surface().is_some()),
                "there is no surface to look into",
            ),
            Action::IntersectTool => need(
                self.document().entities().iter().any(|e| e.surface().is_some() || e.facets().is_some()),
                "there is neither a surface nor a mesh",
            ),
            Action::SelfIntersectTool | Action::SearchSelfIntersections => {
                need(self.document().entities().iter().any(|e| e.surface().is_some()), "there is no surface")
            }
            Action::IntersectVisible => {
                let shown = self.document().entities().iter().filter(|e| e.visible && e.surface().is_some());
                need(shown.count() > 1, "fewer than two surfaces are visible")
            }
            Action::KeepCurves | Action::ExportCurves => {
                need(self.has_found_curves(), "no intersection curves have been found")
            }
            Action::MeasureTool => need(!self.document().entities().is_empty(), "the model is empty"),
            Action::FindDefects => need(self.document().surfaces().next().is_some(), "there is no surface to look at"),
            Action::NextDefect | Action::PreviousDefect => self.can_step_defects(),
            Action::FixDefect => self.can_fix_defect(),
            Action::FrameAll => need(!self.document().entities().is_empty(), "the model is empty"),
            Action::FrameSelection => need(selected, "nothing is selected"),
            Action::CancelJobs => need(!self.jobs.active().is_empty(), "nothing is running"),
            Action::ShowReport => need(self.files.report.is_some(), "no file has been opened"),
            _ => Ok(()),
        }
    }

    /// Whether a switch is on; `None` for what is no switch.
    pub fn checked(&self, action: Action) -> Option<bool> {
        let display = &self.viewport.display;
        Some(match action {
            Action::Perspective => self.viewport.camera.projection == Projection::Perspective,
            Action::Shaded => display.shaded && !display.wireframe && !display.xray,
            Action::Wireframe => display.wireframe,
            Action::Xray => display.xray,
            Action::Edges => display.edges,
            Action::IsoLines => display.isolines,
            Action::Zebra => display.zebra,
            Action::WholeSurfaces => self.viewport.scene.shows_whole_surfaces(),
            Action::Section => self.viewport.section.is_some(),
            Action::LightTheme => self.settings.theme == Theme::Light,
            Action::DarkTheme => self.settings.theme == Theme::Dark,
            Action::LeftPanel => self.settings.left_panel,
            Action::RightPanel => self.settings.right_panel,
            Action::UvView => self.settings.uv_view,
            Action::SelectTool => matches!(self.tool, Tool::Select),
            Action::PatchTool => matches!(self.tool, Tool::Patch(_)),
            Action::MeasureTool => matches!(self.tool, Tool::Measure(_)),
            Action::Inspect => self.inspects() == Some(Look::Hierarchy),
            Action::InspectSearch => self.inspects() == Some(Look::Search),
            Action::IntersectTool => self.intersect_task().is_some_and(|task| task != Task::Itself),
            Action::SelfIntersectTool => self.intersect_task() == Some(Task::Itself),
            _ => return None,
        })
    }

    /// Does an action. What cannot be done now says so in the status line.
    pub fn perform(&mut self, ctx: &egui::Context, action: Action) {
        if let Err(why) = self.enabled(action) {
            let name = super::actions::info(action).name.trim_end_matches('…');
            self.warn(format!("{name}: {why}"));
            return;
        }
        let ids = || self.selection.ids().to_vec();
        match action {
            Action::Open => self.dialog = Some(Dialog::Open(PathField::default())),
            Action::OpenExample => self.dialog = Some(Dialog::Examples),
            Action::Save => self.save(None),
            Action::SaveAs => self.ask_where(SaveWhat::Model, None),
            Action::SaveSpec => self.ask_where(SaveWhat::Spec, None),
            Action::Export => self.ask_export(),
            Action::Quit => self.quit(ctx),
            Action::Undo => {
                if let Some(label) = self.history.undo().map(str::to_owned) {
                    self.say(format!("Undone: {label}"));
                }
                self.selection.prune(self.history.document());
            }
            Action::Redo => {
                if let Some(label) = self.history.redo().map(str::to_owned) {
                    self.say(format!("Redone: {label}"));
                }
                self.selection.prune(self.history.document());
            }
            Action::SelectAll => {
                let visible: Vec<EntityId> =
                    self.document().entities().iter().filter(|e| e.visible).map(|e| e.id).collect();
                self.selection.set(visible);
            }
            Action::Deselect => self.selection.clear(),
            Action::Rename => {
                let id = self.selection.ids().first().copied();
                if let Some(entity) = id.and_then(|id| self.document().get(id)) {
                    self.dialog = Some(Dialog::Rename(entity.id, entity.name.clone()));
                }
            }
            Action::Delete => {
                let ids = ids();
                self.command(&Command::Delete { ids });
            }
            Action::Settings => self.dialog = Some(Dialog::Settings),
            Action::Hide => {
                if self.change_visibility(VisibilityKey::Hide) {
                    self.selection.clear();
                }
            }
            Action::Isolate => {
                self.change_visibility(VisibilityKey::Isolate);
            }
            Action::ShowAll => {
                self.change_visibility(VisibilityKey::ShowAll);
            }
            Action::FrameAll => self.viewport.frame(&visible_bounds(self.history.document())),
            Action::FrameSelection => {
                let document = self.history.document();
                let bounds = self.selection.ids().iter().filter_map(|&id| document.get(id));
                let bounds = bounds.fold(crate::kernel::geom::Aabb::EMPTY, |all, e| all.union(&e.bounds()));
                self.viewport.frame(&bounds);
            }
            Action::Front => self.viewport.look(Axis::Front),
            Action::Back => self.viewport.look(Axis::Back),
            Action::Right => self.viewport.look(Axis::Right),
            Action::Left => self.viewport.look(Axis::Left),
            Action::Top => self.viewport.look(Axis::Top),
            Action::Bottom => self.viewport.look(Axis::Bottom),
            Action::Perspective => self.viewport.toggle_projection(),
            Action::Shaded => {
                let display = &mut self.viewport.display;
                (display.shaded, display.wireframe, display.xray) = (true, false, false);
            }
            Action::Wireframe => {
                let display = &mut self.viewport.display;
                let on = !display.wireframe;
                (display.shaded, display.wireframe, display.xray) = (!on, on, false);
            }
            Action::Xray => {
                let display = &mut self.viewport.display;
                let on = !display.xray;
                (display.shaded, display.wireframe, display.xray) = (true, false, on);
            }
            Action::Edges => self.viewport.display.edges ^= true,
            Action::IsoLines => self.viewport.display.isolines ^= true,
            Action::Zebra => self.viewport.display.zebra ^= true,
            Action::WholeSurfaces => self.viewport.toggle_whole_surfaces(),
            Action::Section => self.viewport.toggle_section(&visible_bounds(self.history.document())),
            Action::LightTheme => self.set_theme(ctx, Theme::Light),
            Action::DarkTheme => self.set_theme(ctx, Theme::Dark),
            Action::LeftPanel => {
                self.settings.left_panel ^= true;
                self.store_settings();
            }
            Action::RightPanel => {
                self.settings.right_panel ^= true;
                self.store_settings();
            }
            Action::UvView => {
                self.settings.uv_view ^= true;
                self.uv.pointer = None;
                self.link_from_domain(None);
                self.tool_uv_pointer(None);
                self.store_settings();
            }
            Action::ShowTool => self.show_page(Page::Tool),
            Action::ShowPatches => self.show_page(Page::Patches),
            Action::ShowDefects => self.show_page(Page::Defects),
            Action::FindDefects => self.find_defects(),
            Action::NextDefect => self.step_defect(1),
            Action::PreviousDefect => self.step_defect(-1),
            Action::FixDefect => self.fix_defect(),
            Action::ShowHistory => self.show_page(Page::History),
            Action::ShowJobs => self.show_page(Page::Jobs),
            Action::ShowReport => self.show_page(Page::Report),
            Action::SelectTool => self.leave_tool(),
            Action::PatchTool => self.start_patch(),
            Action::AdjustPatch => self.adjust_patch(),
            Action::MeasureTool if matches!(self.tool, Tool::Measure(_)) => self.leave_tool(),
            Action::MeasureTool => self.start_measure(),
            Action::Inspect if self.inspects() == Some(Look::Hierarchy) => self.leave_tool(),
            Action::InspectSearch if self.inspects() == Some(Look::Search) => self.leave_tool(),
            Action::Inspect => self.start_inspect(Look::Hierarchy),
            Action::InspectSearch => self.start_inspect(Look::Search),
            Action::IntersectTool => self.start_intersect(Task::Sets),
            Action::IntersectVisible => self.start_intersect(Task::Pairs),
            Action::SelfIntersectTool => self.start_intersect(Task::Itself),
            Action::SearchSelfIntersections => self.search_self_intersections(),
            Action::KeepCurves => self.keep_curves(),
            Action::ExportCurves => self.ask_where(SaveWhat::Curves, None),
            Action::CoaxialDemo => self.start_coaxial_demo(),
            Action::MiterDemo => self.open_example(crate::model::examples::cross_cap::NAME),
            Action::CancelJobs => {
                self.jobs.cancel_all();
                self.say("Asked every job to stop");
            }
            Action::Palette => self.palette = Some(Palette::default()),
            Action::Keys => self.dialog = Some(Dialog::Keys),
            Action::About => self.dialog = Some(Dialog::About),
        }
    }

    /// The command of a key of the visibility group, or why there is nothing to do.
    fn visibility(&self, key: VisibilityKey) -> Result<Command, &'static str> {
        visibility::command(key, self.document(), &self.selection, self.viewport.hovered_entity())
    }

    fn change_visibility(&mut self, key: VisibilityKey) -> bool {
        self.visibility(key).is_ok_and(|command| self.command(&command))
    }

    /// How far each patch is from the patches next to it.
    pub fn seam_gaps(&mut self) -> SeamGaps {
        let revision = self.history.revision();
        if self.seams.as_ref().is_none_or(|(of, _)| *of != revision) {
            let document = self.document();
            self.seams = Some((revision, topology::seam_gaps(document, document.tolerances().joining)));
        }
        self.seams.as_ref().map_or(Vec::new(), |(_, gaps)| gaps.clone())
    }

    /// The tolerance that patches are checked with, in model units.
    pub fn checking_tolerance(&self) -> f64 {
        self.checking.unwrap_or(1e-3 * self.document().bounds().diagonal())
    }

    /// Changes the tolerance that patches are checked with.
    pub fn set_checking_tolerance(&mut self, value: f64) {
        self.checking = Some(value);
    }

    /// Brings a page of the right panel to the front.
    pub fn show_page(&mut self, page: Page) {
        self.page = page;
        self.settings.right_panel = true;
    }

    /// Changes the theme and keeps it.
    pub fn set_theme(&mut self, ctx: &egui::Context, theme: Theme) {
        self.settings.theme = theme;
        self.apply_settings(ctx);
        self.store_settings();
    }

    /// Puts the settings into effect.
    pub fn apply_settings(&mut self, ctx: &egui::Context) {
        ctx.set_theme(match self.settings.theme {
            Theme::Dark => egui::ThemePreference::Dark,
            Theme::Light => egui::ThemePreference::Light,
        });
    }

    /// Closes the window, after asking when there are unsaved changes.
    pub fn quit(&mut self, ctx: &egui::Context) {
        if self.history.is_dirty() && !self.document().entities().is_empty() {
            self.dialog = Some(Dialog::Unsaved(Then::Quit));
        } else {
            self.close(ctx);
        }
    }

    /// Closes the window.
    pub fn close(&mut self, ctx: &egui::Context) {
        self.may_close = true;
        self.jobs.cancel_all();
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }
}

/// A box around what is visible, or around everything when nothing is.
pub fn visible_bounds(document: &Document) -> crate::kernel::geom::Aabb {
    let visible = document.entities().iter().filter(|e| e.visible);
    let bounds = visible.fold(crate::kernel::geom::Aabb::EMPTY, |all, e| all.union(&e.bounds()));
    if bounds.is_empty() { document.bounds() } else { bounds }
}
