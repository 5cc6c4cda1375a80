//! The export dialog: what goes into a STEP, IGES, STL, OBJ or Plot3D file, how it is divided, and how large the gaps and
//! the normal angles between neighbours are, before anything is written.

use std::path::PathBuf;

use egui::{DragValue, Grid, RichText, Ui, vec2};

use super::dialogs::{Answer, Dialog, PathField};
use super::editor::Editor;
use super::status::length;
use super::theme;
use crate::io::export::{self, ExportOptions, ExportSummary, POINTS, Prepared};
use crate::io::{Format, Saved};
use crate::kernel::geom::Side;
use crate::kernel::mesh::structured::{Counts, Spacing};
use crate::model::document::{Document, Shape, Unit};
use crate::work::{Lane, Outcome, Ticket};

/// With more surfaces than this clustering is for the command line.
const MOST_CLUSTERED: usize = 40;

/// Which entities are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The healed patches.
    Patches,
    /// What is visible.
    Visible,
    /// Everything.
    All,
}

/// What the dialog holds.
pub struct ExportForm {
    which: Which,
    format: Format,
    by_tolerance: bool,
    points: usize,
    chord: f64,
    spacing: Spacing,
    options: ExportOptions,
    path: PathField,
    /// The surfaces and patches that are exported, by name.
    names: Vec<String>,
    unit: Unit,
    /// What the last preparation was asked for and came to.
    asked: Option<(Which, Format, ExportOptions)>,
    preparing: Option<Ticket<Result<Prepared, String>>>,
    prepared: Option<Result<Prepared, String>>,
}

impl ExportForm {
    fn new(document: &Document, path: String) -> Self {
        let which = if document.patches().next().is_some() { Which::Patches } else { Which::Visible };
        let format = first_format(document);
        Self {
            which,
            format,
            by_tolerance: by_tolerance(format),
            points: POINTS,
            chord: export::CHORD * document.bounds().diagonal(),
            spacing: Spacing::Uniform,
            options: ExportOptions::default(),
            path: PathField::new(path),
            names: Vec::new(),
            unit: document.unit,
            asked: None,
            preparing: None,
            prepared: None,
        }
    }

    /// What the form asks for now.
    fn wanted(&self) -> (Which, Format, ExportOptions) {
        let counts = if self.by_tolerance { Counts::ChordTolerance(self.chord) } else { Counts::Points(self.points) };
        let tanh = matches!(self.spacing, Spacing::Tanh(_));
        let clusters = if tanh { self.options.clusters.clone() } else { Vec::new() };
        let options = ExportOptions { counts: Some(counts), spacing: self.spacing, clusters, ..self.options.clone() };
        (self.which, self.format, options)
    }

    fn ready(&self) -> Option<&Prepared> {
        let current = self.asked.as_ref() == Some(&self.wanted());
        self.prepared.as_ref().and_then(|p| p.as_ref().ok()).filter(|_| current && self.preparing.is_none())
    }

    /// Draws the form.
    pub fn show(&mut self, ui: &mut Ui) -> Answer {
        ui.heading("Export");
        ui.add_space(6.0);
        Grid::new("export").num_columns(2).spacing(vec2(14.0, 6.0)).show(ui, |ui| self.fields(ui));
        if self.divides() && matches!(self.spacing, Spacing::Tanh(_)) {
            self.clusters(ui);
        }
        ui.add_space(6.0);
        let enter = self.path.show(ui, true);
        ui.add_space(6.0);
        self.account(ui);
        let path = self.path.path();
        let ready = self.ready().is_some() && !self.path.text.trim().is_empty();
        super::dialogs::buttons(ui, |ui| {
            let text = if path.exists() { "Replace" } else { "Export" };
            let write = ui.add_enabled_ui(ready, |ui| super::dialogs::primary(ui, text)).inner;
            if ready && (write.clicked() || (enter && !path.exists())) {
                return Answer::Export(path);
            }
            if super::dialogs::plain(ui, "Cancel").clicked() { Answer::Close } else { Answer::Stay }
        })
    }

    /// Whether surfaces are divided into triangles or grids.
    fn divides(&self) -> bool {
        !matches!(self.format, Format::Step | Format::Iges)
    }

