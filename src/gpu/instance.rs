//! The Vulkan instance: which devices there are, and what the validation layer says.

use std::ffi::{CStr, c_char};
use std::fmt;
use std::sync::Arc;

use ash::{ext, khr, vk};
use winit::raw_window_handle::HasDisplayHandle;

use super::error::Context;
use super::messages::{Messages, messenger_info};
use super::{GpuError, Result};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What a device with ray queries has.
pub(super) const RAY_QUERY_EXTENSIONS: [&CStr; 3] = [
    ash::khr::acceleration_structure::NAME,
    ash::khr::ray_query::NAME,
    // The first needs it.
    ash::khr::deferred_host_operations::NAME,
];

/// What the validation layer looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// Calls, lifetimes and layouts, and hazards between passes.
    Synchronization,
    /// What shaders do to memory, by instructions that the layer adds to them.
    GpuAssisted,
    /// What is allowed and yet not advised.
    BestPractices,
}

/// The Vulkan loader, opened.
pub struct Instance {
    pub(super) handle: ash::Instance,
    debug: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Arc<Messages>,
    shows: bool,
    // Last: the functions of everything above live in its library.
    pub(super) entry: ash::Entry,
}

impl Watch {
    fn features(self) -> &'static [vk::ValidationFeatureEnableEXT] {
        use vk::ValidationFeatureEnableEXT as Feature;
        match self {
            Self::Synchronization => &[Feature::SYNCHRONIZATION_VALIDATION],
            Self::GpuAssisted => &[Feature::GPU_ASSISTED, Feature::GPU_ASSISTED_RESERVE_BINDING_SLOT],
            Self::BestPractices => &[Feature::BEST_PRACTICES],
        }
    }
}

/// What kind of device it is, from the fastest to the slowest expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A GPU of its own
    Discrete,
    /// A GPU inside the processor
    Integrated,
    /// A GPU of a virtual machine
    Virtual,
    /// The processor itself
    Cpu,
    /// None of these
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "cpu",
            Self::Other => "other",
        })
    }
}

/// What a device is made to lack, to see how well it is done without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Handicap {
    /// There are no ray queries.
    pub no_ray_query: bool,
    /// There is no clock.
    pub no_timestamps: bool,
    /// The largest buffer that shaders see has so many bytes.
    pub buffer_bytes: Option<u32>,
    /// The longest side of an image.
    pub image_side: Option<u32>,
    /// There are so many bytes of memory.
    pub memory: Option<u64>,
    /// It is lost while that submission, counted from 0, is executed.
    pub lost_after: Option<u32>,
}

/// How large acceleration structures may be; zeros where a device has none.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AccelerationLimits {
    /// Triangles of one mesh.
    pub(super) triangles: u64,
    /// Meshes in their places.
    pub(super) instances: u64,
    /// Alignment of the memory that a build works in.
    pub(super) scratch_alignment: u64,
}

/// A device found, and what it can do.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    pub(super) handle: vk::PhysicalDevice,
    pub(super) queue_family: u32,
    pub(super) limits: vk::PhysicalDeviceLimits,
    pub(super) acceleration: AccelerationLimits,
    pub(super) timestamp_bits: u32,
    pub(super) handicap: Handicap,
    /// Position in the list of devices, for `--device`.
    pub index: usize,
    /// The device's own name.
    pub name: String,
    /// Name and version of its driver.
    pub driver: String,
    /// The version of Vulkan that it speaks.
    pub api: String,
    /// What kind of device it is.
    pub kind: DeviceKind,
    /// Its largest heap in bytes.
    pub memory: u64,
    /// The rasteriser snaps vertices to 2^-this of a pixel.
    pub sub_pixel_bits: u32,
    /// Shaders can query rays: `VK_KHR_acceleration_structure`, `VK_KHR_ray_query` and their features are there.
    pub ray_query: bool,
    /// What Vitrum needs and it lacks; empty: it can be used.
    pub missing: Vec<String>,
}

impl Instance {
    /// Opens the loader; with `validation`, under the validation layer with synchronization validation.
    pub fn new(validation: bool) -> Result<Arc<Self>> {
        Self::with_extensions(validation.then_some(Watch::Synchronization), &[])
    }

    /// Opens the loader under the validation layer.
    pub fn watched(watch: Watch) -> Result<Arc<Self>> {
        Self::with_extensions(Some(watch), &[])
    }

