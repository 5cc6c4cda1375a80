//! Opening and saving, in workers: the window never waits for a disk.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use super::dialogs::{Dialog, PathField, Problem, SaveWhat, Then};
use super::editor::{Editor, Page};
use crate::io::{self, ImportReport, SaveOptions, Saved};
use crate::model;
use crate::model::document::Document;
use crate::model::history::History;
use crate::model::replay::spec_of;
use crate::view::intersection::{Found, keep};
use crate::work::{Jobs, Lane, Outcome, Ticket};

/// What reading some files came to.
pub struct Read {
    paths: Vec<PathBuf>,
    result: Result<(Document, ImportReport), String>,
}

/// Files on their way.
pub type Opening = Ticket<Read>;

/// Has files read by a worker; `None` without a file.
pub fn begin(jobs: &mut Jobs, paths: Vec<PathBuf>) -> Option<Opening> {
    let name = file_name(paths.first()?);
    let input = paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join("\n");
    Some(jobs.spawn(Lane::Heavy, format!("Open {name}"), input, move |job| {
        let result = read(&paths, job);
        Read { paths, result }
    }))
}

/// What writing a file came to.
struct Written {
    path: PathBuf,
    what: SaveWhat,
    revision: u64,
    result: Result<Saved, String>,
}

/// Where the document came from and goes to.
#[derive(Default)]
pub struct Files {
    /// The file that Save writes; `None` until one has been chosen (the file that was opened is never overwritten
    /// unless it is a project).
    pub target: Option<PathBuf>,
    /// What the title bar calls the document.
    pub title: String,
    /// What happened while the last file was read.
    pub report: Option<ImportReport>,
    /// What was read last.
    pub source: Option<PathBuf>,
    /// What is being exported.
    pub exporting: Option<Ticket<Result<(PathBuf, Saved), String>>>,
    opening: Option<Opening>,
    saving: Option<(Ticket<Written>, Option<Then>)>,
}

impl Files {
    /// Whether a file is being read.
    pub fn is_opening(&self) -> bool {
        self.opening.is_some()
    }

    /// Whether a file is being written.
    pub fn is_saving(&self) -> bool {
        self.saving.is_some()
    }
}

impl Editor {
    /// Opens files in place of the document, after asking when there are unsaved changes.
    pub fn open(&mut self, paths: Vec<PathBuf>) {
        if self.history.is_dirty() && !self.document().entities().is_empty() {
            self.dialog = Some(Dialog::Unsaved(Then::Open(paths)));
        } else {
            self.open_now(paths);
        }
    }

    /// Opens files in place of the document, unsaved changes or not.
    pub fn open_now(&mut self, paths: Vec<PathBuf>) {
        let Some(first) = paths.first() else { return };
        let name = file_name(first);
        if let Some(opening) = begin(&mut self.jobs, paths) {
            self.await_opening(&name, opening);
        }
    }

    /// Files are on their way.
    pub fn await_opening(&mut self, name: &str, opening: Opening) {
        self.say(format!("Opening {name}…"));
        self.files.opening = Some(opening);
    }

    /// Writes the document to its file, or asks where to.
    pub fn save(&mut self, then: Option<Then>) {
        match self.files.target.clone() {
            Some(path) => self.save_to(SaveWhat::Model, path, then),
            None => self.ask_where(SaveWhat::Model, then),
        }
    }

    /// Asks where to write.
    pub fn ask_where(&mut self, what: SaveWhat, then: Option<Then>) {
        let path = match what {
            SaveWhat::Model => self.beside_source(&format!("healed.{}", io::PROJECT_EXTENSION)),
            SaveWhat::Spec => self.beside_source("patches.ron"),
            SaveWhat::Curves => self.beside_source("curves.igs"),
        };
        self.dialog = Some(Dialog::Save(what, PathField::new(path), then));
    }

    /// A path beside the file that was read, with its name and this ending.
    pub fn beside_source(&self, ending: &str) -> String {
        let source = self.files.target.as_ref().or(self.files.source.as_ref());
        let folder = source.and_then(|p| p.parent()).map(Path::to_path_buf).unwrap_or_default();
        let name = source.map_or_else(|| self.files.title.clone(), |p| file_name(p));
        let stem = name.split('.').next().filter(|s| !s.is_empty()).unwrap_or("model").to_owned();
        folder.join(format!("{stem}-{ending}")).display().to_string()
    }

