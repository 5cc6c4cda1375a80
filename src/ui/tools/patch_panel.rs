//! The Tool page while a patch is picked: sides, corners, options, progress, result.

use egui::{Align, Color32, DragValue, Grid, Layout, ProgressBar, RichText, Sense, Ui, vec2};

use super::super::dialogs::primary;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::status::short;
use super::super::{panels, theme};
use super::Tool;
use super::patch::PatchSession;
use crate::kernel::heal::project::Status;
use crate::model::spec::BoundaryMode;
use crate::view::feature_edges::{EdgeKind, LinePattern};
use crate::view::patch_tool::corners::{CornerFix, CornerState};
use crate::view::patch_tool::{Event, HELP, Key, Options, Stage};
use crate::view::snap::SnapKind;

/// What a click in the panel asks for.
enum Ask {
    Event(Event),
    Zoom(glam::DVec3),
}

impl Editor {
    /// Draws the page.
    pub fn patch_panel(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let surfaces = self.document().bodies().count();
        let visible: Vec<usize> = {
            let document = self.document();
            let shown = |id| document.get(id).is_some_and(|e| e.visible);
            document.bodies().enumerate().filter(|(_, (id, _))| shown(*id)).map(|(k, _)| k).collect()
        };
        let job = self.jobs.active();
        let Tool::Patch(session) = &mut self.tool else { return };
        let mut asks = Vec::new();
        let stage = session.tool.stage();
        header(ui, session);
        notice(ui, session);
        match stage {
            Stage::Idle => {}
            Stage::Side(_) | Stage::Review => {
                sides(ui, session, &mut asks);
                edges(ui, session);
                snaps(ui, session);
                corners(ui, session, &mut asks);
                samples(ui, session, &mut asks);
                options(ui, session, &visible, surfaces, &mut asks);
                partial(ui, session, &mut asks);
                ui.add_space(8.0);
                let ready = stage == Stage::Review;
                ui.horizontal(|ui| {
                    let text = match (ready, session.tool.is_loop()) {
                        (true, _) => "Heal",
                        (false, true) => "Review",
                        (false, false) => "Next side",
                    };
                    if primary(ui, text).on_hover_text("Enter").clicked() {
                        asks.push(Ask::Event(Event::Key(Key::Enter)));
                    }
                    if ui
                        .add(egui::Button::new("Undo pick").min_size(vec2(84.0, 26.0)))
                        .on_hover_text("Backspace")
                        .clicked()
                    {
                        asks.push(Ask::Event(Event::Key(Key::Backspace)));
                    }
                    if ui.add(egui::Button::new("Cancel").min_size(vec2(84.0, 26.0))).on_hover_text("Esc").clicked() {
                        asks.push(Ask::Event(Event::Key(Key::Escape)));
                    }
                });
            }
            Stage::Running => running(ui, session, &job, &mut asks),
            Stage::Result => result(ui, session, unit, &mut asks),
        }
        if session.tool.shows_help() {
            ui.add_space(10.0);
            panels::heading(ui, "Keys");
            Grid::new("patch keys").num_columns(2).spacing(vec2(12.0, 3.0)).show(ui, |ui| {
                for line in HELP {
                    ui.monospace(line.key);
                    ui.add(egui::Label::new(line.what).wrap());
                    ui.end_row();
                }
            });
        }
        for ask in asks {
            match ask {
                Ask::Event(event) => self.patch_event(event),
                Ask::Zoom(p) => self.zoom_to(p),
            }
        }
    }
}

fn header(ui: &mut Ui, session: &PatchSession) {
    let t = theme::of(ui);
    ui.horizontal(|ui| {
        ui.label(RichText::new(&session.tool.options().name).color(t.text[2]).size(16.0));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let (text, color) = match session.tool.stage() {
                Stage::Idle => ("", t.text[1]),
                Stage::Side(_) => ("Picking", t.accent),
                Stage::Review => ("Review", t.accent),
                Stage::Running => ("Healing", t.warn),
                Stage::Result => ("Result", t.good),
            };
            ui.label(RichText::new(text).color(color).strong());
        });
    });
    ui.add_space(4.0);
}

fn notice(ui: &mut Ui, session: &PatchSession) {
    let Some(notice) = session.tool.notice() else { return };
    let t = theme::of(ui);
    let color = if notice.refused { t.warn } else { t.text[0] };
    egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(8.0).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal_top(|ui| {
            if notice.refused {
                icons::label(ui, Icon::Warning, t.warn, 16.0);
            }
            ui.add(egui::Label::new(RichText::new(&notice.text).color(color)).wrap());
        });
    });
    ui.add_space(4.0);
}

