//! A device, opened: its queue, its memory, its name.

use std::ffi::{CStr, CString};
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, Weak};

use ash::{ext, khr, vk};
use gpu_allocator::AllocationSizes;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::error::Context;
use super::instance::RAY_QUERY_EXTENSIONS;
use super::memory::Ledger;
use super::{DeviceInfo, GpuError, Instance, Result};

/// A device, shared by everything made on it. Cheap to clone.
#[derive(Clone)]
pub struct Gpu(Arc<Open>);

/// Tells whether a device is still held.
#[derive(Clone)]
pub struct Witness(Weak<Open>);

impl Witness {
    /// How many hold the device, and how many bytes of its memory are held; `None`: it is gone.
    pub fn held(&self) -> Option<(usize, u64)> {
        let open = self.0.upgrade()?;
        let bytes = open.lock_ledger().now;
        Some((Arc::strong_count(&open) - 1, bytes))
    }
}

/// What a [`Gpu`] refers to. Handles are destroyed in [`Drop`], before the fields, the instance among them.
pub struct Open {
    pub(super) device: ash::Device,
    /// One submission at a time.
    pub(super) queue: Mutex<vk::Queue>,
    pub(super) allocator: ManuallyDrop<Mutex<Allocator>>,
    pub(super) ledger: Mutex<Ledger>,
    submissions: AtomicU32,
    /// The functions of acceleration structures, where there are ray queries.
    acceleration: Option<khr::acceleration_structure::Device>,
    names: Option<ext::debug_utils::Device>,
    info: DeviceInfo,
    /// Held so that it outlives the device.
    pub(super) instance: Arc<Instance>,
}

impl Deref for Gpu {
    type Target = Open;

    fn deref(&self) -> &Open {
        &self.0
    }
}

impl Gpu {
    /// Opens the device that was [chosen](Instance::choose), with ray queries if it has them.
    pub fn open(instance: &Arc<Instance>, info: DeviceInfo) -> Result<Self> {
        let priorities = [1.0];
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(info.queue_family).queue_priorities(&priorities)];
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true)
            .maintenance4(true);
        // SAFETY: the device was enumerated from this instance.
        let extensions = unsafe { instance.handle.enumerate_device_extension_properties(info.handle) }
            .context("vkEnumerateDeviceExtensionProperties")?;
        // A device that is not a full Vulkan implementation says so, and wants it to be acknowledged.
        const PORTABILITY: &CStr = ash::khr::portability_subset::NAME;
        let subset = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(PORTABILITY));
        let mut enabled = if subset { vec![PORTABILITY.as_ptr()] } else { Vec::new() };
        if instance.shows() && extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME)) {
            enabled.push(khr::swapchain::NAME.as_ptr());
        }
        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default().buffer_device_address(true);
        let mut acceleration =
            vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
        let mut ray_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
        let mut create = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut vulkan13);
        if info.ray_query {
            enabled.extend(RAY_QUERY_EXTENSIONS.map(CStr::as_ptr));
            create = create.push_next(&mut vulkan12).push_next(&mut acceleration).push_next(&mut ray_query);
        }
        let create = create.enabled_extension_names(&enabled);
        // SAFETY: the features and the queue family were found on this device; the pointers are to locals.
        let device = unsafe { instance.handle.create_device(info.handle, &create, None) }.context("vkCreateDevice")?;
        // SAFETY: queue 0 of that family was just created.
        let queue = unsafe { device.get_device_queue(info.queue_family, 0) };

        const MIB: u64 = 1 << 20;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.handle.clone(),
            device: device.clone(),
            physical_device: info.handle,
            debug_settings: Default::default(),
            buffer_device_address: info.ray_query,
            // Small blocks: on a CPU device they are the process's own memory.
            allocation_sizes: AllocationSizes::new(8 * MIB, 8 * MIB).with_max_device_memblock_size(64 * MIB),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(error) => {
                // SAFETY: nothing was made on the device yet.
                unsafe { device.destroy_device(None) };
                return Err(GpuError::OutOfMemory { what: "the allocator".into(), state: error.to_string() });
            }
        };
        let acceleration = info.ray_query.then(|| khr::acceleration_structure::Device::new(&instance.handle, &device));
        let names = instance.validates().then(|| ext::debug_utils::Device::new(&instance.handle, &device));
        let gpu = Self(Arc::new(Open {
            device,
            queue: Mutex::new(queue),
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            ledger: Mutex::default(),
            submissions: AtomicU32::new(0),
            acceleration,
            names,
            info,
            instance: Arc::clone(instance),
        }));
        gpu.name(gpu.device.handle(), &gpu.info.name);
        gpu.name(queue, "queue");
        Ok(gpu)
    }

    /// What is known of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Shaders can query rays, and [`AccelerationStructure`](super::AccelerationStructure)s can be built.
    pub fn ray_query(&self) -> bool {
        self.info.ray_query
    }

    /// The functions of acceleration structures; an error on a device without ray queries.
    pub(super) fn acceleration(&self) -> Result<&khr::acceleration_structure::Device> {
        let lacking = || GpuError::Lacking { name: self.info.name.clone(), missing: vec!["ray queries".into()] };
        self.acceleration.as_ref().ok_or_else(lacking)
    }

    /// The most bytes of device memory that were held at one time.
    pub fn peak_bytes(&self) -> u64 {
        self.lock_ledger().peak
    }

    /// Who tells, after this is gone, whether something still holds the device.
    pub fn witness(&self) -> Witness {
        Witness(Arc::downgrade(&self.0))
    }

    /// How often something was submitted.
    pub fn submissions(&self) -> u32 {
        self.submissions.load(Ordering::Relaxed)
    }

    /// The longest side of an image.
    pub fn max_image_side(&self) -> u32 {
        self.info.limits.max_image_dimension2_d.min(self.info.limits.max_framebuffer_width)
    }
}

