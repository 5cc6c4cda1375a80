//! The menu bar and the toolbar, made from the list of actions.

use egui::{Align, Button, Layout, MenuBar, Ui, vec2};

use super::actions::{self, ACTIONS, Action, Info, Menu, TOOLBAR};
use super::editor::Editor;
use super::{icons, theme};

/// The menu bar.
pub fn menu(ui: &mut Ui, editor: &mut Editor) {
    MenuBar::new().ui(ui, |ui| {
        ui.spacing_mut().button_padding = vec2(8.0, 3.0);
        for menu in Menu::ALL {
            ui.menu_button(menu.title(), |ui| {
                ui.set_min_width(230.0);
                let mut group = None;
                for info in ACTIONS.iter().filter(|i| i.menu == menu) {
                    if group.is_some_and(|g| g != info.group) {
                        ui.separator();
                    }
                    group = Some(info.group);
                    item(ui, editor, info);
                    if info.action == Action::OpenExample {
                        recent(ui, editor);
                    }
                }
            });
        }
    });
}

fn item(ui: &mut Ui, editor: &mut Editor, info: &Info) {
    let enabled = editor.enabled(info.action);
    let shortcut = info.keys(ui.ctx());
    let on = editor.checked(info.action);
    let button = Button::selectable(on == Some(true), info.name).shortcut_text(shortcut);
    let response = ui.add_enabled(enabled.is_ok(), button).on_hover_text(info.help);
    let response = match enabled {
        Ok(()) => response,
        Err(why) => response.on_disabled_hover_text(format!("{}. Not now: {why}", info.help)),
    };
    if response.clicked() {
        ui.close();
        let ctx = ui.ctx().clone();
        editor.perform(&ctx, info.action);
    }
}

fn recent(ui: &mut Ui, editor: &mut Editor) {
    let files = editor.settings.recent.clone();
    ui.add_enabled_ui(!files.is_empty(), |ui| {
        ui.menu_button("Open recent", |ui| {
            ui.set_min_width(260.0);
            for path in files {
                let name = super::files::file_name(&path);
                if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                    ui.close();
                    editor.open(vec![path]);
                }
            }
        });
    });
}

/// The toolbar.
pub fn toolbar(ui: &mut Ui, editor: &mut Editor) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for (at, group) in TOOLBAR.iter().enumerate() {
            if at > 0 {
                ui.add_space(4.0);
                let (rect, _) = ui.allocate_exact_size(vec2(1.0, 18.0), egui::Sense::hover());
                ui.painter().rect_filled(rect, 0.0, theme::of(ui).border);
                ui.add_space(4.0);
            }
            for &action in *group {
                tool_button(ui, editor, action);
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let info = actions::info(Action::Palette);
            let text = egui::RichText::new("Find command").color(theme::of(ui).text[1]);
            let shortcut = info.keys(ui.ctx());
            let button = Button::new(text).shortcut_text(shortcut).min_size(vec2(190.0, 24.0));
            if ui.add(button).on_hover_text(info.help).clicked() {
                let ctx = ui.ctx().clone();
                editor.perform(&ctx, Action::Palette);
            }
        });
    });
}

/// A button for an action with an icon.
pub fn tool_button(ui: &mut Ui, editor: &mut Editor, action: Action) {
    let info = actions::info(action);
    let Some(icon) = info.icon else { return };
    let enabled = editor.enabled(action);
    let on = editor.checked(action) == Some(true);
    let keys = info.shortcut.map(|_| format!(" ({})", info.keys(ui.ctx()))).unwrap_or_default();
    let name = info.name.trim_end_matches('…');
    let response = ui.add_enabled_ui(enabled.is_ok(), |ui| icons::button(ui, icon, name, theme::TOOL, on)).inner;
    let help = format!("{name}{keys}\n{}", info.help);
    let response = match enabled {
        Ok(()) => response.on_hover_text(help),
        Err(why) => response.on_disabled_hover_text(format!("{help}\nNot now: {why}")),
    };
    if response.clicked() {
        let ctx = ui.ctx().clone();
        editor.perform(&ctx, action);
    }
}
