//! What can go wrong, sorted by whose turn it is: the user's input, the machine's Vulkan, or a check that failed.

use std::path::{Path, PathBuf};

/// The result of everything in this crate that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error that names value, place and next step in one line.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A command line or option that cannot be honoured.
    #[error("{0}")]
    Usage(String),

    /// A file whose content is wrong; `line` counts from 1 and is 0 where the format has no lines.
    #[error("{}: {message}", place(path, *line))]
    Input {
        /// The file.
        path: PathBuf,
        /// Its line, or 0.
        line: usize,
        /// What is wrong and what would be right.
        message: String,
    },

    /// A file that cannot be read or written.
    #[error("{}: cannot {action}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was tried: "read", "write" and the like.
        action: &'static str,
        /// The system's reason.
        #[source]
        source: std::io::Error,
    },

    /// No Vulkan device that can be used, or the device was lost.
    #[error(transparent)]
    Gpu(#[from] crate::gpu::GpuError),

    /// A check that the user asked for failed.
    #[error("{0}")]
    Check(String),
}

impl Error {
    /// A wrong place in a file. `line` 0: the file as a whole.
    pub fn input(path: impl AsRef<Path>, line: usize, message: impl Into<String>) -> Self {
        Self::Input { path: path.as_ref().into(), line, message: message.into() }
    }

    /// A file that the system would not let us `action`.
    pub fn file(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        Self::File { path: path.as_ref().into(), action, source }
    }

    /// This error and what caused it in one line, for messages that go on.
    pub fn in_full(&self) -> String {
        let mut text = self.to_string();
        let mut source = std::error::Error::source(self);
        while let Some(cause) = source {
            text.push_str(&format!(": {cause}"));
            source = cause.source();
        }
        text
    }

    /// The exit code of the binary: 1 failed check, 2 bad usage or input, 3 no usable device.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Check(_) => 1,
            Self::Usage(_) | Self::Input { .. } | Self::File { .. } => 2,
            Self::Gpu(error) => error.exit_code(),
        }
    }
}

fn place(path: &Path, line: usize) -> String {
    match line {
        0 => path.display().to_string(),
        line => format!("{}:{line}", path.display()),
    }
}
