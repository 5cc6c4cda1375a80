//! The application: what is laid out where, and what happens each frame.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use egui::{CentralPanel, Frame, Key, KeyboardShortcut, Margin, Modifiers, Panel, Ui};

use super::actions::{ACTIONS, Action};
use super::autosave::Autosave;
use super::dialogs::{Answer, Dialog, Then};
use super::editor::{Editor, Page};
use super::files::{Files, file_name};
use super::hints::{self, Hints};
use super::numpad::{Listener, Numpad};
use super::palette;
use super::panels::defects::DefectSearch;
use super::panels::uv::{self, UvView};
use super::settings::Settings;
use super::startup::{Clock, Startup};
use super::tools::Tool;
use super::viewport::Viewport;
use super::{bars, panels, status, theme};
use crate::io::autosave::Journal;
use crate::model::command::Command;
use crate::model::history::History;
use crate::model::selection::Selection;
use crate::view::pick::Filter;

/// How the editor starts.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The files to open; the bundled example when there are none.
    pub files: Vec<PathBuf>,
    /// Where settings are kept between sessions; nowhere when left out.
    pub settings: Option<PathBuf>,
    /// Where changes are put aside for recovery; nowhere when left out.
    pub journal: Option<Journal>,
    /// Where positions of buttons and curves are written for scripts.
    pub hints: Option<PathBuf>,
    /// Who tells the digits of the numeric pad from the others.
    pub numpad: Numpad,
}

impl Options {
    /// What a user's session starts with.
    pub fn of_user(files: Vec<PathBuf>) -> Self {
        let hints = std::env::var_os("PATCHWRIGHT_SCRIPT_HINTS").map(PathBuf::from);
        let numpad = Numpad::default();
        Self { files, settings: Settings::path(), journal: Journal::of_user(), hints, numpad }
    }
}

/// Opens the window and stays until it is closed.
///
/// # Errors
/// The reason in one line when no window or no graphics adapter is to be had.
pub fn run(files: Vec<PathBuf>) -> Result<(), String> {
    let startup = Startup::begin(files.clone());
    let options = Options::of_user(files);
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Patchwright")
            .with_app_id("patchwright")
            .with_inner_size([1400.0, 900.0])
            .with_min_inner_size([900.0, 600.0])
            .with_drag_and_drop(true),
        // The 3D view writes exact colours; dithering would only add noise to screenshots.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let failed = |error: &dyn std::fmt::Display| format!("no window could be opened: {error}");
    let mut event_loop = winit::event_loop::EventLoop::<eframe::UserEvent>::with_user_event();
    let event_loop = event_loop.build().map_err(|error| failed(&error))?;
    let numpad = options.numpad.clone();
    let opened = Arc::new(AtomicBool::new(false));
    let note = Arc::clone(&opened);
    let make: eframe::AppCreator<'_> = Box::new(move |cc| {
        note.store(true, Ordering::Relaxed);
        Ok(Box::new(App::begun(cc, options, startup)))
    });
    let app = eframe::create_native("Patchwright", native, make, &event_loop);
    event_loop.run_app(&mut Listener { app, numpad }).map_err(|error| failed(&error))?;
    // eframe logs why and ends its loop; what it came to is not handed on.
    if opened.load(Ordering::Relaxed) {
        Ok(())
    } else {
        Err(failed(&"no graphics adapter could be used; the log line above says more"))
    }
}

/// The application.
pub struct App {
    /// Everything but the drawing.
    pub editor: Editor,
    hints: Option<Arc<Mutex<hints::State>>>,
    numpad: Numpad,
    clock: Clock,
    device: Option<wgpu::Device>,
}

impl App {
    /// An editor in `cc`'s window.
    pub fn new(cc: &eframe::CreationContext<'_>, options: Options) -> Self {
        let startup = Startup::begin(options.files.clone());
        Self::begun(cc, options, startup)
    }

    /// An editor in `cc`'s window whose files are on their way.
    fn begun(cc: &eframe::CreationContext<'_>, options: Options, startup: Startup) -> Self {
        let ctx = &cc.egui_ctx;
        theme::install(ctx);
        let settings = options.settings.as_deref().map(Settings::load).unwrap_or_default();
        let viewport = Viewport::new(cc.wgpu_render_state.as_ref());
        let (jobs, opening, clock) = startup.enter(ctx);
        let mut editor = Editor {
            history: History::new(crate::model::document::Document::default(), true),
            selection: Selection::default(),
            files: Files::default(),
            jobs,
            settings,
            settings_path: options.settings,
            viewport,
            tool: Tool::Select,
            pickable: Filter { iso_lines: true, ..Filter::ALL },
            pick_list: None,
            defects: DefectSearch::default(),
            page: Page::Tool,
            dialog: None,
            palette: None,
            note: None,
            filter: String::new(),
            checking: None,
            seams: None,
            may_close: false,
            recoveries: Vec::new(),
            uv: UvView::default(),
            linked: None,
            autosave: options.journal.as_ref().map(Autosave::start).unwrap_or_default(),
        };
        editor.apply_settings(ctx);
        match (opening, options.files.first()) {
            (Some(opening), Some(first)) => editor.await_opening(&file_name(first), opening),
            _ => editor.open_first_example(),
        }
        if let Some(journal) = &options.journal {
            editor.offer_recovery(journal.recoverable());
        }
        let hints = options.hints.map(|path| Hints::install(ctx, path));
        let device = cc.wgpu_render_state.as_ref().map(|state| state.device.clone());
        Self { editor, hints, numpad: options.numpad, clock, device }
    }