    /// Writes to a file.
    pub fn save_to(&mut self, what: SaveWhat, path: PathBuf, then: Option<Then>) {
        let (document, revision) = (self.document().clone(), self.history.revision());
        let found = self.found_intersection().cloned();
        let name = format!("Save {}", file_name(&path));
        let ticket = self.jobs.spawn(Lane::Heavy, name, path.display().to_string(), move |_| {
            let result = match what {
                SaveWhat::Model => io::save(&path, &document, &SaveOptions::default()).map_err(|e| e.to_string()),
                SaveWhat::Spec => write_spec(&path, &document),
                SaveWhat::Curves => write_curves(&path, found.as_deref(), document.unit),
            };
            Written { path, what, revision, result }
        });
        self.files.saving = Some((ticket, then));
    }

    /// Takes over what the workers have read and written.
    pub fn poll_files(&mut self, ctx: &egui::Context) {
        if let Some(outcome) = self.files.opening.as_ref().and_then(Ticket::poll) {
            self.files.opening = None;
            match outcome {
                Outcome::Finished { cancelled: true, .. } | Outcome::NeverRan => self.say("Opening was cancelled"),
                Outcome::Finished { value: Read { paths, result }, .. } => self.opened(&paths, result),
                Outcome::Panicked { message, input } => self.died("Opening the file", &message, input),
            }
        }
        let Some(outcome) = self.files.saving.as_ref().and_then(|(ticket, _)| ticket.poll()) else { return };
        let then = self.files.saving.take().and_then(|(_, then)| then);
        match outcome {
            Outcome::Finished { value, .. } => self.written(ctx, value, then),
            Outcome::NeverRan => self.warn("Saving was cancelled; nothing was written"),
            Outcome::Panicked { message, input } => self.died("Saving the file", &message, input),
        }
    }

    fn opened(&mut self, paths: &[PathBuf], result: Result<(Document, ImportReport), String>) {
        let Some(first) = paths.first() else { return };
        match result {
            Ok((document, report)) => {
                for path in paths.iter().rev() {
                    self.settings.remember(path);
                }
                self.store_settings();
                let skipped = report.count(io::Severity::Skipped);
                let project = io::Format::of_name(first) == Some(io::Format::Project) && paths.len() == 1;
                self.show_document(document, Some(report), file_name(first), true);
                self.files.target = project.then(|| first.clone());
                self.files.source = Some(first.clone());
                self.autosave_fresh(Some(first));
                let count = self.document().entities().len();
                if skipped > 0 {
                    self.show_page(Page::Report);
                    self.warn(format!("{count} entities read, {skipped} skipped: see the report"));
                } else {
                    self.say(format!("{count} entities read"));
                }
            }
            Err(why) => self.problem(Problem {
                what: format!("{} was not opened", file_name(first)),
                why: why.clone(),
                remedy: Some(("Open another…".to_owned(), super::actions::Action::Open)),
                details: format!("file: {}\nerror: {why}", first.display()),
            }),
        }
    }

    /// Puts another document in the place of the one that is shown; `saved` says that it is on disk.
    pub fn show_document(&mut self, document: Document, report: Option<ImportReport>, title: String, saved: bool) {
        self.leave_tool();
        self.selection.clear();
        self.files.title = title;
        self.files.report = report;
        self.history = History::new(document, saved);
        self.seams = None;
        self.files.target = None;
        self.viewport.new_document(self.history.document());
    }

    fn written(&mut self, ctx: &egui::Context, written: Written, then: Option<Then>) {
        match written.result {
            Ok(saved) => {
                let name = file_name(&written.path);
                if written.what == SaveWhat::Model {
                    if self.history.revision() == written.revision {
                        self.history.mark_saved();
                    }
                    self.settings.remember(&written.path);
                    self.store_settings();
                    self.files.title.clone_from(&name);
                    self.autosave_fresh(Some(&written.path));
                    self.files.target = Some(written.path);
                }
                if saved.notes.is_empty() {
                    let what = if written.what == SaveWhat::Spec { "patches" } else { "entities" };
                    self.say(format!("Saved {name}: {} {what}", saved.entities));
                } else {
                    self.warn(format!("Saved {name}: {}", saved.notes.join("; ")));
                }
                match then {
                    Some(Then::Quit) => self.close(ctx),
                    Some(Then::Open(paths)) => self.open_now(paths),
                    Some(Then::Example(name)) => self.open_example_now(name),
                    None => {}
                }
            }
            Err(why) => self.problem(Problem {
                what: format!("{} was not saved", file_name(&written.path)),
                why: why.clone(),
                remedy: Some(("Save elsewhere…".to_owned(), super::actions::Action::SaveAs)),
                details: format!(
                    "file: {}\nerror: {why}\nThe model is unchanged and still open.",
                    written.path.display()
                ),
            }),
        }
    }

