//! What tests on a device share: one device under the validation layer, and its verdict.

#![allow(dead_code, reason = "each test program uses its share")]

pub mod desktop;
pub mod gltf;
pub mod pictures;
pub mod reference;
pub mod tables;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use vitrum::gpu::{Gpu, GpuError, Instance};

/// The manifest of a driver that `ci/setup.sh` fetches where the distribution has it. Without it the test is skipped, aloud.
pub fn manifest(driver: &str) -> Option<PathBuf> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!(".native/drivers/{driver}.json"));
    if !manifest.is_file() {
        let _ = writeln!(std::io::stderr(), "skipped: no driver {driver}; ci/setup.sh fetches it where it can be had");
    }
    manifest.is_file().then_some(manifest)
}

/// A device under validation with synchronization validation. [`Validated::verdict`] ends every test.
pub struct Validated {
    pub gpu: Gpu,
    pub instance: Arc<Instance>,
}

impl Validated {
    /// The device named by `VITRUM_DEVICE`, or the best one. Without one the test is skipped, aloud; with
    /// `VITRUM_REQUIRE_DEVICE` set, as in CI, it fails.
    pub fn open() -> Option<Self> {
        let wanted = std::env::var("VITRUM_DEVICE").ok();
        let open = || -> Result<Self, GpuError> {
            let instance = Instance::new(/* validation: */ true)?;
            let device = instance.choose(wanted.as_deref())?;
            Ok(Self { gpu: Gpu::open(&instance, device)?, instance })
        };
        match open() {
            Ok(validated) => Some(validated),
            Err(error) if std::env::var_os("VITRUM_REQUIRE_DEVICE").is_some() => panic!("{error}"),
            Err(error) => {
                static SKIPPED: AtomicUsize = AtomicUsize::new(0);
                let count = SKIPPED.fetch_add(1, Ordering::Relaxed) + 1;
                // Past the test runner, which keeps the words of tests that pass to itself.
                let _ = writeln!(std::io::stderr(), "skipped: no device ({count} so far): {error}");
                None
            }
        }
    }

    /// Closes the device and the instance, and fails if the layer had anything to say, up to the last destruction.
    pub fn verdict(self) {
        let messages = self.messages();
        assert!(messages.is_empty(), "{} validation messages:\n{}", messages.len(), messages.join("\n\n"));
    }

    /// Closes the device and the instance; what the layer said.
    pub fn messages(self) -> Vec<String> {
        let messages = self.instance.messages();
        drop(self.gpu);
        drop(self.instance);
        messages.all().into_iter().map(|message| message.text).collect()
    }
}