/// A disc with the number of a side, in its colour.
fn badge(ui: &mut Ui, side: usize) {
    let t = theme::of(ui);
    let (rect, _) = ui.allocate_exact_size(vec2(20.0, 20.0), Sense::hover());
    ui.painter().circle_filled(rect.center(), 9.0, t.sides[side]);
    let font = egui::FontId::proportional(12.5);
    let ink = Color32::from_rgb(0x0d, 0x10, 0x14);
    ui.painter().text(rect.center(), egui::Align2::CENTER_CENTER, side + 1, font, ink);
}

fn sides(ui: &mut Ui, session: &PatchSession, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    panels::heading(ui, "Sides");
    for (k, side) in session.tool.sides().iter().enumerate() {
        let active = session.tool.stage() == Stage::Side(k);
        let fill = if active { t.accent_fill } else { t.field };
        egui::Frame::new().fill(fill).corner_radius(5.0).inner_margin(egui::Margin::symmetric(7, 3)).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal(|ui| {
                badge(ui, k);
                let length: f64 = side.pieces.iter().map(|p| p.length()).sum();
                let text = match side.pieces.len() {
                    0 if active => "Click a curve".to_owned(),
                    0 => "Not picked".to_owned(),
                    1 => session.tool.length(length),
                    n => format!("{n} pieces, {}", session.tool.length(length)),
                };
                let color = if side.pieces.is_empty() { t.text[1] } else { t.text[2] };
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if !side.pieces.is_empty() {
                        let remove = icons::button(
                            ui,
                            Icon::Close,
                            &format!("Remove last piece of side {}", k + 1),
                            20.0,
                            false,
                        );
                        if remove.on_hover_text("Take its last piece out").clicked() {
                            asks.push(Ask::Event(Event::Remove { side: k, piece: side.pieces.len() - 1 }));
                        }
                        let mut mode = side.boundary;
                        let name = |m| if m == BoundaryMode::Keep { "Keep" } else { "Project" };
                        let combo = egui::ComboBox::from_id_salt(("boundary", k))
                            .width(70.0)
                            .selected_text(name(mode))
                            .show_ui(ui, |ui| {
                                ui.selectable_value(&mut mode, BoundaryMode::Keep, "Keep")
                                    .on_hover_text("The curve stays as picked");
                                ui.selectable_value(&mut mode, BoundaryMode::Project, "Project")
                                    .on_hover_text("The curve is projected onto the surfaces");
                            });
                        combo.response.accessible_name(format!("Boundary of side {}", k + 1));
                        if mode != side.boundary {
                            asks.push(Ask::Event(Event::Boundary { side: k, mode }));
                        }
                    }
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                        let row = egui::Button::new(RichText::new(text).color(color)).frame(false).truncate();
                        let row = ui.add(row).accessible_name(format!("Side {}", k + 1));
                        if row.on_hover_text(format!("Go to side {} ({})", k + 1, k + 1)).clicked() {
                            asks.push(Ask::Event(Event::Key(Key::Digit(k as u8 + 1))));
                        }
                    });
                });
            });
        });
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let picking = matches!(session.tool.stage(), Stage::Side(_));
        for (text, key, help) in [
            ("Flip", Key::Flip, "Turn the current side round (X)"),
            ("Chain", Key::Chain, "Add the curves that carry on smoothly (T)"),
            ("Segment", Key::Line, "A straight segment between two points (L)"),
            ("Polyline", Key::Polyline, "A polyline between points (P)"),
            ("Draw", Key::Draw, "A curve drawn across surfaces (W)"),
        ] {
            if ui.add_enabled(picking, egui::Button::new(text)).on_hover_text(help).clicked() {
                asks.push(Ask::Event(Event::Key(key)));
            }
        }
    });
    if session.tool.is_ambiguous() {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Two loops fit nearly as well").color(t.warn));
            if ui.button("Switch").on_hover_text("Tab").clicked() {
                asks.push(Ask::Event(Event::Key(Key::Tab)));
            }
        });
    }
    ui.add_space(6.0);
}