    /// Shows that a worker panicked.
    pub fn died(&mut self, what: &str, message: &str, input: String) {
        self.problem(Problem {
            what: format!("{what} ran into a bug"),
            why: "The computation stopped; the model is unchanged. Please report this with the details below."
                .to_owned(),
            remedy: None,
            details: format!("version: {}\npanic: {message}\ninput:\n{input}", env!("CARGO_PKG_VERSION")),
        });
    }
}

/// The last part of a path.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn read(paths: &[PathBuf], job: &crate::kernel::job::Job) -> Result<(Document, ImportReport), String> {
    let mut all: Option<(Document, ImportReport)> = None;
    for (done, path) in paths.iter().enumerate() {
        job.phase(&format!("Reading {}", file_name(path)));
        job.progress(done as f64 / paths.len() as f64);
        let opened = io::open(path).map_err(|e| e.to_string())?;
        match &mut all {
            None => all = Some((opened.document, opened.report)),
            Some((document, report)) => {
                for entity in opened.document.entities() {
                    document.add(entity.name.clone(), entity.shape.clone(), entity.color);
                }
                for (kind, count) in opened.report.found {
                    *report.found.entry(kind).or_default() += count;
                }
                report.surfaces += opened.report.surfaces;
                report.curves += opened.report.curves;
                report.meshes += opened.report.meshes;
                report.lines.extend(opened.report.lines);
            }
        }
    }
    all.ok_or_else(|| "no file was named".to_owned())
}

fn write_spec(path: &Path, document: &Document) -> Result<Saved, String> {
    let spec = spec_of(document).ok_or("there are no patches to write a specification of")?;
    io::save_spec(path, &spec).map_err(|e| e.to_string())?;
    Ok(Saved { entities: document.patches().count(), ..Saved::default() })
}

/// Writes the curves of an intersection; as IGES with the curves on surfaces.
fn write_curves(path: &Path, found: Option<&Found>, unit: crate::model::document::Unit) -> Result<Saved, String> {
    let Some(found) = found else { return Err("the result is gone; compute it again".to_owned()) };
    let mut traces = keep::traces(found, unit);
    let saved = match io::Format::of_name(path) {
        Some(io::Format::Iges) => io::save_iges(path, &traces.document, &traces.traces),
        _ => io::save(path, &traces.document, &SaveOptions::default()),
    };
    let mut saved = saved.map_err(|e| e.to_string())?;
    saved.notes.append(&mut traces.notes);
    Ok(saved)
}

/// The bundled examples: names and what each shows.
pub fn examples() -> &'static [(&'static str, &'static str)] {
    static LIST: LazyLock<Vec<(&str, &str)>> = LazyLock::new(|| {
        let demos = model::examples::demos().into_iter().map(|demo| (demo.name, demo.about));
        model::examples::all().iter().map(|e| (e.name, e.about)).chain(demos).collect()
    });
    &LIST
}

impl Editor {
    /// Opens an example, after asking when there are unsaved changes.
    pub fn open_example(&mut self, name: &'static str) {
        if self.history.is_dirty() && !self.document().entities().is_empty() {
            self.dialog = Some(Dialog::Unsaved(Then::Example(name)));
        } else {
            self.open_example_now(name);
        }
    }

    /// Opens an example, unsaved changes or not.
    pub fn open_example_now(&mut self, name: &'static str) {
        let healed = model::examples::all().into_iter().find(|e| e.name == name).map(|e| (e.document, e.about));
        let demo = || model::examples::demos().into_iter().find(|d| d.name == name).map(|d| ((d.document)(), d.about));
        let Some((document, about)) = healed.or_else(demo) else {
            self.warn(format!("There is no example called {name}"));
            return;
        };
        self.show_document(document, None, readable(name), true);
        self.files.source = None;
        self.autosave_fresh(None);
        if model::examples::demos().iter().any(|demo| demo.name == name) {
            self.begin_demo(name);
        }
        self.say(about);
    }

    /// Opens the example that a session without files starts with.
    pub fn open_first_example(&mut self) {
        if let Some((name, _)) = examples().get(1).or(examples().first()) {
            self.open_example_now(name);
        }
    }
}

/// The name of an example for people: "car body".
pub fn readable(name: &str) -> String {
    let mut text = name.replace('_', " ");
    if let Some(first) = text.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    text
}
