//! The window without a screen, driven as a user would.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test helper may stop the test; not every test uses all"
)]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, HarnessBuilder};
use patchwright::ui::{App, Options};

/// The application in its window.
pub type Window = Harness<'static, App>;

pub fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name)
}

pub fn builder() -> HarnessBuilder<App> {
    let builder = Harness::builder().with_size([1400.0, 900.0]).with_max_steps(64);
    // Only who wants pictures pays for drawing them.
    if std::env::var_os("PATCHWRIGHT_PICTURES").is_some() { builder.wgpu() } else { builder }
}

pub fn window(builder: HarnessBuilder<App>, options: Options) -> Window {
    let mut window = builder.build_eframe(|cc| App::new(cc, options));
    settle(&mut window);
    window
}

pub fn opened(name: &str) -> Window {
    window(builder(), Options { files: vec![asset(name)], ..Options::default() })
}

/// Steps until nothing is computed or moves any more.
pub fn settle(window: &mut Window) {
    let start = Instant::now();
    let mut calm = 0;
    while calm < 4 {
        window.step();
        let editor = &window.state().editor;
        let busy = !editor.jobs.active().is_empty() || editor.viewport.is_moving() || editor.files.is_opening();
        calm = if busy { 0 } else { calm + 1 };
        assert!(start.elapsed() < Duration::from_secs(120), "never calm: {:?}", editor.jobs.active());
        if busy {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Types a path into the export dialog and presses Enter; the file is there then.
pub fn export_to(window: &mut Window, path: &Path) {
    window.get_by_label("Path").focus();
    key(window, Modifiers::COMMAND, Key::A);
    window.event(Event::Text(path.display().to_string()));
    window.step();
    key(window, Modifiers::NONE, Key::Enter);
    assert!(path.exists(), "nothing was written");
}

pub fn key(window: &mut Window, modifiers: Modifiers, key: Key) {
    for pressed in [true, false] {
        window.event(Event::Key { key, physical_key: None, pressed, repeat: false, modifiers });
    }
    settle(window);
}

/// Moves the mouse somewhere.
pub fn hover(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    window.step();
    settle(window);
}

pub fn click(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    window.step();
    for pressed in [true, false] {
        window.event(Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        window.step();
    }
    settle(window);
}

/// Clicks a curve where the editor itself says that it can be picked.
pub fn pick(window: &mut Window, surface: &str, curve: &str) {
    let hints = window.state().editor.curve_hints(1.0);
    let hint = hints.iter().find(|h| h.name == surface && h.curve == curve);
    let hint = hint.unwrap_or_else(|| panic!("{curve} of {surface} cannot be picked: {hints:?}"));
    click(window, pos2(hint.at[0], hint.at[1]));
}

pub fn prompt(window: &Window) -> String {
    let (tool, prompt, _) = window.state().editor.prompt();
    format!("{tool} · {prompt}")
}

pub fn picture(window: &mut Window, name: &str) {
    if let Some(folder) = std::env::var_os("PATCHWRIGHT_PICTURES").filter(|_| window.state().editor.viewport.can_draw())
    {
        window.render().unwrap().save(Path::new(&folder).join(format!("{name}.png"))).unwrap();
    }
}