/// What the coloured edges in the view are, and how many there are of each kind.
fn edges(ui: &mut Ui, session: &PatchSession) {
    if !matches!(session.tool.stage(), Stage::Side(_)) {
        return;
    }
    let t = theme::of(ui);
    let Some(edges) = session.edges() else {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("Looking for free edges and gaps");
        });
        return;
    };
    let title =
        format!("Edges of the model: {} free, {} gaps", edges.count(EdgeKind::Free), edges.count(EdgeKind::Gap));
    egui::CollapsingHeader::new(title).id_salt("edges").show(ui, |ui| {
        Grid::new("edge kinds").num_columns(3).spacing(vec2(10.0, 3.0)).show(ui, |ui| {
            for kind in EdgeKind::ALL {
                let ([r, g, b], pattern) = kind.style();
                let [r, g, b] = [r, g, b].map(|c| (255.0 * c).round() as u8);
                stroke(ui, Color32::from_rgb(r, g, b), pattern);
                ui.label(RichText::new(kind.label()).color(t.text[0]));
                ui.label(RichText::new(edges.count(kind).to_string()).color(t.text[1]));
                ui.end_row();
            }
        });
        if !edges.complete {
            ui.label(RichText::new("The search was stopped; edges may be missing").color(t.warn));
        }
    });
    ui.add_space(6.0);
}

/// A short line as it is drawn in the view.
fn stroke(ui: &mut Ui, color: Color32, pattern: LinePattern) {
    let (rect, _) = ui.allocate_exact_size(vec2(30.0, 14.0), Sense::hover());
    let y = rect.center().y;
    let line = |x: egui::Rangef, y: f32, width: f32| {
        ui.painter().hline(x, y, egui::Stroke::new(width, color));
    };
    match pattern {
        LinePattern::Solid => line(rect.x_range(), y, 2.5),
        LinePattern::Thin => line(rect.x_range(), y, 1.2),
        LinePattern::Double => {
            line(rect.x_range(), y - 1.8, 1.2);
            line(rect.x_range(), y + 1.8, 1.2);
        }
        LinePattern::ShortDash => {
            for k in 0..4 {
                let x = rect.left() + 7.5 * k as f32;
                line(egui::Rangef::new(x, x + 4.0), y, 2.5);
            }
        }
    }
}

fn snaps(ui: &mut Ui, session: &mut PatchSession) {
    if !session.tool.wants_point() && session.trimming.is_none() {
        return;
    }
    panels::heading(ui, "Snap to");
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (k, kind) in SnapKind::ALL.into_iter().enumerate() {
            ui.toggle_value(&mut session.snaps[k], kind.label());
        }
    });
    ui.small("S turns snapping on and off, Ctrl suspends it");
    ui.add_space(6.0);
}

fn corners(ui: &mut Ui, session: &PatchSession, asks: &mut Vec<Ask>) {
    if session.tool.corners().is_empty() {
        return;
    }
    let t = theme::of(ui);
    panels::heading(ui, "Corners");
    for (k, corner) in session.tool.corners().iter().enumerate() {
        let [a, b] = corner.sides;
        let open = !corner.is_settled();
        egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(egui::Margin::symmetric(7, 3)).show(
            ui,
            |ui| {
                ui.set_width(ui.available_width());
                ui.horizontal(|ui| {
                    badge(ui, a);
                    badge(ui, b);
                    ui.label(RichText::new(format!("gap {}", session.tool.length(corner.gap))).color(t.text[0]));
                    ui.with_layout(Layout::right_to_left(Align::Center), |ui| match corner.state {
                        CornerState::Closed => {
                            icons::label(ui, Icon::Tick, t.good, 15.0).on_hover_text("Within the joining tolerance");
                        }
                        CornerState::ClosedBy(fix) => {
                            ui.label(RichText::new(fix.label()).color(t.good));
                        }
                        CornerState::Open => {
                            if ui.small_button("Zoom to").clicked() {
                                asks.push(Ask::Zoom(corner.point()));
                            }
                            ui.label(RichText::new("open").color(t.warn).strong());
                        }
                    });
                });
                if open || matches!(corner.state, CornerState::ClosedBy(_)) {
                    ui.horizontal_wrapped(|ui| {
                        ui.spacing_mut().item_spacing.x = 4.0;
                        for fix in corner.fixes() {
                            let on = corner.state == CornerState::ClosedBy(fix);
                            let help = match fix {
                                CornerFix::Average => "Both ends go to their middle",
                                CornerFix::MoveSide(_) => "The end of this side goes onto the other one",
                                CornerFix::Bridge => "A straight piece is put between the ends",
                                CornerFix::Trim => "Both sides end where they cross",
                            };
                            let button = egui::Button::selectable(on, RichText::new(fix.label()).small());
                            if ui.add(button).on_hover_text(help).clicked() {
                                asks.push(Ask::Event(Event::Fix { corner: k, fix }));
                            }
                        }
                    });
                }
            },
        );
    }
    ui.add_space(6.0);
}

