//! Files: reading a model into a document with a report of everything that was met, and writing one.
//!
//! [`open`] chooses the reader by what the file contains, then by its extension; [`save`] chooses the writer by
//! extension. Every reader returns an [`ImportReport`] beside the document: an entity of the file either becomes
//! geometry or a line there. Every writer replaces the old file in one step, or leaves it as it was.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::model::document::Document;
use crate::model::spec::HealSpec;
use crate::model::traces::SurfaceTrace;

pub(crate) mod atomic;
pub mod autosave;
mod color;
mod discrete;
pub mod export;
mod faces;
mod format;
pub mod iges;
mod number;
pub mod obj;
pub mod plot3d;
pub mod project;
pub(crate) mod report;
mod stamp;
pub mod step;
pub mod stl;
mod tidy;

pub use atomic::WriteError;
pub use discrete::DiscreteError;
pub use format::{Format, PROJECT_EXTENSION};
pub use report::{ImportReport, ReportLine, Severity};

/// How many bytes of a file are looked at to see whether it has to be read as a whole.
const BEGINNING: u64 = 4096;

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
    /// It is no mesh or grid that can be read.
    #[error("{} cannot be read as {}: {source}", path.display(), format.name())]
    Discrete {
        /// The file.
        path: PathBuf,
        /// What it was taken for.
        format: Format,
        /// What is wrong with it.
        source: DiscreteError,
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
    /// The document cannot be made into what the format holds.
    #[error("cannot save {} as {}: {source}", path.display(), format.name())]
    Export {
        /// The file.
        path: PathBuf,
        /// The format.
        format: Format,
        /// What is wrong.
        source: export::ExportError,
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
    /// What is one edge, and how surfaces become triangles (STL, OBJ) or grids (Plot3D).
    pub export: export::ExportOptions,
}

/// What was written.
#[derive(Clone, Debug, Default)]
pub struct Saved {
    /// Entities written.
    pub entities: usize,
    /// What the format could not hold, one line each.
    pub notes: Vec<String>,
    /// How surfaces became triangles or grids, or how well they fit as B-splines.
    pub export: Option<export::ExportSummary>,
}

/// Reads a model. Of a whole binary STL file a few batches are in memory at a time;
/// other files are read as a whole.
pub fn open(path: &Path) -> Result<Opened, OpenError> {
    let unreadable = |source| OpenError::Read { path: path.into(), source };
    let mut file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let mut bytes = Vec::new();
    file.by_ref().take(BEGINNING).read_to_end(&mut bytes).map_err(unreadable)?;
    if Format::of_beginning(&bytes, length) == Some(Format::Stl) && stl::is_exact_binary(&bytes, length) {
        let mut report = ImportReport::default();
        let mesh = stl::read_binary(bytes.chain(file), length, &mut report).map_err(unreadable)?;
        return discrete::of_stl(mesh, report).map_err(|source| OpenError::Discrete {
            path: path.into(),
            format: Format::Stl,
            source,
        });
    }
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.is_empty() {
        return Err(OpenError::Empty { path: path.into() });
    }
    read(path, &bytes, Format::of_content(&bytes).or_else(|| Format::of_name(path)))
}

/// Reads the bytes of a file as one format; without any as Plot3D. The path is for messages.
pub fn read(path: &Path, bytes: &[u8], format: Option<Format>) -> Result<Opened, OpenError> {
    match format {
        Some(Format::Iges) => iges::read(bytes).map_err(|source| OpenError::Iges { path: path.into(), source }),
        Some(Format::Step) => Ok(step::open(bytes)),
        Some(Format::Project) => {
            project::read(bytes).map_err(|source| OpenError::Project { path: path.into(), source })
        }
        Some(format @ (Format::Stl | Format::Obj | Format::Plot3d)) => {
            discrete::open(bytes, format).map_err(|source| OpenError::Discrete { path: path.into(), format, source })
        }
        // Nothing in a Plot3D file says what it is, and its extension may be anything.
        None => discrete::open(bytes, Format::Plot3d).map_err(|_| OpenError::Unknown { path: path.into() }),
    }
}

/// Writes a patch specification, in one step: on an error the file that was there before is untouched.
pub fn save_spec(path: &Path, spec: &HealSpec) -> Result<(), SaveError> {
    let text = spec.to_ron().map_err(|error| SaveError::Project {
        path: path.into(),
        source: project::ProjectWriteError(error.to_string()),
    })?;
    Ok(atomic::write(path, text.as_bytes())?)
}

/// Writes a document, in one step: on an error the file that was there before is untouched.
pub fn save(path: &Path, document: &Document, options: &SaveOptions) -> Result<Saved, SaveError> {
    let unknown = || SaveError::Unknown { path: path.into() };
    match options.format.or_else(|| Format::of_name(path)).ok_or_else(unknown)? {
        format @ (Format::Iges | Format::Step | Format::Stl | Format::Obj | Format::Plot3d) => {
            export::save(path, document, format, &options.export)
        }
        Format::Project => {
            let text = project::write(document).map_err(|source| SaveError::Project { path: path.into(), source })?;
            atomic::write(path, text.as_bytes())?;
            Ok(Saved { entities: document.entities().len(), ..Saved::default() })
        }
    }
}

/// Writes a document with curves on its surfaces as an IGES file, in one step.
pub fn save_iges(path: &Path, document: &Document, traces: &[SurfaceTrace]) -> Result<Saved, SaveError> {
    let file_name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let options = iges::IgesOptions { file_name, time: std::time::SystemTime::now() };
    let (text, saved) = iges::write_with_traces(document, traces, &options)
        .map_err(|source| SaveError::Iges { path: path.into(), source })?;
    atomic::write(path, text.as_bytes())?;
    Ok(saved)
}
