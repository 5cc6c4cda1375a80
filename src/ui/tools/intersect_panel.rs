//! The Tool page of the intersection tools: what goes in, progress, certificate, list, cursor, tangency inspector.

use std::sync::Arc;

use egui::{Align, Button, Grid, Layout, ProgressBar, RichText, ScrollArea, Sense, Slider, Ui, vec2};

use super::super::actions::{self, Action};
use super::super::dialogs::primary;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::status::{length, short};
use super::super::{panels, theme};
use super::Tool;
use super::intersect::{FieldKind, IntersectSession};
use super::intersect_overlay::swatch;
use crate::kernel::intersect::Engine;
use crate::kernel::mesh::body::Body;
use crate::model::document::{Document, EntityId, Unit};
use crate::model::examples::coaxial;
use crate::view::intersection::certificate::{Verdict, certificate};
use crate::view::intersection::{Found, Item, OnCurve, Task, body_of, list};

/// Rows of one group that are listed.
const ROWS: usize = 200;

/// What a click in the panel asks for.
enum Ask {
    Run,
    Cancel,
    Choose(Item),
    TrueScale(usize),
    Field(FieldKind),
    Forget,
    Leave,
    Turn(f64),
    Biarcs(bool),
    LayOver(bool),
    Act(Action),
}

impl Editor {
    /// Draws the page.
    pub fn intersect_panel(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let gap_tol = self.document().tolerances().gap;
        let angle = coaxial::angle(self.document());
        let document = self.document().clone();
        let active = self.jobs.active();
        let can_keep = self.has_found_curves();
        let Tool::Intersect(session) = &mut self.tool else { return };
        let mut asks = Vec::new();
        let title = if session.picks.task == Task::Itself { "Self-intersection" } else { "Intersect" };
        panels::heading(ui, title);
        if session.picks.task == Task::Itself {
            miter_help(ui);
        }
        if let Some(degrees) = angle.filter(|_| session.picks.task == Task::Sets) {
            demo(ui, degrees, session.is_stale(), &mut asks);
        }
        notices(ui, session, &document);
        if let Some(ticket) = &session.running {
            let time = active.iter().find(|r| r.id == ticket.id).map(crate::work::JobRecord::elapsed);
            running(ui, ticket.job(), time, &mut asks);
        } else if let Some(found) = session.found.clone() {
            result(ui, session, &found, unit, gap_tol, can_keep, &mut asks);
        } else {
            picking(ui, session, &document, &mut asks);
        }
        self.plane_panel(ui, unit);
        let ctx = ui.ctx().clone();
        for ask in asks {
            let Tool::Intersect(session) = &mut self.tool else { return };
            match ask {
                Ask::Run => self.run_intersect(),
                Ask::Cancel => session.running.iter().for_each(crate::work::Ticket::cancel),
                Ask::Choose(item) => {
                    session.choose(Some(item), None);
                    self.zoom_to_item(item);
                }
                Ask::TrueScale(miter) => self.zoom_to_true_scale(miter),
                Ask::Field(kind) => self.shade_intersect(kind),
                Ask::Forget => session.forget(),
                Ask::Leave => self.leave_tool(),
                Ask::Turn(degrees) => self.turn_cylinder(degrees),
                Ask::Biarcs(on) => self.fit_biarcs(on),
                Ask::LayOver(on) => self.lay_over(on),
                Ask::Act(action) => self.perform(&ctx, action),
            }
        }
    }
}

fn miter_help(ui: &mut Ui) {
    let t = theme::of(ui);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Curves end at the border or in a").color(t.text[1]));
        ui.label(RichText::new("miter point").color(t.accent).underline()).on_hover_text(
            "A miter point is where a self-intersection curve begins: the two places of the surface that meet along the \
             curve run together into one, and Su x Sv vanishes there. The surface is not smooth in it, as at the tip of \
             a cross-cap or where a pleat begins. It is drawn as a triangle.",
        );
    });
    ui.add_space(4.0);
}