fn samples(ui: &mut Ui, session: &mut PatchSession, asks: &mut Vec<Ask>) {
    if !session.tool.is_loop() {
        return;
    }
    let t = theme::of(ui);
    let Some(Some(sketch)) = session.sketch.value() else { return };
    let Some(grid) = &sketch.samples else { return };
    let mut counts = [0; 3];
    for sample in grid.values() {
        counts[match sample {
            Some(s) if s.status == Status::Several => 1,
            Some(_) => 0,
            None => 2,
        }] += 1;
    }
    let [hit, several, none] = counts;
    let slab = sketch.slab;
    panels::heading(ui, "Coarse projection");
    ui.horizontal(|ui| {
        for (count, what, color) in [(hit, "hit", t.good), (several, "several", t.accent), (none, "none", t.bad)] {
            ui.label(RichText::new(format!("{count} {what}")).color(color));
        }
        if session.sketch.is_stale() {
            ui.spinner();
        }
    });
    if none == hit + several + none {
        ui.add(
            egui::Label::new(
                RichText::new("Nothing to project on within the box of influence; enlarge it below").color(t.warn),
            )
            .wrap(),
        );
    }
    if ui
        .checkbox(&mut session.show_slab, format!("Show the box of influence ({} each way)", session.tool.length(slab)))
        .changed()
    {
        session.revision += 1;
    }
    if session.show_slab {
        let points: Vec<glam::DVec3> = session.tool.corners().iter().map(|c| c.point()).collect();
        let around: f64 = (0..points.len()).map(|k| points[k].distance(points[(k + 1) % points.len()])).sum();
        // HJR99 (7) takes an eighth of the way round.
        let natural = around / 8.0;
        let mut own = session.tool.options().slab.unwrap_or(slab);
        ui.horizontal(|ui| {
            let range = 0.02 * natural..=4.0 * natural;
            let slider = egui::Slider::new(&mut own, range).logarithmic(true).custom_formatter(|v, _| short(v));
            let slider = ui.add(slider).accessible_name("Thickness of the box of influence");
            if slider.on_hover_text("How far from the preview originals are looked for, each way").changed() {
                let options = Options { slab: Some(own), ..session.tool.options().clone() };
                asks.push(Ask::Event(Event::Options(Box::new(options))));
            }
            if session.tool.options().slab.is_some() && ui.small_button("From the corners").clicked() {
                let options = Options { slab: None, ..session.tool.options().clone() };
                asks.push(Ask::Event(Event::Options(Box::new(options))));
            }
        });
    }
    ui.add_space(6.0);
}

