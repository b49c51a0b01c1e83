//! Files that are written whole or not at all. In flow a path, before the work starts, and bytes, when it is done.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// A format that images are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR: linear radiance and extra layers.
    Exr,
    /// PNG: display values.
    Png,
}

impl ImageFormat {
    /// The format that the extension of `path` asks for.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::input(path, 0, "unknown image format; name the output .exr or .png")),
        }
    }
}

/// A file that can be written: its folder exists and takes files, and nothing but a file is in its place.
#[derive(Clone, Debug)]
pub struct OutputFile {
    path: PathBuf,
    /// Behind symbolic links, which stay.
    target: PathBuf,
}

impl OutputFile {
    /// Checks that `path` can be written, and leaves nothing there.
    pub fn new(path: &Path) -> Result<Self> {
        if path.file_name().is_none() {
            return Err(Error::input(path, 0, "names no file; add a file name"));
        }
        let target = behind_links(path).map_err(|source| Error::file(path, "write", source))?;
        match fs::metadata(&target) {
            Ok(metadata) if metadata.is_dir() => {
                return Err(Error::input(path, 0, "is a folder; add a file name"));
            }
            Ok(metadata) if !metadata.is_file() => {
                return Err(Error::input(
                    path,
                    0,
                    "is a device, pipe or socket, which cannot be replaced; name a file",
                ));
            }
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(Error::file(path, "write", error)),
        }
        let folder = folder_of(&target);
        if !folder.is_dir() {
            return Err(Error::input(
                path,
                0,
                format!("folder {:?} does not exist; create it first", folder.display()),
            ));
        }
        let output = Self { path: path.into(), target };
        output.temporary().map_err(|source| Error::file(path, "write", source))?;
        Ok(output)
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Puts a file with these bytes in place. After an error the old file, if any, is as it was.
    pub fn write(&self, bytes: &[u8]) -> Result<()> {
        self.write_with(|file| file.write_all(bytes))
    }

    /// As [`OutputFile::write`], with the content from `write`.
    pub fn write_with(&self, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
        let replace = || {
            let mut temporary = self.temporary()?;
            write(temporary.as_file_mut())?;
            temporary.as_file_mut().flush()?;
            if let Ok(old) = fs::metadata(&self.target) {
                temporary.as_file().set_permissions(old.permissions())?;
            }
            temporary.as_file().sync_all()?;
            temporary.persist(&self.target).map_err(|error| error.error)
        };
        replace().map(|_| ()).map_err(|source| Error::file(&self.path, "write", source))
    }

    /// A file beside the target that vanishes unless it is put in place.
    fn temporary(&self) -> io::Result<tempfile::NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".vitrum-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // Less the umask, as any other file.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        builder.tempfile_in(folder_of(&self.target))
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Where symbolic links at `path` lead to, whether or not something is there.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    // As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(link) => path = folder_of(&path).join(link),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}
