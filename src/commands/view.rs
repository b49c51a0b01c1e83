//! `vitrum view`: the desktop viewer.

use std::path::PathBuf;

use clap::Args;

use super::{Talk, devices, print};
use crate::gpu::{Instance, complaint};
use crate::options::RenderArgs;
use crate::viewer::{self, Options};
use crate::{Error, Result};

/// Options of `vitrum view`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct ViewCommand {
    /// A .toml scene, a .glb or .gltf, or a bare .obj shown as clear glass; none: the built-in teapot and cups
    scene: Option<PathBuf>,

    #[command(flatten)]
    options: RenderArgs,
}

impl ViewCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        if self.options.device.as_deref() == Some("list") {
            return print(&devices::table(&Instance::new(/* validation: */ false)?.devices()?));
        }
        let messages = viewer::run(Options { scene: self.scene, args: self.options })?;
        let all: Vec<_> = messages.iter().flat_map(|messages| messages.all()).collect();
        for message in &all {
            talk.detail(&message.text);
        }
        complaint(&all).map_or(Ok(()), |said| Err(Error::Check(said)))
    }
}
