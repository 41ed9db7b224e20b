//! Folders are written within a temporary folder next to their target and change places with what was there when they are complete.
//!
//! # Invariants
//!
//! Nothing is removed that this program did not write: a folder is replaced only if it contains nothing but the files that its own index
//! lists, and only these are removed. At every moment the old folder or the new one is at the target, or the old one is next to it and the
//! error says where.
//!
//! A temporary folder contains a file that its process keeps locked. If the process is killed, the next one with the same target
//! finds the file unlocked and removes the folder.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::RwLockReadGuard;

use crate::abandoned::{LOCK, REPLACED, exists, remove_abandoned, temporary_name};
use crate::atomic_file::{final_path, parent_folder, sync_folder, unfinished};
use crate::error::{Error, Result};

/// The replaced folder within the temporary one once the new one is at the target.
const REMOVED: &str = "removed";

/// A temporary folder in the folder of a target, removed when it is dropped. As long as it exists, its thread must not call
/// [`write_atomically`](crate::atomic_file::write_atomically): a thread waiting in
/// [`block_writes`](crate::atomic_file::block_writes) would deadlock both.
#[derive(Debug)]
pub struct TemporaryFolder {
    /// Declared before the lock and the guard, so that it is removed before they are released.
    folder: tempfile::TempDir,
    _lock: File,
    _guard: RwLockReadGuard<'static, ()>,
}

impl TemporaryFolder {
    /// Creates one in the folder of the file `path`, behind its symbolic links.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`, also if something other than a regular file exists there.
    pub fn next_to(path: &Path) -> Result<Self> {
        let create = || {
            let target = final_path(path)?;
            if fs::metadata(&target).is_ok_and(|found| !found.is_file()) {
                return Err(io::Error::other("exists and is not a regular file"));
            }
            TemporaryFolder::beside(&target)
        };
        create().map_err(|error| Error::io(path, error))
    }

    /// Creates one in the folder of the folder `path`, behind its symbolic links. `own_files` lists the files that this program wrote
    /// into a folder of the same kind.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`, also if something exists there that [`TemporaryFolder::move_folder`] would not replace.
    pub fn next_to_folder(
        path: &Path,
        own_files: impl Fn(&Path) -> Result<Vec<String>>,
    ) -> Result<Self> {
        let create = || {
            let target = final_path(path)?;
            if exists(&target) {
                replaceable(&target, own_files)?;
            }
            TemporaryFolder::beside(&target)
        };
        create().map_err(|error| Error::io(path, error))
    }

    fn beside(target: &Path) -> io::Result<Self> {
        let (parent, name) = (parent_folder(target), target.file_name().unwrap_or_default());
        let _guard = unfinished();
        let folder = temporary_name().tempdir_in(parent)?;
        let _lock = locked(folder.path(), name)?;
        remove_abandoned(parent, name, folder.path());
        Ok(TemporaryFolder { folder, _lock, _guard })
    }

    /// The path of the temporary folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Moves a finished folder out of this one to `path`, behind its symbolic links. What was there is replaced, if it contains
    /// only files that `own_files` lists.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`; what was there is then unchanged, or the message says where it is.
    pub fn move_folder(
        mut self,
        name: &str,
        path: &Path,
        own_files: impl Fn(&Path) -> Result<Vec<String>>,
    ) -> Result<()> {
        let new = self.path().join(name);
        let replace = || {
            sync_folder(&new)?;
            let target = final_path(path)?;
            if !exists(&target) {
                fs::rename(&new, &target)?;
                return sync_folder(parent_folder(&target));
            }
            let files = replaceable(&target, own_files)?;
            let old = self.exchange(&new, &target)?;
            let removed =
                sync_folder(parent_folder(&target)).and_then(|()| remove_files(&old, &files));
            removed.map_err(|error| self.keep(&old, &error))
        };
        replace().map_err(|error| Error::io(path, error))
    }

