//! Everything that stands in front of the window: open and save, problems, unsaved changes, settings, keys.

use std::path::PathBuf;
use std::sync::mpsc::Receiver;

use egui::{Align, Key, Layout, Modifiers, RichText, ScrollArea, TextEdit, Ui, vec2};

use super::actions::{ACTIONS, Action, Menu};
use super::icons::{self, Icon};
use super::settings::{Settings, Theme};
use super::theme;
use crate::model::document::EntityId;
use crate::view::navigation::Preset;
use crate::view::patch_tool::HELP;

/// Something that went wrong: what, why, and what can be done about it.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// One line: what did not work.
    pub what: String,
    /// One line: why.
    pub why: String,
    /// What helps: the button's text and what it does.
    pub remedy: Option<(String, Action)>,
    /// Everything a bug report needs.
    pub details: String,
}

/// What is to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveWhat {
    /// The document.
    Model,
    /// The patch specification.
    Spec,
    /// The curves that the intersection tool has found.
    Curves,
}

/// What waits for unsaved changes to be settled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Then {
    /// The window closes.
    Quit,
    /// These files are opened.
    Open(Vec<PathBuf>),
    /// This example is opened.
    Example(&'static str),
}

/// What the system's dialog offers: every extension in small and capital letters, as some systems tell them apart.
fn extensions() -> Vec<String> {
    let all = crate::io::Format::EXTENSIONS.iter();
    all.flat_map(|(names, _)| *names).flat_map(|name| [(*name).to_owned(), name.to_ascii_uppercase()]).collect()
}

/// A dialog of the system, on a thread of its own: it may block for as long as it likes.
pub struct Browse(Receiver<Option<PathBuf>>);

impl Browse {
    /// Asks the system for a file to open or to write.
    pub fn start(ctx: &egui::Context, save: bool, name: &str) -> Self {
        let (sender, receiver) = std::sync::mpsc::channel();
        let (ctx, name) = (ctx.clone(), name.to_owned());
        let spawned = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
            let dialog = rfd::FileDialog::new().add_filter("Models", &extensions()).add_filter("All files", &["*"]);
            let chosen = if save { dialog.set_file_name(name).save_file() } else { dialog.pick_file() };
            let _closed_meanwhile = sender.send(chosen);
            ctx.request_repaint();
        });
        if let Err(error) = spawned {
            log::error!("no thread for the file dialog: {error}");
        }
        Self(receiver)
    }

    /// `None` while it is open; then the file, or `None` when it was cancelled or is not to be had.
    fn poll(&self) -> Option<Option<PathBuf>> {
        match self.0.try_recv() {
            Ok(chosen) => Some(chosen),
            Err(std::sync::mpsc::TryRecvError::Empty) => None,
            Err(std::sync::mpsc::TryRecvError::Disconnected) => Some(None),
        }
    }
}

/// A path typed or browsed for.
#[derive(Default)]
pub struct PathField {
    /// The text.
    pub text: String,
    browse: Option<Browse>,
    note: Option<String>,
    focused: bool,
}

impl PathField {
    /// A field with a suggestion.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// Draws the field; true when Enter was pressed in it or the system's dialog answered.
    pub fn show(&mut self, ui: &mut Ui, save: bool) -> bool {
        let mut done = false;
        if let Some(answer) = self.browse.as_ref().and_then(Browse::poll) {
            self.browse = None;
            match answer {
                Some(path) => {
                    self.text = path.display().to_string();
                    done = true;
                }
                None => {
                    self.note = Some("Nothing was chosen in the system's dialog; the path can be typed here".to_owned())
                }
            }
        }
        ui.horizontal(|ui| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let waiting = self.browse.is_some();
                let browse = ui.add_enabled(!waiting, egui::Button::new("Browse…"));
                if browse.on_disabled_hover_text("The system's dialog is open").clicked() {
                    let name = self.text.rsplit(['/', '\\']).next().unwrap_or("").to_owned();
                    self.browse = Some(Browse::start(ui.ctx(), save, &name));
                    self.note = None;
                }
                let edit = TextEdit::singleline(&mut self.text)
                    .hint_text(if save {
                        "Path of the file to write"
                    } else {
                        "Path of a model: IGES, STEP, STL, OBJ, Plot3D or a project"
                    })
                    .margin(egui::Margin::symmetric(7, 5))
                    .desired_width(f32::INFINITY);
                let field = ui.add(edit).accessible_name("Path");
                if !self.focused {
                    field.request_focus();
                    self.focused = true;
                }
                done |= field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            });
        });
        if let Some(note) = &self.note {
            ui.small(note);
        }
        done && !self.text.trim().is_empty()
    }

    /// The path, with `~` standing for the home folder.
    pub fn path(&self) -> PathBuf {
        let text = self.text.trim();
        match (text.strip_prefix("~/"), directories::BaseDirs::new()) {
            (Some(rest), Some(dirs)) => dirs.home_dir().join(rest),
            _ => PathBuf::from(text),
        }
    }
}

