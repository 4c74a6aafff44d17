//! One error type. Every variant names what is at fault and says what to do about it.

use std::path::{Path, PathBuf};

/// The result of anything here that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can go wrong, in the words that the user reads.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene file that cannot be rendered; `fault` holds the JSON path where there is one.
    #[error("{}: {fault}", path.display())]
    Scene { path: PathBuf, fault: String },
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    /// An image that cannot be read, written or resumed.
    #[error("{}: {fault}", path.display())]
    Image { path: PathBuf, fault: String },
    /// No Vulkan device here can run lightfall; the text says what to install.
    #[error("{0}")]
    NoDevice(String),
    /// A device that failed or lacks something; the text says which and what to do.
    #[error("device {device}: {fault}")]
    Device { device: String, fault: String },
    /// A command line option out of range.
    #[error("{option}: {fault}")]
    Option { option: &'static str, fault: String },
}

impl Error {
    /// A fault in the scene file `path`.
    pub fn scene(path: &Path, fault: impl Into<String>) -> Self {
        Self::Scene {
            path: path.into(),
            fault: fault.into(),
        }
    }

    /// A fault in the image file `path`.
    pub fn image(path: &Path, fault: impl Into<String>) -> Self {
        Self::Image {
            path: path.into(),
            fault: fault.into(),
        }
    }

    /// A failed read or write of `path`.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.into(),
            source,
        }
    }
}