    /// Moves a finished file out of this folder to `path`, behind its symbolic links, and removes the folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] with `path`; what was there is then unchanged.
    pub fn move_file(self, name: &str, path: &Path) -> Result<()> {
        let rename = || {
            let (new, target) = (self.path().join(name), final_path(path)?);
            // Windows syncs only what is open for writing.
            fs::OpenOptions::new().write(true).open(&new)?.sync_all()?;
            fs::rename(new, &target)?;
            sync_folder(parent_folder(&target))
        };
        rename().map_err(|error| Error::io(path, error))
    }

    /// Replaces the path in an [`Error::Io`] of a file in this folder, which no user has named, by `path`.
    pub fn hide_in(&self, error: Error, path: &Path) -> Error {
        match error {
            Error::Io { path: inner, source } if inner.starts_with(self.path()) => {
                Error::io(path, source)
            }
            other => other,
        }
    }

    /// Puts a new folder in the place of an old one. Returns where the old one is.
    fn exchange(&mut self, new: &Path, target: &Path) -> io::Result<PathBuf> {
        match exchange(new, target) {
            Ok(()) => Ok(new.to_owned()),
            Err(_) => self.rename_both(new, target, |from, to| fs::rename(from, to)),
        }
    }

    /// As `exchange`, in two steps, for file systems that cannot exchange two folders.
    fn rename_both(
        &mut self,
        new: &Path,
        target: &Path,
        mut rename: impl FnMut(&Path, &Path) -> io::Result<()>,
    ) -> io::Result<PathBuf> {
        let (old, removed) = (self.path().join(REPLACED), self.path().join(REMOVED));
        rename(target, &old)?;
        if let Err(error) = rename(new, target) {
            return Err(match rename(&old, target) {
                Ok(()) => error,
                Err(_) => self.keep(&old, &error),
            });
        }
        Ok(rename(&old, &removed).map_or(old, |()| removed))
    }

    /// Keeps this folder for ever, because it contains an old one. Returns the error with the place of the old one.
    fn keep(&mut self, old: &Path, error: &io::Error) -> io::Error {
        self.folder.disable_cleanup(true);
        // Without it, no later process takes the folder for an abandoned one.
        let _ = fs::remove_file(self.path().join(LOCK));
        io::Error::new(error.kind(), format!("{error}; the old folder is {}", old.display()))
    }
}

/// The files in a folder that may be replaced: all that is there was written by this program.
fn replaceable(
    folder: &Path,
    own_files: impl Fn(&Path) -> Result<Vec<String>>,
) -> io::Result<Vec<String>> {
    let refused = |what: String| io::Error::other(format!("already exists, {what}"));
    if !fs::metadata(folder)?.is_dir() {
        return Err(refused("expected a name that is free".to_owned()));
    }
    let mut found = fs::read_dir(folder)?
        .map(|entry| entry.and_then(|entry| Ok((entry.file_name(), entry.file_type()?.is_file()))))
        .collect::<io::Result<Vec<(OsString, bool)>>>()?;
    found.sort_unstable();
    let in_it = |name: &OsStr| name.to_string_lossy().escape_debug().to_string();
    let mut listed = own_files(folder).map_err(|error| match found.first() {
        Some((first, _)) => refused(format!(
            "and this program may not have written {} in it: {error}",
            in_it(first)
        )),
        None => refused("expected a name that is free".to_owned()),
    })?;
    listed.sort_unstable();
    let is_listed = |name: &str| listed.binary_search_by(|own| (**own).cmp(name)).is_ok();
    let foreign =
        found.iter().find(|(name, is_file)| !(*is_file && name.to_str().is_some_and(is_listed)));
    match foreign {
        Some((name, _)) => {
            Err(refused(format!("and this program did not write {} in it", in_it(name))))
        }
        None => Ok(listed),
    }
}

