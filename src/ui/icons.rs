//! Icons, drawn as strokes on a 16 x 16 grid so that they take the text's colour and stay sharp at any scale.

use egui::{Color32, Pos2, Rect, Response, Sense, Stroke, Ui, vec2};

use super::theme;

/// A stroke of an icon, in units of the grid.
enum Mark {
    /// A polyline.
    Line(&'static [(f32, f32)]),
    /// A circular arc: centre, radius, start and end in degrees (0 to the right, clockwise on the screen).
    Arc((f32, f32), f32, f32, f32),
    /// A filled convex polygon.
    Fill(&'static [(f32, f32)]),
    /// A filled disc.
    Dot((f32, f32), f32),
}

/// The icons of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say what they show")]
pub enum Icon {
    Open,
    Save,
    Undo,
    Redo,
    Select,
    Patch,
    FrameAll,
    FrameSelection,
    Shaded,
    Wireframe,
    Xray,
    Edges,
    Iso,
    Section,
    Eye,
    EyeOff,
    Isolate,
    Surface,
    Curve,
    Mesh,
    Block,
    Close,
    Tick,
    Warning,
    Cross,
    Search,
    Trash,
    Projection,
    Inspect,
    Intersect,
    SelfIntersect,
    Measure,
}

use Mark::{Arc, Dot, Fill, Line};

impl Icon {
    fn marks(self) -> &'static [Mark] {
        match self {
            Self::Open => &[
                Line(&[(2.0, 12.5), (2.0, 4.0), (6.0, 4.0), (7.5, 5.7), (12.5, 5.7), (12.5, 7.7)]),
                Line(&[(2.0, 12.8), (4.2, 7.8), (14.3, 7.8), (12.2, 12.8), (2.0, 12.8)]),
            ],
            Self::Save => &[
                Line(&[(2.7, 2.7), (11.2, 2.7), (13.3, 4.8), (13.3, 13.3), (2.7, 13.3), (2.7, 2.7)]),
                Line(&[(5.0, 2.9), (5.0, 6.2), (10.3, 6.2), (10.3, 2.9)]),
                Line(&[(4.7, 13.2), (4.7, 9.0), (11.3, 9.0), (11.3, 13.2)]),
            ],
            Self::Undo => &[
                Line(&[(6.0, 2.8), (2.8, 6.0), (6.0, 9.2)]),
                Line(&[(3.0, 6.0), (9.8, 6.0)]),
                Arc((9.8, 9.3), 3.3, -90.0, 90.0),
                Line(&[(9.8, 12.6), (6.0, 12.6)]),
            ],
            Self::Redo => &[
                Line(&[(10.0, 2.8), (13.2, 6.0), (10.0, 9.2)]),
                Line(&[(13.0, 6.0), (6.2, 6.0)]),
                Arc((6.2, 9.3), 3.3, 90.0, 270.0),
                Line(&[(6.2, 12.6), (10.0, 12.6)]),
            ],
            Self::Select => &[Line(&[
                (4.0, 2.0),
                (4.0, 12.5),
                (6.8, 9.9),
                (8.7, 14.0),
                (10.3, 13.2),
                (8.5, 9.3),
                (12.0, 8.9),
                (4.0, 2.0),
            ])],
            Self::Patch => &[
                Line(&[(2.8, 4.0), (5.5, 3.2), (8.5, 3.6), (13.0, 2.8)]),
                Line(&[(13.0, 2.8), (12.5, 6.5), (13.2, 9.5), (12.8, 12.8)]),
                Line(&[(12.8, 12.8), (9.5, 12.2), (6.0, 13.2), (3.2, 12.6)]),
                Line(&[(3.2, 12.6), (3.6, 9.0), (2.6, 7.0), (2.8, 4.0)]),
                Dot((2.8, 4.0), 1.5),
                Dot((13.0, 2.8), 1.5),
                Dot((12.8, 12.8), 1.5),
                Dot((3.2, 12.6), 1.5),
            ],
            Self::FrameAll => &[
                Line(&[(2.5, 5.5), (2.5, 2.5), (5.5, 2.5)]),
                Line(&[(10.5, 2.5), (13.5, 2.5), (13.5, 5.5)]),
                Line(&[(13.5, 10.5), (13.5, 13.5), (10.5, 13.5)]),
                Line(&[(5.5, 13.5), (2.5, 13.5), (2.5, 10.5)]),
                Arc((8.0, 8.0), 2.6, 0.0, 360.0),
            ],
            Self::FrameSelection => &[
                Line(&[(2.5, 5.5), (2.5, 2.5), (5.5, 2.5)]),
                Line(&[(10.5, 2.5), (13.5, 2.5), (13.5, 5.5)]),
                Line(&[(13.5, 10.5), (13.5, 13.5), (10.5, 13.5)]),
                Line(&[(5.5, 13.5), (2.5, 13.5), (2.5, 10.5)]),
                Dot((8.0, 8.0), 2.6),
            ],
            Self::Shaded => &[
                Arc((8.0, 8.0), 5.5, 0.0, 360.0),
                Fill(&[
                    (8.0, 2.5),
                    (11.9, 4.1),
                    (13.5, 8.0),
                    (11.9, 11.9),
                    (8.0, 13.5),
                    (9.6, 10.8),
                    (10.1, 8.0),
                    (9.6, 5.2),
                ]),
            ],
            Self::Wireframe => &[
                Line(&[(2.5, 2.5), (13.5, 2.5), (13.5, 13.5), (2.5, 13.5), (2.5, 2.5)]),
                Line(&[(6.2, 2.5), (6.2, 13.5)]),
                Line(&[(9.8, 2.5), (9.8, 13.5)]),
                Line(&[(2.5, 6.2), (13.5, 6.2)]),
                Line(&[(2.5, 9.8), (13.5, 9.8)]),
            ],
            Self::Xray => &[
                Line(&[(2.5, 5.5), (10.5, 5.5), (10.5, 13.5), (2.5, 13.5), (2.5, 5.5)]),
                Line(&[(5.5, 2.5), (13.5, 2.5), (13.5, 10.5), (5.5, 10.5), (5.5, 2.5)]),
            ],
            Self::Edges => &[
                Line(&[(8.0, 2.0), (13.5, 4.8), (13.5, 11.2), (8.0, 14.0), (2.5, 11.2), (2.5, 4.8), (8.0, 2.0)]),
                Line(&[(2.5, 4.8), (8.0, 7.6), (13.5, 4.8)]),
                Line(&[(8.0, 7.6), (8.0, 14.0)]),
            ],
            Self::Iso => &[
                Line(&[(2.0, 12.0), (4.5, 9.8), (8.0, 9.6), (11.0, 9.0), (14.0, 6.5)]),
                Line(&[(2.0, 8.8), (4.5, 6.6), (8.0, 6.4), (11.0, 5.8), (14.0, 3.3)]),
                Line(&[(5.2, 13.4), (4.6, 9.8), (5.2, 4.0)]),
                Line(&[(11.2, 12.4), (10.8, 9.0), (11.2, 3.0)]),
            ],
            Self::Section => &[
                Arc((8.0, 8.0), 5.0, 100.0, 260.0),
                Line(&[(8.5, 1.8), (8.5, 14.2)]),
                Line(&[(11.2, 4.5), (11.2, 4.6)]),
                Line(&[(11.0, 4.2), (12.2, 5.4)]),
                Line(&[(13.0, 7.2), (13.0, 8.8)]),
                Line(&[(12.2, 10.6), (11.0, 11.8)]),
            ],
            Self::Eye => &[
                Line(&[
                    (1.8, 8.0),
                    (4.0, 5.4),
                    (8.0, 3.9),
                    (12.0, 5.4),
                    (14.2, 8.0),
                    (12.0, 10.6),
                    (8.0, 12.1),
                    (4.0, 10.6),
                    (1.8, 8.0),
                ]),
                Dot((8.0, 8.0), 2.0),
            ],
            Self::EyeOff => &[
                Line(&[(1.8, 7.0), (4.2, 9.6), (8.0, 10.8), (11.8, 9.6), (14.2, 7.0)]),
                Line(&[(4.4, 9.8), (3.0, 12.0)]),
                Line(&[(8.0, 10.9), (8.0, 13.2)]),
                Line(&[(11.6, 9.8), (13.0, 12.0)]),
            ],
            Self::Isolate => &[
                Dot((8.0, 8.0), 3.0),
                Arc((8.0, 8.0), 5.8, 20.0, 70.0),
                Arc((8.0, 8.0), 5.8, 110.0, 160.0),
                Arc((8.0, 8.0), 5.8, 200.0, 250.0),
                Arc((8.0, 8.0), 5.8, 290.0, 340.0),
            ],
            Self::Surface => &[Line(&[
                (2.0, 10.5),
                (4.5, 7.5),
                (7.0, 6.6),
                (9.5, 4.6),
                (14.0, 4.4),
                (12.4, 8.0),
                (11.2, 11.8),
                (7.6, 11.6),
                (5.0, 13.0),
                (2.0, 10.5),
            ])],
            Self::Mesh => &[
                Line(&[(2.0, 12.5), (8.0, 2.5), (14.0, 12.5), (2.0, 12.5)]),
                Line(&[(5.0, 7.5), (11.0, 7.5), (8.0, 12.5), (5.0, 7.5)]),
            ],
            Self::Block => &[
                Line(&[(2.5, 3.5), (13.5, 2.5), (12.5, 13.5), (3.5, 12.5), (2.5, 3.5)]),
                Line(&[(6.3, 3.2), (6.6, 12.8)]),
                Line(&[(10.0, 2.9), (9.7, 13.2)]),
                Line(&[(2.9, 6.6), (13.1, 6.3)]),
                Line(&[(3.2, 9.6), (12.8, 9.9)]),
            ],
            Self::Curve => &[
                Line(&[(2.5, 12.5), (3.2, 9.0), (5.2, 6.4), (8.0, 7.6), (10.6, 8.6), (12.6, 6.6), (13.5, 3.5)]),
                Dot((2.5, 12.5), 1.3),
                Dot((13.5, 3.5), 1.3),
            ],
            Self::Close | Self::Cross => &[Line(&[(4.0, 4.0), (12.0, 12.0)]), Line(&[(12.0, 4.0), (4.0, 12.0)])],
            Self::Tick => &[Line(&[(3.0, 8.6), (6.5, 12.0), (13.0, 4.2)])],
            Self::Warning => &[
                Line(&[(8.0, 2.4), (14.2, 13.2), (1.8, 13.2), (8.0, 2.4)]),
                Line(&[(8.0, 6.4), (8.0, 9.6)]),
                Dot((8.0, 11.4), 0.8),
            ],
            Self::Search => &[Arc((7.0, 7.0), 4.3, 0.0, 360.0), Line(&[(10.2, 10.2), (13.8, 13.8)])],
            Self::Trash => &[
                Line(&[(2.8, 4.4), (13.2, 4.4)]),
                Line(&[(6.0, 4.2), (6.0, 2.6), (10.0, 2.6), (10.0, 4.2)]),
                Line(&[(4.0, 4.6), (4.6, 13.4), (11.4, 13.4), (12.0, 4.6)]),
                Line(&[(6.8, 6.8), (6.8, 11.0)]),
                Line(&[(9.2, 6.8), (9.2, 11.0)]),
            ],
            // A rounded box, halved, and its first quarter halved again.
            Self::Inspect => &[
                Line(&[(4.0, 2.5), (12.0, 2.5)]),
                Arc((12.0, 4.0), 1.5, -90.0, 0.0),
                Line(&[(13.5, 4.0), (13.5, 12.0)]),
                Arc((12.0, 12.0), 1.5, 0.0, 90.0),
                Line(&[(12.0, 13.5), (4.0, 13.5)]),
                Arc((4.0, 12.0), 1.5, 90.0, 180.0),
                Line(&[(2.5, 12.0), (2.5, 4.0)]),
                Arc((4.0, 4.0), 1.5, 180.0, 270.0),
                Line(&[(8.0, 2.5), (8.0, 13.5)]),
                Line(&[(2.5, 8.0), (13.5, 8.0)]),
                Line(&[(5.2, 2.5), (5.2, 8.0)]),
                Line(&[(2.5, 5.2), (8.0, 5.2)]),
            ],
            Self::Intersect => &[
                Line(&[(1.8, 10.2), (9.6, 5.0), (14.2, 7.4), (6.4, 12.6), (1.8, 10.2)]),
                Line(&[(5.0, 2.4), (11.4, 4.8), (11.4, 13.6), (5.0, 11.2), (5.0, 2.4)]),
                Dot((5.0, 8.2), 1.3),
                Dot((11.4, 9.2), 1.3),
            ],
            Self::SelfIntersect => &[
                Line(&[(1.8, 12.8), (5.4, 9.6), (9.2, 6.2), (11.6, 4.4), (13.4, 5.6), (12.6, 8.6), (9.8, 10.4)]),
                Line(&[(9.8, 10.4), (6.6, 9.6), (4.4, 7.0), (3.4, 2.8)]),
                Fill(&[(5.8, 11.2), (4.2, 8.4), (7.4, 8.4)]),
            ],
            // A dimension line between two strokes.
            Self::Measure => &[
                Line(&[(2.5, 3.0), (2.5, 13.0)]),
                Line(&[(13.5, 3.0), (13.5, 13.0)]),
                Line(&[(2.9, 8.0), (13.1, 8.0)]),
                Line(&[(5.4, 5.8), (2.9, 8.0), (5.4, 10.2)]),
                Line(&[(10.6, 5.8), (13.1, 8.0), (10.6, 10.2)]),
            ],
            Self::Projection => &[
                Line(&[(2.5, 3.5), (6.0, 5.5), (6.0, 10.5), (2.5, 12.5), (2.5, 3.5)]),
                Line(&[(6.0, 5.5), (13.5, 6.6)]),
                Line(&[(6.0, 10.5), (13.5, 9.4)]),
                Line(&[(13.5, 6.6), (13.5, 9.4)]),
            ],
        }
    }

    /// Draws the icon into the largest square in the middle of `rect`.
    pub fn paint(self, painter: &egui::Painter, rect: Rect, color: Color32) {
        let scale = rect.width().min(rect.height()) / 16.0;
        let origin = rect.center() - vec2(8.0, 8.0) * scale;
        let at = |(x, y): (f32, f32)| -> Pos2 { origin + vec2(x, y) * scale };
        let stroke = Stroke::new((1.25 * scale).max(1.0), color);
        for mark in self.marks() {
            match mark {
                Line(points) => {
                    painter.line(points.iter().copied().map(at).collect(), stroke);
                }
                Arc(center, radius, start, end) => {
                    let steps = ((end - start).abs() / 12.0).ceil() as usize;
                    let points = (0..=steps).map(|i| {
                        let a = (start + (end - start) * i as f32 / steps as f32).to_radians();
                        at(*center) + vec2(a.cos(), a.sin()) * (radius * scale)
                    });
                    painter.line(points.collect(), stroke);
                }
                Fill(points) => {
                    painter.add(egui::Shape::convex_polygon(
                        points.iter().copied().map(at).collect(),
                        color,
                        Stroke::NONE,
                    ));
                }
                Dot(center, radius) => {
                    painter.circle_filled(at(*center), radius * scale, color);
                }
            }
        }
    }
}

/// A square button with an icon. `name` is what assistive programs read.
pub fn button(ui: &mut Ui, icon: Icon, name: &str, edge: f32, selected: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(edge, edge), Sense::click());
    let enabled = ui.is_enabled();
    response.widget_info(|| {
        if selected {
            egui::WidgetInfo::selected(egui::Role::Button, enabled, true, name)
        } else {
            egui::WidgetInfo::labeled(egui::Role::Button, enabled, name)
        }
    });
    if ui.is_rect_visible(rect) {
        let t = theme::of(ui);
        let visuals = ui.style().interact(&response);
        let (fill, color) = if selected {
            (t.accent_fill, t.text[2])
        } else if enabled && (response.hovered() || response.is_pointer_button_down_on() || response.has_focus()) {
            (visuals.weak_bg_fill, t.text[2])
        } else {
            (Color32::TRANSPARENT, t.text[0])
        };
        let painter = ui.painter();
        painter.rect_filled(rect.shrink(1.0), 4.0, fill);
        if response.has_focus() {
            painter.rect_stroke(rect.shrink(1.0), 4.0, Stroke::new(1.0, t.accent), egui::StrokeKind::Inside);
        }
        icon.paint(painter, Rect::from_center_size(rect.center(), vec2(edge, edge) * 0.62), color);
    }
    response
}

/// An icon in a line of text.
pub fn label(ui: &mut Ui, icon: Icon, color: Color32, edge: f32) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(edge, edge), Sense::hover());
    icon.paint(ui.painter(), rect, color);
    response
}
