//! The legend of the deviation map, which is dragged to another range, and the histogram.

use egui::{Align2, Color32, FontId, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

use super::super::editor::Editor;
use super::super::status::{length, short};
use super::super::theme;
use super::Tool;
use super::patch::{PatchSession, fitting};
use crate::model::document::Unit;
use crate::render::to_srgb8;
use crate::view::histogram::Histogram;
use crate::view::legend::LegendRange;
use crate::view::patch_tool::Stage;

/// Bins of the histogram.
const BINS: usize = 33;

fn color32(c: crate::render::Color) -> Color32 {
    let [r, g, b, a] = to_srgb8(c);
    Color32::from_rgba_unmultiplied(r, g, b, a)
}

impl Editor {
    /// The legend in the view, while there is a deviation map.
    pub fn legend(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let view = self.viewport.rect;
        let Tool::Patch(session) = &mut self.tool else { return };
        if session.tool.stage() != Stage::Result || !session.tool.shows_deviation() || session.shown.is_none() {
            return;
        }
        let t = theme::of(ui);
        let scale = session.scale();
        let height = (view.height() * 0.42).clamp(140.0, 300.0);
        let bar = Rect::from_min_size(pos2(view.right() - 96.0, view.center().y - 0.5 * height), vec2(18.0, height));
        let panel =
            Rect::from_min_max(bar.min - vec2(12.0, 34.0), bar.max + vec2(84.0, 44.0)).intersect(view.shrink(4.0));
        let painter = ui.painter().with_clip_rect(view);
        painter.rect(panel, 6.0, t.label.gamma_multiply(0.92), Stroke::new(1.0, t.border), StrokeKind::Inside);
        let title = match unit.symbol() {
            "" => "Deviation".to_owned(),
            symbol => format!("Deviation {symbol}"),
        };
        let small = FontId::proportional(theme::SMALL);
        painter.text(pos2(panel.left() + 10.0, panel.top() + 9.0), Align2::LEFT_TOP, title, small.clone(), t.text[2]);
        let y_of = |v: f32| bar.bottom() - (v - scale.low) / (scale.high - scale.low) * bar.height();
        let rows = bar.height() as usize;
        for row in 0..rows {
            let v = scale.high - (row as f32 + 0.5) / rows as f32 * (scale.high - scale.low);
            let y = bar.top() + row as f32;
            painter.rect_filled(
                Rect::from_min_size(pos2(bar.left(), y), vec2(bar.width(), 1.5)),
                0.0,
                color32(scale.color(v)),
            );
        }
        // What lies beyond the range, and what has no data.
        let cap = |y: f32, color| {
            Rect::from_min_size(pos2(bar.left(), y), vec2(bar.width(), 5.0))
                .pipe(|r| painter.rect_filled(r, 0.0, color))
        };
        cap(bar.top() - 7.0, color32(scale.above));
        cap(bar.bottom() + 2.0, color32(scale.below));
        for v in [scale.high, 0.5 * scale.high, 0.0, 0.5 * scale.low, scale.low] {
            let y = y_of(v);
            painter.hline(bar.right()..=bar.right() + 4.0, y, Stroke::new(1.0, t.text[1]));
            let text = if v > 0.0 { format!("+{}", short(f64::from(v))) } else { short(f64::from(v)) };
            painter.text(pos2(bar.right() + 7.0, y), Align2::LEFT_CENTER, text, small.clone(), t.text[0]);
        }
        if scale.band > 0.0 && scale.band < scale.high {
            let band =
                Rect::from_min_max(pos2(bar.left() - 3.0, y_of(scale.band)), pos2(bar.left() - 1.0, y_of(-scale.band)));
            painter.rect_filled(band, 0.0, t.good);
        }
        let gap = Rect::from_min_size(pos2(bar.left(), bar.bottom() + 14.0), vec2(18.0, 10.0));
        painter.rect_filled(gap, 0.0, color32(scale.no_data));
        for k in 0..3 {
            let x = gap.left() + 3.0 + 6.0 * k as f32;
            painter.line_segment(
                [pos2(x, gap.bottom()), pos2(x + 4.0, gap.top())],
                Stroke::new(1.0, Color32::from_gray(110)),
            );
        }
        painter.text(pos2(gap.right() + 7.0, gap.center().y), Align2::LEFT_CENTER, "no data", small, t.text[1]);
        let area = ui.interact(panel, ui.scope_id().with("legend"), Sense::click_and_drag());
        area.widget_info(|| egui::WidgetInfo::slider(true, session.range.high, "Deviation range"));
        if area.dragged() {
            let to = session.range.high * f64::from(area.drag_delta().y / 120.0).exp();
            session.range =
                LegendRange { locked: true, ..session.range.dragged(false, to, session.tool.options().tol) };
            session.revision += 1;
        }
        if area.double_clicked() {
            session.reset_range();
        }
        area.on_hover_cursor(egui::CursorIcon::ResizeVertical)
            .on_hover_text("Drag up or down for another range; double-click for the one that fits");
    }
}

/// Hands a value to a function: keeps one-line drawings one line.
trait Pipe: Sized {
    fn pipe<R>(self, f: impl FnOnce(Self) -> R) -> R {
        f(self)
    }
}

impl Pipe for Rect {}

impl PatchSession {
    /// The range that fits what was measured.
    pub fn reset_range(&mut self) {
        if let Some(shown) = &self.shown {
            self.range = fitting(shown, self.tool.options().tol);
            self.revision += 1;
        }
    }

    /// How often which deviation was measured, in the colours of the map.
    pub fn histogram(&self, ui: &mut Ui, unit: Unit) {
        let Some(shown) = &self.shown else { return };
        let t = theme::of(ui);
        let scale = self.scale();
        let values = shown.deviation.values.iter().map(|&v| Some(f64::from(v)));
        let histogram = Histogram::new(values, [self.range.low, self.range.high], BINS);
        let most = histogram.highest().max(1);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 74.0), Sense::hover());
        let painter = ui.painter();
        painter.rect_filled(rect, 4.0, t.field);
        let inner = rect.shrink2(vec2(8.0, 6.0));
        let width = inner.width() / BINS as f32;
        for (k, &count) in histogram.counts.iter().enumerate() {
            // A root keeps single outliers visible beside the bulk.
            let h = (count as f32 / most as f32).sqrt() * (inner.height() - 14.0);
            let x = inner.left() + k as f32 * width;
            let bar =
                Rect::from_min_max(pos2(x, inner.bottom() - 14.0 - h), pos2(x + width - 1.0, inner.bottom() - 14.0));
            let v = scale.low + (k as f32 + 0.5) / BINS as f32 * (scale.high - scale.low);
            painter.rect_filled(bar, 0.0, color32(scale.color(v)));
        }
        let y = inner.bottom() - 13.0;
        painter.hline(inner.x_range(), y, Stroke::new(1.0, t.border));
        let font = FontId::proportional(11.0);
        let ends = [
            (inner.left(), Align2::LEFT_TOP, scale.low),
            (inner.center().x, Align2::CENTER_TOP, 0.0),
            (inner.right(), Align2::RIGHT_TOP, scale.high),
        ];
        for (x, align, v) in ends {
            painter.text(pos2(x, y + 1.0), align, short(f64::from(v)), font.clone(), t.text[1]);
        }
        response.on_hover_text(format!(
            "{} vertices: {} below and {} above the range, {} without data (over gaps). Heights are square roots. Within \
             tolerance: {:.0} %. Largest {}",
            shown.deviation.values.len(),
            histogram.below,
            histogram.above,
            histogram.missing,
            100.0 * histogram.share_within(self.tool.options().tol),
            length(shown.deviation.max, unit)
        ));
    }
}
