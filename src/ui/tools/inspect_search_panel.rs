//! The Tool page while the Inspect tool looks at the search for self-intersections: what is shown, the node in focus, the
//! levels, and the conversion of the leaves with miter points (thesis Fig. 4.8).

use egui::{Checkbox, Color32, Grid, Label, Pos2, ProgressBar, Rect, RichText, Sense, Slider, Stroke, StrokeKind, Ui};
use egui::{Shape, pos2, vec2};

use super::super::editor::Editor;
use super::super::panels::{self, property};
use super::super::status::{length, short};
use super::super::theme;
use super::Tool;
use super::inspect::InspectSession;
use super::inspect_panel::{count, progress};
use super::inspect_search::SIZES;
use super::inspect_search_labels::states;
use crate::kernel::self_ssi::leaf::ConvertedLeaf;
use crate::model::document::Unit;
use crate::view::inspect::{Searched, corners, role_name, state_name};

/// What a click asks for.
enum Ask {
    Again,
    Cancel,
    /// A box of parameters of a subject, in both views.
    GoTo(usize, [[f64; 2]; 2]),
}

impl Editor {
    /// Draws the page below the choice of what is looked at.
    pub fn search_panel(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let active = self.jobs.active();
        let t = theme::of(ui);
        let Tool::Inspect(session) = &mut self.tool else { return };
        let mut asks = Vec::new();
        for subject in &session.subjects {
            ui.label(RichText::new(&subject.name).color(t.text[2]));
            if let Some(error) = subject.searched.error() {
                ui.add(Label::new(RichText::new(error).color(t.bad)).wrap());
            }
        }
        if session.subjects.iter().any(|s| s.searched.error().is_some()) && ui.button("Search again").clicked() {
            asks.push(Ask::Again);
        }
        if let Some(job) = active.iter().find(|job| job.name.starts_with("Self-intersection search of")) {
            ui.add(ProgressBar::new(job.job.done() as f32).text(progress(&job.job)));
            if ui.button("Cancel").on_hover_text("Stop searching; what was visited is kept and marked").clicked() {
                asks.push(Ask::Cancel);
            }
        }
        if session.is_built() {
            controls(ui, session);
            notes(ui, session);
            let all: Vec<_> =
                (0..session.subjects.len()).filter_map(|k| Some((k, session.searched(k)?.clone()))).collect();
            for (at, searched) in &all {
                ui.add_space(10.0);
                leaves(ui, session, *at, searched, unit, &mut asks);
            }
            ui.add_space(10.0);
            node(ui, session);
            for (_, searched) in &all {
                ui.add_space(10.0);
                levels(ui, session, searched);
            }
        }
        for ask in asks {
            let Tool::Inspect(session) = &mut self.tool else { return };
            match ask {
                Ask::Again => session.forget(),
                Ask::Cancel => session.subjects.iter().for_each(|s| s.searched.cancel()),
                Ask::GoTo(at, uv_box) => {
                    let Some(searched) = session.searched(at).cloned() else { continue };
                    let (Some(entity), Some(surface)) = (searched.entity(), searched.surface()) else { continue };
                    self.uv.go_to(entity, surface.domain(), corners(uv_box));
                    let bounds = searched.bounds(uv_box);
                    if !bounds.is_empty() {
                        self.viewport.frame(&bounds);
                    }
                }
            }
        }
    }
}

