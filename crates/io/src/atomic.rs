//! Writing that leaves the old file or the new one, never half.

use crate::error::IoError;
use std::convert::Infallible;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary files that are being written; held while one is made or renamed, so that an end in between leaves none.
static UNDER_WAY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Bytes that are handed to the system at once.
const AT_ONCE: usize = 1 << 16;

/// Files that [`write_atomic`] leaves alone.
static INPUTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Takes a file for an input of this process: from now on [`write_atomic`] refuses to replace it, under whatever name.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("trial.csv");
/// std::fs::write(&path, "measured")?;
/// ndof_io::keep(&path);
/// assert!(ndof_io::write_atomic(&folder.path().join("./trial.csv"), b"computed").is_err());
/// assert_eq!(std::fs::read(&path)?, b"measured");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn keep(path: &Path) {
    // What does not exist cannot be overwritten.
    if let Ok(own) = std::fs::canonicalize(path).and_then(|own| if own.is_file() { Ok(own) } else { Err(io::ErrorKind::IsADirectory.into()) }) {
        INPUTS.lock().unwrap_or_else(PoisonError::into_inner).push(own);
    }
}

fn under_way() -> MutexGuard<'static, Vec<PathBuf>> {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files that are being written and calls `end`, which must not return: for the handler of an
/// interrupt. Writers in other threads wait meanwhile, so that a file is there as a whole or not at all.
pub fn abandon_writes(end: impl FnOnce() -> Infallible) -> Infallible {
    // Held until the process has ended.
    let paths = under_way();
    for path in paths.iter() {
        // What cannot be removed cannot be helped: the process is about to end.
        let _ = std::fs::remove_file(path);
    }
    end()
}

/// Writes `bytes` to `path`: into a temporary file beside it, to the disk, then renamed over it.
///
/// A crash, a full disk or a signal leaves what stood there before; the temporary file is removed on an error.
/// A file that exists keeps its permissions, a new one gets the usual ones. A link is followed.
///
/// # Errors
/// [`IoError::Write`] with what the system says, [`IoError::Input`] for a file that is [kept](keep).
///
/// ```
/// let dir = tempfile::tempdir()?;
/// let path = dir.path().join("result.json");
/// ndof_io::write_atomic(&path, b"{}")?;
/// assert_eq!(std::fs::read(&path)?, b"{}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    write_atomic_with(path, |to| to.write_all(bytes))
}

/// [`write_atomic`] of what `write` writes, which need not be in memory as a whole.
///
/// # Errors
/// Those of [`write_atomic`], and those of `write`.
///
/// ```
/// let dir = tempfile::tempdir()?;
/// let path = dir.path().join("lines.txt");
/// ndof_io::write_atomic_with(&path, |to| (1..4).try_for_each(|k| writeln!(to, "{k}")))?;
/// assert_eq!(std::fs::read(&path)?, b"1\n2\n3\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_atomic_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), IoError> {
    if std::fs::canonicalize(path).is_ok_and(|own| INPUTS.lock().unwrap_or_else(PoisonError::into_inner).contains(&own)) {
        return Err(IoError::Input { file: path.display().to_string() });
    }
    replace(path, write).map_err(|source| IoError::Write { file: path.display().to_string(), source })
}

fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let existing = std::fs::metadata(&target).ok();
    // A device or a pipe (`/dev/stdout`) has no half-written state that a rename could save; a folder is an error.
    if existing.as_ref().is_some_and(|m| !m.is_file()) {
        return buffered(&std::fs::OpenOptions::new().write(true).open(target)?, write);
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".ndof-").suffix(".tmp");
    let permissions = match &existing {
        Some(metadata) => Some(metadata.permissions()),
        None => usual_permissions(),
    };
    if let Some(permissions) = &permissions {
        builder.permissions(permissions.clone());
    }
    let temporary = {
        let mut paths = under_way();
        let temporary = builder.tempfile_in(folder)?;
        paths.push(temporary.path().to_owned());
        temporary
    };
    let own = temporary.path().to_owned();
    let written = buffered(temporary.as_file(), write).and_then(|()| temporary.as_file().sync_all());
    let mut paths = under_way();
    paths.retain(|path| *path != own);
    written?;
    temporary.persist(&target).map_err(|e| e.error)?;
    drop(paths);
    // Makes the rename itself durable; where a folder cannot be synced the data are still whole.
    let _ = File::open(folder).and_then(|handle| handle.sync_all());
    Ok(())
}

fn buffered(file: &File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut to = io::BufWriter::with_capacity(AT_ONCE, file);
    write(&mut to)?;
    to.flush()
}

#[cfg(unix)]
fn usual_permissions() -> Option<std::fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(std::fs::Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn usual_permissions() -> Option<std::fs::Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_atomic(&path, b"old").unwrap();
        write_atomic(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn a_failure_leaves_no_temporary_file_and_names_the_target() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("taken");
        std::fs::create_dir(&target).unwrap();
        let error = write_atomic(&target, b"x").unwrap_err();
        assert!(error.to_string().contains("taken"), "{error}");
        assert_eq!(names(folder.path()), ["taken"]);
        let error = write_atomic(&folder.path().join("no/such/folder.csv"), b"x").unwrap_err();
        assert!(!error.is_machine_failure(), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_the_machines_failure() {
        let error = write_atomic(Path::new("/dev/full"), b"x").unwrap_err();
        assert!(error.is_machine_failure() && error.to_string().contains("/dev/full"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        std::fs::write(&target, b"old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write_atomic(&link, b"new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&target).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_of_an_existing_file_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, b"old").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        write_atomic(&path, b"new").unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
