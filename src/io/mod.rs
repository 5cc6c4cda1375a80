//! Files: reading a model into a document with a report of everything that was met, and writing one.
//!
//! [`open`] chooses the reader by what the file contains, then by its extension; [`save`] chooses the writer by
//! extension. Every reader returns an [`ImportReport`] beside the document: an entity of the file either becomes
//! geometry or a line there. Every writer replaces the old file in one step, or leaves it as it was.

use std::path::{Path, PathBuf};

use crate::model::document::Document;

pub(crate) mod atomic;
pub mod autosave;
mod format;
pub mod iges;
pub mod obj;
pub mod plot3d;
pub mod project;
pub(crate) mod report;
pub mod step;
pub mod stl;
mod tidy;

pub use atomic::WriteError;
pub use format::{Format, PROJECT_EXTENSION};
pub use report::{ImportReport, ReportLine, Severity};

/// A file that was read.
#[derive(Clone, Debug)]
pub struct Opened {
    /// What it contains.
    pub document: Document,
    /// What happened to each of its entities.
    pub report: ImportReport,
}

/// Why a file was not opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The file system said no.
    #[error("cannot read {}: {source}; check that the file exists and that you may read it", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the file system said.
        source: std::io::Error,
    },
    /// There is nothing in it.
    #[error("{} is empty; export the model again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// It is no IGES file that can be read.
    #[error("{} cannot be read: {source}", path.display())]
    Iges {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: iges::IgesError,
    },
    /// It is no project that can be read.
    #[error("{} cannot be read: {source}", path.display())]
    Project {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: project::ProjectError,
    },
    /// Neither the content nor the extension is that of a format that can be read.
    #[error("{} is no file that can be read: expected {}", path.display(), Format::list())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
}

/// Why a file was not written. The file that was there before is untouched.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file system said no.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The document does not fit into an IGES file.
    #[error("cannot save {} as IGES: {source}", path.display())]
    Iges {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: iges::IgesWriteError,
    },
    /// The format can be read but not written.
    #[error("{} files cannot be written: save as IGES (.igs) or as a project (.patchwright.ron)", format.name())]
    ReadOnly {
        /// The format.
        format: Format,
    },
    /// The document does not fit into a project.
    #[error("cannot save {}: {source}", path.display())]
    Project {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: project::ProjectWriteError,
    },
    /// The extension names no format that can be written.
    #[error("cannot tell the format of {} by its extension: expected {}", path.display(), Format::list())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
}

/// How a document is written.
#[derive(Clone, Debug, Default)]
pub struct SaveOptions {
    /// The format; by extension when left out.
    pub format: Option<Format>,
}

/// What was written.
#[derive(Clone, Debug, Default)]
pub struct Saved {
    /// Entities written.
    pub entities: usize,
    /// What the format could not hold, one line each.
    pub notes: Vec<String>,
}

/// Reads a model.
pub fn open(path: &Path) -> Result<Opened, OpenError> {
    let bytes = std::fs::read(path).map_err(|source| OpenError::Read { path: path.into(), source })?;
    if bytes.is_empty() {
        return Err(OpenError::Empty { path: path.into() });
    }
    match Format::of_content(&bytes).or_else(|| Format::of_name(path)) {
        Some(Format::Iges) => iges::read(&bytes).map_err(|source| OpenError::Iges { path: path.into(), source }),
        Some(Format::Step) => Ok(step::open(&bytes)),
        Some(Format::Project) => {
            project::read(&bytes).map_err(|source| OpenError::Project { path: path.into(), source })
        }
        None => Err(OpenError::Unknown { path: path.into() }),
    }
}

/// Writes a document, in one step: on an error the file that was there before is untouched.
pub fn save(path: &Path, document: &Document, options: &SaveOptions) -> Result<Saved, SaveError> {
    let unknown = || SaveError::Unknown { path: path.into() };
    match options.format.or_else(|| Format::of_name(path)).ok_or_else(unknown)? {
        Format::Iges => {
            let file_name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            let options = iges::IgesOptions { file_name, time: std::time::SystemTime::now() };
            let (text, saved) =
                iges::write(document, &options).map_err(|source| SaveError::Iges { path: path.into(), source })?;
            atomic::write(path, text.as_bytes())?;
            Ok(saved)
        }
        format @ Format::Step => Err(SaveError::ReadOnly { format }),
        Format::Project => {
            let text = project::write(document).map_err(|source| SaveError::Project { path: path.into(), source })?;
            atomic::write(path, text.as_bytes())?;
            Ok(Saved { entities: document.entities().len(), notes: Vec::new() })
        }
    }
}