fn controls(ui: &mut Ui, session: &mut InspectSession) {
    let t = theme::of(ui);
    let deepest = session.deepest();
    let mut level = session.search.options.level;
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Level").color(t.text[1]));
        ui.add(Slider::new(&mut level, 0..=deepest)).accessible_name("Level").on_hover_text(
            "Splits above the nodes: 0 is the whole surface, every split is in one direction (digits 0-9, PgUp, PgDn)",
        );
    });
    session.set_search_level(level);
    let all: Vec<_> = session.subjects.iter().filter_map(|s| s.searched.value().cloned()).collect();
    let sum = |of: &dyn Fn(&Searched) -> usize| all.iter().map(|s| of(s)).sum::<usize>();
    let options = &mut session.search.options;
    for (k, &size) in SIZES.iter().enumerate() {
        let failed = sum(&|s| s.windows(size).count());
        let text = format!("Failed {size} x {size} windows ({})", count(failed));
        ui.add_enabled(failed > 0, Checkbox::new(&mut options.windows[k], text))
            .on_hover_text(
                "Windows of grid cells that no proved node contains and that could not be proved injective: here pairs \
                 of cells are looked at down to the curve (W)",
            )
            .on_disabled_hover_text("Every window is proved free of self-intersection");
    }
    let pairs = sum(&|s| s.record.leaf_pairs.len());
    ui.add_enabled(pairs > 0, Checkbox::new(&mut options.pairs, format!("Leaf pairs ({})", count(pairs))))
        .on_hover_text("The pairs of smallest boxes in which a curve was looked for; hovering one shows its partner")
        .on_disabled_hover_text("Everything was settled by larger nodes");
    let converted = sum(&|s| s.record.leaves.len());
    ui.add_enabled(converted > 0, Checkbox::new(&mut options.leaves, format!("Converted leaves ({converted})")))
        .on_hover_text("Cells with a miter point, split around its quadrangle as in thesis Fig. 4.8")
        .on_disabled_hover_text("There is no miter point");
}

/// What was searched, and what is not drawn as one might expect.
fn notes(ui: &mut Ui, session: &InspectSession) {
    let t = theme::of(ui);
    let say = |ui: &mut Ui, text: String, color| {
        ui.add(Label::new(RichText::new(text).color(color)).wrap());
    };
    if let Some(dressed) = session.search_drawn() {
        if dressed.too_fine {
            say(ui, "This level is too fine for its colours in space; the uv view has them".to_owned(), t.warn);
        }
        if dressed.crowded {
            say(ui, "Too many boxes: not all of them are outlined".to_owned(), t.warn);
        }
    }
    for searched in session.subjects.iter().filter_map(|s| s.searched.value()) {
        let [u, v] = searched.record.lines.each_ref().map(|l| l.len().saturating_sub(1));
        let r = &searched.found.result;
        let (verdict, color) = match (searched.found.cancelled, r.complete) {
            (true, _) => ("Stopped before it was done", t.warn),
            (_, true) => ("Complete", t.good),
            _ => ("Not complete", t.warn),
        };
        let many = |n: usize, one: &str, more: &str| if n == 1 { format!("1 {one}") } else { format!("{n} {more}") };
        let text = format!(
            "{verdict}: {}, {}{}",
            many(r.curves.len(), "curve", "curves"),
            many(r.miters.len(), "miter point", "miter points"),
            if r.unresolved.is_empty() {
                String::new()
            } else {
                format!(", {}", many(r.unresolved.len(), "place unresolved", "places unresolved"))
            }
        );
        say(ui, text, color);
        let grid = if u > 0 { format!("{u} x {v} cells, ") } else { String::new() };
        let e = &searched.evidence;
        let text = format!(
            "{grid}{} nodes visited, {} windows tested, {} pairs. {} ms with the record",
            count(searched.record.nodes.len()),
            count(e.windows),
            count(e.pairs),
            short(searched.took.as_secs_f64() * 1e3)
        );
        say(ui, text, t.text[1]);
        for u in r.unresolved.iter().take(3) {
            say(ui, format!("Unresolved: {}", u.reason), t.warn);
        }
    }
}

/// The node in focus.
fn node(ui: &mut Ui, session: &InspectSession) {
    let t = theme::of(ui);
    let focus = session.search.focus();
    let pinned = session.search.pinned.is_some() && focus == session.search.pinned;
    panels::heading(ui, if pinned { "Pinned node" } else { "Node" });
    let found = focus.and_then(|f| {
        let searched = session.searched(f.subject)?;
        Some((f, searched, searched.node(f.node)?))
    });
    let Some((focus, searched, node)) = found else {
        let text = "Hover a node in either view; a click pins it.";
        ui.add(Label::new(RichText::new(text).color(t.text[1])).wrap());
        return;
    };
    Grid::new("search node").num_columns(2).spacing(vec2(10.0, 4.0)).show(ui, |ui| {
        property(ui, "Proved", state_name(node.state));
        property(ui, "Level", node.level.to_string());
        property(ui, "Child", role_name(node.role));
        let [u, v] = node.uv_box;
        property(ui, "u", format!("{} to {}", short(u[0]), short(u[1])));
        property(ui, "v", format!("{} to {}", short(v[0]), short(v[1])));
        let cells = match node.cells {
            Some([u, v]) => format!("{} x {}: {}-{}, {}-{}", u[1] - u[0], v[1] - v[0], u[0], u[1], v[0], v[1]),
            None => "a part of one, below the grid".to_owned(),
        };
        property(ui, "Cells", cells);
        property(ui, "Children", searched.children(focus.node).len().to_string());
    });
}