/// The angle of the demo.
fn demo(ui: &mut Ui, degrees: f64, stale: bool, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(8.0).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal(|ui| {
            ui.label(RichText::new("Angle between the axes").color(t.text[0]));
            if stale {
                ui.spinner();
            }
        });
        let mut value = degrees;
        let slider = Slider::new(&mut value, coaxial::RANGE[0]..=coaxial::RANGE[1])
            .logarithmic(true)
            .smallest_positive(coaxial::RANGE[0])
            .custom_formatter(|v, _| short(v))
            .suffix("°");
        ui.spacing_mut().slider_width = (ui.available_width() - 90.0).max(80.0);
        if ui.add(slider).accessible_name("Angle between the cylinders").changed() && value != degrees {
            asks.push(Ask::Turn(value));
        }
        let text = "Two ellipses cross at two points for every angle, down to 0.00001°.";
        ui.add(egui::Label::new(RichText::new(text).color(t.text[1]).small()).wrap());
    });
    ui.add_space(6.0);
}

fn notices(ui: &mut Ui, session: &IntersectSession, document: &Document) {
    let t = theme::of(ui);
    let changed = session.found.as_ref().is_some_and(|found| {
        !session.is_stale()
            && found.numbers().iter().filter_map(|&n| found.subjects.get(n)).any(|s| {
                let now = document.get(s.id).and_then(|e| body_of(e));
                now.is_none_or(|body| !same_body(&body, &s.body))
            })
    });
    let changed = changed.then_some("The model has changed since this was computed. Enter computes it again");
    let died = session.live.error().map(|_| "The last computation ran into a bug; what is shown is older");
    let texts = [session.error.as_deref(), session.picks.notice.as_deref(), changed, died];
    for text in texts.into_iter().flatten() {
        egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(8.0).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal_top(|ui| {
                icons::label(ui, Icon::Warning, t.warn, 16.0);
                ui.add(egui::Label::new(RichText::new(text).color(t.warn)).wrap());
            });
        });
        ui.add_space(4.0);
    }
}

/// Whether two bodies are one and the same.
fn same_body(a: &Body, b: &Body) -> bool {
    match (a, b) {
        (Body::Surface(a), Body::Surface(b)) => Arc::ptr_eq(a, b),
        (Body::Face(a), Body::Face(b)) => Arc::ptr_eq(a, b),
        (Body::Facets(a), Body::Facets(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

fn picking(ui: &mut Ui, session: &mut IntersectSession, document: &Document, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    let name = |id: &EntityId| document.get(*id).map_or_else(|| "(deleted)".to_owned(), |e| e.name.clone());
    let sides: &[(usize, &str)] = match session.picks.task {
        Task::Sets => &[(0, "First set"), (1, "Second set")],
        Task::Itself => &[(0, "Surfaces")],
        Task::Pairs => &[],
    };
    for &(side, title) in sides {
        let active = session.picks.task == Task::Itself || session.picks.filling == side;
        let ids = session.picks.sides[side].clone();
        let fill = if active { t.accent_fill } else { t.field };
        let shown = egui::Frame::new().fill(fill).corner_radius(5.0).inner_margin(egui::Margin::symmetric(8, 5)).show(
            ui,
            |ui| {
                ui.set_width(ui.available_width());
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
                    ui.painter().circle_filled(rect.center(), 6.0, t.sides[side]);
                    ui.label(RichText::new(title).color(t.text[2]).strong());
                    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                        let text = match ids.len() {
                            0 => "none yet".to_owned(),
                            1 => "1 picked".to_owned(),
                            n => format!("{n} picked"),
                        };
                        ui.label(RichText::new(text).color(t.text[1]));
                    });
                });
                for id in ids.iter().take(8) {
                    ui.label(RichText::new(name(id)).color(t.text[0]));
                }
                if ids.len() > 8 {
                    ui.label(RichText::new(format!("and {} more", ids.len() - 8)).color(t.text[1]));
                }
            },
        );
        let id = ui.scope_id().with(("set", side));
        let area = ui.interact(shown.response.rect, id, Sense::click());
        area.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, active, format!("Pick {title}")));
        if area.on_hover_text("The next click in the view goes here (Tab)").clicked() {
            session.picks.fill(side);
        }
        ui.add_space(4.0);
    }
    engine(ui, session, document);
    let ready = session.picks.chosen(document);
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let text = if session.picks.task == Task::Itself { "Search" } else { "Intersect" };
        ui.add_enabled_ui(ready.is_ok(), |ui| {
            let button = primary(ui, text).on_hover_text("Enter");
            let why = ready.as_ref().err().map_or_else(String::new, |e| format!("Not yet: {e}"));
            if button.on_disabled_hover_text(why).clicked() {
                asks.push(Ask::Run);
            }
        });
        if session.picks.task == Task::Sets && ui.button("Swap").on_hover_text("X").clicked() {
            session.picks.swap();
            session.changed();
        }
        if ui.button("Leave").on_hover_text("Esc").clicked() {
            asks.push(Ask::Leave);
        }
    });
    ui.add_space(10.0);
    panels::heading(ui, "Or");
    let others = match session.picks.task {
        Task::Itself => &[Action::SearchSelfIntersections, Action::IntersectTool][..],
        _ => &[Action::IntersectVisible, Action::SelfIntersectTool, Action::CoaxialDemo],
    };
    for &action in others {
        let info = actions::info(action);
        let button = Button::new(info.name).min_size(vec2(ui.available_width(), 26.0));
        if ui.add(button).on_hover_text(info.help).clicked() {
            asks.push(Ask::Act(action));
        }
    }
}

