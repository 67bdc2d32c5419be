//! What can be wrong with a catalogue, and reading its file.

use std::path::Path;

/// What can be wrong with a catalogue file.
#[derive(Debug, thiserror::Error)]
pub enum CatalogueError {
    /// It cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// What the file system says.
        source: std::io::Error,
    },
    /// It is no catalogue of ours.
    #[error("{path}: {reason}")]
    Format {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
    },
}

/// The bytes of a file or pipe.
///
/// # Errors
/// [`CatalogueError`] if it cannot be read, or is a device that may never end.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, CatalogueError> {
    let io = |source| CatalogueError::Io { path: path.display().to_string(), source };
    let kind = std::fs::metadata(path).map_err(io)?.file_type();
    if kind.is_dir() || is_device(kind) {
        let reason = "neither a file nor a pipe".to_owned();
        return Err(CatalogueError::Format { path: path.display().to_string(), reason });
    }
    std::fs::read(path).map_err(io)
}

#[cfg(unix)]
fn is_device(kind: std::fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: std::fs::FileType) -> bool {
    false
}
