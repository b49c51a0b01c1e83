//! `vitrum devices`: the Vulkan devices and what each can do.

use std::fmt::Write;

use clap::Args;

use super::print;
use crate::Result;
use crate::gpu::{DeviceInfo, GpuError, Instance};

/// Options of `vitrum devices`.
#[derive(Debug, Args)]
pub(super) struct DevicesCommand {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl DevicesCommand {
    pub(super) fn run(self) -> Result<()> {
        let devices = Instance::new(/* validation: */ false)?.devices()?;
        if devices.is_empty() {
            return Err(GpuError::NoDevice.into());
        }
        print(&if self.json { json(&devices) } else { table(&devices) })
    }
}

/// The list for a person; one line a device, and one more for what it lacks.
pub(super) fn table(devices: &[DeviceInfo]) -> String {
    let width = devices.iter().map(|device| device.name.len()).max().unwrap_or(0).max(6);
    let mut text = format!("index  {:width$}  kind        Vulkan    memory     ray query  driver\n", "device");
    for device in devices {
        let DeviceInfo { index, name, kind, api, memory, driver, .. } = device;
        let rays = if device.ray_query { "yes" } else { "no" };
        let memory = format!("{:.1} GiB", *memory as f64 / f64::from(1 << 30));
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{index:<5}  {name:width$}  {kind:<10}  {api:<8}  {memory:<9}  {rays:<9}  {driver}");
        if !device.missing.is_empty() {
            let _ = writeln!(text, "       cannot be used: it lacks {}", device.missing.join(", "));
        }
    }
    text
}

fn json(devices: &[DeviceInfo]) -> String {
    let devices: Vec<_> = devices
        .iter()
        .map(|device| {
            serde_json::json!({
                "index": device.index,
                "name": device.name,
                "driver": device.driver,
                "api": device.api,
                "type": device.kind.to_string(),
                "memory_bytes": device.memory,
                "ray_query": device.ray_query,
                "missing": device.missing,
            })
        })
        .collect();
    format!("{:#}\n", serde_json::json!({ "schema": 1, "devices": devices }))
}
