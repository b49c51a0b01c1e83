//! Files that the viewer keeps an eye on, and those that it opened last.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher};

/// Files that are remembered.
const MOST_RECENT: usize = 10;

/// An eye on some files: whether one of them changed.
pub(super) struct Watch {
    /// None where the system does not tell.
    _watcher: Option<RecommendedWatcher>,
    files: Vec<PathBuf>,
    changed: Arc<AtomicBool>,
}

impl Watch {
    /// On `files`; `wake` is called when one of them changes.
    pub(super) fn new(files: &[PathBuf], wake: impl Fn() + Send + 'static) -> Self {
        let changed = Arc::new(AtomicBool::new(false));
        let full = |file: &PathBuf| file.canonicalize().ok();
        let watched: HashSet<PathBuf> = files.iter().filter_map(full).collect();
        let folders: HashSet<PathBuf> = watched.iter().filter_map(|file| Some(file.parent()?.to_owned())).collect();
        let tell = changed.clone();
        let heard = move |event: notify::Result<notify::Event>| {
            let Ok(event) = event else { return };
            let is_change = matches!(event.kind, EventKind::Modify(_) | EventKind::Create(_));
            if is_change && event.paths.iter().any(|path| watched.contains(path)) {
                tell.store(true, Ordering::Relaxed);
                wake();
            }
        };
        let mut watcher = if folders.is_empty() { None } else { notify::recommended_watcher(heard).ok() };
        // Editors put another file in the place of one: the folder tells.
        if let Some(watcher) = &mut watcher {
            for folder in folders {
                let _ = watcher.watch(&folder, RecursiveMode::NonRecursive);
            }
        }
        Self { _watcher: watcher, files: files.to_vec(), changed }
    }

    /// Whether it is of these files.
    pub(super) fn is_of(&self, files: &[PathBuf]) -> bool {
        self.files == files
    }

    /// Whether one changed since the last time.
    pub(super) fn take(&self) -> bool {
        self.changed.swap(false, Ordering::Relaxed)
    }
}

/// Files that were opened last, the last one first, kept in a file.
#[derive(Default)]
pub(super) struct Recent {
    pub(super) files: Vec<PathBuf>,
    list: Option<PathBuf>,
}

impl Recent {
    /// Those of this user.
    pub(super) fn load() -> Self {
        Self::from_list(dirs::config_dir().map(|folder| folder.join("vitrum").join("recent.txt")))
    }

    fn from_list(list: Option<PathBuf>) -> Self {
        let text = list.as_ref().and_then(|list| fs::read_to_string(list).ok()).unwrap_or_default();
        let files = text.lines().filter(|line| !line.is_empty()).map(PathBuf::from).take(MOST_RECENT).collect();
        Self { files, list }
    }

    /// Puts a file in front. A list that cannot be kept is no reason to stop.
    pub(super) fn add(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
        self.files.retain(|other| *other != path);
        self.files.insert(0, path);
        self.files.truncate(MOST_RECENT);
        let Some(list) = &self.list else { return };
        let lines: Vec<_> = self.files.iter().map(|file| file.display().to_string()).collect();
        if let Some(folder) = list.parent() {
            let _ = fs::create_dir_all(folder);
        }
        let _ = fs::write(list, lines.join("\n") + "\n");
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::Duration;

    use super::*;

    #[test]
    fn recent_files_come_back_the_last_one_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let list = folder.path().join("settings/recent.txt");
        let mut recent = Recent::from_list(Some(list.clone()));
        assert!(recent.files.is_empty());
        for number in (0..15).chain([3]) {
            recent.add(&folder.path().join(format!("{number}.toml")));
        }
        let names = |recent: &Recent| -> Vec<String> {
            recent.files.iter().map(|file| file.file_stem().expect("a name").to_string_lossy().into()).collect()
        };
        assert_eq!(names(&recent)[..3], ["3", "14", "13"]);
        assert_eq!(names(&Recent::from_list(Some(list))), names(&recent));
        assert_eq!(recent.files.len(), MOST_RECENT);
    }

    #[test]
    fn a_file_that_changes_is_seen_and_its_neighbour_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let [scene, other] = ["scene.toml", "other.toml"].map(|name| folder.path().join(name));
        fs::write(&scene, "a").expect("a file");
        let (woken, wakes) = channel();
        let files = [scene.clone()];
        let watch = Watch::new(&files, move || woken.send(()).unwrap_or_default());
        assert!(watch.is_of(&files));
        fs::write(&other, "b").expect("a file");
        assert!(wakes.recv_timeout(Duration::from_millis(300)).is_err() && !watch.take());
        // As editors do it.
        fs::write(folder.path().join("scene.tmp"), "c").expect("a file");
        fs::rename(folder.path().join("scene.tmp"), &scene).expect("a file");
        wakes.recv_timeout(Duration::from_secs(5)).expect("it is seen");
        assert!(watch.take() && !watch.take());
    }
}
