//! Files appear under their final name only when they are whole.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Write `bytes` to `path` through a neighbour that is renamed when complete.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let partial = partial_name(path);
    let told = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", path.display()));
    std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path)).map_err(told)
}

/// Create the neighbour of `path` that becomes it when [`finish`]ed.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn create(path: &Path) -> io::Result<File> {
    File::create(partial_name(path)).map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))
}

/// Give a complete neighbour its final name.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn finish(path: &Path) -> io::Result<()> {
    std::fs::rename(partial_name(path), path)
        .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))
}

/// Make a directory and those above it.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn create_dir(path: &Path) -> io::Result<()> {
    std::fs::create_dir_all(path).map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))
}

/// The name a file has while it is written.
fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}