/// On what is computed.
fn engine(ui: &mut Ui, session: &mut IntersectSession, document: &Document) {
    if session.picks.task == Task::Itself {
        return;
    }
    let t = theme::of(ui);
    let is_mesh = |id: &EntityId| document.get(*id).is_some_and(|e| e.facets().is_some());
    let meshes = session.picks.sides.iter().flatten().any(is_mesh);
    let now = session.picks.engine.unwrap_or(if meshes { Engine::Mesh } else { Engine::Bvh });
    ui.horizontal(|ui| {
        ui.label(RichText::new("On").color(t.text[1]));
        for (engine, name, help) in [
            (Engine::Bvh, "Exact surfaces", "With a proof that no branch is missing"),
            (Engine::Mesh, "Triangles", "Surfaces are cut into triangles first, and the curves refined on them"),
        ] {
            let can = engine == Engine::Mesh || !meshes;
            let button = Button::selectable(now == engine, name);
            let shown = ui.add_enabled(can, button).on_hover_text(help);
            if shown.on_disabled_hover_text("A mesh that was picked has no exact surface").clicked() {
                session.picks.engine = Some(engine);
            }
        }
    });
    // What is chosen by hand holds until a mesh makes it impossible.
    if meshes && session.picks.engine == Some(Engine::Bvh) {
        session.picks.engine = None;
    }
}

fn running(ui: &mut Ui, job: &crate::kernel::job::Job, time: Option<std::time::Duration>, asks: &mut Vec<Ask>) {
    let phase = Some(job.current_phase()).filter(|p| !p.is_empty()).unwrap_or_else(|| "Starting".to_owned());
    ui.add(ProgressBar::new(job.done() as f32).desired_height(8.0));
    ui.horizontal(|ui| {
        ui.label(if job.is_cancelled() { "Stopping".to_owned() } else { phase });
        if let Some(time) = time {
            ui.weak(format!("{:.1} s", time.as_secs_f64()));
        }
    });
    ui.add_space(6.0);
    let stop = Button::new("Stop").min_size(vec2(84.0, 26.0));
    if ui.add_enabled(!job.is_cancelled(), stop).on_hover_text("Esc. What is ready is kept and marked").clicked() {
        asks.push(Ask::Cancel);
    }
}

