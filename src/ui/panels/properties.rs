//! What is known of the selected entity, or of the whole model when nothing is selected.

use egui::{Grid, Ui, vec2};

use super::super::actions::Action;
use super::super::editor::Editor;
use super::super::status::{length, short};
use crate::kernel::geom::{Aabb, Curve, Surface};
use crate::kernel::mesh::facets::Facets;
use crate::model::command::Command;
use crate::model::document::{Entity, Shape, Unit};

const UNITS: [Unit; 11] = [
    Unit::Unknown,
    Unit::Millimetre,
    Unit::Centimetre,
    Unit::Metre,
    Unit::Kilometre,
    Unit::Micrometre,
    Unit::Inch,
    Unit::Foot,
    Unit::Mile,
    Unit::Mil,
    Unit::Microinch,
];

/// Draws the properties.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let document = editor.document().clone();
    let ids = editor.selection.ids().to_vec();
    match ids.as_slice() {
        [] => model(ui, editor),
        [id] => {
            if let Some(entity) = document.get(*id) {
                one(ui, editor, entity, document.unit);
            }
        }
        many => {
            let entities: Vec<_> = many.iter().filter_map(|&id| document.get(id)).collect();
            let bounds = entities.iter().fold(Aabb::EMPTY, |all, e| all.union(&e.bounds()));
            grid(ui, |ui| {
                super::property(ui, "Selected", format!("{} entities", entities.len()));
                size(ui, &bounds, document.unit);
            });
        }
    }
}

fn grid(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    Grid::new("properties").num_columns(2).spacing(vec2(14.0, 4.0)).min_col_width(70.0).show(ui, add);
}

fn size(ui: &mut Ui, bounds: &Aabb, unit: Unit) {
    if !bounds.is_empty() {
        let s = bounds.size();
        super::property(ui, "Size", format!("{} x {} x {}", short(s.x), short(s.y), short(s.z)));
        super::property(ui, "Diagonal", length(bounds.diagonal(), unit));
    }
}

fn model(ui: &mut Ui, editor: &mut Editor) {
    let document = editor.document().clone();
    if document.entities().is_empty() {
        super::empty(ui, "Nothing is open");
        return;
    }
    let mut unit = document.unit;
    grid(ui, |ui| {
        super::property(ui, "Surfaces", document.surfaces().count().to_string());
        super::property(ui, "Curves", document.curves().count().to_string());
        super::property(ui, "Patches", document.patches().count().to_string());
        if document.meshes().next().is_some() {
            super::property(ui, "Meshes and blocks", document.meshes().count().to_string());
        }
        size(ui, &document.bounds(), document.unit);
        ui.label(egui::RichText::new("Unit").color(super::super::theme::of(ui).text[1]));
        let name = |unit: Unit| if unit == Unit::Unknown { "none" } else { unit.symbol() };
        let combo = egui::ComboBox::from_id_salt("unit").selected_text(name(unit)).show_ui(ui, |ui| {
            for choice in UNITS {
                ui.selectable_value(&mut unit, choice, name(choice));
            }
        });
        combo.response.accessible_name("Unit").on_hover_text("What the lengths are measured in; no number changes");
        ui.end_row();
    });
    if unit != document.unit {
        editor.command(&Command::SetUnit { unit });
    }
}

fn one(ui: &mut Ui, editor: &mut Editor, entity: &Entity, unit: Unit) {
    grid(ui, |ui| {
        super::property(ui, "Name", &entity.name);
        match &entity.shape {
            Shape::Surface(s) => {
                super::property(ui, "Kind", "Surface");
                if let Some(number) = editor.document().surfaces().position(|(id, _)| id == entity.id) {
                    super::property(ui, "Number", number.to_string());
                }
                surface(ui, s);
            }
            Shape::Face(face) => {
                super::property(ui, "Kind", "Trimmed face");
                if let Some(number) = editor.document().surfaces().position(|(id, _)| id == entity.id) {
                    super::property(ui, "Number", number.to_string());
                }
                super::property(ui, "Lies on", face.kind.name());
                super::property(ui, "Loops", face.rings().len().to_string());
                super::property(ui, "Edges", face.rings().iter().map(|r| r.edges.len()).sum::<usize>().to_string());
                surface(ui, face.surface());
            }
            Shape::Curve(c) => {
                super::property(ui, "Kind", "Curve");
                curve(ui, c);
            }
            Shape::Mesh(f) | Shape::Block(f) => {
                super::property(ui, "Kind", if f.grid().is_some() { "Structured block" } else { "Triangle mesh" });
                if let Some(number) = editor.document().meshes().position(|(id, _)| id == entity.id) {
                    super::property(ui, "Number", number.to_string());
                }
                facets(ui, f);
            }
            Shape::Patch(patch) => {
                super::property(ui, "Kind", "Healed patch");
                surface(ui, &patch.surface);
                let report = &patch.report;
                super::property(ui, "Largest error", length(report.max_error, unit));
                super::property(ui, "RMS error", length(report.rms, unit));
                super::property(ui, "Resolution", format!("{} x {}", report.resolution[0], report.resolution[1]));
                super::property(
                    ui,
                    "Samples",
                    format!("{} projected, {} artificial", report.projected, report.artificial),
                );
            }
        }
        size(ui, &entity.bounds(), unit);
    });
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let ctx = ui.ctx().clone();
        if ui.button("Rename…").clicked() {
            editor.perform(&ctx, Action::Rename);
        }
        if ui.button("Delete").clicked() {
            editor.perform(&ctx, Action::Delete);
        }
    });
}

fn surface(ui: &mut Ui, s: &Surface) {
    let [u, v] = s.knots();
    let [m, n] = s.counts();
    super::property(ui, "Degree", format!("{} x {}", u.degree(), v.degree()));
    super::property(ui, "Control points", format!("{m} x {n}"));
    let [[u0, u1], [v0, v1]] = s.domain();
    super::property(ui, "u", format!("{} to {}", short(u0), short(u1)));
    super::property(ui, "v", format!("{} to {}", short(v0), short(v1)));
    super::property(ui, "Weights", if s.weights().is_some() { "rational" } else { "all 1" });
}

fn facets(ui: &mut Ui, f: &Facets) {
    if let Some(grid) = f.grid() {
        super::property(ui, "Points", grid.counts().map(|c| c.to_string()).join(" x "));
        super::property(ui, "Blanking", if grid.blank().is_some() { "IBLANK" } else { "none" });
    }
    super::property(ui, "Triangles", f.mesh().triangles().len().to_string());
    super::property(ui, "Vertices", f.mesh().points().len().to_string());
    super::property(ui, "Pickable curves", f.curves().len().to_string());
}

fn curve(ui: &mut Ui, c: &Curve) {
    super::property(ui, "Degree", c.knots().degree().to_string());
    super::property(ui, "Control points", c.points().len().to_string());
    let [a, b] = c.domain();
    super::property(ui, "t", format!("{} to {}", short(a), short(b)));
    super::property(ui, "Weights", if c.weights().is_some() { "rational" } else { "all 1" });
}
