//! Positions for scripts that drive the real window, for example under a virtual display.
//!
//! With `PATCHWRIGHT_SCRIPT_HINTS=FILE` in the environment the editor rewrites FILE (JSON, in one step) whenever
//! what it would say has changed:
//!
//! ```json
//! {"frame": 12, "busy": false, "page": "Tool", "dialog": "", "prompt": "Patch · Pick side 1 of 4",
//!  "entities": 4, "patches": 0, "dirty": false, "title": "part.igs",
//!  "buttons": {"Open": [20.0, 45.0], "File": [22.0, 14.0]},
//!  "curves": [{"entity": 3, "name": "Surface 1", "curve": "border u max", "at": [512.0, 300.5]}],
//!  "surfaces": [{"entity": 3, "name": "Surface 1", "uv": [0.25, 0.5], "at": [498.0, 310.0]}]}
//! ```
//!
//! Positions are pixels from the window's upper left corner. `busy` is true while anything is computed or drawn
//! that may still move them. `buttons` holds every named widget that takes clicks and is in the window; of several
//! with one name the first keeps it and the others are `name#2` and so on. `curves` holds one point of every
//! curve that the active tool lets one pick and that is not hidden behind something else there; `surfaces` places in which
//! a click picks the surface, with the parameters there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

/// One pickable curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveHint {
    /// The entity's number.
    pub entity: u64,
    /// The entity's name.
    pub name: String,
    /// Which of its curves.
    pub curve: String,
    /// A point on it.
    pub at: [f32; 2],
}

/// One place of a surface that can be picked.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceHint {
    /// The entity's number.
    pub entity: u64,
    /// The entity's name.
    pub name: String,
    /// The parameters there.
    pub uv: [f64; 2],
    /// The point.
    pub at: [f32; 2],
}

/// What the editor says of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct State {
    /// How often it has been written.
    pub frame: u64,
    /// Whether something is under way that may still change the rest.
    pub busy: bool,
    /// The page of the right panel.
    pub page: String,
    /// The dialog in front, empty when there is none.
    pub dialog: String,
    /// Tool and prompt of the status line.
    pub prompt: String,
    /// How many entities the document has.
    pub entities: usize,
    /// How many of them are healed patches.
    pub patches: usize,
    /// Whether there are unsaved changes.
    pub dirty: bool,
    /// What the document is called.
    pub title: String,
    /// Every named widget that takes clicks.
    pub buttons: BTreeMap<String, [f32; 2]>,
    /// The curves that can be picked.
    pub curves: Vec<CurveHint>,
    /// Places of the surfaces that can be picked.
    pub surfaces: Vec<SurfaceHint>,
}

/// Writes positions for scripts whenever a frame has ended.
pub struct Hints {
    path: PathBuf,
    state: Arc<Mutex<State>>,
    written: State,
    failed: bool,
}

impl Hints {
    /// Writes to `path` from now on. What the editor says of itself goes into the returned slot each frame.
    pub fn install(ctx: &egui::Context, path: PathBuf) -> Arc<Mutex<State>> {
        let state = Arc::new(Mutex::new(State::default()));
        let hints = Self { path, state: Arc::clone(&state), written: State::default(), failed: false };
        ctx.add_plugin(hints);
        state
    }

    fn write(&self, state: &State) -> std::io::Result<()> {
        let json = serde_json::to_string(state).map_err(std::io::Error::other)?;
        let folder = self.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        std::io::Write::write_all(&mut file, json.as_bytes())?;
        file.persist(&self.path)?;
        Ok(())
    }
}

impl egui::Plugin for Hints {
    fn debug_name(&self) -> &'static str {
        "script hints"
    }

    fn on_begin_pass(&mut self, ui: &mut egui::Ui) {
        // Named widgets are collected for assistive programs; scripts read the same names.
        ui.ctx().enable_accesskit();
    }

    fn output_hook(&mut self, _ctx: &egui::Context, output: &mut egui::FullOutput) {
        let Some(update) = &output.platform_output.accesskit_update else { return };
        if self.failed {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for (_, node) in &update.nodes {
            let (Some(name), Some(bounds)) = (node.label(), node.bounds()) else { continue };
            if !node.supports_action(egui::accesskit::Action::Click) {
                continue;
            }
            let center = [0.5 * (bounds.x0 + bounds.x1) as f32, 0.5 * (bounds.y0 + bounds.y1) as f32];
            let mut key = name.to_owned();
            for n in 2.. {
                if !state.buttons.contains_key(&key) {
                    break;
                }
                key = format!("{name}#{n}");
            }
            state.buttons.insert(key, center);
        }
        state.frame = self.written.frame;
        if state != self.written {
            state.frame += 1;
            if let Err(error) = self.write(&state) {
                log::warn!("script hints cannot be written to {}: {error}", self.path.display());
                self.failed = true;
            }
            self.written = state;
        }
    }
}