/// The dialog that is open.
pub enum Dialog {
    /// Which file to open.
    Open(PathField),
    /// Which example to open.
    Examples,
    /// Where to write.
    Save(SaveWhat, PathField, Option<Then>),
    /// What goes into a grid or mesh, and where.
    Export(Box<super::export::ExportForm>),
    /// The file is there already.
    Overwrite(SaveWhat, PathBuf, Option<Then>),
    /// There are unsaved changes.
    Unsaved(Then),
    /// Something went wrong.
    Problem(Problem),
    /// An entity gets another name.
    Rename(EntityId, String),
    /// Settings.
    Settings,
    /// Keys and mouse.
    Keys,
    /// Version and licence.
    About,
    /// A session ended without saving.
    Recovery(Vec<Recoverable>),
}

/// Work that a crashed session left behind.
#[derive(Clone, Debug)]
pub struct Recoverable {
    /// What it is called.
    pub name: String,
    /// When it was put aside and what had been done last.
    pub summary: String,
}

/// What a dialog asks the editor to do. The dialog closes unless it is [`Answer::Stay`].
#[derive(Debug, PartialEq)]
#[allow(missing_docs, reason = "each says what it asks for")]
pub enum Answer {
    Stay,
    Close,
    Open(PathBuf),
    Example(&'static str),
    Save(SaveWhat, PathBuf, Option<Then>),
    Overwrite(SaveWhat, PathBuf, Option<Then>),
    Export(PathBuf),
    SaveFirst(Then),
    Discard(Then),
    Rename(EntityId, String),
    Do(Action),
    Recover(usize),
    Forget(usize),
    SettingsChanged,
}

/// A button that stands for the default choice.
pub fn primary(ui: &mut Ui, text: &str) -> egui::Response {
    let t = theme::of(ui);
    let button = egui::Button::new(RichText::new(text).color(t.on_accent)).fill(t.accent).min_size(vec2(84.0, 26.0));
    ui.add(button)
}

/// A button that is not the default choice.
pub fn plain(ui: &mut Ui, text: &str) -> egui::Response {
    ui.add(egui::Button::new(text).min_size(vec2(84.0, 26.0)))
}

/// The row of buttons at the foot of a dialog, the default choice first.
pub fn buttons<R>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.add_space(10.0);
    ui.with_layout(Layout::right_to_left(Align::Min), add).inner
}