    /// The same, able to show pictures where nobody sees them; `None` where no driver can.
    pub fn headless(watch: Watch) -> Result<Option<Arc<Self>>> {
        let wanted = [khr::surface::NAME.as_ptr(), ext::headless_surface::NAME.as_ptr()];
        match Self::with_extensions(Some(watch), &wanted) {
            Ok(instance) => Ok(Some(instance)),
            Err(GpuError::NoWindow(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The same, able to show pictures in windows of `display`.
    pub fn for_windows(validation: bool, display: &impl HasDisplayHandle) -> Result<Arc<Self>> {
        let display = display.display_handle().map_err(|error| GpuError::NoWindow(error.to_string()))?;
        let extensions = ash_window::enumerate_required_extensions(display.as_raw())
            .map_err(|result| GpuError::NoWindow(format!("Vulkan has no windows here: {result}")))?;
        Self::with_extensions(validation.then_some(Watch::Synchronization), extensions)
    }

    fn with_extensions(watch: Option<Watch>, wanted: &[*const c_char]) -> Result<Arc<Self>> {
        let (entry, _) = open_loader()?;
        let application = vk::ApplicationInfo::default()
            .application_name(c"vitrum")
            .engine_name(c"vitrum")
            .api_version(vk::API_VERSION_1_3);
        let mut extensions = wanted.to_vec();
        // SAFETY: no layer is named.
        let available = unsafe { entry.enumerate_instance_extension_properties(None) }
            .context("vkEnumerateInstanceExtensionProperties")?;
        let has = |name: &CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let portability = has(ash::khr::portability_enumeration::NAME);
        if portability {
            extensions.push(ash::khr::portability_enumeration::NAME.as_ptr());
        }

        let messages = Arc::new(Messages::default());
        let mut layers = Vec::new();
        let mut messenger = messenger_info(&messages);
        let enabled = watch.map_or(&[][..], Watch::features);
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
        let mut info = vk::InstanceCreateInfo::default().application_info(&application);
        if watch.is_some() {
            validation_layer(&entry)?;
            layers.push(VALIDATION.as_ptr());
            extensions.push(ext::debug_utils::NAME.as_ptr());
            extensions.push(ext::validation_features::NAME.as_ptr());
            info = info.push_next(&mut messenger).push_next(&mut features);
        }
        if portability {
            info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
        }
        let info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions);
        // SAFETY: every pointer in `info` is to a local that outlives the call, or to a constant.
        let handle = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_EXTENSION_NOT_PRESENT if !wanted.is_empty() => {
                GpuError::NoWindow("no driver here shows pictures in windows".into())
            }
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
            result => GpuError::Call { call: "vkCreateInstance", result },
        })?;

        let mut instance = Self { handle, debug: None, messages, shows: !wanted.is_empty(), entry };
        if watch.is_some() {
            let debug = ext::debug_utils::Instance::new(&instance.entry, &instance.handle);
            let info = messenger_info(&instance.messages);
            // SAFETY: the callback's user data is the `Messages` that this instance holds until it is destroyed.
            let messenger =
                unsafe { debug.create_debug_utils_messenger(&info, None) }.context("vkCreateDebugUtilsMessengerEXT")?;
            instance.debug = Some((debug, messenger));
        }
        Ok(Arc::new(instance))
    }

    /// The versions of Vulkan that the loader and the validation layer are of. No driver is looked at.
    pub fn versions() -> Result<[String; 2]> {
        let (entry, version) = open_loader()?;
        Ok([version_text(version), validation_layer(&entry)?])
    }

    /// What the validation layer says; it outlives the instance, so that messages of its end are seen too.
    pub fn messages(&self) -> Arc<Messages> {
        Arc::clone(&self.messages)
    }

    /// Whether it was made for windows.
    pub(super) fn shows(&self) -> bool {
        self.shows
    }

    pub(super) fn validates(&self) -> bool {
        self.debug.is_some()
    }

    /// Every device of every driver, in the loader's order.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>> {
        // SAFETY: the instance is alive.
        let handles = unsafe { self.handle.enumerate_physical_devices() }.or_else(|result| match result {
            // The loader's word for drivers that all failed to start.
            vk::Result::ERROR_INITIALIZATION_FAILED => Ok(Vec::new()),
            result => Err(result),
        });
        let handles = handles.context("vkEnumeratePhysicalDevices")?;
        Ok(handles.into_iter().enumerate().map(|(index, handle)| self.inspect(index, handle)).collect())
    }

