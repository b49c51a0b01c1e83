//! Bytes on their way to the device and back. In flow what the host has, out flow buffers and images, and the other way round.

use ash::vk;
use bytemuck::NoUninit;

use super::{Buffer, BufferDesc, BufferUse, Commands, GpuError, Image, ImageDesc, Recorder, Result, Use};

impl Commands {
    /// A storage buffer that holds `data`.
    pub fn upload_buffer<T: NoUninit>(&mut self, name: &str, data: &[T]) -> Result<Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let mut buffer =
            Buffer::new(self.gpu(), &BufferDesc { name, size: bytes.len() as u64, usage: BufferUse::Storage })?;
        if !bytes.is_empty() && !buffer.write(bytes) {
            let staging = self.staging(name, bytes)?;
            self.run(|cmd| cmd.copy_buffer(&staging, &buffer))?;
        }
        Ok(buffer)
    }

    /// Puts `data` in the place of what `buffer` holds from its start on.
    pub fn update_buffer<T: NoUninit>(&mut self, buffer: &Buffer, data: &[T]) -> Result<()> {
        let staging = self.staging("data", bytemuck::cast_slice(data))?;
        self.run(|cmd| cmd.copy_buffer(&staging, buffer)).map(|_| ())
    }

    /// What `buffer` holds.
    pub fn read_buffer(&mut self, buffer: &Buffer) -> Result<Vec<u8>> {
        let desc = BufferDesc { name: "readback", size: buffer.size(), usage: BufferUse::Readback };
        let readback = Buffer::new(self.gpu(), &desc)?;
        self.run(|cmd| {
            cmd.wait_for_buffers();
            cmd.copy_buffer(buffer, &readback);
        })?;
        Ok(readback.bytes().to_vec())
    }

    /// An image of `desc` that holds `texels`, row after row.
    pub fn upload_image(&mut self, desc: &ImageDesc<'_>, texels: &[u8]) -> Result<Image> {
        let image = Image::new(self.gpu(), desc)?;
        self.fill_image(&image, desc.name, texels)?;
        Ok(image)
    }

    /// Fills `image`, which was made to be copied to, with `texels`, row after row.
    pub fn write_image(&mut self, image: &Image, texels: &[u8]) -> Result<()> {
        self.fill_image(image, "texels", texels)
    }

    fn fill_image(&mut self, image: &Image, name: &str, texels: &[u8]) -> Result<()> {
        let rows = self.rows_at_once(image);
        let row_bytes = (image.texel_bytes() * u64::from(image.width())) as usize;
        for (first, band) in (0..).step_by(rows as usize).zip(texels.chunks(row_bytes * rows as usize)) {
            let staging = self.staging(name, band)?;
            let count = (band.len() / row_bytes) as u32;
            self.run(|cmd| cmd.copy_to_rows(&staging, image, first, count))?;
        }
        Ok(())
    }

    /// The texels of `image`, row after row.
    pub fn read_image(&mut self, image: &Image) -> Result<Vec<u8>> {
        let rows = self.rows_at_once(image);
        let row_bytes = image.texel_bytes() * u64::from(image.width());
        let desc = BufferDesc { name: "readback", size: row_bytes * u64::from(rows), usage: BufferUse::Readback };
        let buffer = Buffer::new(self.gpu(), &desc)?;
        let mut texels = Vec::new();
        let bytes = row_bytes * u64::from(image.height());
        texels.try_reserve_exact(bytes as usize).map_err(|_| GpuError::OutOfMemory {
            what: format!("a copy of {} MiB for the host", bytes >> 20),
            state: "the system has no more".into(),
        })?;
        for first in (0..image.height()).step_by(rows as usize) {
            let count = rows.min(image.height() - first);
            self.run(|cmd| cmd.copy_from_rows(image, first, count, &buffer))?;
            texels.extend_from_slice(&buffer.bytes()[..(row_bytes * u64::from(count)) as usize]);
        }
        Ok(texels)
    }

    /// Large images travel in bands, so that a copy of the whole is never needed.
    fn rows_at_once(&self, image: &Image) -> u32 {
        const BAND: u64 = 16 << 20;
        let row_bytes = image.texel_bytes() * u64::from(image.width());
        (BAND / row_bytes).clamp(1, u64::from(image.height())) as u32
    }

    fn staging(&self, name: &str, bytes: &[u8]) -> Result<Buffer> {
        let desc =
            BufferDesc { name: &format!("{name} on its way"), size: bytes.len() as u64, usage: BufferUse::Upload };
        let mut staging = Buffer::new(self.gpu(), &desc)?;
        if !staging.write(bytes) {
            let result = vk::Result::ERROR_MEMORY_MAP_FAILED;
            return Err(GpuError::Call { call: "vkMapMemory", result });
        }
        Ok(staging)
    }
}

impl<'r> Recorder<'_, 'r> {
    /// Copies as much as both hold.
    pub fn copy_buffer(&mut self, from: &'r Buffer, to: &'r Buffer) {
        let region = [vk::BufferCopy::default().size(from.size.min(to.size))];
        // SAFETY: both are alive and of at least that size.
        unsafe { self.device().cmd_copy_buffer(self.commands.buffer, from.handle, to.handle, &region) };
        self.wait_for_buffers();
        self.make_visible_to_host();
    }

    fn copy_to_rows(&mut self, from: &'r Buffer, to: &'r Image, first: u32, count: u32) {
        self.use_image(to, Use::CopyTarget);
        let region = [rows(to, first, count)];
        // SAFETY: the buffer holds `count` rows; the image is in the layout named.
        unsafe {
            let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            self.device().cmd_copy_buffer_to_image(self.commands.buffer, from.handle, to.handle, layout, &region);
        }
    }

    fn copy_from_rows(&mut self, from: &'r Image, first: u32, count: u32, to: &'r Buffer) {
        self.use_image(from, Use::CopySource);
        let region = [rows(from, first, count)];
        // SAFETY: the buffer has room for `count` rows; the image is in the layout named.
        unsafe {
            let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            self.device().cmd_copy_image_to_buffer(self.commands.buffer, from.handle, layout, to.handle, &region);
        }
        self.make_visible_to_host();
    }

    fn make_visible_to_host(&mut self) {
        self.memory_barrier(
            (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE),
            (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ),
        );
    }
}

/// Rows of an image, packed in a buffer.
fn rows(image: &Image, first: u32, count: u32) -> vk::BufferImageCopy {
    let range = image.range();
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: range.aspect_mask,
            mip_level: 0,
            base_array_layer: 0,
            layer_count: 1,
        })
        .image_offset(vk::Offset3D { x: 0, y: first as i32, z: 0 })
        .image_extent(vk::Extent3D { width: image.extent.width, height: count, depth: 1 })
}