fn result(
    ui: &mut Ui,
    session: &mut IntersectSession,
    found: &Found,
    unit: Unit,
    gap_tol: f64,
    can_keep: bool,
    asks: &mut Vec<Ask>,
) {
    let t = theme::of(ui);
    let write = |v: f64| length(v, unit);
    let words = certificate(found, &write);
    let (icon, color) = match words.verdict {
        Verdict::Proved => (Icon::Tick, t.good),
        Verdict::Open | Verdict::Stopped => (Icon::Warning, t.warn),
    };
    ui.horizontal(|ui| {
        icons::label(ui, icon, color, 16.0);
        ui.label(RichText::new(&words.headline).color(color).strong());
    });
    for sentence in words.sentences.iter().chain(&found.warnings) {
        ui.add(egui::Label::new(RichText::new(sentence).color(t.text[1]).small()).wrap());
    }
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        let name = if session.chosen_curve().is_some() { "Keep curve" } else { "Keep curves" };
        let help = "Make it a free curve of the model, to be picked as a side of a patch (K)";
        if ui.add_enabled(can_keep, Button::new(name)).on_hover_text(help).clicked() {
            asks.push(Ask::Act(Action::KeepCurves));
        }
        let help = "Write them as IGES with their surfaces and the curves on these, or as a project";
        if ui.add_enabled(can_keep, Button::new("Export…")).on_hover_text(help).clicked() {
            asks.push(Ask::Act(Action::ExportCurves));
        }
        if ui.button("Again").on_hover_text("Enter").clicked() {
            asks.push(Ask::Run);
        }
        if session.picks.task == Task::Itself && ui.button("Inspect the search").clicked() {
            asks.push(Ask::Act(Action::InspectSearch));
        }
        if ui.button("Other surfaces").on_hover_text("Backspace").clicked() {
            asks.push(Ask::Forget);
        }
    });
    ui.add_space(6.0);
    rows(ui, session, found, &write, asks);
    cursor(ui, session, found, unit, gap_tol);
    biarcs(ui, session, unit, asks);
    other_engine(ui, session, found, unit, asks);
    fields(ui, session, asks);
}

fn rows(ui: &mut Ui, session: &IntersectSession, found: &Found, write: &dyn Fn(f64) -> String, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    let dark = ui.visuals().dark_mode;
    let groups = list::groups(found, write);
    if groups.is_empty() {
        return;
    }
    // What is below is about what is chosen here, and both should be seen at once.
    let height = 232.0;
    egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(6.0).show(ui, |ui| {
        ScrollArea::vertical().id_salt("found").max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            for group in &groups {
                ui.horizontal(|ui| {
                    if let Some(class) = group.class {
                        let (rect, _) = ui.allocate_exact_size(vec2(30.0, 12.0), Sense::hover());
                        swatch(ui.painter(), rect.left_center(), rect.right_center(), class.style(dark));
                    }
                    let open = group.class == Some(crate::view::intersection::Class::Unresolved);
                    let color = if open { t.warn } else { t.text[2] };
                    ui.label(RichText::new(format!("{} ({})", group.title, group.rows.len())).color(color).strong());
                });
                for row in group.rows.iter().take(ROWS) {
                    let on = session.chosen() == Some(row.item);
                    let fill = if on { t.accent_fill } else { t.field };
                    let shown = egui::Frame::new().fill(fill).corner_radius(4.0).inner_margin(4.0).show(ui, |ui| {
                        ui.set_width(ui.available_width());
                        ui.add(egui::Label::new(RichText::new(&row.title).color(t.text[0])).truncate());
                        ui.add(egui::Label::new(RichText::new(&row.detail).color(t.text[1]).small()).wrap());
                    });
                    let id = ui.scope_id().with(("found", row.item));
                    let area = ui.interact(shown.response.rect, id, Sense::click());
                    area.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, on, &row.title));
                    if area.on_hover_text("Choose it and zoom to it").clicked() {
                        asks.push(Ask::Choose(row.item));
                    }
                    if let Item::Miter(k) = row.item
                        && ui.small_button("Zoom to true scale").clicked()
                    {
                        asks.push(Ask::TrueScale(k));
                    }
                }
                if group.rows.len() > ROWS {
                    ui.label(RichText::new(format!("and {} more", group.rows.len() - ROWS)).color(t.text[1]));
                }
            }
        });
    });
    ui.add_space(6.0);
}

