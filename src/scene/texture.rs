//! Images on surfaces. In flow image files, out flow [`Texture`]s, each file opened once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use half::f16;

use super::files::Files;
use super::mesh_file::{Image, ImageSource};
use crate::Result;
use crate::image::{self, Stored};

/// An image that objects wear; row 0 is the top row, and it repeats in both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The file, for messages.
    pub path: PathBuf,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Reflectance, row by row.
    pub texels: Texels,
}

/// Texels in the form that takes the least memory. The fourth channel is always 1: opaque surfaces let nothing through.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Encoded as sRGB, of an image with 8 bits a channel.
    Srgb(Vec<[u8; 4]>),
    /// Linear Rec. 709 from 0 to 1, of any other image.
    Linear(Vec<[f16; 4]>),
}

impl Texture {
    /// The image at `path`, of these bytes; values that are no reflectance are moved to one and told in `warnings`.
    pub fn decode(path: &Path, bytes: &[u8], warnings: &mut Vec<String>) -> Result<Self> {
        let (width, height, texels) = match image::decode_stored(path, bytes)? {
            Stored::Srgb { width, height, pixels } => {
                (width, height, Texels::Srgb(pixels.into_iter().map(|[r, g, b]| [r, g, b, u8::MAX]).collect()))
            }
            Stored::Linear(image) => {
                let wrong = |pixel: &&[f32; 3]| !pixel.iter().all(|value| (0.0..=1.0).contains(value));
                let count = image.pixels.iter().filter(wrong).count();
                if count > 0 {
                    let what = if count == 1 { "texel was" } else { "texels were" };
                    warnings
                        .push(format!("{}: {count} {what} no reflectance from 0 to 1, and moved there", name(path)));
                }
                let half = |value: f32| f16::from_f32(if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) });
                let texels = image.pixels.into_iter().map(|[r, g, b]| [half(r), half(g), half(b), f16::ONE]);
                (image.width, image.height, Texels::Linear(texels.collect()))
            }
        };
        Ok(Self { path: path.into(), width, height, texels })
    }

    /// Multiplies every texel.
    fn scale(&mut self, factor: DVec3) {
        let factor = factor.as_vec3().to_array();
        let scaled = |[r, g, b]: [f32; 3]| {
            let [x, y, z] = factor;
            [f16::from_f32(r * x), f16::from_f32(g * y), f16::from_f32(b * z), f16::ONE]
        };
        self.texels = Texels::Linear(match &self.texels {
            Texels::Srgb(texels) => {
                texels.iter().map(|&[r, g, b, _]| scaled([r, g, b].map(image::decode_srgb))).collect()
            }
            Texels::Linear(texels) => texels.iter().map(|&[r, g, b, _]| scaled([r, g, b].map(f16::to_f32))).collect(),
        });
    }

    /// The file's name, for messages.
    pub fn name(&self) -> String {
        name(&self.path)
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// What tells textures apart: the file, and the bits of its factor.
type Key = (PathBuf, [u64; 3]);

/// The textures so far.
#[derive(Debug, Default)]
pub struct Textures {
    /// In the order in which they were named first.
    pub all: Vec<Arc<Texture>>,
    numbers: HashMap<Key, usize>,
}

impl Textures {
    /// The number in [`Textures::all`] of the image at `path`, which is read unless it was before.
    pub fn open(&mut self, files: Files, path: &Path, warnings: &mut Vec<String>) -> Result<usize> {
        self.open_image(files, &Image::file(path.into()), warnings)
    }

    /// The same of an image that a mesh file names.
    pub fn open_image(&mut self, files: Files, image: &Image, warnings: &mut Vec<String>) -> Result<usize> {
        let identity = match &image.source {
            ImageSource::File(path) => files.identity(path),
            ImageSource::Embedded { name, .. } => name.clone(),
        };
        let key = (identity, image.factor.to_array().map(f64::to_bits));
        if let Some(&number) = self.numbers.get(&key) {
            return Ok(number);
        }
        let mut texture = match &image.source {
            ImageSource::File(path) => Texture::decode(path, &files.read(path)?, warnings)?,
            ImageSource::Embedded { name, bytes } => Texture::decode(name, bytes, warnings)?,
        };
        if image.factor != DVec3::ONE {
            texture.scale(image.factor);
        }
        self.all.push(Arc::new(texture));
        self.numbers.insert(key, self.all.len() - 1);
        Ok(self.all.len() - 1)
    }
}
