//! Real volumes, where they are: the folder ISOSPECTRUM_DATA, or `../shared/data` beside the repository.
use std::path::{Path, PathBuf};

/// The folder of real volumes; `None`, said loudly, where there is none.
pub(crate) fn folder(test: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("ISOSPECTRUM_DATA").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("NOT RUN: {test}: no folder {} (set ISOSPECTRUM_DATA)", folder.display());
    None
}

/// One file of the folder; `None`, said loudly, where there is none.
pub(crate) fn file(test: &str, name: &str) -> Option<PathBuf> {
    let path = folder(test)?.join(name);
    if path.is_file() {
        return Some(path);
    }
    eprintln!("NOT RUN: {test}: no {} (ISOSPECTRUM_DATA names the folder)", path.display());
    None
}