fn options(ui: &mut Ui, session: &PatchSession, visible: &[usize], surfaces: usize, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    let before = session.tool.options();
    let mut o: Options = before.clone();
    panels::heading(ui, "Options");
    let label = |ui: &mut Ui, text: &str| ui.label(RichText::new(text).color(t.text[1]));
    let tolerance = |ui: &mut Ui, value: &mut f64, name: &str| {
        let speed = 0.02 * value.abs().max(1e-12);
        let drag = DragValue::new(value).speed(speed).range(1e-15..=f64::MAX).custom_formatter(|v, _| short(v));
        ui.add(drag).accessible_name(name);
    };
    Grid::new("patch options").num_columns(2).spacing(vec2(12.0, 6.0)).min_col_width(110.0).show(ui, |ui| {
        label(ui, "Name");
        ui.add(egui::TextEdit::singleline(&mut o.name).desired_width(150.0)).accessible_name("Patch name");
        ui.end_row();
        label(ui, "Largest error");
        tolerance(ui, &mut o.tol, "Largest error wanted");
        ui.end_row();
        label(ui, "Project on");
        let text = |onto: &Option<Vec<usize>>| match onto {
            None if surfaces == 1 => "The only original".to_owned(),
            None => format!("All {surfaces} originals"),
            Some(list) => format!("{} of {surfaces} originals", list.len()),
        };
        let combo = egui::ComboBox::from_id_salt("onto").selected_text(text(&o.onto)).show_ui(ui, |ui| {
            ui.selectable_value(&mut o.onto, None, text(&None));
            ui.selectable_value(&mut o.onto, Some(visible.to_vec()), format!("The {} visible now", visible.len()));
        });
        combo.response.accessible_name("Project on");
        ui.end_row();
    });
    egui::CollapsingHeader::new("Advanced").id_salt("patch advanced").show(ui, |ui| {
        Grid::new("patch advanced").num_columns(2).spacing(vec2(12.0, 6.0)).min_col_width(110.0).show(ui, |ui| {
            label(ui, "Joining tolerance");
            tolerance(ui, &mut o.joining_tol, "Joining tolerance");
            ui.end_row();
            label(ui, "First M, N");
            let help = "The number of spans along each side that the refinement starts with";
            ui.add(DragValue::new(&mut o.min_resolution).range(1..=o.max_resolution.max(1)))
                .accessible_name("First number of spans")
                .on_hover_text(help);
            ui.end_row();
            label(ui, "Largest M, N");
            ui.add(DragValue::new(&mut o.max_resolution).range(8..=1024)).accessible_name("Largest number of spans");
            ui.end_row();
            label(ui, "Neighbours K");
            let help = "How many known projections an artificial one is made from";
            ui.add(DragValue::new(&mut o.neighbours).range(1..=64)).accessible_name("Neighbours").on_hover_text(help);
            ui.end_row();
            label(ui, "Hardy's R");
            ui.horizontal(|ui| {
                let mut own = o.radius.is_some();
                // Half the sum of the mean spacings of eight spans each way.
                if ui.checkbox(&mut own, "").accessible_name("Set Hardy's R").changed() {
                    o.radius = own.then_some(1.0 / 8.0);
                }
                match &mut o.radius {
                    Some(radius) => tolerance(ui, radius, "Hardy's R"),
                    None => {
                        ui.label(RichText::new("from the spacing").color(t.text[1]));
                    }
                }
            });
            ui.end_row();
            label(ui, "Hardy's gamma");
            tolerance(ui, &mut o.gamma, "Hardy's gamma");
            ui.end_row();
            label(ui, "Box of influence");
            ui.horizontal(|ui| {
                let mut own = o.slab.is_some();
                let natural = match session.sketch.value() {
                    Some(Some(sketch)) => sketch.slab,
                    _ => 100.0 * o.tol,
                };
                if ui.checkbox(&mut own, "").accessible_name("Set the box of influence").changed() {
                    o.slab = own.then_some(natural);
                }
                match &mut o.slab {
                    Some(slab) => tolerance(ui, slab, "Half the thickness of the box of influence"),
                    None => {
                        ui.label(RichText::new("from the corners").color(t.text[1]));
                    }
                }
            });
            ui.end_row();
        });
    });
    if o != *before {
        asks.push(Ask::Event(Event::Options(Box::new(o))));
    }
}

/// What a cancelled heal had finished.
fn partial(ui: &mut Ui, session: &PatchSession, asks: &mut Vec<Ask>) {
    let Some(patch) = session.tool.partial() else { return };
    let t = theme::of(ui);
    let [m, n] = patch.report.resolution;
    ui.add_space(6.0);
    egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(8.0).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let error = session.tool.length(patch.report.max_error);
        ui.label(RichText::new(format!("Cancelled at {m} x {n}, largest error {error}")).color(t.warn));
        let help = "Show the patch of the last resolution that was finished; it stays marked as incomplete (K)";
        if ui.button("Keep partial").on_hover_text(help).clicked() {
            asks.push(Ask::Event(Event::Key(Key::Keep)));
        }
    });
}

fn running(ui: &mut Ui, session: &PatchSession, active: &[crate::work::JobRecord], asks: &mut Vec<Ask>) {
    let job = session.healing.as_ref().map(|ticket| ticket.job());
    let done = job.map_or(0.0, |job| job.done());
    let phase = job.map(|job| job.current_phase()).filter(|p| !p.is_empty()).unwrap_or_else(|| "Starting".to_owned());
    let time =
        session.healing.as_ref().and_then(|ticket| active.iter().find(|r| r.id == ticket.id)).map(|r| r.elapsed());
    ui.add(ProgressBar::new(done as f32).desired_height(8.0));
    ui.horizontal(|ui| {
        ui.label(phase);
        if let Some(time) = time {
            ui.weak(format!("{:.1} s", time.as_secs_f64()));
        }
    });
    ui.add_space(6.0);
    if ui.add(egui::Button::new("Cancel").min_size(vec2(84.0, 26.0))).on_hover_text("Esc").clicked() {
        asks.push(Ask::Event(Event::Key(Key::Escape)));
    }
}

