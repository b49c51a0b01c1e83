//! Where a scene's files come from: the disk, or the program itself. In flow paths, out flow bytes.

use std::borrow::Cow;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use super::builtin;
use crate::{Error, Result};

/// A place that holds files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Files {
    /// The file system.
    Disk,
    /// What was compiled in; paths start at `built-in`.
    BuiltIn,
}

/// The largest file that is read; triangle indices and pixel counts of larger ones would leave 32 bits.
const LARGEST: u64 = 4 << 30;

impl Files {
    /// The bytes of the file at `path`.
    pub fn read(self, path: &Path) -> Result<Cow<'static, [u8]>> {
        match self {
            Self::BuiltIn => builtin::file(&resolved(path))
                .map(Cow::Borrowed)
                .ok_or_else(|| Error::file(path, "read", io::ErrorKind::NotFound.into())),
            Self::Disk => from_disk(path).map(Cow::Owned),
        }
    }

    /// Whether there is a file at `path`.
    pub fn exists(self, path: &Path) -> bool {
        match self {
            Self::BuiltIn => builtin::file(&resolved(path)).is_some(),
            Self::Disk => path.is_file(),
        }
    }

    /// One name for the file that `path` leads to, for comparisons.
    pub fn identity(self, path: &Path) -> PathBuf {
        match self {
            Self::BuiltIn => resolved(path),
            Self::Disk => path.canonicalize().unwrap_or_else(|_| path.into()),
        }
    }
}

fn from_disk(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |source| Error::file(path, "read", source);
    let metadata = path.metadata().map_err(unreadable)?;
    // A pipe or a device might never end.
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "is a folder" } else { "is no regular file" };
        return Err(Error::input(path, 0, format!("{what}; name a file")));
    }
    if metadata.len() > LARGEST {
        let size = metadata.len() as f64 / f64::from(1 << 30);
        return Err(Error::input(path, 0, format!("holds {size:.1} GiB; files up to 4 GiB are read")));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    std::fs::File::open(path).and_then(|file| file.take(LARGEST).read_to_end(&mut bytes)).map_err(unreadable)?;
    Ok(bytes)
}

/// `path` without `.` and `..`.
fn resolved(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut folder, component| {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                folder.pop();
            }
            other => folder.push(other),
        }
        folder
    })
}
