//! The Tool page while the Inspect tool is on: what is shown, the numbers of the levels, the node in focus.

use egui::{Button, Checkbox, ComboBox, DragValue, Grid, ProgressBar, RichText, Slider, Ui, vec2};

use super::super::actions::{self, Action};
use super::super::editor::Editor;
use super::super::panels::{self, property};
use super::super::status::{length, short};
use super::super::theme;
use super::Tool;
use super::inspect::{InspectSession, Look, MOST_HEIGHT};
use super::inspect_overlay::{Dressed, PARTNERS};
use super::inspect_subject::Subject;
use crate::kernel::job::Job;
use crate::model::document::Unit;
use crate::render::BODIES;
use crate::view::inspect::{Coloring, Hierarchy, MOST, NodeCard, VolumeForm};

/// Bytes in few characters.
fn bytes(n: usize) -> String {
    let n = n as f64;
    match n {
        n if n < 1e3 => format!("{n:.0} B"),
        n if n < 1e6 => format!("{} kB", short(n / 1e3)),
        n if n < 1e9 => format!("{} MB", short(n / 1e6)),
        n => format!("{} GB", short(n / 1e9)),
    }
}

/// Phase and percentage of a job.
pub fn progress(job: &Job) -> String {
    let percent = format!("{:.0} %", 100.0 * job.done());
    match job.current_phase() {
        phase if phase.is_empty() => percent,
        phase => format!("{phase} · {percent}"),
    }
}

/// A count with groups of three digits.
pub fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (k, c) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

impl Editor {
    /// Draws the page.
    pub fn inspect_panel(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let active = self.jobs.active();
        let t = theme::of(ui);
        let ctx = ui.ctx().clone();
        let mut cancel = false;
        let mut toggle_uv = false;
        let uv_view = self.settings.uv_view;
        let Tool::Inspect(session) = &mut self.tool else { return };
        panels::heading(ui, "Inspect");
        looks(ui, session);
        let text = match (session.look, session.subjects.len()) {
            (Look::Hierarchy, 0) => "Click a surface to see its bounding volumes level by level.",
            (Look::Hierarchy, 1) => "Shift+click a second surface to see which nodes overlap.",
            (Look::Hierarchy, _) => "Two surfaces: their overlapping nodes can be shown.",
            (Look::Search, 0) => "Click a surface to see how it is searched for self-intersections.",
            (Look::Search, _) => "The ternary tree: what was proved about each node against itself.",
        };
        ui.add(egui::Label::new(RichText::new(text).color(t.text[1])).wrap());
        ui.add_space(6.0);
        if session.look == Look::Search {
            self.search_panel(ui);
            return;
        }
        for subject in &session.subjects {
            ui.label(RichText::new(&subject.name).color(t.text[2]));
            if let Some(error) = subject.hierarchy.error() {
                ui.add(egui::Label::new(RichText::new(error).color(t.bad)).wrap());
            }
        }
        if session.subjects.iter().any(|s| s.hierarchy.error().is_some()) && ui.button("Build again").clicked() {
            session.forget();
        }
        if let Some(job) = active.iter().find(|job| job.name.starts_with("Hierarchy of")) {
            ui.add(ProgressBar::new(job.job.done() as f32).text(progress(&job.job)));
            cancel = ui.button("Cancel").on_hover_text("Stop building; what is built is dropped").clicked();
        }
        if session.subjects.is_empty() {
            return;
        }
        ui.add_space(4.0);
        controls(ui, session);
        let mut uv = uv_view;
        if ui.add(Checkbox::new(&mut uv, "UV view (U)")).on_hover_text(actions::info(Action::UvView).help).changed() {
            toggle_uv = true;
        }
        if let Some(dressed) = session.current() {
            notes(ui, dressed);
        }
        if let Some(Err(why)) = session.dressed.value() {
            ui.add(egui::Label::new(RichText::new(why).color(t.bad)).wrap());
        }
        if let Some(why) = session.dressed.error() {
            ui.add(egui::Label::new(RichText::new(why).color(t.bad)).wrap());
        }
        ui.add_space(10.0);
        node(ui, session, unit);
        let mut level = session.options.level;
        for subject in &session.subjects {
            if let Some(hierarchy) = subject.hierarchy.value() {
                ui.add_space(10.0);
                levels(ui, subject, hierarchy, &mut level, unit);
            }
        }
        session.set_level(level);
        if cancel {
            for job in active.iter().filter(|job| job.name.starts_with("Hierarchy of")) {
                self.jobs.cancel(job.id);
            }
        }
        if toggle_uv {
            self.perform(&ctx, Action::UvView);
        }
    }
}

/// What is looked at.
fn looks(ui: &mut Ui, session: &mut InspectSession) {
    ui.horizontal(|ui| {
        for (look, name, help) in [
            (Look::Hierarchy, "Hierarchy", "The bounding volumes that intersections are found with (S)"),
            (
                Look::Search,
                "Self-intersection search",
                "The ternary tree, its failed windows, its converted leaves (S)",
            ),
        ] {
            if ui.add(Button::selectable(session.look == look, name)).on_hover_text(help).clicked() {
                session.look_at(look);
            }
        }
    });
    ui.add_space(4.0);
}

