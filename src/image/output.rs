//! Files that are written whole or not at all. In flow a path, before the work starts, and bytes, when it is done.

use std::fs::{self, File, TryLockError};
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

const NOT_A_FILE: &str = "is a device, pipe or socket, which cannot be replaced; name a file";

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
        // Links such as /dev/stdout lead to files that are not ours to replace; /dev/shm is a folder as any other.
        let whole = std::path::absolute(path).map_err(|source| Error::file(path, "write", source))?;
        let is_device = whole.parent() == Some(Path::new("/dev"));
        if is_device || whole.starts_with("/dev/fd") || whole.starts_with("/proc") {
            return Err(Error::input(path, 0, NOT_A_FILE));
        }
        let target = behind_links(path).map_err(|source| Error::file(path, "write", source))?;
        match fs::metadata(&target) {
            Ok(metadata) if metadata.is_dir() => {
                return Err(Error::input(path, 0, "is a folder; add a file name"));
            }
            Ok(metadata) if !metadata.is_file() => {
                return Err(Error::input(path, 0, NOT_A_FILE));
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

    /// Whether writing this would replace the file at `other`.
    pub fn replaces(&self, other: &Path) -> bool {
        let place = |path: &Path| {
            let path = behind_links(path).unwrap_or_else(|_| path.into());
            let folder = folder_of(&path).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        };
        place(&self.target).is_some_and(|target| Some(target) == place(other))
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
            let file = temporary.file();
            write(file)?;
            file.flush()?;
            if let Ok(old) = fs::metadata(&self.target) {
                file.set_permissions(old.permissions())?;
            }
            file.sync_all()?;
            temporary.put(&self.target)
        };
        replace().map_err(|source| Error::file(&self.path, "write", source))
    }

    /// A file on the target's file system that vanishes unless it is put in place.
    fn temporary(&self) -> io::Result<Temporary> {
        let folder = folder_of(&self.target);
        #[cfg(target_os = "linux")]
        if let Some(file) = unnamed::open(folder) {
            return Ok(Temporary::Unnamed(file));
        }
        named(folder).map(Temporary::Named)
    }
}

/// A file that is written and not yet in place.
enum Temporary {
    /// Without a name: nothing is left of it even where the program is killed.
    #[cfg(target_os = "linux")]
    Unnamed(File),
    Named(tempfile::NamedTempFile),
}

impl Temporary {
    fn file(&mut self) -> &mut File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => file,
            Self::Named(file) => file.as_file_mut(),
        }
    }

    fn put(self, target: &Path) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => unnamed::put(&file, target),
            Self::Named(file) => file.persist(target).map(drop).map_err(|error| error.error),
        }
    }
}

