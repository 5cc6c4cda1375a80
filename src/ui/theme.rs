//! Design tokens: every colour and size that the window uses, for the light and the dark theme, and the egui
//! styles made from them. Nothing else in `ui` names a colour.

use egui::{Color32, CornerRadius, FontId, Margin, Stroke, TextStyle, Visuals, vec2};

/// The colours of one theme.
#[derive(Clone, Copy, Debug)]
pub struct Tokens {
    /// Behind panels.
    pub panel: Color32,
    /// Behind menus and dialogs.
    pub raised: Color32,
    /// Behind text fields and lists.
    pub field: Color32,
    /// Lines between things.
    pub border: Color32,
    /// A button at rest, under the pointer, and pressed.
    pub button: [Color32; 3],
    /// Normal, quiet, and emphasised text.
    pub text: [Color32; 3],
    /// What is selected or active, and text on it.
    pub accent: Color32,
    /// Text on the accent colour.
    pub on_accent: Color32,
    /// A quiet fill for selected rows.
    pub accent_fill: Color32,
    /// Fine.
    pub good: Color32,
    /// Needs a look.
    pub warn: Color32,
    /// Wrong.
    pub bad: Color32,
    /// The four sides of a patch; told apart by their numerals as well (Okabe and Ito's palette).
    pub sides: [Color32; 4],
    /// Behind labels in the viewport.
    pub label: Color32,
}

/// Body text.
pub const TEXT: f32 = 13.5;
/// Small text: captions, table heads.
pub const SMALL: f32 = 12.0;
/// The height of the status line.
pub const STATUS_HEIGHT: f32 = 26.0;
/// The height of a row in a list.
pub const ROW: f32 = 22.0;
/// The edge of a toolbar button.
pub const TOOL: f32 = 28.0;

const DARK: Tokens = Tokens {
    panel: Color32::from_rgb(0x22, 0x25, 0x2a),
    raised: Color32::from_rgb(0x2a, 0x2e, 0x34),
    field: Color32::from_rgb(0x19, 0x1b, 0x1f),
    border: Color32::from_rgb(0x3b, 0x40, 0x48),
    button: [
        Color32::from_rgb(0x34, 0x39, 0x41),
        Color32::from_rgb(0x40, 0x46, 0x50),
        Color32::from_rgb(0x4b, 0x53, 0x5f),
    ],
    text: [
        Color32::from_rgb(0xd6, 0xda, 0xe0),
        Color32::from_rgb(0x9a, 0xa3, 0xae),
        Color32::from_rgb(0xf4, 0xf6, 0xf8),
    ],
    accent: Color32::from_rgb(0x4c, 0x9d, 0xf2),
    on_accent: Color32::from_rgb(0x0b, 0x15, 0x20),
    accent_fill: Color32::from_rgb(0x25, 0x46, 0x69),
    good: Color32::from_rgb(0x5b, 0xc2, 0x7b),
    warn: Color32::from_rgb(0xf0, 0xae, 0x45),
    bad: Color32::from_rgb(0xf2, 0x70, 0x68),
    sides: [
        Color32::from_rgb(0xe6, 0x9f, 0x00),
        Color32::from_rgb(0x56, 0xb4, 0xe9),
        Color32::from_rgb(0x1f, 0xc0, 0x92),
        Color32::from_rgb(0xe0, 0x83, 0xb8),
    ],
    label: Color32::from_rgb(0x1b, 0x1e, 0x23),
};

const LIGHT: Tokens = Tokens {
    panel: Color32::from_rgb(0xf2, 0xf3, 0xf5),
    raised: Color32::from_rgb(0xfc, 0xfc, 0xfd),
    field: Color32::from_rgb(0xff, 0xff, 0xff),
    border: Color32::from_rgb(0xc9, 0xcd, 0xd3),
    button: [
        Color32::from_rgb(0xe2, 0xe5, 0xe9),
        Color32::from_rgb(0xd4, 0xd9, 0xdf),
        Color32::from_rgb(0xc4, 0xcb, 0xd4),
    ],
    text: [
        Color32::from_rgb(0x24, 0x29, 0x30),
        Color32::from_rgb(0x5b, 0x64, 0x6f),
        Color32::from_rgb(0x0b, 0x0e, 0x12),
    ],
    accent: Color32::from_rgb(0x17, 0x67, 0xbd),
    on_accent: Color32::from_rgb(0xff, 0xff, 0xff),
    accent_fill: Color32::from_rgb(0xc8, 0xdf, 0xf8),
    good: Color32::from_rgb(0x1a, 0x76, 0x3b),
    warn: Color32::from_rgb(0x9c, 0x62, 0x00),
    bad: Color32::from_rgb(0xc0, 0x2d, 0x25),
    sides: [
        Color32::from_rgb(0xb8, 0x73, 0x00),
        Color32::from_rgb(0x1b, 0x7d, 0xbd),
        Color32::from_rgb(0x00, 0x83, 0x60),
        Color32::from_rgb(0xb0, 0x4a, 0x86),
    ],
    label: Color32::from_rgb(0xff, 0xff, 0xff),
};

