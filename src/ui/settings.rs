//! What is remembered between sessions: theme, navigation, recent files, panels. Kept as RON in the user's
//! configuration folder; a missing or damaged file means the defaults.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::view::navigation::Preset;

/// How many recent files are kept.
const RECENT: usize = 12;

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Theme {
    /// Light text on dark.
    #[default]
    Dark,
    /// Dark text on light.
    Light,
}

/// What is remembered between sessions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Light or dark.
    pub theme: Theme,
    /// Which mouse buttons navigate.
    pub navigation: Preset,
    /// Whether the digits of the main row do what those of the numeric pad do, while no tool wants them: for keyboards
    /// without a pad.
    pub digits_as_pad: bool,
    /// The files opened last, newest first.
    pub recent: Vec<PathBuf>,
    /// Whether the left panel is shown.
    pub left_panel: bool,
    /// Whether the right panel is shown.
    pub right_panel: bool,
    /// Whether the uv view is shown.
    pub uv_view: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            theme: Theme::default(),
            navigation: Preset::default(),
            digits_as_pad: false,
            recent: Vec::new(),
            left_panel: true,
            right_panel: true,
            uv_view: false,
        }
    }
}

impl Settings {
    /// Where they are kept; `None` where the system names no such folder. `PATCHWRIGHT_CONFIG` names another folder.
    pub fn path() -> Option<PathBuf> {
        let folder = match std::env::var_os("PATCHWRIGHT_CONFIG") {
            Some(folder) => PathBuf::from(folder),
            None => directories::ProjectDirs::from("", "", "patchwright")?.config_dir().to_path_buf(),
        };
        Some(folder.join("settings.ron"))
    }

    /// What is kept at `path`, or the defaults.
    pub fn load(path: &Path) -> Self {
        let Ok(text) = std::fs::read_to_string(path) else { return Self::default() };
        ron::from_str(&text).unwrap_or_else(|error| {
            log::warn!("{} is damaged ({error}); the default settings are used", path.display());
            Self::default()
        })
    }

    /// Keeps them at `path`, replacing the old file in one step.
    pub fn store(&self, path: &Path) -> std::io::Result<()> {
        let folder = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder)?;
        let text =
            ron::ser::to_string_pretty(self, ron::ser::PrettyConfig::default()).map_err(std::io::Error::other)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        std::io::Write::write_all(&mut file, text.as_bytes())?;
        file.persist(path)?;
        Ok(())
    }

    /// Puts a file at the top of the recent ones.
    pub fn remember(&mut self, file: &Path) {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
        self.recent.retain(|other| *other != file);
        self.recent.insert(0, file);
        self.recent.truncate(RECENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_a_round_trip_and_damage_means_defaults() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/settings.ron");
        let mut settings = Settings { theme: Theme::Light, navigation: Preset::Maya, ..Settings::default() };
        for i in 0..20 {
            settings.remember(Path::new(&format!("/a/{}.igs", i % 15)));
        }
        assert_eq!(settings.recent.len(), RECENT);
        assert_eq!(settings.recent[0], Path::new("/a/4.igs"));
        settings.store(&path).unwrap();
        assert_eq!(Settings::load(&path), settings);
        std::fs::write(&path, "(theme: Blue").unwrap();
        assert_eq!(Settings::load(&path), Settings::default());
        assert_eq!(Settings::load(&folder.path().join("missing")), Settings::default());
        std::fs::write(&path, "(theme: Light)").unwrap();
        assert_eq!(Settings::load(&path).theme, Theme::Light);
    }
}