/// A file in `folder` that vanishes when it is dropped.
fn named(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".vitrum-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Less the umask, as any other file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(target_os = "linux")]
mod unnamed {
    use std::fs::{self, File};
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open as open_file};

    /// A file in `folder` without a name, where the file system has such.
    pub(super) fn open(folder: &Path) -> Option<File> {
        // Names come by way of /proc.
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = open_file(folder, flags, Mode::from_raw_mode(0o666)).ok()?;
        Path::new("/proc/self/fd").is_dir().then(|| file.into())
    }

    /// Gives the file its name, in the place of what has it.
    pub(super) fn put(file: &File, target: &Path) -> io::Result<()> {
        let itself = format!("/proc/self/fd/{}", file.as_raw_fd());
        let link = |name: &Path| linkat(CWD, &*itself, CWD, name, AtFlags::SYMLINK_FOLLOW);
        match link(target) {
            Err(rustix::io::Errno::EXIST) => {}
            linked => return Ok(linked?),
        }
        // A name cannot be taken from another file; it can be moved to. Whoever is killed between leaves a whole file.
        let folder = super::folder_of(target);
        loop {
            let name = folder.join(format!(".vitrum-{:016x}.part", fastrand::u64(..)));
            match link(&name) {
                Err(rustix::io::Errno::EXIST) => {}
                linked => {
                    linked?;
                    return fs::rename(&name, target).inspect_err(|_| {
                        let _ = fs::remove_file(&name);
                    });
                }
            }
        }
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

/// Whether `folder` is one or can become one; `otherwise` says what to do where it is a file. Nothing is made.
pub fn check_folder(folder: &Path, otherwise: &'static str) -> Result<()> {
    match folder.ancestors().find(|place| place.exists()) {
        Some(place) if !place.is_dir() => Err(Error::input(place, 0, otherwise)),
        _ => Ok(()),
    }
}

/// Makes `folder`, unless it is there.
pub fn make_folder(folder: &Path, otherwise: &'static str) -> Result<()> {
    check_folder(folder, otherwise)?;
    std::fs::create_dir_all(folder).map_err(|source| Error::file(folder, "create", source))
}

/// The file in a folder by which one run at a time has it.
pub const LOCK: &str = "lock";

/// A folder that no other run writes to while this is there.
#[derive(Debug)]
pub struct FolderLock {
    _file: File,
}

impl FolderLock {
    /// Takes the folder, which is there.
    pub fn take(folder: &Path) -> Result<Self> {
        let path = folder.join(LOCK);
        let mut options = File::options();
        let file = options
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(|source| Error::file(&path, "create", source))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let why = "another run writes its report there; wait for it, or name another folder";
                Err(Error::input(folder, 0, why))
            }
            // Some file systems have no locks; there, two runs are the user's to keep apart.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self { _file: file }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[cfg(unix)]
    #[test]
    fn what_stdout_leads_to_is_not_replaced() {
        for path in ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "/dev/null"] {
            let error = OutputFile::new(Path::new(path)).unwrap_err();
            assert!(error.to_string().contains("cannot be replaced"), "{error}");
        }
    }

    #[test]
    fn the_extension_decides_the_format() {
        assert_eq!(ImageFormat::of(Path::new("a/b.EXR")).unwrap(), ImageFormat::Exr);
        assert_eq!(ImageFormat::of(Path::new("b.png")).unwrap(), ImageFormat::Png);
        for name in ["b.jpg", "b", "png", ".png"] {
            let error = ImageFormat::of(Path::new(name)).unwrap_err();
            assert_eq!(error.to_string(), format!("{name}: unknown image format; name the output .exr or .png"));
            assert_eq!(error.exit_code(), 2);
        }
    }

    #[test]
    fn what_cannot_be_written_is_refused_early() {
        let folder = tempfile::tempdir().unwrap();
        let refusal = |path: &Path| {
            let error = OutputFile::new(path).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        };
        assert!(refusal(&folder.path().join("no/a.png")).contains("/no\" does not exist; create it first"));
        assert!(refusal(folder.path()).contains("is a folder"));
        assert!(refusal(Path::new("..")).contains("names no file"));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(OutputFile::new(&folder.path().join("file/a.png")).is_err());
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_file_is_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let output = OutputFile::new(&path).unwrap();
        assert!(names(folder.path()).is_empty());
        output.write(b"first").unwrap();
        output.write(b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let output = OutputFile::new(&path).unwrap();
        output.write(b"old").unwrap();
        let error = output.write_with(|file| {
            file.write_all(b"half of the ne")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        let error = error.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().ends_with("a.exr: cannot write"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_devices_are_refused() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let in_folder = |name: &str| folder.path().join(name);
        fs::create_dir(in_folder("real")).unwrap();
        symlink("real/a.png", in_folder("link.png")).unwrap();
        symlink("link.png", in_folder("chain.png")).unwrap();
        // Dangling at first, then not.
        for content in ["one", "two"] {
            OutputFile::new(&in_folder("chain.png")).unwrap().write(content.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(in_folder("real/a.png")).unwrap(), content);
        }
        assert!(fs::read_link(in_folder("link.png")).is_ok() && fs::read_link(in_folder("chain.png")).is_ok());
        assert_eq!(names(&in_folder("real")), ["a.png"]);
        symlink("loop.png", in_folder("loop.png")).unwrap();
        assert!(OutputFile::new(&in_folder("loop.png")).is_err());
        let error = OutputFile::new(Path::new("/dev/null")).unwrap_err();
        assert!(error.to_string().contains("device, pipe or socket"), "{error}");
        assert!(fs::metadata("/dev/null").is_ok_and(|metadata| !metadata.is_file()));
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_the_umask_or_of_the_old_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let plain = folder.path().join("plain");
        fs::write(&plain, "").unwrap();
        let path = folder.path().join("a.png");
        let output = OutputFile::new(&path).unwrap();
        output.write(b"").unwrap();
        assert_eq!(mode(&path), mode(&plain));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        output.write(b"").unwrap();
        assert_eq!(mode(&path), 0o640);
    }

    /// The real thing, where it can be had: a file system that is full.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_leaves_the_old_file() {
        let full = |file: &mut File| -> io::Result<()> {
            file.write_all(b"new")?;
            File::options().write(true).open("/dev/full")?.write_all(b"rest")
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        fs::write(&path, "old").unwrap();
        let error = OutputFile::new(&path).unwrap().write_with(full).unwrap_err();
        let cause = std::error::Error::source(&error).unwrap().to_string();
        assert!(cause.contains("No space left"), "{cause}");
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), names(folder.path()).len()), ("old", 1));
    }
}
