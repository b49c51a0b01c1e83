//! What can go wrong between us and a Vulkan device.

use ash::vk;

/// A failure of Vulkan, of a device, or of its memory.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The loader is not installed.
    #[error("no Vulkan loader on this machine; install it (Debian, Ubuntu: libvulkan1) or run ci/setup.sh")]
    NoLoader(#[source] ash::LoadingError),

    /// The loader is older than Vulkan 1.3.
    #[error("the Vulkan loader speaks {found}, Vitrum needs 1.3; install a newer libvulkan1")]
    OldLoader {
        /// Its version.
        found: String,
    },

    /// No driver, or no driver with a device.
    #[error(
        "no Vulkan device on this machine; install a driver (Debian, Ubuntu: mesa-vulkan-drivers) or run ci/setup.sh"
    )]
    NoDevice,

    /// Every device lacks something.
    #[error("no usable Vulkan device: {}; update its driver, or install lavapipe (Debian, Ubuntu: mesa-vulkan-drivers)", .0.join("; "))]
    NoUsableDevice(Vec<String>),

    /// The device asked for lacks something.
    #[error("device {name:?} lacks {}; choose another with --device (see vitrum devices)", .missing.join(", "))]
    Lacking {
        /// The device.
        name: String,
        /// Features and versions that are missing.
        missing: Vec<String>,
    },

    /// There is no window system, or nothing can be shown in it.
    #[error("no window: {0}; vitrum render needs none")]
    NoWindow(String),

    /// The device cannot show pictures in this window.
    #[error("device {name:?} cannot show pictures in this window; choose another with --device (see vitrum devices)")]
    CannotShow {
        /// The device.
        name: String,
    },

    /// What the user interface is drawn with.
    #[error("drawing the user interface: {0}")]
    Interface(String),

    /// What was being done is not wanted any more.
    #[error("interrupted")]
    Interrupted,

    /// No device of that name or index.
    #[error("no Vulkan device {wanted:?}; found: {}", .found.join(", "))]
    UnknownDevice {
        /// What was asked for.
        wanted: String,
        /// The devices there are.
        found: Vec<String>,
    },

    /// Ray queries were asked for and the device has none.
    #[error(
        "--trace hardware: device {name:?} has no ray queries; use --trace software, or choose another with --device"
    )]
    NoRayQuery {
        /// The device.
        name: String,
    },

    /// The validation layer was asked for and is not installed.
    #[error(
        "there is no VK_LAYER_KHRONOS_validation here; install it (Debian, Ubuntu: vulkan-validationlayers) or run ci/setup.sh"
    )]
    NoValidationLayer,

    /// More memory than the device has.
    #[error("out of device memory: {what}: {state}; use a smaller --size or another --device")]
    OutOfMemory {
        /// What it was for, with its size if that is known.
        what: String,
        /// How much there is, or what the driver said.
        state: String,
    },

    /// Something larger than a limit of the device.
    #[error("{what} is {size}, more than this device's limit of {limit}; {advice}")]
    TooLarge {
        /// What it is.
        what: String,
        /// Its size, with unit.
        size: String,
        /// The limit, with unit.
        limit: String,
        /// What to do about it.
        advice: &'static str,
    },

    /// The device was lost.
    #[error("the Vulkan device was lost; see the system's log, or try another with --device")]
    Lost,

    /// A call that failed.
    #[error("Vulkan: {call} failed: {result}")]
    Call {
        /// The function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
}

impl GpuError {
    /// 2 where another command line would do, 3 where no device can be used.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::OutOfMemory { .. }
            | Self::TooLarge { .. }
            | Self::UnknownDevice { .. }
            | Self::NoRayQuery { .. }
            | Self::NoValidationLayer => 2,
            _ => 3,
        }
    }
}

/// Names the call in what it returned.
pub(super) trait Context<T> {
    fn context(self, call: &'static str) -> Result<T, GpuError>;
}

impl<T> Context<T> for Result<T, vk::Result> {
    fn context(self, call: &'static str) -> Result<T, GpuError> {
        self.map_err(|result| match result {
            // A surface that is lost is made anew with all the rest.
            vk::Result::ERROR_DEVICE_LOST | vk::Result::ERROR_SURFACE_LOST_KHR => GpuError::Lost,
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                GpuError::OutOfMemory { what: call.into(), state: result.to_string() }
            }
            result => GpuError::Call { call, result },
        })
    }
}