    /// Shortcuts of the active tool first, then those of the actions.
    fn keys(&mut self, ctx: &egui::Context) {
        // An open menu has the keyboard: Esc closes it and nothing else.
        let menu = egui::Popup::is_any_open(ctx);
        let elsewhere = menu || self.editor.dialog.is_some() || self.editor.palette.is_some();
        let typing = ctx.text_edit_focused();
        let pad = ctx.input_mut(|input| self.numpad.take(&mut input.events, elsewhere || typing));
        if elsewhere {
            return;
        }
        if !typing {
            self.editor.tool_keys(ctx);
        }
        let mut chosen = Vec::new();
        for (held, digit) in pad {
            let same = |s: KeyboardShortcut| s.logical_key == digit && same_modifiers(held, s.modifiers);
            chosen.extend(ACTIONS.iter().filter(|i| i.pad && i.shortcut.is_some_and(same)).map(|i| i.action));
        }
        let plain_digits = self.editor.settings.digits_as_pad && matches!(self.editor.tool, Tool::Select);
        ctx.input_mut(|input| {
            for info in ACTIONS {
                let Some(shortcut) = info.shortcut.filter(|_| !info.pad || plain_digits) else { continue };
                let function_key = matches!(shortcut.logical_key, Key::F1 | Key::F9 | Key::F10);
                if typing && !function_key && (shortcut.modifiers.is_none() || shortcut.conflicts_with_text_editing()) {
                    continue;
                }
                let text_editing = [Action::SelectAll, Action::Undo, Action::Redo, Action::Deselect];
                if typing && text_editing.contains(&info.action) {
                    continue;
                }
                if take_key(input, shortcut.modifiers, shortcut.logical_key) {
                    chosen.push(info.action);
                }
            }
            if !typing && take_key(input, Modifiers::COMMAND, Key::Y) {
                chosen.push(Action::Redo);
            }
        });
        for action in chosen {
            self.editor.perform(ctx, action);
        }
        if !typing && ctx.input_mut(|i| take_key(i, Modifiers::NONE, Key::Escape)) {
            self.editor.escape();
        }
    }

    fn dialogs(&mut self, ctx: &egui::Context) {
        let editor = &mut self.editor;
        if let Some(mut palette) = editor.palette.take() {
            match palette.show(ctx, |action| editor.enabled(action)) {
                palette::Answer::Open => editor.palette = Some(palette),
                palette::Answer::Dismissed => {}
                palette::Answer::Chosen(action) => editor.perform(ctx, action),
            }
        }
        let Some(mut dialog) = editor.dialog.take() else { return };
        let answer = dialog.show(ctx, &mut editor.settings, super::files::examples());
        match answer {
            Answer::Stay => editor.dialog = Some(dialog),
            Answer::SettingsChanged => {
                editor.apply_settings(ctx);
                editor.store_settings();
                editor.dialog = Some(dialog);
            }
            Answer::Close => {}
            Answer::Open(path) => editor.open(vec![path]),
            Answer::Example(name) => editor.open_example(name),
            Answer::Save(what, path, then) => editor.save_to(what, path, then),
            Answer::Export(path) => {
                if let Dialog::Export(form) = dialog {
                    editor.export_to(&form, path);
                }
            }
            Answer::Overwrite(what, path, then) => editor.dialog = Some(Dialog::Overwrite(what, path, then)),
            Answer::SaveFirst(then) => editor.save(Some(then)),
            Answer::Discard(Then::Quit) => editor.close(ctx),
            Answer::Discard(Then::Open(paths)) => editor.open_now(paths),
            Answer::Discard(Then::Example(name)) => editor.open_example_now(name),
            Answer::Rename(id, name) => {
                editor.command(&Command::Rename { id, name });
            }
            Answer::Do(action) => editor.perform(ctx, action),
            Answer::Recover(at) => editor.recover(at),
            Answer::Forget(at) => editor.forget(at),
        }
    }
}

/// Takes a key press with exactly these modifiers out of the input.
pub fn take_key(input: &mut egui::InputState, modifiers: Modifiers, key: Key) -> bool {
    let mut taken = false;
    input.events.retain(|event| {
        let hit = matches!(event, egui::Event::Key { key: k, modifiers: m, pressed: true, .. }
            if *k == key && same_modifiers(*m, modifiers));
        taken |= hit;
        !hit
    });
    taken
}

