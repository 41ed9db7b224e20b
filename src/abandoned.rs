//! Temporary files and folders next to their target, and those that killed processes have left.
//!
//! # Invariants
//!
//! Each is locked by its process: a file itself, a folder by a file in it. One that can be locked was left by a killed process, and the
//! next process with the same target removes it, if it has the same owner and a folder contains nothing else than this program writes.
//! A file is known by its name, which contains a checksum of the target's.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// The start of the names of temporary files and folders.
const PREFIX: &str = ".isospectrum-";

/// The end of the names of temporary files and folders.
const SUFFIX: &str = ".part";

/// Most temporary files of one target whose names are tried in turn; more have random names, and are not removed once abandoned.
const MAX_FILES: usize = 16;

/// The locked file in a temporary folder; its content is the name of the target.
pub(crate) const LOCK: &str = "lock";

/// Most bytes that are read of a lock; names of files have at most 255.
const MAX_NAME: u64 = 1024;

/// The extensions of all files that are written within temporary folders.
const EXTENSIONS: [&str; 5] = ["part", "png", "log", "mp4", "webm"];

/// Names of temporary folders, and of files beyond [`MAX_FILES`].
pub(crate) fn temporary_name() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    builder
}

/// Creates a temporary file for a target in the folder `parent`, locks it and removes abandoned ones for the same target.
/// `create` creates a file by a builder of names.
pub(crate) fn temporary_file(
    parent: &Path,
    target: &OsStr,
    create: impl Fn(&mut tempfile::Builder<'_, '_>) -> io::Result<NamedTempFile>,
) -> io::Result<NamedTempFile> {
    let crc32 = crc32fast::hash(target.as_encoded_bytes());
    let mut others: Vec<PathBuf> = Vec::new();
    for number in 0..MAX_FILES {
        let name = format!("{PREFIX}{crc32:08x}-{number}{SUFFIX}");
        match create(tempfile::Builder::new().prefix(&name).suffix("").rand_bytes(0)) {
            Ok(file) if is_held(file.as_file()) => {
                let of_user = others.iter().filter(|other| have_same_owner(other, file.path()));
                of_user.for_each(|other| remove_file_if_abandoned(other));
                return Ok(file);
            }
            // Another process takes it for an abandoned one.
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                others.push(parent.join(name));
            }
            Err(error) => return Err(error),
        }
    }
    create(&mut temporary_name())
}

/// Locks a new file. False if another process has locked or removed it since it was created.
fn is_held(file: &File) -> bool {
    // On a file system without locks, no process can lock the file, so none takes it for an abandoned one.
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return false;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        file.metadata().is_ok_and(|found| found.nlink() > 0)
    }
    #[cfg(not(unix))]
    true
}

/// Removes a temporary file that no process has locked. What cannot be removed stays.
fn remove_file_if_abandoned(path: &Path) {
    let remove = || {
        if !fs::symlink_metadata(path)?.is_file() {
            return Err(io::Error::other("not a file"));
        }
        let file = fs::OpenOptions::new().read(true).write(true).open(path)?;
        file.try_lock()?;
        fs::remove_file(path)
    };
    if let Err(error) = remove() {
        log::debug!("{}: stays: {error}", path.display());
    }
}

/// Removes the temporary folders for a target whose processes were killed, if they have the owner of `own`. What cannot be removed
/// stays.
pub(crate) fn remove_abandoned(parent: &Path, target: &OsStr, own: &Path) {
    let Ok(entries) = fs::read_dir(parent) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_temporary =
            name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        if is_temporary
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
            && have_same_owner(&entry.path(), own)
            && let Err(error) = remove_if_abandoned(&entry.path(), target)
        {
            log::debug!("{}: stays: {error}", entry.path().display());
        }
    }
}

/// Whether two files or folders belong to one user. In a folder for all users, others could exchange what is in theirs meanwhile.
fn have_same_owner(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let owner = |path: &Path| fs::symlink_metadata(path).ok().map(|found| found.uid());
        owner(a).is_some() && owner(a) == owner(b)
    }
    #[cfg(not(unix))]
    {
        a.exists() && b.exists()
    }
}

/// Removes a temporary folder if it is for a target and no process has it.
fn remove_if_abandoned(folder: &Path, target: &OsStr) -> io::Result<()> {
    let path = folder.join(LOCK);
    if !fs::symlink_metadata(&path)?.is_file() {
        return Err(io::Error::other("its lock is not a file"));
    }
    let lock = fs::OpenOptions::new().read(true).write(true).open(&path)?;
    lock.try_lock()?;
    let mut name = Vec::new();
    (&lock).take(MAX_NAME).read_to_end(&mut name)?;
    if name != target.as_encoded_bytes() {
        return Err(io::Error::other("it is for another target"));
    }
    contents(folder)?.iter().try_for_each(fs::remove_file)?;
    // Last, so that the folder is found again if this process is killed.
    fs::remove_file(path)?;
    fs::remove_dir(folder)
}

/// The files in a temporary folder, except its lock; an error if there is anything that no process writes there.
fn contents(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name() == LOCK {
            continue;
        }
        let path = entry.path();
        let extension = path.extension().and_then(OsStr::to_str);
        if !entry.file_type()?.is_file() || !extension.is_some_and(|e| EXTENSIONS.contains(&e)) {
            return Err(io::Error::other(format!("{}: not of this program", path.display())));
        }
        files.push(path);
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn an_abandoned_folder_is_removed_by_the_next_one_for_its_target_if_all_in_it_is_known() {
        let parent = tempfile::tempdir().expect("a folder");
        let killed = parent.path().join(".isospectrum-1.part");
        fs::create_dir_all(killed.join("mine")).expect("made");
        fs::write(killed.join(LOCK), "a.isp").expect("written");
        fs::write(killed.join("000000.part"), "part").expect("written");
        remove_abandoned(parent.path(), OsStr::new("a.isp"), parent.path());
        assert!(killed.join("000000.part").exists());
        fs::remove_dir(killed.join("mine")).expect("there");
        remove_abandoned(parent.path(), OsStr::new("b.isp"), parent.path());
        assert!(killed.exists());
        remove_abandoned(parent.path(), OsStr::new("a.isp"), parent.path());
        assert!(!killed.exists());
    }

    #[test]
    fn an_abandoned_file_is_removed_by_the_next_one_for_its_target() {
        let parent = tempfile::tempdir().expect("a folder");
        let create = |target: &str| {
            temporary_file(parent.path(), target.as_ref(), |name| name.tempfile_in(parent.path()))
                .expect("a file")
        };
        let [first, second] = [create("a.isp"), create("a.isp")];
        assert!(first.path().exists(), "it is locked");
        assert_ne!(first.path(), second.path());
        // As after a kill: the lock ends, the file stays.
        let first = first.into_temp_path().keep().expect("kept");
        drop(create("b.isp"));
        assert!(first.exists(), "another target");
        let third = create("a.isp");
        assert!(!first.exists() && second.path().exists() && third.path().exists());
        // A folder of this name is of somebody else.
        fs::create_dir(&first).expect("made");
        drop(create("a.isp"));
        assert!(first.exists());
    }
}