impl Dialog {
    /// Its name for scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Open(_) => "open",
            Self::Examples => "examples",
            Self::Save(..) => "save",
            Self::Export(_) => "export",
            Self::Overwrite(..) => "overwrite",
            Self::Unsaved(_) => "unsaved",
            Self::Problem(_) => "problem",
            Self::Rename(..) => "rename",
            Self::Settings => "settings",
            Self::Keys => "keys",
            Self::About => "about",
            Self::Recovery(_) => "recovery",
        }
    }

    /// Draws the dialog.
    pub fn show(
        &mut self,
        ctx: &egui::Context,
        settings: &mut Settings,
        examples: &[(&'static str, &'static str)],
    ) -> Answer {
        let mut answer = Answer::Stay;
        let escape = ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
        let width: f32 = match self {
            Self::Keys => 720.0,
            Self::Open(_) | Self::Save(..) | Self::Examples => 560.0,
            Self::Export(_) => 620.0,
            _ => 460.0,
        };
        let modal = egui::Modal::new(egui::Id::unique("dialog"))
            .frame(egui::Frame::window(&ctx.global_style()).inner_margin(18.0));
        let response = modal.show(ctx, |ui| {
            ui.set_width(width.min(ctx.content_rect().width() - 80.0));
            answer = self.contents(ui, settings, examples);
        });
        // Only a question that must be answered stays when one clicks beside it.
        let must_answer = matches!(self, Self::Unsaved(_) | Self::Recovery(_) | Self::Overwrite(..));
        if answer == Answer::Stay && (escape || (response.should_close() && !must_answer)) {
            answer = Answer::Close;
        }
        answer
    }

    fn contents(&mut self, ui: &mut Ui, settings: &mut Settings, examples: &[(&'static str, &'static str)]) -> Answer {
        match self {
            Self::Open(field) => open(ui, field, &settings.recent),
            Self::Examples => {
                ui.heading("Open example");
                ui.add_space(6.0);
                for (name, about) in examples {
                    if row(ui, Icon::Surface, &super::files::readable(name), about).clicked() {
                        return Answer::Example(name);
                    }
                }
                buttons(ui, |ui| if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay })
            }
            Self::Save(what, field, then) => {
                let what = *what;
                ui.heading(match what {
                    SaveWhat::Model => "Save as",
                    SaveWhat::Spec => "Save patch specification",
                    SaveWhat::Curves => "Export curves",
                });
                ui.add_space(6.0);
                let enter = field.show(ui, true);
                ui.add_space(2.0);
                ui.small(match what {
                    SaveWhat::Model => "The extension says the format: .patchwright.ron keeps everything; .igs holds the surfaces and patches as B-splines for other programs; .stl, .obj and .xyz hold triangles or grids (Export has the choices)",
                    SaveWhat::Spec => "RON, for patchwright heal FILE --patches",
                    SaveWhat::Curves => "Cubic B-splines: .igs with their surfaces and the curves on these; .patchwright.ron without the curves on surfaces",
                });
                let path = field.path();
                buttons(ui, |ui| {
                    let ready = !field.text.trim().is_empty();
                    let save = ui.add_enabled_ui(ready, |ui| primary(ui, "Save")).inner;
                    if (save.clicked() || enter) && ready {
                        return match path.exists() {
                            true => Answer::Overwrite(what, path, then.clone()),
                            false => Answer::Save(what, path, then.clone()),
                        };
                    }
                    if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
                })
            }
            Self::Export(form) => form.show(ui),
            Self::Overwrite(what, path, then) => {
                ui.heading("Replace the file?");
                ui.add_space(6.0);
                ui.label(format!("{} is there already. Saving replaces it.", path.display()));
                let (what, path, then) = (*what, path.clone(), then.clone());
                buttons(ui, |ui| {
                    if primary(ui, "Replace").clicked() {
                        return Answer::Save(what, path, then);
                    }
                    if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
                })
            }
            Self::Unsaved(then) => {
                ui.heading("Save the changes?");
                ui.add_space(6.0);
                ui.label("The model has changes that are not on disk. They are lost if they are not saved.");
                let then = then.clone();
                buttons(ui, |ui| {
                    if primary(ui, "Save").clicked() {
                        return Answer::SaveFirst(then);
                    }
                    if plain(ui, "Discard").clicked() {
                        return Answer::Discard(then);
                    }
                    if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
                })
            }
            Self::Problem(problem) => problem_dialog(ui, problem),
            Self::Rename(id, name) => {
                ui.heading("Rename");
                ui.add_space(6.0);
                let edit =
                    TextEdit::singleline(name).desired_width(f32::INFINITY).margin(egui::Margin::symmetric(7, 5));
                let field = ui.add(edit).accessible_name("Name");
                if !field.has_focus() && !field.lost_focus() {
                    field.request_focus();
                }
                let enter = field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
                let (id, name) = (*id, name.trim().to_owned());
                buttons(ui, |ui| {
                    let button = ui.add_enabled_ui(!name.is_empty(), |ui| primary(ui, "Rename")).inner;
                    if (button.clicked() || enter) && !name.is_empty() {
                        return Answer::Rename(id, name);
                    }
                    if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
                })
            }
            Self::Settings => settings_dialog(ui, settings),
            Self::Keys => keys(ui, settings.navigation),
            Self::About => {
                ui.heading("Patchwright");
                ui.add_space(4.0);
                ui.label(format!("Version {}", env!("CARGO_PKG_VERSION")));
                ui.label(env!("CARGO_PKG_DESCRIPTION"));
                ui.add_space(4.0);
                ui.weak(format!("Licence: {}", env!("CARGO_PKG_LICENSE")));
                buttons(ui, |ui| if primary(ui, "Close").clicked() { Answer::Close } else { Answer::Stay })
            }
            Self::Recovery(found) => {
                ui.heading("Recover unsaved work?");
                ui.add_space(6.0);
                ui.label("An earlier session ended before its changes were saved.");
                ui.add_space(6.0);
                let mut answer = Answer::Stay;
                for (at, item) in found.iter().enumerate() {
                    egui::Frame::new().fill(theme::of(ui).field).corner_radius(6.0).inner_margin(10.0).show(ui, |ui| {
                        ui.set_width(ui.available_width());
                        ui.strong(&item.name);
                        ui.small(&item.summary);
                        ui.horizontal(|ui| {
                            if ui.button("Recover").clicked() {
                                answer = Answer::Recover(at);
                            }
                            if ui.button("Delete").clicked() {
                                answer = Answer::Forget(at);
                            }
                        });
                    });
                }
                if answer != Answer::Stay {
                    return answer;
                }
                buttons(ui, |ui| if plain(ui, "Decide later").clicked() { Answer::Close } else { Answer::Stay })
            }
        }
    }
}