    fn fields(&mut self, ui: &mut Ui) {
        ui.label("What");
        ui.horizontal(|ui| {
            for (which, name) in
                [(Which::Patches, "Healed patches"), (Which::Visible, "What is visible"), (Which::All, "Everything")]
            {
                ui.selectable_value(&mut self.which, which, name);
            }
        });
        ui.end_row();
        ui.label("Format");
        ui.horizontal(|ui| {
            let before = self.format;
            for format in [Format::Step, Format::Iges, Format::Plot3d, Format::Stl, Format::Obj] {
                ui.selectable_value(&mut self.format, format, format.name());
            }
            if self.format != before {
                self.by_tolerance = by_tolerance(self.format);
                let path = PathBuf::from(&self.path.text).with_extension(extension(self.format));
                self.path.text = path.display().to_string();
            }
        });
        ui.end_row();
        if !self.divides() {
            return;
        }
        ui.label("Points");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut self.by_tolerance, false, "On every edge");
            ui.selectable_value(&mut self.by_tolerance, true, "By tolerance");
            if self.by_tolerance {
                let speed = 0.01 * self.chord.abs().max(1e-12);
                let drag = DragValue::new(&mut self.chord).speed(speed).range(f64::MIN_POSITIVE..=f64::MAX);
                let unit = self.unit.symbol();
                ui.add(drag.suffix(if unit.is_empty() { String::new() } else { format!(" {unit}") }))
                    .accessible_name("Chord tolerance")
                    .on_hover_text("How far cells may be from the surfaces");
            } else {
                ui.add(DragValue::new(&mut self.points).range(2..=2049)).accessible_name("Points on every edge");
            }
        });
        ui.end_row();
        ui.label("Spacing");
        ui.horizontal(|ui| {
            let stretch = if let Spacing::Tanh(d) = self.spacing { d } else { 2.5 };
            ui.selectable_value(&mut self.spacing, Spacing::Uniform, "Even in parameter");
            ui.selectable_value(&mut self.spacing, Spacing::ArcLength, "Even in arc length");
            if ui.selectable_label(matches!(self.spacing, Spacing::Tanh(_)), "Clustered (tanh)").clicked() {
                self.spacing = Spacing::Tanh(stretch);
            }
            if let Spacing::Tanh(d) = &mut self.spacing {
                ui.add(DragValue::new(d).speed(0.02).range(0.01..=20.0)).accessible_name("Stretching");
            }
        });
        ui.end_row();
        ui.label("Encoding");
        ui.horizontal(|ui| {
            if self.format == Format::Obj {
                ui.label("text");
                return;
            }
            ui.checkbox(&mut self.options.ascii, "Text");
            if self.format == Format::Plot3d && !self.options.ascii {
                ui.checkbox(&mut self.options.records, "Fortran records");
                ui.checkbox(&mut self.options.big_endian, "Big endian");
                ui.checkbox(&mut self.options.single, "Single precision");
            }
        });
        ui.end_row();
    }

    fn clusters(&mut self, ui: &mut Ui) {
        ui.add_space(4.0);
        if self.names.len() > MOST_CLUSTERED {
            ui.small("Too many surfaces to list their sides; convert --cluster takes them on the command line");
            return;
        }
        ui.label("Sides that attract grid lines");
        egui::ScrollArea::vertical().max_height(120.0).show(ui, |ui| {
            Grid::new("clusters").num_columns(5).spacing(vec2(14.0, 2.0)).show(ui, |ui| {
                for (k, name) in self.names.iter().enumerate() {
                    ui.label(name);
                    for (side, text) in
                        [(Side::UMin, "u min"), (Side::UMax, "u max"), (Side::VMin, "v min"), (Side::VMax, "v max")]
                    {
                        let mut on = self.options.clusters.contains(&(k, side));
                        if ui.checkbox(&mut on, text).changed() {
                            self.options.clusters.retain(|c| *c != (k, side));
                            if on {
                                self.options.clusters.push((k, side));
                            }
                        }
                    }
                    ui.end_row();
                }
            });
        });
    }

    /// What will be written, or why nothing can be.
    fn account(&self, ui: &mut Ui) {
        let t = theme::of(ui);
        match (&self.prepared, self.ready()) {
            (_, Some(prepared)) => summary(ui, &prepared.summary, self.unit),
            (Some(Err(why)), None) if self.preparing.is_none() && self.asked.as_ref() == Some(&self.wanted()) => {
                ui.label(RichText::new(why).color(t.bad));
            }
            _ => {
                ui.horizontal(|ui| {
                    ui.spinner();
                    ui.label(if self.divides() { "Dividing the surfaces…" } else { "Comparing the edges…" });
                });
            }
        }
    }
}

fn summary(ui: &mut Ui, s: &ExportSummary, unit: Unit) {
    let t = theme::of(ui);
    let grid = Grid::new("export summary").num_columns(2).spacing(vec2(14.0, 3.0));
    grid.show(ui, |ui| {
        let mut line = |name: &str, value: String| {
            ui.label(RichText::new(name).color(t.text[1]));
            ui.label(value);
            ui.end_row();
        };
        line("Surfaces and patches", s.surfaces.to_string());
        if s.as_they_are > 0 {
            line("Meshes and blocks as they are", s.as_they_are.to_string());
        }
        let named = |pair: &Option<[String; 2]>| pair.as_ref().map_or(String::new(), |[a, b]| format!(", {a} to {b}"));
        let between = named(&s.largest_between);
        line("Shared edges", s.seams.to_string());
        if let Some(angle) = s.largest_angle_deg {
            line("Largest edge gap", format!("{}{between}", length(s.largest_gap, unit)));
            line("Largest normal angle", format!("{angle:.3}°{}", named(&s.angle_between)));
            return;
        }
        line("Points and cells", format!("{} and {}", s.points, s.cells));
        line("Largest seam gap", format!("{}{between}; closed in the file", length(s.largest_gap, unit)));
        line("Cells from the surfaces", format!("within {}", length(s.chord_error, unit)));
    });
    for note in &s.notes {
        ui.label(RichText::new(note).color(t.warn));
    }
}

