//! Autosave: a folder for each running session, from which a crashed one is recovered.
//!
//! A session's folder holds the document as it was last saved there (a project), the list of commands since the
//! start, and a lock that the operating system lets go when the process ends, however it ends. A clean exit
//! removes the folder. A folder whose lock nobody holds is therefore a crash: [`Journal::recoverable`] lists those.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::{Format, OpenError, Opened, SaveError, SaveOptions, atomic};
use crate::model::document::Document;

const LOCK: &str = "lock";
const ABOUT: &str = "session.ron";
const COMMANDS: &str = "commands.txt";
const DOCUMENT: &str = "document.patchwright.ron";

/// Where autosaved sessions are kept.
#[derive(Clone, Debug)]
pub struct Journal {
    folder: PathBuf,
}

/// Why autosave does not work. The document itself is untouched.
#[derive(Debug, thiserror::Error)]
pub enum AutosaveError {
    /// The folder cannot be used.
    #[error("autosave is off: {} cannot be used: {source}", path.display())]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// What the file system said.
        source: io::Error,
    },
    /// The document was not written.
    #[error("the document was not autosaved: {0}")]
    Save(#[from] SaveError),
}

#[derive(Default, Serialize, Deserialize)]
struct About {
    /// The file that was open, empty for none.
    file: Option<PathBuf>,
}

impl Journal {
    /// The journal of this user, in the place that the system has for such data; `None` where it has none.
    pub fn of_user() -> Option<Self> {
        let folders = directories::ProjectDirs::from("", "", "patchwright")?;
        let state = folders.state_dir().unwrap_or_else(|| folders.data_local_dir());
        Some(Self::at(state.join("sessions")))
    }

    /// A journal in a folder, which is made when the first session starts.
    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Starts a session on a file, or on none.
    pub fn start(&self, file: Option<&Path>) -> Result<Session, AutosaveError> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| AutosaveError::Folder { path, source }
        };
        fs::create_dir_all(&self.folder).map_err(failed(&self.folder))?;
        let folder = tempfile::Builder::new()
            .prefix("session-")
            .rand_bytes(12)
            .tempdir_in(&self.folder)
            .map_err(failed(&self.folder))?
            .keep();
        let lock = File::create(folder.join(LOCK)).map_err(failed(&folder))?;
        lock.try_lock().map_err(|error| failed(&folder)(error.into()))?;
        let mut session = Session { folder, _lock: lock };
        session.set_file(file)?;
        Ok(session)
    }

    /// The sessions that ended without saying goodbye, the latest first. Sessions that still run are not among
    /// them; those that crashed before anything was changed are removed.
    pub fn recoverable(&self) -> Vec<Recovery> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let mut found: Vec<Recovery> = entries.flatten().filter_map(|entry| Recovery::of(entry.path())).collect();
        found.sort_by(|a, b| (b.saved, &b.folder).cmp(&(a.saved, &a.folder)));
        found
    }
}

/// A running session. Dropping it without [`Session::end`] leaves it recoverable, as a crash does.
#[derive(Debug)]
pub struct Session {
    folder: PathBuf,
    _lock: File,
}

impl Session {
    /// Says which file the document is of (after "save as").
    pub fn set_file(&mut self, file: Option<&Path>) -> Result<(), AutosaveError> {
        let path = self.folder.join(ABOUT);
        let absolute = file.map(|file| std::path::absolute(file).unwrap_or_else(|_| file.into()));
        // A path that is no text cannot be kept; the document can.
        let text = ron::to_string(&About { file: absolute }).unwrap_or_else(|_| "(file: None)".into());
        atomic::write(&path, text.as_bytes()).map_err(|error| SaveError::Write(error).into())
    }

    /// Keeps the document as it is now, and the command that made it so. Safe to call from a worker thread; the
    /// last call wins.
    pub fn save(&mut self, document: &Document, command: &str) -> Result<(), AutosaveError> {
        let path = self.folder.join(COMMANDS);
        let append = || -> io::Result<()> {
            let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
            writeln!(file, "{}", command.replace(['\n', '\r'], " "))?;
            file.sync_data()
        };
        append().map_err(|source| AutosaveError::Folder { path: path.clone(), source })?;
        let options = SaveOptions { format: Some(Format::Project), ..SaveOptions::default() };
        super::save(&self.folder.join(DOCUMENT), document, &options)?;
        Ok(())
    }

    /// Forgets what was autosaved: the user has saved the document, nothing is left to recover.
    pub fn saved_by_user(&mut self) {
        let _ = fs::remove_file(self.folder.join(DOCUMENT));
        let _ = fs::remove_file(self.folder.join(COMMANDS));
    }

