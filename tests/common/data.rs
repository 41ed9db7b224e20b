//! Real volumes, which are not in the repository: in the folder `$ISOSPECTRUM_DATA`, or `../shared/data` next to it.
//!
//! Tests that need them are in modules `real_volumes` and ignored by default; `scripts/test` runs them where the folder exists.

use std::path::{Path, PathBuf};

fn place() -> PathBuf {
    let neighbour = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    std::env::var_os("ISOSPECTRUM_DATA").map_or_else(neighbour, PathBuf::from)
}

/// The folder of real volumes: an absolute path, because programs are run in folders of their own.
pub(crate) fn folder() -> PathBuf {
    let folder = place();
    assert!(folder.is_dir(), "no folder {}: set ISOSPECTRUM_DATA", folder.display());
    folder.canonicalize().expect("a folder that exists")
}

/// One file of the folder.
pub(crate) fn file(name: &str) -> PathBuf {
    let path = folder().join(name);
    assert!(path.is_file(), "no {}: set ISOSPECTRUM_DATA", path.display());
    path
}