/// The numbers of all levels; a click goes to one.
fn levels(ui: &mut Ui, session: &mut InspectSession, searched: &Searched) {
    let t = theme::of(ui);
    panels::heading(ui, &format!("Levels of {}", searched.found.name(0)));
    let mut level = session.search.options.level;
    let id = ("search levels", searched.entity().map(|e| e.0));
    Grid::new(id).num_columns(6).striped(true).spacing(vec2(10.0, 3.0)).show(ui, |ui| {
        for (head, help) in
            [("Level", "A click shows it; * marks levels below the grid"), ("Nodes", "Nodes that were visited")]
        {
            ui.label(RichText::new(head).color(t.text[1]).small()).on_hover_text(help);
        }
        for (_, name, help, color) in states().take(4) {
            let head = name.split(' ').next().unwrap_or(name);
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 3.0;
                swatch(ui, color);
                ui.label(RichText::new(head).color(t.text[1]).small()).on_hover_text(help);
            });
        }
        ui.end_row();
        for row in &searched.levels {
            let text = format!("  {}{}  ", row.level, if row.below_grid { "*" } else { "" });
            if ui.selectable_label(row.level == level, text).clicked() {
                level = row.level;
            }
            ui.label(count(row.nodes));
            for n in row.states {
                ui.label(if n == 0 { "-".to_owned() } else { count(n) });
            }
            ui.end_row();
        }
    });
    session.set_search_level(level);
}

fn swatch(ui: &mut Ui, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, color);
}

/// The converted leaves; the chosen one as a diagram.
fn leaves(ui: &mut Ui, session: &mut InspectSession, at: usize, searched: &Searched, unit: Unit, asks: &mut Vec<Ask>) {
    let leaves = &searched.record.leaves;
    if leaves.is_empty() {
        return;
    }
    let t = theme::of(ui);
    panels::heading(ui, "Converted leaves");
    for (k, leaf) in leaves.iter().enumerate() {
        let on = session.search.leaf == Some((at, k));
        let text = format!("Miter point {}: {}", leaf.miter + 1, if leaf.whole { "R is the leaf" } else { "R and Q" });
        let help = "Shows how the cell around the miter point becomes an inner node";
        if ui.selectable_label(on, text).on_hover_text(help).clicked() {
            session.search.leaf = (!on).then_some((at, k));
            if !on {
                session.search.options.leaves = true;
                asks.push(Ask::GoTo(at, leaf.cell));
            }
        }
        if !on {
            continue;
        }
        let Some(miter) = searched.found.result.miters.get(leaf.miter) else { continue };
        diagram(ui, leaf, miter.quad);
        let words = if leaf.whole {
            "The cell is split in three by the slab around the miter quadrangle Q, its middle child in three again. \
             The image of R, the smallest rectangle around Q, fits into the ball, so R replaces Q."
        } else {
            "The cell is split in three by the slab around the miter quadrangle Q, its middle child in three again. \
             The image of R, the smallest rectangle around Q, does not fit into the ball: R holds Q and one triangle for \
             each edge of Q."
        };
        ui.add(Label::new(RichText::new(words).color(t.text[1]).small()).wrap());
        let size = |[u, v]: [[f64; 2]; 2]| format!("{} x {}", short(u[1] - u[0]), short(v[1] - v[0]));
        Grid::new(("leaf", at, k)).num_columns(2).spacing(vec2(10.0, 4.0)).show(ui, |ui| {
            property(
                ui,
                "Cell",
                format!("{}{}", size(leaf.cell), if leaf.expanded { ", widened to hold Q" } else { "" }),
            );
            property(ui, "R", size(leaf.middle[1]));
            property(ui, "Ball", length(miter.radius, unit));
        });
        ui.horizontal(|ui| {
            if ui.button("Zoom to cell").on_hover_text("In both views").clicked() {
                asks.push(Ask::GoTo(at, leaf.cell));
            }
            if ui.button("Zoom to R").on_hover_text("In both views, at true scale").clicked() {
                asks.push(Ask::GoTo(at, leaf.middle[1]));
            }
        });
        ui.add_space(6.0);
    }
}