/// The cursor on the chosen curve and what the surfaces do there.
fn cursor(ui: &mut Ui, session: &mut IntersectSession, found: &Found, unit: Unit, gap_tol: f64) {
    let write = |v: f64| length(v, unit);
    let place = session.cursor.and_then(|c| Some((c, c.point(found)?)));
    if place.is_none() && session.contact.is_none() {
        return;
    }
    let t = theme::of(ui);
    panels::heading(ui, "Cursor");
    if let Some((on, _)) = place {
        let mut fraction = on.fraction(found);
        let slider = Slider::new(&mut fraction, 0.0..=1.0).show_value(false);
        ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(80.0);
        if ui.add(slider).accessible_name("Place along the curve").changed() {
            session.put_cursor(OnCurve::at_fraction(found, on.curve, fraction));
        }
    }
    let three = |p: glam::DVec3| format!("{:.6}  {:.6}  {:.6}", p.x, p.y, p.z);
    Grid::new("cursor").num_columns(2).spacing(vec2(12.0, 3.0)).show(ui, |ui| {
        if let Some((_, p)) = session.cursor.and_then(|c| Some((c, c.point(found)?))) {
            panels::property(ui, "Point", three(p.xyz));
            panels::property(ui, &format!("On {}", found.name(p.a)), format!("u {:.6}  v {:.6}", p.uv.x, p.uv.y));
            panels::property(ui, &format!("On {}", found.name(p.b)), format!("u {:.6}  v {:.6}", p.st.x, p.st.y));
        }
        match &session.contact {
            Some(Ok(c)) => {
                let per = match unit.symbol() {
                    "" => String::new(),
                    symbol => format!(" 1/{symbol}"),
                };
                let pair = |k: [f64; 2]| format!("{}, {}{per}", short(k[0]), short(k[1]));
                panels::property(ui, "Signed gap", write(c.gap));
                panels::property(ui, "Angle", format!("{}°", short(c.angle.to_degrees())));
                panels::property(ui, "Curvatures, first", pair(c.a.curvature.k));
                panels::property(ui, "Curvatures, second", pair(c.b.curvature.k));
                panels::property(ui, "Difference", pair(c.relative));
                let radii = |l: &crate::view::intersection::contact::Local| match l.radii() {
                    Some([major, minor]) => format!("R {}, r {}", write(major), write(minor)),
                    None => "flat in one direction".to_owned(),
                };
                panels::property(ui, "Torus, first", radii(&c.a));
                panels::property(ui, "Torus, second", radii(&c.b));
            }
            Some(Err(why)) => panels::property(ui, "Contact", *why),
            None => {}
        }
    });
    if let Some(Ok(c)) = &session.contact {
        ui.add(egui::Label::new(RichText::new(c.words(gap_tol)).color(t.text[0])).wrap());
    }
    let help = "The patches of the two tori that osculate the surfaces at the cursor, and the normals of both";
    if ui.checkbox(&mut session.tori, "Tori and normals at the cursor").on_hover_text(help).changed() {
        session.put_cursor(session.cursor);
    }
    if let Some(tangency) = &session.tangency {
        let text = match (&tangency.point, tangency.family) {
            (Some(p), _) => format!("Nearest common normal of the surfaces: gap {}", write(p.gap)),
            (None, true) => "The common normals of the tori form a family here".to_owned(),
            (None, false) => "The surfaces have no common normal near here".to_owned(),
        };
        ui.add(egui::Label::new(RichText::new(text).color(t.text[1]).small()).wrap());
    }
    ui.add_space(6.0);
}

/// The chosen curve as biarcs, on demand.
fn biarcs(ui: &mut Ui, session: &IntersectSession, unit: Unit, asks: &mut Vec<Ask>) {
    let Some(curve) = session.chosen_curve() else { return };
    let t = theme::of(ui);
    let fit = session.biarcs.value().filter(|fit| fit.as_ref().is_ok_and(|f| f.curve == curve) || fit.is_err());
    let mut on = fit.is_some() || session.biarcs.is_stale();
    ui.horizontal(|ui| {
        let help = "Matched circular arcs in both parameter domains that join with a common tangent, with a bound of \
                    their error";
        if ui.checkbox(&mut on, "Biarcs in both domains").on_hover_text(help).changed() {
            asks.push(Ask::Biarcs(on));
        }
        if session.biarcs.is_stale() {
            ui.spinner();
        }
    });
    match fit {
        Some(Ok(fit)) => {
            let within = if fit.within { "" } else { ", more than asked for" };
            let text = format!("{} biarcs in each domain, within {}{within}", fit.count, length(fit.bound, unit));
            ui.add(egui::Label::new(RichText::new(text).color(t.text[1]).small()).wrap());
        }
        Some(Err(why)) => {
            ui.add(egui::Label::new(RichText::new(why).color(t.warn)).wrap());
        }
        None => {}
    }
    ui.add_space(6.0);
}

