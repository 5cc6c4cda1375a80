//! Writing a file in one step: the new content goes to a temporary file in the same folder, is flushed to the
//! disk, and takes the place of the old file only then. Whatever fails before leaves the old file as it was and
//! no temporary file behind.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Why a file was not written. The old file, if there was one, is untouched.
#[derive(Debug, thiserror::Error)]
#[error("cannot save {}: {action} failed: {source}; {}; the old file is untouched", path.display(), advice(source))]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// What was being done.
    pub action: &'static str,
    /// What the system said.
    pub source: io::Error,
}

/// What to do about it.
fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space or save elsewhere",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "make the file and its folder writable or save elsewhere"
        }
        ErrorKind::NotFound | ErrorKind::NotADirectory => "save into a folder that exists",
        ErrorKind::IsADirectory => "give the file another name, this one is a folder",
        _ => "save elsewhere",
    }
}

/// Replaces the content of `path` by `bytes`.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    write_with(path, |file| file.write_all(bytes))
}

/// Replaces the content of `path` by what `content` writes.
pub fn write_with(path: &Path, content: impl FnOnce(&mut File) -> io::Result<()>) -> Result<(), WriteError> {
    let failed = |action| move |source| WriteError { path: path.into(), action, source };
    // A link stays a link: the file that it names is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let old = fs::metadata(&target).ok();
    if let Some(old) = &old {
        let refusal = if old.is_dir() {
            Some(ErrorKind::IsADirectory)
        } else if old.permissions().readonly() {
            Some(ErrorKind::PermissionDenied)
        } else {
            None
        };
        if let Some(kind) = refusal {
            return Err(failed("replacing it")(kind.into()));
        }
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".patchwright-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // less the umask, as for any new file
    let mut file = builder.tempfile_in(folder).map_err(failed("making a file in its folder"))?;
    content(file.as_file_mut()).map_err(failed("writing"))?;
    file.as_file().sync_all().map_err(failed("flushing it to the disk"))?;
    if let Some(old) = old {
        // A copy of the permissions is a courtesy; a file system without them must not stop the save.
        let _ = file.as_file().set_permissions(old.permissions());
    }
    file.persist(&target).map_err(|e| failed("putting it in place")(e.error))?;
    #[cfg(unix)]
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all(); // the rename itself; the content is safe already
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_disk_that_fills_up_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.igs");
        write(&path, b"old").unwrap();
        let error = write_with(&path, |file| {
            file.write_all(b"half of the new")?;
            Err(ErrorKind::StorageFull.into())
        })
        .unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["model.igs"]);
        let text = error.to_string();
        assert!(text.contains("model.igs") && text.contains("writing") && text.contains("free some space"), "{text}");
    }

    #[test]
    fn read_only_files_and_folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.igs");
        write(&path, b"old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = write(&path, b"new").unwrap_err().to_string();
        assert!(error.contains("writable"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert!(write(folder.path(), b"new").unwrap_err().to_string().contains("is a folder"));
        assert!(write(&folder.path().join("none/model.igs"), b"new").unwrap_err().to_string().contains("that exists"));
        // Not even the superuser can make files there.
        if Path::new("/sys/kernel").is_dir() {
            let error = write(Path::new("/sys/kernel/model.igs"), b"new").unwrap_err().to_string();
            assert!(error.contains("/sys/kernel/model.igs") && error.contains("save elsewhere"), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("model.igs"), folder.path().join("link.igs"));
        write(&path, b"old").unwrap();
        fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write(&link, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