/// A row with a name and a quieter line under it.
fn row(ui: &mut Ui, icon: Icon, name: &str, about: &str) -> egui::Response {
    let t = theme::of(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 40.0), egui::Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    let fill = if response.hovered() || response.has_focus() { t.button[1] } else { egui::Color32::TRANSPARENT };
    ui.painter().rect_filled(rect, 5.0, fill);
    let icon_rect = egui::Rect::from_min_size(rect.left_top() + vec2(8.0, 11.0), vec2(18.0, 18.0));
    icon.paint(ui.painter(), icon_rect, t.accent);
    let width = rect.width() - 46.0;
    let text = |text: &str, size: f32, color, y: f32| {
        let mut job =
            egui::text::LayoutJob::simple_singleline(text.to_owned(), egui::FontId::proportional(size), color);
        job.wrap = egui::text::TextWrapping::truncate_at_width(width);
        let galley = ui.painter().layout_job(job);
        ui.painter().galley(rect.left_top() + vec2(36.0, y), galley, color);
    };
    text(name, theme::TEXT, t.text[0], 4.0);
    text(about, theme::SMALL, t.text[1], 21.0);
    response
}

fn open(ui: &mut Ui, field: &mut PathField, recent: &[PathBuf]) -> Answer {
    ui.heading("Open");
    ui.add_space(6.0);
    let enter = field.show(ui, false);
    let mut chosen = None;
    if !recent.is_empty() {
        ui.add_space(8.0);
        ui.weak("Recent files");
        ScrollArea::vertical().max_height(240.0).show(ui, |ui| {
            for path in recent {
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
                let folder = path.parent().map(|p| p.display().to_string()).unwrap_or_default();
                if row(ui, Icon::Open, &name, &folder).clicked() {
                    chosen = Some(path.clone());
                }
            }
        });
    }
    if let Some(path) = chosen {
        return Answer::Open(path);
    }
    buttons(ui, |ui| {
        let ready = !field.text.trim().is_empty();
        let open = ui.add_enabled_ui(ready, |ui| primary(ui, "Open")).inner;
        if open.clicked() || enter {
            return Answer::Open(field.path());
        }
        if plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
    })
}