fn result(ui: &mut Ui, session: &mut PatchSession, unit: crate::model::document::Unit, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    let Some(shown) = &session.shown else { return };
    let report = &shown.patch.report;
    let tol = session.tool.options().tol;
    let length = |v: f64| super::super::status::length(v, unit);
    ui.horizontal(|ui| {
        let (icon, color, text) = match (shown.complete, report.reached) {
            (false, _) => (Icon::Warning, t.warn, "Incomplete: the job was cancelled".to_owned()),
            (true, true) => (Icon::Tick, t.good, format!("Within {}", length(tol))),
            (true, false) => (Icon::Warning, t.warn, format!("{} was not reached", length(tol))),
        };
        icons::label(ui, icon, color, 16.0);
        ui.label(RichText::new(text).color(color).strong());
    });
    ui.add_space(4.0);
    let samples = (report.projected + report.artificial + report.kept).max(1);
    let share = |n: usize| format!("{n} ({:.0} %)", 100.0 * n as f64 / samples as f64);
    Grid::new("result").num_columns(2).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
        panels::property(ui, "Largest error", length(report.max_error));
        panels::property(ui, "RMS error", length(report.rms));
        panels::property(ui, "Resolution", format!("{} x {}", report.resolution[0], report.resolution[1]));
        panels::property(ui, "Projected", share(report.projected));
        panels::property(ui, "Artificial", share(report.artificial));
        panels::property(ui, "Kept", share(report.kept));
        panels::property(ui, "Checked", format!("{}, {} over gaps left out", report.checked, report.skipped));
        for (name, gap, angle) in &shown.seams {
            panels::property(ui, "Shared with", format!("{name}: gap {}, normals within {angle:.2}°", length(*gap)));
        }
    });
    match shown.neighbours.len() {
        0 => {}
        1 => panels::empty(ui, "1 patch next to it was healed anew with it, so that both agree along their boundary"),
        n => panels::empty(ui, &format!("{n} patches next to it were healed anew with it, so that all agree")),
    }
    ui.add_space(6.0);
    panels::heading(ui, "Deviation");
    session.histogram(ui, unit);
    let mut event = None;
    let mut reset = false;
    ui.horizontal(|ui| {
        let mut on = session.tool.shows_deviation();
        if ui.checkbox(&mut on, "Map").on_hover_text("D").changed() {
            event = Some(Event::Key(Key::Deviation));
        }
        if ui.checkbox(&mut session.range.locked, "Lock range").on_hover_text("Keep it for the next patch").changed() {
            session.revision += 1;
        }
        reset = ui.button("Fit range").clicked();
    });
    let shown = session.shown.as_ref();
    let worst: Vec<_> = shown.map(|s| s.worst.clone()).unwrap_or_default();
    if !worst.is_empty() {
        ui.add_space(4.0);
        panels::heading(ui, "Worst points");
        for (k, check) in worst.iter().enumerate() {
            let text = format!("{}   {}", k + 1, length(check.distance));
            let button = egui::Button::new(text).min_size(vec2(ui.available_width(), 24.0)).right_text("Zoom to");
            if ui.add(button).accessible_name(format!("Worst point {}", k + 1)).clicked() {
                asks.push(Ask::Zoom(check.point));
            }
        }
    }
    if let Some(shown) = shown
        && shown.patch.report.history.len() > 1
    {
        egui::CollapsingHeader::new("Refinement").show(ui, |ui| {
            Grid::new("steps").num_columns(2).spacing(vec2(14.0, 3.0)).show(ui, |ui| {
                for step in &shown.patch.report.history {
                    panels::property(
                        ui,
                        &format!("{} x {}", step.resolution[0], step.resolution[1]),
                        length(step.max_error),
                    );
                }
            });
        });
    }
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        if primary(ui, "Accept").on_hover_text("Enter").clicked() {
            asks.push(Ask::Event(Event::Key(Key::Enter)));
        }
        let button = |ui: &mut Ui, text| ui.add(egui::Button::new(text).min_size(vec2(84.0, 26.0)));
        if button(ui, "Adjust").on_hover_text("Back to the sides; 1-4 goes to one of them").clicked() {
            asks.push(Ask::Event(Event::Key(Key::Digit(1))));
        }
        if button(ui, "Discard").on_hover_text("Esc").clicked() {
            asks.push(Ask::Event(Event::Key(Key::Escape)));
        }
    });
    if reset {
        session.reset_range();
    }
    if let Some(event) = event {
        asks.push(Ask::Event(event));
    }
}