/// The conversion as a diagram: the topology of the cell with R magnified, since true to scale it would be a dot.
fn diagram(ui: &mut Ui, leaf: &ConvertedLeaf, quad: [glam::DVec2; 4]) {
    let t = theme::of(ui);
    let side = ui.available_width().min(220.0);
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Leaf conversion, not to scale"));
    response.on_hover_text("Not to scale: R is magnified so that Q can be seen");
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 5.0, t.field);
    let cell = rect.shrink(16.0);
    // R takes the middle third wherever it is; slabs without width have none here either.
    let r = leaf.middle[1];
    let [cu, cv] = leaf.cell;
    let stops = |whole: [f64; 2], inner: [f64; 2]| {
        let before = if inner[0] > whole[0] { 1.0 / 3.0 } else { 0.0 };
        let after = if inner[1] < whole[1] { 2.0 / 3.0 } else { 1.0 };
        [before, after]
    };
    let (su, sv) = (stops(cu, r[0]), stops(cv, r[1]));
    let x = |f: f64| cell.left() + f as f32 * cell.width();
    let y = |f: f64| cell.bottom() - f as f32 * cell.height();
    let inner = Rect::from_two_pos(pos2(x(su[0]), y(sv[0])), pos2(x(su[1]), y(sv[1])));
    let slab = Rect::from_two_pos(pos2(x(su[0]), y(0.0)), pos2(x(su[1]), y(1.0)));
    painter.rect_filled(slab, 0.0, t.accent.gamma_multiply(0.10));
    let at = |p: glam::DVec2| -> Pos2 {
        let f = |v: f64, [a, b]: [f64; 2]| if b > a { ((v - a) / (b - a)).clamp(0.0, 1.0) as f32 } else { 0.5 };
        pos2(inner.left() + f(p.x, r[0]) * inner.width(), inner.bottom() - f(p.y, r[1]) * inner.height())
    };
    let corners = quad.map(at).to_vec();
    painter.add(Shape::convex_polygon(corners, t.accent.gamma_multiply(0.45), Stroke::new(1.5, t.accent)));
    for triangle in &leaf.triangles {
        let mut line: Vec<Pos2> = triangle.iter().map(|p| at(*p)).collect();
        line.extend(line.first().copied());
        painter.line(line, Stroke::new(1.0, t.text[1]));
    }
    let thin = Stroke::new(1.2, t.text[1]);
    painter.rect_stroke(slab, 0.0, thin, StrokeKind::Middle);
    painter.rect_stroke(inner, 0.0, Stroke::new(1.8, t.text[2]), StrokeKind::Middle);
    painter.rect_stroke(cell, 0.0, Stroke::new(1.8, t.text[2]), StrokeKind::Middle);
    let font = egui::FontId::proportional(theme::SMALL);
    let write = |p: Pos2, text: &str, color| {
        painter.text(p, egui::Align2::CENTER_CENTER, text, font.clone(), color);
    };
    write(inner.left_top() + vec2(10.0, 9.0), "R", t.text[2]);
    write(inner.center(), "Q", t.text[2]);
    if su[0] > 0.0 {
        write(pos2(0.5 * (cell.left() + slab.left()), cell.center().y), "left", t.text[1]);
    }
    if su[1] < 1.0 {
        write(pos2(0.5 * (cell.right() + slab.right()), cell.center().y), "right", t.text[1]);
    }
    if sv[0] > 0.0 {
        write(pos2(slab.center().x, 0.5 * (cell.bottom() + inner.bottom())), "below", t.text[1]);
    }
    if sv[1] < 1.0 {
        write(pos2(slab.center().x, 0.5 * (cell.top() + inner.top())), "above", t.text[1]);
    }
    write(pos2(cell.center().x, rect.bottom() - 7.0), "u", t.text[1]);
    write(pos2(rect.left() + 7.0, cell.center().y), "v", t.text[1]);
}
