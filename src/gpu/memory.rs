//! Buffers, and how much memory is held.

use std::sync::{MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::Open;
use super::error::Context;
use super::{Gpu, GpuError, Result};

/// Bytes held by allocations.
#[derive(Debug, Default)]
pub struct Ledger {
    pub(super) now: u64,
    pub(super) peak: u64,
}

impl Open {
    pub(super) fn lock_ledger(&self) -> MutexGuard<'_, Ledger> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Memory for one resource. The driver's word is not waited for where the largest heap is plainly too small: a CPU device
    /// would hand out memory that the system does not have.
    pub(super) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let out_of_memory = |state| out_of_memory(name, requirements.size, state);
        let mut ledger = self.lock_ledger();
        let heap = self.heap();
        if ledger.now.saturating_add(requirements.size) > heap {
            let state = format!("{} of {} MiB are in use", ledger.now >> 20, heap >> 20);
            return Err(out_of_memory(state));
        }
        let allocation = self
            .allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|error| out_of_memory(format!("the driver says: {error}")))?;
        if allocation.offset() == 0 {
            // SAFETY: the block is alive as long as the allocation, and only named.
            self.name(unsafe { allocation.memory() }, &format!("memory, the first in it: {name}"));
        }
        ledger.now += allocation.size();
        ledger.peak = ledger.peak.max(ledger.now);
        Ok(allocation)
    }

    pub(super) fn free(&self, allocation: Allocation) {
        self.lock_ledger().now -= allocation.size();
        // It fails only for an allocation of another allocator.
        let _ = self.allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation);
    }
}

/// Some drivers find out only when memory is bound.
pub(super) fn bound(name: &str, size: u64, result: Result<(), vk::Result>) -> Result<()> {
    result.map_err(|result| match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            out_of_memory(name, size, "the driver has no more".into())
        }
        result => GpuError::Call { call: "vkBindMemory", result },
    })
}

fn out_of_memory(name: &str, size: u64, state: String) -> GpuError {
    GpuError::OutOfMemory { what: format!("{name} needs {} MiB", size >> 20), state }
}

/// What a buffer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    /// Read and written by shaders; on devices with ray queries also by builds of acceleration structures.
    Storage,
    /// Written by the host, copied from by the device.
    Upload,
    /// Copied to by the device, read by the host.
    Readback,
    /// Holds an acceleration structure; on devices with ray queries.
    Acceleration,
    /// Worked in while an acceleration structure is built; on devices with ray queries.
    Scratch,
}

/// How a buffer is made.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// Its name in messages.
    pub name: &'a str,
    /// Its size in bytes; 0 makes one of 4, since Vulkan knows no empty buffer.
    pub size: u64,
    /// What it is for.
    pub usage: BufferUse,
}

/// Bytes on the device.
pub struct Buffer {
    pub(super) handle: vk::Buffer,
    pub(super) size: u64,
    usage: BufferUse,
    allocation: Option<Allocation>,
    gpu: Gpu,
}

impl Buffer {
    /// An uninitialised buffer.
    pub fn new(gpu: &Gpu, desc: &BufferDesc<'_>) -> Result<Self> {
        let size = desc.size.max(4);
        let limit = u64::from(gpu.info().limits.max_storage_buffer_range);
        if desc.usage == BufferUse::Storage && size > limit {
            return Err(GpuError::TooLarge {
                what: format!("the buffer of {}", desc.name),
                size: format!("{} MiB", size >> 20),
                limit: format!("{} MiB", limit >> 20),
                advice: "use smaller meshes",
            });
        }
        // A CPU device's memory is the host's: nothing is gained by a copy.
        let near =
            if gpu.info().kind == super::DeviceKind::Cpu { MemoryLocation::CpuToGpu } else { MemoryLocation::GpuOnly };
        use vk::BufferUsageFlags as Flags;
        let (flags, location) = match desc.usage {
            BufferUse::Storage => {
                let input = Flags::SHADER_DEVICE_ADDRESS | Flags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
                let input = if gpu.ray_query() { input } else { Flags::empty() };
                (Flags::STORAGE_BUFFER | Flags::TRANSFER_DST | Flags::TRANSFER_SRC | input, near)
            }
            BufferUse::Upload => (Flags::TRANSFER_SRC, MemoryLocation::CpuToGpu),
            BufferUse::Readback => (Flags::TRANSFER_DST, MemoryLocation::GpuToCpu),
            BufferUse::Acceleration => {
                gpu.acceleration()?;
                (Flags::ACCELERATION_STRUCTURE_STORAGE_KHR | Flags::SHADER_DEVICE_ADDRESS, near)
            }
            BufferUse::Scratch => {
                gpu.acceleration()?;
                (Flags::STORAGE_BUFFER | Flags::SHADER_DEVICE_ADDRESS, near)
            }
        };
        let info = vk::BufferCreateInfo::default().size(size).usage(flags);
        // SAFETY: the device is alive; the size is not 0.
        let handle = unsafe { gpu.device.create_buffer(&info, None) }.context("vkCreateBuffer")?;
        // From here on, dropping `buffer` cleans up.
        let mut buffer = Self { handle, size, usage: desc.usage, allocation: None, gpu: gpu.clone() };
        gpu.name(handle, desc.name);
        // SAFETY: the buffer was just made on this device.
        let mut requirements = unsafe { gpu.device.get_buffer_memory_requirements(handle) };
        if gpu.ray_query() {
            // Builds of acceleration structures read placed meshes at multiples of 16.
            requirements.alignment = requirements.alignment.max(16);
        }
        let allocation = gpu.allocate(desc.name, requirements, location, /* linear: */ true)?;
        // SAFETY: memory and offset come from the allocator for these very requirements; bound once, and kept until the
        // buffer is destroyed.
        let result = unsafe { gpu.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound(desc.name, requirements.size, result)?;
        Ok(buffer)
    }

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Where builds of acceleration structures find it.
    ///
    /// # Panics
    ///
    /// If it was made for something else, or on a device without ray queries.
    pub(super) fn address(&self) -> vk::DeviceAddress {
        let found = matches!(self.usage, BufferUse::Storage | BufferUse::Scratch) && self.gpu.ray_query();
        assert!(found, "a buffer for {:?} without an address", self.usage);
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.handle);
        // SAFETY: the buffer was made with SHADER_DEVICE_ADDRESS, see `new`, and is bound to memory.
        unsafe { self.gpu.device.get_buffer_device_address(&info) }
    }

    /// Writes from the start; false if the host cannot see this memory.
    pub(super) fn write(&mut self, bytes: &[u8]) -> bool {
        match self.allocation.as_mut().and_then(Allocation::mapped_slice_mut) {
            Some(memory) if bytes.len() <= memory.len() => {
                memory[..bytes.len()].copy_from_slice(bytes);
                true
            }
            _ => false,
        }
    }

    /// What the device has copied here; empty unless made for [`BufferUse::Readback`].
    pub fn bytes(&self) -> &[u8] {
        let readable = self.usage == BufferUse::Readback;
        let memory = self.allocation.as_ref().filter(|_| readable).and_then(Allocation::mapped_slice);
        memory.map_or(&[], |memory| &memory[..self.size as usize])
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: `Commands::run` waits, so no recording that names this buffer is still executing.
        unsafe { self.gpu.device.destroy_buffer(self.handle, None) };
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}