/// Lets two folders change their places, in one step.
#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Removes some files of a folder and then the folder, if nothing else is in it.
fn remove_files(folder: &Path, files: &[String]) -> io::Result<()> {
    for file in files {
        match fs::remove_file(folder.join(file)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    fs::remove_dir(folder)
}

/// Makes the locked file of a temporary folder.
fn locked(folder: &Path, name: &OsStr) -> io::Result<File> {
    let unlocked = folder.join("unlocked.part");
    let mut file = File::create_new(&unlocked)?;
    // On a file system without locks, no process can lock the file, so none takes the folder for an abandoned one.
    let _ = file.try_lock();
    file.write_all(name.as_encoded_bytes())?;
    // It has its name only once it is locked.
    fs::rename(unlocked, folder.join(LOCK))?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A target with one file, and a temporary folder with a new one, `made`.
    fn old_and_new(parent: &Path) -> (PathBuf, TemporaryFolder) {
        let target = parent.join("a.isp");
        fs::create_dir(&target).expect("made");
        fs::write(target.join("old"), "old").expect("written");
        let work = TemporaryFolder::next_to_folder(&target, own).expect("a folder");
        fs::create_dir(work.path().join("made")).expect("made");
        fs::write(work.path().join("made/new"), "new").expect("written");
        (target, work)
    }

    fn own(_: &Path) -> Result<Vec<String>> {
        Ok(vec!["old".to_owned()])
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("readable").map(|e| e.expect("readable"));
        let mut names: Vec<_> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn without_an_exchange_two_renames_do_the_same() {
        let parent = tempfile::tempdir().expect("a folder");
        let (target, mut work) = old_and_new(parent.path());
        let new = work.path().join("made");
        let old = work.rename_both(&new, &target, rename).expect("renamed");
        assert_eq!((names(&target), names(&old)), (vec!["new".to_owned()], vec!["old".to_owned()]));
        remove_files(&old, &["old".to_owned(), "missing".to_owned()]).expect("removed");
        drop(work);
        assert_eq!(names(parent.path()), ["a.isp"]);
        // If there is nothing new to rename, the old folder is back at its place.
        let mut work = TemporaryFolder::next_to(&parent.path().join("b")).expect("a folder");
        let none = parent.path().join("none");
        work.rename_both(&none, &target, rename).expect_err("nothing to rename");
        drop(work);
        assert_eq!(names(&target), ["new"]);
    }

    fn rename(from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    #[test]
    fn an_old_folder_that_cannot_return_to_its_place_is_kept_and_named() {
        let parent = tempfile::tempdir().expect("a folder");
        let (target, mut work) = old_and_new(parent.path());
        let new = work.path().join("made");
        let mut n_renames = 0;
        let only_first = |from: &Path, to: &Path| {
            n_renames += 1;
            if n_renames == 1 { rename(from, to) } else { Err(io::ErrorKind::StorageFull.into()) }
        };
        let error = work.rename_both(&new, &target, only_first).expect_err("two renames fail");
        let old = work.path().join(REPLACED);
        assert!(error.to_string().ends_with(&format!("the old folder is {}", old.display())));
        drop(work);
        let _next = TemporaryFolder::next_to_folder(&target, own).expect("a folder");
        assert_eq!(names(&old), ["old"]);
    }

    #[test]
    fn an_old_folder_that_gets_a_foreign_file_meanwhile_is_kept() {
        let parent = tempfile::tempdir().expect("a folder");
        let (target, work) = old_and_new(parent.path());
        fs::write(target.join("mine"), "mine").expect("written");
        let refused = work.move_folder("made", &target, own).expect_err("not of this program");
        assert!(refused.to_string().contains("did not write mine in it"), "{refused}");
        assert_eq!(names(&target), ["mine", "old"]);
        assert_eq!(names(parent.path()), ["a.isp"]);

        let mut work = TemporaryFolder::next_to(&parent.path().join("b")).expect("a folder");
        let old = work.path().join("old");
        fs::rename(&target, &old).expect("renamed");
        let error = remove_files(&old, &["old".to_owned()]).expect_err("not empty");
        let error = work.keep(&old, &error).to_string();
        assert!(error.contains(&old.display().to_string()), "{error}");
        drop(work);
        let _next = TemporaryFolder::next_to(&parent.path().join("b")).expect("a folder");
        assert_eq!(names(&old), ["mine"]);
    }
}