fn controls(ui: &mut Ui, session: &mut InspectSession) {
    let t = theme::of(ui);
    let quiet = |text: &str| RichText::new(text).color(t.text[1]);
    Grid::new("inspect controls").num_columns(2).spacing(vec2(10.0, 6.0)).show(ui, |ui| {
        ui.label(quiet("Level"));
        let mut level = session.options.level;
        ui.add(Slider::new(&mut level, 0..=session.height))
            .accessible_name("Level")
            .on_hover_text("0 is the Bezier patches; each level quarters the nodes (digits 0-9, PgUp, PgDn)");
        session.set_level(level);
        ui.end_row();
        ui.label(quiet("Height"));
        let mut height = session.height;
        ui.add(DragValue::new(&mut height).range(1..=MOST_HEIGHT).speed(0.05))
            .accessible_name("Height")
            .on_hover_text("Levels that are built: every Bezier patch has 2^height x 2^height leaves");
        session.set_height(height);
        ui.end_row();
        ui.label(quiet("Volumes"));
        choice(ui, "Volumes", &VolumeForm::ALL, &mut session.options.form);
        ui.end_row();
        ui.label(quiet("Colour"));
        choice(ui, "Colour", &Coloring::ALL, &mut session.options.coloring);
        ui.end_row();
    });
    let options = &mut session.options;
    ui.add(Checkbox::new(&mut options.ghosts, "Levels above and below (G)"))
        .on_hover_text("Outlines of the coarser and the finer level, in grey");
    ui.add(Checkbox::new(&mut options.tori, "Leaf tori (T)")).on_hover_text(
        "The used patch of the osculating torus of every leaf, coloured by its deviation from the surface",
    );
    let changed = ui
        .add(Checkbox::new(&mut session.whole_torus, "Whole torus of the node"))
        .on_hover_text("The torus in contact with the surface at the node under the cursor, or at the pinned one")
        .changed();
    if changed {
        session.revision += 1;
    }
    let two = session.subjects.len() == 2;
    ui.add_enabled(two, Checkbox::new(&mut session.options.pairs, "Overlapping pairs only"))
        .on_hover_text("Only nodes whose swept spheres overlap one of the other surface")
        .on_disabled_hover_text("Shift+click a second surface first");
}

fn choice<T: Copy + PartialEq>(ui: &mut Ui, name: &str, all: &[(T, &str)], value: &mut T) {
    let shown = all.iter().find(|(v, _)| v == value).map_or("", |(_, text)| text);
    let response = ComboBox::from_id_salt(name)
        .selected_text(shown)
        .width(170.0)
        .show_ui(ui, |ui| {
            for (v, text) in all {
                ui.selectable_value(value, *v, *text);
            }
        })
        .response;
    response.accessible_name(name);
}

/// What is not drawn as one might expect, and the pairs.
fn notes(ui: &mut Ui, dressed: &Dressed) {
    let t = theme::of(ui);
    let mut say = |text: String, color| {
        ui.add(egui::Label::new(RichText::new(text).color(color)).wrap());
    };
    let most = dressed.nodes.iter().copied().max().unwrap_or(0);
    if most > MOST {
        say(
            format!(
                "{} nodes are more than the {} that are drawn: choose a coarser level. The uv view shows all.",
                count(most),
                count(MOST)
            ),
            t.warn,
        );
    } else if dressed.shown.iter().any(|s| s.volumes.len() > BODIES) {
        say(format!("More than {} nodes: silhouettes instead of bodies", count(BODIES)), t.text[1]);
    }
    if dressed.too_many_tori() {
        say(format!("More than {} leaves: the tori are not drawn. Lower the height.", count(MOST)), t.warn);
    }
    if let Some(overlaps) = &dressed.overlaps {
        say(
            format!(
                "{} overlapping pairs at level {}, of {} and {} nodes; {} tests in {:.1} ms{}",
                count(overlaps.pairs),
                overlaps.level,
                count(overlaps.partners.len()),
                count(overlaps.back.len()),
                count(overlaps.tests as usize),
                overlaps.took.as_secs_f64() * 1e3,
                if overlaps.complete { "" } else { "; cancelled, there are more" }
            ),
            t.text[0],
        );
    }
}