fn problem_dialog(ui: &mut Ui, problem: &Problem) -> Answer {
    let t = theme::of(ui);
    ui.horizontal(|ui| {
        icons::label(ui, Icon::Warning, t.bad, 22.0);
        ui.add(egui::Label::new(RichText::new(&problem.what).heading()).wrap());
    });
    ui.add_space(6.0);
    ui.add(egui::Label::new(&problem.why).wrap());
    if !problem.details.is_empty() {
        ui.add_space(6.0);
        egui::CollapsingHeader::new("Details").show(ui, |ui| {
            ScrollArea::vertical().max_height(180.0).show(ui, |ui| {
                ui.add(egui::Label::new(RichText::new(&problem.details).monospace()).wrap().selectable(true));
            });
        });
    }
    buttons(ui, |ui| {
        if primary(ui, "Close").clicked() {
            return Answer::Close;
        }
        if let Some((text, action)) = &problem.remedy
            && plain(ui, text).clicked()
        {
            return Answer::Do(*action);
        }
        if !problem.details.is_empty() && plain(ui, "Copy details").clicked() {
            ui.ctx().copy_text(format!("{}\n{}\n\n{}", problem.what, problem.why, problem.details));
        }
        Answer::Stay
    })
}

fn settings_dialog(ui: &mut Ui, settings: &mut Settings) -> Answer {
    ui.heading("Settings");
    ui.add_space(8.0);
    let before = settings.clone();
    egui::Grid::new("settings").num_columns(2).spacing(vec2(18.0, 10.0)).show(ui, |ui| {
        ui.label("Theme");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut settings.theme, Theme::Dark, "Dark");
            ui.selectable_value(&mut settings.theme, Theme::Light, "Light");
        });
        ui.end_row();
        ui.label("Navigation");
        ui.vertical(|ui| {
            ui.horizontal(|ui| {
                for preset in Preset::ALL {
                    ui.selectable_value(&mut settings.navigation, preset, preset.name());
                }
            });
            ui.add(egui::Label::new(RichText::new(settings.navigation.summary()).small()).wrap());
        });
        ui.end_row();
        ui.label("Digits");
        ui.checkbox(&mut settings.digits_as_pad, "Plain digits stand for the numeric pad while no tool is on");
        ui.end_row();
    });
    let closed = buttons(ui, |ui| primary(ui, "Close").clicked());
    if closed {
        Answer::Close
    } else if *settings != before {
        Answer::SettingsChanged
    } else {
        Answer::Stay
    }
}

fn keys(ui: &mut Ui, preset: Preset) -> Answer {
    ui.heading("Keys and mouse");
    ui.add_space(6.0);
    ScrollArea::vertical().max_height(460.0).auto_shrink([false, true]).show(ui, |ui| {
        ui.columns(2, |columns| {
            let (left, right) = columns.split_at_mut(1);
            let (left, right) = (&mut left[0], &mut right[0]);
            left.strong("Mouse");
            for line in preset.summary().split(" · ") {
                left.label(line);
            }
            left.label("Left click pick · Shift add · again at the same place: what lies behind");
            for menu in Menu::ALL {
                let column =
                    if matches!(menu, Menu::File | Menu::Edit | Menu::Heal) { &mut *left } else { &mut *right };
                column.add_space(8.0);
                column.strong(menu.title());
                egui::Grid::new(menu.title()).num_columns(2).spacing(vec2(14.0, 3.0)).show(column, |ui| {
                    for info in ACTIONS.iter().filter(|i| i.menu == menu) {
                        if info.shortcut.is_some() {
                            ui.monospace(info.keys(ui.ctx()));
                            ui.label(info.name);
                            ui.end_row();
                        }
                    }
                });
            }
            right.add_space(8.0);
            right.strong("While picking a patch");
            egui::Grid::new("tool keys").num_columns(2).spacing(vec2(14.0, 3.0)).show(right, |ui| {
                for line in HELP {
                    ui.monospace(line.key);
                    ui.add(egui::Label::new(line.what).wrap());
                    ui.end_row();
                }
            });
        });
    });
    buttons(ui, |ui| if primary(ui, "Close").clicked() { Answer::Close } else { Answer::Stay })
}