    /// Ends the session cleanly.
    pub fn end(self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A session that crashed.
#[derive(Debug)]
pub struct Recovery {
    folder: PathBuf,
    /// The file that was open.
    pub file: Option<PathBuf>,
    /// When the document was autosaved last.
    pub saved: SystemTime,
    /// The commands since the document was opened or saved, in order.
    pub commands: Vec<String>,
    _lock: File,
}

impl Recovery {
    fn of(folder: PathBuf) -> Option<Self> {
        let lock = OpenOptions::new().write(true).open(folder.join(LOCK)).ok()?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => return None,
        }
        let Ok(saved) = fs::metadata(folder.join(DOCUMENT)).and_then(|m| m.modified()) else {
            let _ = fs::remove_dir_all(&folder); // it ended before anything was changed
            return None;
        };
        let about = fs::read_to_string(folder.join(ABOUT)).unwrap_or_default();
        let about: About = ron::from_str(&about).unwrap_or_default();
        let commands = fs::read_to_string(folder.join(COMMANDS)).unwrap_or_default();
        let commands = commands.lines().map(str::to_owned).collect();
        Some(Self { folder, file: about.file, saved, commands, _lock: lock })
    }

    /// Opens the autosaved document. It stays recoverable until it is discarded.
    pub fn open(&self) -> Result<Opened, OpenError> {
        super::open(&self.folder.join(DOCUMENT))
    }

    /// Throws it away.
    pub fn discard(self) -> io::Result<()> {
        fs::remove_dir_all(&self.folder)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::kernel::geom::Curve;
    use crate::model::document::{Shape, Unit};

    fn document(curves: usize) -> Document {
        let mut document = Document::new(Unit::Metre);
        for i in 0..curves {
            let curve = Curve::segment(DVec3::ZERO, DVec3::splat(1.0 + i as f64)).unwrap();
            document.add(format!("curve {i}"), Shape::Curve(Arc::new(curve)), None);
        }
        document
    }

    fn journal() -> (tempfile::TempDir, Journal) {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::at(folder.path().join("not/yet/there"));
        (folder, journal)
    }

    #[test]
    fn a_crash_is_recovered_with_its_last_document() {
        let (_folder, journal) = journal();
        assert!(journal.recoverable().is_empty());
        let mut session = journal.start(Some(Path::new("hood.igs"))).unwrap();
        session.save(&document(1), "Heal").unwrap();
        session.save(&document(2), "Hide\n2 entities").unwrap();
        assert!(journal.recoverable().is_empty(), "it still runs");
        drop(session);
        let found = journal.recoverable();
        assert_eq!(found.len(), 1);
        assert!(found[0].file.as_ref().unwrap().is_absolute() && found[0].file.as_ref().unwrap().ends_with("hood.igs"));
        assert_eq!(found[0].commands, ["Heal", "Hide 2 entities"]);
        assert_eq!(found[0].open().unwrap().document.entities().len(), 2);
        assert!(journal.recoverable().is_empty(), "held by the recovery itself");
        drop(found);
        for recovery in journal.recoverable() {
            recovery.discard().unwrap();
        }
        assert!(journal.recoverable().is_empty());
    }

    #[test]
    fn a_clean_exit_and_a_saved_document_leave_nothing() {
        let (_folder, journal) = journal();
        let mut session = journal.start(None).unwrap();
        session.save(&document(1), "Heal").unwrap();
        session.end();
        assert!(journal.recoverable().is_empty());
        let mut session = journal.start(None).unwrap();
        session.save(&document(1), "Heal").unwrap();
        session.saved_by_user();
        drop(session);
        assert!(journal.recoverable().is_empty());
        assert_eq!(fs::read_dir(&journal.folder).unwrap().count(), 0);
    }

    #[test]
    fn sessions_are_independent_and_the_latest_comes_first() {
        let (_folder, journal) = journal();
        for i in 1..=3 {
            let mut session = journal.start(None).unwrap();
            session.save(&document(i), "x").unwrap();
            let file = File::options().write(true).open(session.folder.join(DOCUMENT)).unwrap();
            file.set_modified(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(i as u64)).unwrap();
        }
        let found = journal.recoverable();
        let sizes: Vec<usize> = found.iter().map(|r| r.open().unwrap().document.entities().len()).collect();
        assert_eq!(sizes, [3, 2, 1]);
    }

    #[test]
    fn damaged_folders_do_no_harm() {
        let (_folder, journal) = journal();
        let mut session = journal.start(None).unwrap();
        session.save(&document(1), "x").unwrap();
        fs::write(session.folder.join(DOCUMENT), "(version: 1, uni").unwrap();
        fs::write(session.folder.join(ABOUT), b"\xff\xfe").unwrap();
        drop(session);
        fs::create_dir(journal.folder.join("session-empty")).unwrap();
        fs::write(journal.folder.join("a file"), "x").unwrap();
        let found = journal.recoverable();
        assert_eq!(found.len(), 1);
        assert!(found[0].open().is_err());
    }
}
