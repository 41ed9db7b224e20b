//! Writes a file beside its place and renames it when it is complete.
//!
//! A full disk, an error or an interruption leaves what was there before, and no part of the new
//! file: the temporary file is removed when it is dropped.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Writes what `content` writes to `path`. A link is followed, and what is no regular file (a
/// device, a pipe) is written to directly.
///
/// # Errors
///
/// [`Error::Io`] with the path asked for; a regular file at `path` then is what it was.
pub fn write_beside(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let place: PathBuf = match fs::canonicalize(path) {
        Ok(place) => place,
        Err(_) => path.to_path_buf(),
    };
    let result = match fs::metadata(&place) {
        Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(metadata) if !metadata.is_file() => {
            fs::OpenOptions::new().write(true).open(&place).and_then(|file| buffered(file, content))
        }
        _ => replace(&place, content),
    };
    result.map_err(|e| Error::io(path, e))
}

fn replace(place: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = match place.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospectrum-").suffix(".part");
    #[cfg(unix)]
    {
        // What any program creates, less the umask; the crate's default is the owner only.
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder)?;
    buffered(file.as_file(), content)?;
    file.persist(place).map_err(|e| e.error)?;
    Ok(())
}

fn buffered(
    file: impl Write,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    content(&mut writer)?;
    writer.flush()
}