#[cfg(test)]
impl Gpu {
    /// Takes the device from under all that is left on it, to see what the layer calls that. Nothing of it may be touched again.
    pub(crate) fn abandon(self) {
        // SAFETY: nothing is being executed; the caller forgets what is left.
        unsafe { self.device.destroy_device(None) };
        std::mem::forget(self);
    }
}

impl Open {
    /// Bytes of the largest heap.
    pub(super) fn heap(&self) -> u64 {
        self.info.memory
    }

    /// The name of `handle` in messages of the validation layer and in RenderDoc.
    pub(super) fn name(&self, handle: impl vk::Handle, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle belongs to this device and is alive. A name that could not be set is only missed in messages.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }

    /// What follows in `buffer` is of a pass, for messages of the validation layer and for RenderDoc; `None`: it is over.
    pub(super) fn label(&self, buffer: vk::CommandBuffer, pass: Option<&str>) {
        let Some(names) = &self.names else { return };
        let name = pass.map(|pass| CString::new(pass).unwrap_or_default());
        // SAFETY: the buffer is being recorded; the name outlives the call; labels are closed as often as they are opened.
        unsafe {
            match &name {
                Some(name) => {
                    names.cmd_begin_debug_utils_label(buffer, &vk::DebugUtilsLabelEXT::default().label_name(name));
                }
                None => names.cmd_end_debug_utils_label(buffer),
            }
        }
    }

    /// One more submission: whether the device is lost with it, as was wished to see what becomes of it.
    pub(super) fn count_submission(&self) -> bool {
        let before = self.submissions.fetch_add(1, Ordering::Relaxed);
        self.info.handicap.lost_after.is_some_and(|most| before >= most)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        // SAFETY: buffers, images and pipelines hold the `Gpu`, so none is left; the allocator frees its blocks while the
        // device lives, and is not used again. The instance, a field, goes after this.
        unsafe {
            // A device that was lost is idle.
            let _ = self.device.device_wait_idle();
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
        }
    }
}