    /// The device of that index, of that name, or with that in its name (in any case); `None` or nothing: the best one.
    pub fn choose(&self, wanted: Option<&str>) -> Result<DeviceInfo> {
        let wanted = wanted.filter(|wanted| !wanted.is_empty());
        let devices = self.devices()?;
        if devices.is_empty() {
            return Err(GpuError::NoDevice);
        }
        let Some(wanted) = wanted else {
            let lacking = |d: &DeviceInfo| format!("{:?} lacks {}", d.name, d.missing.join(", "));
            let all: Vec<_> = devices.iter().map(lacking).collect();
            return devices
                .into_iter()
                .filter(|device| device.missing.is_empty())
                .min_by_key(|device| device.kind)
                .ok_or(GpuError::NoUsableDevice(all));
        };
        let found = devices.iter().map(|d| format!("{} ({})", d.index, d.name)).collect();
        let names: Vec<_> = devices.iter().map(|device| device.name.as_str()).collect();
        let Some(index) = find(wanted, &names) else {
            return Err(GpuError::UnknownDevice { wanted: wanted.into(), found });
        };
        let device = devices[index].clone();
        if !device.missing.is_empty() {
            return Err(GpuError::Lacking { name: device.name, missing: device.missing });
        }
        Ok(device)
    }

    fn inspect(&self, index: usize, handle: vk::PhysicalDevice) -> DeviceInfo {
        // SAFETY: `handle` was enumerated from this instance.
        let extensions = unsafe { self.handle.enumerate_device_extension_properties(handle) };
        // A device that cannot list its extensions has none that matter.
        let extensions = extensions.unwrap_or_default();
        let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let rays = RAY_QUERY_EXTENSIONS.into_iter().all(has);

        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut limits = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut acceleration = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut ray_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan13).push_next(&mut vulkan12);
        if rays {
            properties = properties.push_next(&mut limits);
            features = features.push_next(&mut acceleration).push_next(&mut ray_query);
        }
        // SAFETY: `handle` was enumerated from this instance. A device older than 1.3 ignores structs that it does not know,
        // and what stays false then reads as missing.
        let (families, memory, depth) = unsafe {
            self.handle.get_physical_device_properties2(handle, &mut properties);
            self.handle.get_physical_device_features2(handle, &mut features);
            (
                self.handle.get_physical_device_queue_family_properties(handle),
                self.handle.get_physical_device_memory_properties(handle),
                self.handle.get_physical_device_format_properties(handle, vk::Format::D32_SFLOAT),
            )
        };
        let properties = properties.properties;
        let work = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue_family = families.iter().position(|family| family.queue_flags.contains(work));

        let text = |text: Result<&CStr, _>| text.map_or(String::new(), |text| text.to_string_lossy().into_owned());
        DeviceInfo {
            handle,
            queue_family: queue_family.unwrap_or(0) as u32,
            limits: properties.limits,
            acceleration: AccelerationLimits {
                triangles: limits.max_primitive_count,
                instances: limits.max_instance_count,
                scratch_alignment: limits.min_acceleration_structure_scratch_offset_alignment.into(),
            },
            timestamp_bits: queue_family.map_or(0, |family| families[family].timestamp_valid_bits),
            handicap: Handicap::default(),
            index,
            name: text(properties.device_name_as_c_str()),
            driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
            api: version_text(properties.api_version),
            kind: match properties.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
                _ => DeviceKind::Other,
            },
            memory: memory.memory_heaps_as_slice().iter().map(|heap| heap.size).max().unwrap_or(0),
            sub_pixel_bits: properties.limits.sub_pixel_precision_bits,
            // Without the extensions the first two were not asked for, and are false.
            ray_query: [acceleration.acceleration_structure, ray_query.ray_query, vulkan12.buffer_device_address]
                == [vk::TRUE; 3],
            missing: missing(
                properties.api_version,
                &vulkan13,
                &properties.limits,
                depth.optimal_tiling_features,
                queue_family.is_some(),
            ),
        }
    }
}

impl DeviceInfo {
    /// The same device with something missing.
    #[must_use]
    pub fn with_handicap(mut self, handicap: Handicap) -> Self {
        let least = |limit: &mut u32, wanted: Option<u32>| *limit = wanted.map_or(*limit, |wanted| wanted.min(*limit));
        self.ray_query &= !handicap.no_ray_query;
        if handicap.no_timestamps {
            self.timestamp_bits = 0;
        }
        least(&mut self.limits.max_storage_buffer_range, handicap.buffer_bytes);
        least(&mut self.limits.max_image_dimension2_d, handicap.image_side);
        self.memory = handicap.memory.map_or(self.memory, |memory| memory.min(self.memory));
        self.handicap = handicap;
        self
    }