/// The other engine's result over this one, on demand.
fn other_engine(ui: &mut Ui, session: &IntersectSession, found: &Found, unit: Unit, asks: &mut Vec<Ask>) {
    if found.with_itself {
        return;
    }
    let t = theme::of(ui);
    let mut on = session.other.value().is_some() || session.other.is_stale();
    let (text, name) = match found.engine {
        Engine::Bvh => ("Lay the result on triangles over it", "On triangles"),
        Engine::Mesh => ("Lay the result on exact surfaces over it", "On exact surfaces"),
    };
    let used = session.picks.sides.iter().flatten().filter_map(|id| found.number(*id));
    let meshes = found.engine == Engine::Mesh
        && used.chain(found.numbers()).any(|n| found.subjects.get(n).is_some_and(|s| s.surface().is_none()));
    ui.horizontal(|ui| {
        let check = egui::Checkbox::new(&mut on, text);
        let shown = ui.add_enabled(!meshes, check).on_hover_text("Both engines' curves at once: this one dashed");
        if shown.on_disabled_hover_text("A mesh has no exact surface").changed() {
            asks.push(Ask::LayOver(on));
        }
        if session.other.is_stale() {
            ui.spinner();
        }
    });
    let say = |ui: &mut Ui, text: String, color| {
        ui.add(egui::Label::new(RichText::new(text).color(color).small()).wrap());
    };
    match session.other.value() {
        Some(Ok(both)) => {
            let (own, other) = (found.result.curves.len(), both.other.result.curves.len());
            let many = |n: usize| if n == 1 { "1 curve".to_owned() } else { format!("{n} curves") };
            let apart = match both.apart {
                d if d.is_finite() => format!("at most {} apart", length(d, unit)),
                _ => "only one has curves".to_owned(),
            };
            let lengths = both.lengths.map(|l| length(l, unit));
            let text = format!(
                "{name}: {}, {} long; here {}, {} long; {apart}",
                many(other),
                lengths[1],
                many(own),
                lengths[0]
            );
            say(ui, text, if own == other && both.apart.is_finite() { t.text[1] } else { t.warn });
            if !both.other.result.complete {
                say(ui, format!("{name} the result is not complete"), t.warn);
            }
        }
        Some(Err(why)) => say(ui, why.clone(), t.warn),
        None => {}
    }
    ui.add_space(6.0);
}

/// The fields that can be shaded.
fn fields(ui: &mut Ui, session: &mut IntersectSession, asks: &mut Vec<Ask>) {
    let t = theme::of(ui);
    panels::heading(ui, "Shade");
    ui.horizontal(|ui| {
        let choices: &[(FieldKind, &str, &str)] = if session.picks.task == Task::Itself {
            &[
                (FieldKind::None, "Nothing", "Plain surfaces"),
                (FieldKind::Area, "|Su x Sv|", "Dark where it vanishes: at miter points, cusps and poles"),
            ]
        } else {
            &[
                (FieldKind::None, "Nothing", "Plain surfaces"),
                (FieldKind::Gap, "Gap", "Signed distance of the first set from the second, in steps of ten (G)"),
                (FieldKind::Area, "|Su x Sv|", "Dark where it vanishes: at cusps and poles"),
            ]
        };
        for &(kind, name, help) in choices {
            let on = session.field == kind;
            if ui.add(Button::selectable(on, name)).on_hover_text(help).clicked() && !on {
                asks.push(Ask::Field(kind));
            }
        }
        if session.shaded.is_stale() {
            ui.spinner();
        }
    });
    if session.field == FieldKind::None {
        return;
    }
    if session.shaded.value().is_some_and(|(_, meshes)| meshes.is_empty()) {
        let text = "There is nothing to shade: the surfaces of the sets are not in the result";
        ui.add(egui::Label::new(RichText::new(text).color(t.warn)).wrap());
    }
    ui.spacing_mut().slider_width = 130.0;
    let decades = Slider::new(&mut session.decades, 2..=12).text("powers of ten");
    if ui.add(decades).accessible_name("Powers of ten").changed() {
        session.changed();
    }
    if session.field == FieldKind::Gap {
        let slider = Slider::new(&mut session.exaggeration, 0.0..=6.0)
            .custom_formatter(|v, _| format!("x {}", short(10.0_f64.powf(v))))
            .text("exaggeration");
        let help = "Draws the gap so many times as large; moved by a tenth of the model at most";
        if ui.add(slider).accessible_name("Exaggeration").on_hover_text(help).changed() {
            session.changed();
        }
    }
}