/// The tokens of the theme that is on.
pub fn tokens(dark: bool) -> &'static Tokens {
    if dark { &DARK } else { &LIGHT }
}

/// The tokens of the theme that `ui` is drawn in.
pub fn of(ui: &egui::Ui) -> &'static Tokens {
    tokens(ui.visuals().dark_mode)
}

/// Hands both themes to egui.
pub fn install(ctx: &egui::Context) {
    ctx.set_visuals_of(egui::Theme::Dark, visuals(&DARK, Visuals::dark()));
    ctx.set_visuals_of(egui::Theme::Light, visuals(&LIGHT, Visuals::light()));
    ctx.all_styles_mut(|style| {
        for (text_style, font) in &mut style.text_styles {
            *font = match text_style {
                TextStyle::Small => FontId::proportional(SMALL),
                TextStyle::Heading => FontId::proportional(17.0),
                TextStyle::Monospace => FontId::monospace(12.5),
                _ => FontId::proportional(TEXT),
            };
        }
        let s = &mut style.spacing;
        s.item_spacing = vec2(6.0, 5.0);
        s.button_padding = vec2(9.0, 3.0);
        s.interact_size = vec2(32.0, 24.0);
        s.menu_margin = Margin::same(5);
        s.menu_spacing = 4.0;
        s.window_margin = Margin::same(14);
        s.indent = 16.0;
        s.combo_width = 80.0;
        s.slider_width = 120.0;
        s.tooltip_width = 340.0;
        s.scroll = egui::style::ScrollStyle::solid();
        s.scroll.bar_width = 7.0;
        style.interaction.tooltip_delay = 0.4;
        style.interaction.selectable_labels = false;
    });
}

fn visuals(t: &Tokens, mut v: Visuals) -> Visuals {
    v.panel_fill = t.panel;
    v.window_fill = t.raised;
    v.window_stroke = Stroke::new(1.0, t.border);
    v.extreme_bg_color = t.field;
    v.text_edit_bg_color = Some(t.field);
    v.faint_bg_color = t.raised;
    v.code_bg_color = t.field;
    v.hyperlink_color = t.accent;
    v.warn_fg_color = t.warn;
    v.error_fg_color = t.bad;
    v.weak_text_color = Some(t.text[1]);
    v.selection.bg_fill = t.accent_fill;
    v.selection.stroke = Stroke::new(1.0, t.text[2]);
    v.window_corner_radius = CornerRadius::same(8);
    v.menu_corner_radius = CornerRadius::same(6);
    v.slider_trailing_fill = true;
    v.indent_has_left_vline = false;
    let corner_radius = CornerRadius::same(4);
    for w in [
        &mut v.widgets.noninteractive,
        &mut v.widgets.inactive,
        &mut v.widgets.hovered,
        &mut v.widgets.active,
        &mut v.widgets.open,
    ] {
        w.corner_radius = corner_radius;
        w.expansion = 0.0;
    }
    let w = &mut v.widgets;
    w.noninteractive.bg_fill = t.panel;
    w.noninteractive.weak_bg_fill = t.panel;
    w.noninteractive.bg_stroke = Stroke::new(1.0, t.border);
    w.noninteractive.fg_stroke = Stroke::new(1.0, t.text[0]);
    w.inactive.bg_fill = t.button[0];
    w.inactive.weak_bg_fill = t.button[0];
    w.inactive.bg_stroke = Stroke::new(1.0, t.border);
    w.inactive.fg_stroke = Stroke::new(1.0, t.text[0]);
    w.hovered.bg_fill = t.button[1];
    w.hovered.weak_bg_fill = t.button[1];
    w.hovered.bg_stroke = Stroke::new(1.0, t.text[1]);
    w.hovered.fg_stroke = Stroke::new(1.0, t.text[2]);
    w.active.bg_fill = t.button[2];
    w.active.weak_bg_fill = t.button[2];
    w.active.bg_stroke = Stroke::new(1.0, t.accent);
    w.active.fg_stroke = Stroke::new(1.0, t.text[2]);
    w.open.bg_fill = t.button[1];
    w.open.weak_bg_fill = t.button[1];
    w.open.bg_stroke = Stroke::new(1.0, t.border);
    w.open.fg_stroke = Stroke::new(1.0, t.text[2]);
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: Color32) -> f64 {
        let lin = |v: u8| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * lin(c.r()) + 0.7152 * lin(c.g()) + 0.0722 * lin(c.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// WCAG 2.1: 4.5 for text, 3 for marks.
    #[test]
    fn text_and_marks_stand_out_in_both_themes() {
        for t in [&DARK, &LIGHT] {
            for background in [t.panel, t.raised, t.field] {
                for text in t.text.iter().chain([&t.good, &t.warn, &t.bad]) {
                    assert!(contrast(*text, background) >= 4.5, "{text:?} on {background:?}");
                }
            }
            assert!(contrast(t.on_accent, t.accent) >= 4.5);
            assert!(contrast(t.text[0], t.accent_fill) >= 4.5);
            for side in t.sides {
                assert!(contrast(side, t.label) >= 3.0, "{side:?}");
            }
        }
    }
}