/// The node in focus.
fn node(ui: &mut Ui, session: &InspectSession, unit: Unit) {
    let t = theme::of(ui);
    let pinned = session.pinned.is_some() && session.focus() == session.pinned;
    panels::heading(ui, if pinned { "Pinned node" } else { "Node" });
    let found = session.focus().and_then(|f| Some((f, session.tree(f.subject)?)));
    let Some((focus, tree)) = found else {
        ui.add(
            egui::Label::new(RichText::new("Hover a node in either view; a click pins it.").color(t.text[1])).wrap(),
        );
        return;
    };
    let card = NodeCard::new(tree, focus.node);
    Grid::new("inspect node").num_columns(2).spacing(vec2(10.0, 4.0)).show(ui, |ui| {
        let patches = tree.patches().len();
        let which = if patches > 1 {
            format!("{} of patch {} of {patches}", card.id.index, card.id.patch)
        } else {
            card.id.index.to_string()
        };
        property(ui, "Heap index", which);
        property(ui, "Level", card.level.to_string());
        let [low, high] = card.rectangle;
        property(ui, "u", format!("{} to {}", short(low.x), short(high.x)));
        property(ui, "v", format!("{} to {}", short(low.y), short(high.y)));
        property(ui, "Rectangle", format!("{} x {}", short(2.0 * card.half[0]), length(2.0 * card.half[1], unit)));
        property(ui, "Swept radius", length(card.radius, unit));
        property(ui, "Bounding sphere", length(card.sphere, unit));
        property(
            ui,
            "Normal cone",
            card.cone.map_or("wider than a half space".to_owned(), |c| format!("{}° half angle", short(c))),
        );
        if let Some(torus) = &card.torus {
            let p = torus.torus.point;
            property(ui, "Contact", format!("{}, {}, {}", short(p.x), short(p.y), short(p.z)));
            property(ui, "Curvatures", format!("{} and {}", short(torus.torus.k[0]), short(torus.torus.k[1])));
            let radii = match torus.radii {
                Some([major, minor]) => format!("R {}, r {}", short(major), length(minor, unit)),
                None => "infinite: a cylinder or a plane".to_owned(),
            };
            property(ui, "Torus", radii);
            property(ui, "Deviation", length(torus.torus.deviation, unit));
            property(ui, "Normals differ", format!("{}° at most", short(torus.torus.normal_deviation().to_degrees())));
        }
    });
    if let Some(partners) = session.current().filter(|d| d.overlaps.is_some()).map(|d| d.partners(focus).len()) {
        let more = if partners > PARTNERS { format!(", {PARTNERS} of them outlined") } else { String::new() };
        ui.label(RichText::new(format!("Overlaps {partners} nodes of the other surface{more}")).color(t.text[0]));
    }
}

/// The numbers of all levels; a click goes to one.
fn levels(ui: &mut Ui, subject: &Subject, hierarchy: &Hierarchy, level: &mut u32, unit: Unit) {
    let t = theme::of(ui);
    panels::heading(ui, &format!("Levels of {}", subject.name));
    let symbol = unit.symbol();
    let radius = if symbol.is_empty() { "Radius".to_owned() } else { format!("Radius {symbol}") };
    Grid::new(("inspect levels", subject.entity.0)).num_columns(5).striped(true).spacing(vec2(12.0, 3.0)).show(
        ui,
        |ui| {
            for (head, help) in [
                ("Level", "A click shows it"),
                ("Nodes", "Nodes of the level"),
                ("Bytes", "Of its nodes, and of the tori at the last level"),
                (radius.as_str(), "The largest swept radius: how far the surface may be from the rectangles"),
                ("Cone °", "The largest half angle of a normal cone"),
            ] {
                ui.label(RichText::new(head).color(t.text[1]).small()).on_hover_text(help);
            }
            ui.end_row();
            for row in &hierarchy.levels {
                if ui.selectable_label(row.level == *level, format!("  {}  ", row.level)).clicked() {
                    *level = row.level;
                }
                ui.label(count(row.nodes));
                ui.label(bytes(row.bytes));
                ui.label(short(row.largest_radius));
                ui.label(row.largest_cone.map_or("-".to_owned(), |c| short(c.to_degrees())));
                ui.end_row();
            }
        },
    );
    let memory = &hierarchy.memory;
    let deviation = hierarchy.levels.last().and_then(|l| l.largest_deviation);
    let quiet = |ui: &mut Ui, text: String| ui.add(egui::Label::new(RichText::new(text).color(t.text[1])).wrap());
    if let Some(deviation) = deviation {
        quiet(ui, format!("Largest deviation of a leaf torus {}", length(deviation, unit)));
    }
    quiet(
        ui,
        format!(
            "{} Bezier patches. Built in {} ms. {} in all: nodes {}, tori {}, the rest {}",
            count(hierarchy.tree.patches().len()),
            short(hierarchy.took.as_secs_f64() * 1e3),
            bytes(memory.total()),
            bytes(memory.node_bytes),
            bytes(memory.torus_bytes),
            bytes(memory.other_bytes)
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_bytes_read_easily() {
        assert_eq!([7, 999, 1000, 262_144].map(count), ["7", "999", "1,000", "262,144"]);
        assert_eq!([12, 64_000, 1_200_000].map(bytes), ["12 B", "64.0 kB", "1.20 MB"]);
    }
}