    /// Whether passes can be timed.
    pub fn has_clock(&self) -> bool {
        self.timestamp_bits > 0
    }
}

/// Which of the devices called `names` is meant: a number is an index and nothing else.
pub(crate) fn find(wanted: &str, names: &[&str]) -> Option<usize> {
    if let Ok(index) = wanted.parse::<usize>() {
        return (index < names.len()).then_some(index);
    }
    let wanted = wanted.to_lowercase();
    let names: Vec<_> = names.iter().map(|name| name.to_lowercase()).collect();
    names.iter().position(|name| *name == wanted).or_else(|| names.iter().position(|name| name.contains(&wanted)))
}

/// Storage buffers that one shader sees at most.
const STORAGE_BUFFERS: u32 = 16;

/// What Vitrum needs of a device, and this one lacks.
fn missing(
    api: u32,
    features: &vk::PhysicalDeviceVulkan13Features<'_>,
    limits: &vk::PhysicalDeviceLimits,
    depth: vk::FormatFeatureFlags,
    queue: bool,
) -> Vec<String> {
    let mut missing = Vec::new();
    if api < vk::API_VERSION_1_3 {
        missing.push(format!("Vulkan 1.3 (it has {})", version_text(api)));
    }
    for (there, name) in [
        (features.dynamic_rendering == vk::TRUE, "the feature dynamicRendering"),
        (features.synchronization2 == vk::TRUE, "the feature synchronization2"),
        (features.maintenance4 == vk::TRUE, "the feature maintenance4"),
        (limits.max_per_stage_descriptor_storage_buffers >= STORAGE_BUFFERS, "16 storage buffers in one shader"),
        (depth.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT), "depth images of 32-bit float"),
        (queue, "a queue for graphics and compute"),
    ] {
        if !there {
            missing.push(name.into());
        }
    }
    missing
}

/// The loader, and the version of Vulkan that it speaks: one that is new enough.
fn open_loader() -> Result<(ash::Entry, u32)> {
    // SAFETY: the loader is the system's own library; its initialisers are those of every Vulkan program.
    let entry = unsafe { ash::Entry::load() }.map_err(GpuError::NoLoader)?;
    // SAFETY: no arguments.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .context("vkEnumerateInstanceVersion")?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_3 {
        return Err(GpuError::OldLoader { found: version_text(version) });
    }
    Ok((entry, version))
}

/// The version of Vulkan that the validation layer is of; an error where there is none.
fn validation_layer(entry: &ash::Entry) -> Result<String> {
    // SAFETY: no arguments.
    let found = unsafe { entry.enumerate_instance_layer_properties() }.context("vkEnumerateInstanceLayerProperties")?;
    let layer = found.iter().find(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION));
    layer.map(|layer| version_text(layer.spec_version)).ok_or(GpuError::NoValidationLayer)
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold this instance, so none is left; the messenger goes before the instance that made it.
        unsafe {
            if let Some((debug, messenger)) = self.debug.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.handle.destroy_instance(None);
        }
    }
}

fn version_text(version: u32) -> String {
    let part = (vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version));
    format!("{}.{}.{}", part.0, part.1, part.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_old_device_lacks_is_named() {
        let features = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true)
            .maintenance4(true);
        let limits = vk::PhysicalDeviceLimits { max_per_stage_descriptor_storage_buffers: 16, ..Default::default() };
        let depth = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
        assert!(missing(vk::API_VERSION_1_3, &features, &limits, depth, true).is_empty());
        let old = missing(vk::make_api_version(0, 1, 2, 131), &features, &limits, depth, true);
        assert_eq!(old, ["Vulkan 1.3 (it has 1.2.131)"]);
        let none = vk::PhysicalDeviceVulkan13Features::default();
        let all = missing(vk::API_VERSION_1_3, &none, &Default::default(), vk::FormatFeatureFlags::empty(), false);
        assert_eq!(all.len(), 6, "{all:?}");
        assert!(all[0].contains("dynamicRendering"));
    }

    #[test]
    fn a_number_is_an_index_and_a_name_may_be_part_of_one() {
        let names = ["llvmpipe (LLVM 15.0.6, 256 bits)", "GeForce 1060", "GeForce"];
        assert_eq!(find("1", &names), Some(1));
        assert_eq!(find("15", &names), None);
        assert_eq!(find("LLVM", &names), Some(0));
        assert_eq!(find("geforce", &names), Some(2));
        assert_eq!(find("geforce 10", &names), Some(1));
        assert_eq!(find("abacus", &names), None);
    }
}