/// The part of a document that is exported.
fn part(document: &Document, which: Which) -> Document {
    let mut out = document.clone();
    out.retain(|e| match which {
        Which::Patches => matches!(e.shape, Shape::Patch(_)),
        Which::Visible => e.visible,
        Which::All => true,
    });
    out
}

/// The format that is offered first: STEP, unless there is nothing that it can hold.
fn first_format(document: &Document) -> Format {
    let has = |which: fn(&Shape) -> bool| document.entities().iter().any(|e| which(&e.shape));
    if has(|s| !matches!(s, Shape::Mesh(_) | Shape::Block(_))) {
        Format::Step
    } else if has(|s| matches!(s, Shape::Block(_))) {
        Format::Plot3d
    } else if has(|s| matches!(s, Shape::Mesh(_))) {
        Format::Stl
    } else {
        Format::Step
    }
}

/// Whether surfaces are first divided by tolerance rather than by counts.
fn by_tolerance(format: Format) -> bool {
    !matches!(format, Format::Plot3d | Format::Step | Format::Iges)
}

fn extension(format: Format) -> &'static str {
    match format {
        Format::Step => "step",
        Format::Iges => "igs",
        Format::Stl => "stl",
        Format::Obj => "obj",
        _ => "xyz",
    }
}

impl Editor {
    /// Opens the export dialog.
    pub fn ask_export(&mut self) {
        let what = if self.document().patches().next().is_some() { "patches" } else { "exported" };
        let path = self.beside_source(&format!("{what}.{}", extension(first_format(self.document()))));
        self.dialog = Some(Dialog::Export(Box::new(ExportForm::new(self.document(), path))));
    }

    /// Keeps the account of the export dialog up with what is chosen in it.
    pub fn poll_export(&mut self) {
        if let Some(outcome) = self.files.exporting.as_ref().and_then(Ticket::poll) {
            self.files.exporting = None;
            match outcome {
                Outcome::Finished { value: Ok((path, saved)), .. } => self.exported(&path, &saved),
                Outcome::Finished { value: Err(why), .. } => self.warn(why),
                Outcome::NeverRan => self.warn("Exporting was cancelled; nothing was written"),
                Outcome::Panicked { message, input } => self.died("Exporting", &message, input),
            }
        }
        let document = self.history.document().clone();
        let Some(Dialog::Export(form)) = &mut self.dialog else { return };
        if let Some(outcome) = form.preparing.as_ref().and_then(Ticket::poll) {
            form.preparing = None;
            form.prepared = Some(match outcome {
                Outcome::Finished { value, .. } => value,
                Outcome::NeverRan => Err("stopped before the surfaces were divided".to_owned()),
                Outcome::Panicked { message, .. } => Err(format!("a bug stopped it: {message}")),
            });
        }
        let wanted = form.wanted();
        if form.preparing.is_some() || form.asked.as_ref() == Some(&wanted) {
            return;
        }
        let part = part(&document, wanted.0);
        form.names = part.entities().iter().filter(|e| e.surface().is_some()).map(|e| e.name.clone()).collect();
        form.options.clusters.retain(|(k, _)| *k < form.names.len());
        let wanted = form.wanted();
        form.asked = Some(wanted.clone());
        let (_, format, options) = wanted;
        form.preparing = Some(self.jobs.spawn(Lane::Heavy, "Divide surfaces", format!("{options:?}"), move |job| {
            export::prepare(&part, format, &options, job).map_err(|e| e.to_string())
        }));
    }

    /// Writes what the export dialog has prepared.
    pub fn export_to(&mut self, form: &ExportForm, path: PathBuf) {
        let Some(prepared) = form.ready().cloned() else { return };
        let (_, _, options) = form.wanted();
        let (name, input) = (format!("Export {}", super::files::file_name(&path)), path.display().to_string());
        self.files.exporting = Some(self.jobs.spawn(Lane::Heavy, name, input, move |_| {
            let saved = export::write(&path, &prepared, &options).map_err(|e| e.to_string())?;
            Ok((path, saved))
        }));
    }

    fn exported(&mut self, path: &std::path::Path, saved: &Saved) {
        let name = super::files::file_name(path);
        let gap = saved.export.as_ref().map_or(0.0, |e| e.largest_gap);
        let gap = length(gap, self.document().unit);
        self.say(format!(
            "Exported {} entities to {name}; the largest gap between edges that meet is {gap}",
            saved.entities
        ));
    }
}