fn same_modifiers(a: Modifiers, b: Modifiers) -> bool {
    a.shift == b.shift && a.alt == b.alt && (a.command || a.ctrl) == (b.command || b.ctrl)
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.editor.poll_files(ctx);
        self.editor.poll_export();
        self.editor.poll_defects();
        if self.editor.poll_tool() && !ctx.input(|i| i.focused) {
            // Whoever went elsewhere meanwhile is told that the heal is done.
            let attention = egui::UserAttentionType::Informational;
            ctx.send_viewport_cmd(egui::ViewportCommand::RequestUserAttention(attention));
        }
        self.editor.poll_autosave();
        if ctx.input(|i| i.viewport().close_requested()) && !self.editor.may_close {
            let dirty = self.editor.history.is_dirty() && !self.editor.document().entities().is_empty();
            if dirty {
                ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
                self.editor.dialog = Some(Dialog::Unsaved(Then::Quit));
            } else {
                self.editor.jobs.cancel_all();
            }
        }
    }

    fn on_exit(&mut self) {
        self.editor.autosave.end();
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let start = Instant::now();
        let ctx = ui.ctx().clone();
        let dropped: Vec<PathBuf> = ctx.input(|i| {
            i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).filter(|p| !p.as_os_str().is_empty()).collect()
        });
        if !dropped.is_empty() {
            self.editor.open(dropped);
        }
        self.keys(&ctx);

        let t = theme::of(ui);
        let bar = Frame::new().fill(t.panel).inner_margin(Margin::symmetric(8, 3));
        Panel::top("menu").frame(bar).show_separator_line(false).show(ui, |ui| bars::menu(ui, &mut self.editor));
        Panel::top("toolbar").frame(bar).show(ui, |ui| bars::toolbar(ui, &mut self.editor));
        Panel::bottom("status")
            .exact_size(theme::STATUS_HEIGHT)
            .frame(Frame::new().fill(t.panel).inner_margin(Margin::symmetric(10, 0)))
            .show(ui, |ui| status::show(ui, &mut self.editor));
        let side = Frame::new().fill(t.panel).inner_margin(Margin::same(0));
        if self.editor.settings.left_panel {
            Panel::left("left")
                .frame(side)
                .default_size(250.0)
                .size_range(180.0..=420.0)
                .show(ui, |ui| panels::left(ui, &mut self.editor));
        }
        if self.editor.settings.right_panel {
            Panel::right("right")
                .frame(side)
                .default_size(340.0)
                .size_range(290.0..=520.0)
                .show(ui, |ui| panels::right(ui, &mut self.editor));
        }
        if self.editor.settings.uv_view {
            Panel::bottom("uv view")
                .frame(side)
                .resizable(true)
                .default_size(280.0)
                .size_range(140.0..=640.0)
                .show(ui, |ui| uv::show(ui, &mut self.editor));
        }
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| self.editor.show_viewport(ui));

        self.dialogs(&ctx);
        self.title(&ctx);
        if !self.editor.jobs.active().is_empty() {
            // Progress moves although nobody touches the mouse.
            ctx.request_repaint_after(Duration::from_millis(100));
        }
        self.hint(&ctx);
        if self.clock.runs() {
            let entities = self.editor.document().entities().len();
            self.clock.follow(entities, self.editor.viewport.scene.counts().0, &ctx, self.device.as_ref());
        }
        self.editor.viewport.note_frame_time(start.elapsed());
    }
}

impl App {
    /// Tells scripts where things are.
    fn hint(&mut self, ctx: &egui::Context) {
        let Some(slot) = &self.hints else { return };
        let editor = &self.editor;
        let (tool, prompt, _) = editor.prompt();
        let state = hints::State {
            busy: !editor.jobs.active().is_empty() || editor.viewport.is_moving(),
            page: format!("{:?}", editor.page),
            dialog: editor.dialog.as_ref().map_or("", Dialog::name).to_owned(),
            prompt: format!("{tool} · {prompt}"),
            entities: editor.document().entities().len(),
            patches: editor.document().patches().count(),
            dirty: editor.history.is_dirty(),
            title: editor.files.title.clone(),
            curves: editor.curve_hints(ctx.pixels_per_point()),
            surfaces: editor.surface_hints(ctx.pixels_per_point()),
            ..hints::State::default()
        };
        *slot.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }

    fn title(&self, ctx: &egui::Context) {
        let editor = &self.editor;
        let dirty = if editor.history.is_dirty() { "*" } else { "" };
        let title = match editor.files.title.as_str() {
            "" => "Patchwright".to_owned(),
            name => format!("{name}{dirty} - Patchwright"),
        };
        let id = egui::Id::unique("window title");
        if ctx.data(|d| d.get_temp::<String>(id)).as_deref() != Some(&title) {
            ctx.data_mut(|d| d.insert_temp(id, title.clone()));
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }
}
