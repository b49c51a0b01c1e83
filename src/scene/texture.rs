//! Images on surfaces. In flow image files, out flow [`Texture`]s, each file opened once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, DVec4, Vec3};
use half::f16;

use super::files::Files;
use super::mesh_file::{Channel, Image, ImageSource};
use crate::Result;
use crate::image::{self, Numbers};
use crate::optics::spectrum::luminance;

/// An image that objects wear; row 0 is the top row.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The file, for messages.
    pub path: PathBuf,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Reflectance or what else they stand for, row by row.
    pub texels: Texels,
}

/// Texels in the form that takes the least memory; the fourth channel is alpha.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Colours encoded as sRGB, of an image with 8 bits a channel.
    Srgb(Vec<[u8; 4]>),
    /// Numbers of such an image, 255 being 1.
    Unorm(Vec<[u8; 4]>),
    /// Linear Rec. 709, or numbers, from 0 to 1, of any other image.
    Linear(Vec<[f16; 4]>),
}

/// What the integers of an image stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Colours, encoded as sRGB.
    Color,
    /// Numbers, as they are.
    Data,
    /// A map of normals where an image looks like one, else heights of a surface, as bright as they are.
    Bump,
    /// How much of a surface is there; becomes alpha.
    Opacity,
}

impl Texture {
    /// The image at `path`, of these bytes; values that are not from 0 to 1 are moved there and told in `warnings`.
    pub fn decode(path: &Path, bytes: &[u8], encoding: Encoding, warnings: &mut Vec<String>) -> Result<Self> {
        let (width, height, texels) = match image::decode_numbers(path, bytes)? {
            Numbers::Eight { width, height, pixels } => match encoding {
                Encoding::Color => (width, height, Texels::Srgb(pixels)),
                Encoding::Data => (width, height, Texels::Unorm(pixels)),
                Encoding::Opacity => {
                    // What has alpha says it with that.
                    let has_alpha = pixels.iter().any(|[.., a]| *a < u8::MAX);
                    let texel = |[r, g, b, a]: [u8; 4]| {
                        let grey = luminance(DVec3::new(r.into(), g.into(), b.into())).round() as u8;
                        [u8::MAX, u8::MAX, u8::MAX, if has_alpha { a } else { grey }]
                    };
                    (width, height, Texels::Unorm(pixels.into_iter().map(texel).collect()))
                }
                Encoding::Bump => {
                    let numbers = pixels.iter().map(|texel| texel.map(|code| f32::from(code) / 255.0));
                    let texels = bumps(numbers, width).map_or(Texels::Unorm(pixels), Texels::Linear);
                    (width, height, texels)
                }
            },
            Numbers::Sixteen { width, height, pixels } => {
                let unit = |code: u16| f64::from(code) / 65535.0;
                let value = |code: u16| match encoding {
                    Encoding::Color => f16::from_f32(image::from_srgb(unit(code))),
                    Encoding::Data | Encoding::Bump | Encoding::Opacity => f16::from_f64(unit(code)),
                };
                let has_alpha = pixels.iter().any(|[.., a]| *a < u16::MAX);
                let bumps = match encoding {
                    Encoding::Bump => bumps(pixels.iter().map(|texel| texel.map(|code| unit(code) as f32)), width),
                    _ => None,
                };
                let texel = |[r, g, b, a]: [u16; 4]| {
                    let alpha = match encoding == Encoding::Opacity && !has_alpha {
                        true => luminance(DVec3::new(unit(r), unit(g), unit(b))),
                        false => unit(a),
                    };
                    [value(r), value(g), value(b), f16::from_f64(alpha)]
                };
                let texels = bumps.unwrap_or_else(|| pixels.into_iter().map(texel).collect());
                (width, height, Texels::Linear(texels))
            }
            Numbers::Float(image) => {
                let wrong = |pixel: &&[f32; 3]| !pixel.iter().all(|value| (0.0..=1.0).contains(value));
                let count = image.pixels.iter().filter(wrong).count();
                if count > 0 {
                    let what = if count == 1 { "texel was" } else { "texels were" };
                    warnings
                        .push(format!("{}: {count} {what} no reflectance from 0 to 1, and moved there", name(path)));
                }
                let half = |value: f32| f16::from_f32(if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) });
                let bumps = match encoding {
                    Encoding::Bump => bumps(image.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]), image.width),
                    _ => None,
                };
                let texel = |[r, g, b]: [f32; 3]| {
                    let alpha = if encoding == Encoding::Opacity { half(g) } else { f16::ONE };
                    [half(r), half(g), half(b), alpha]
                };
                let texels = bumps.unwrap_or_else(|| image.pixels.into_iter().map(texel).collect());
                (image.width, image.height, Texels::Linear(texels))
            }
        };
        Ok(Self { path: path.into(), width, height, texels })
    }

    /// Roughness as green and metal as blue, each a number of an image or 1, as large as the larger one.
    fn finish(images: [Option<(Self, Option<usize>)>; 2]) -> Self {
        let all = || images.iter().flatten().map(|(image, _)| image);
        let width = all().map(|image| image.width).max().unwrap_or(1);
        let height = all().map(|image| image.height).max().unwrap_or(1);
        let path = all().next().map_or_else(PathBuf::new, |image| image.path.clone());
        let is_eight = all().all(|image| matches!(image.texels, Texels::Unorm(_)));
        let mut numbers = vec![[1.0; 4]; width as usize * height as usize];
        for (target, image) in [1, 2].into_iter().zip(images) {
            let Some((image, number)) = image else { continue };
            let grey = |texel: [f32; 4]| match number {
                Some(number) => texel[number],
                None => luminance(Vec3::from_slice(&texel).as_dvec3()) as f32,
            };
            let greys: Vec<_> = image.linear().map(grey).collect();
            let nearest = |at: usize, from: u32, to: u32| at * to as usize / from as usize;
            for (i, texel) in numbers.iter_mut().enumerate() {
                let (x, y) = (i % width as usize, i / width as usize);
                let (x, y) = (nearest(x, width, image.width), nearest(y, height, image.height));
                texel[target] = greys[y * image.width as usize + x];
            }
        }
        let code = |x: f32| (x * 255.0).round() as u8;
        let texels = match is_eight {
            true => Texels::Unorm(numbers.into_iter().map(|texel| texel.map(code)).collect()),
            false => Texels::Linear(numbers.into_iter().map(|texel| texel.map(f16::from_f32)).collect()),
        };
        Self { path, width, height, texels }
    }

    /// Red, green, blue and alpha of each texel, linear.
    pub fn linear(&self) -> Box<dyn Iterator<Item = [f32; 4]> + '_> {
        match &self.texels {
            Texels::Srgb(texels) => {
                let table: [f32; 256] = std::array::from_fn(|code| image::decode_srgb(code as u8));
                Box::new(texels.iter().map(move |&[r, g, b, a]| {
                    let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
                    [r, g, b, f32::from(a) / 255.0]
                }))
            }
            Texels::Unorm(texels) => Box::new(texels.iter().map(|texel| texel.map(|code| f32::from(code) / 255.0))),
            Texels::Linear(texels) => Box::new(texels.iter().map(|texel| texel.map(f16::to_f32))),
        }
    }

    /// Whether any texel has an alpha below 1.
    pub fn has_alpha(&self) -> bool {
        match &self.texels {
            Texels::Srgb(texels) | Texels::Unorm(texels) => texels.iter().any(|[.., alpha]| *alpha < u8::MAX),
            Texels::Linear(texels) => texels.iter().any(|[.., alpha]| *alpha < f16::ONE),
        }
    }

    /// The mean of each channel.
    pub fn mean(&self) -> DVec4 {
        let sum: DVec4 = self.linear().map(|texel| DVec4::from_array(texel.map(f64::from))).sum();
        sum / f64::from(self.width) / f64::from(self.height)
    }

    /// The smallest green, which is the smallest roughness where it tells that.
    pub fn least_green(&self) -> f64 {
        self.linear().map(|[_, g, ..]| g).fold(f32::INFINITY, f32::min).into()
    }

    /// The file's name, for messages.
    pub fn name(&self) -> String {
        name(&self.path)
    }
}

/// Normals of texels that are heights; nothing where they are normals themselves: those are mostly blue, and red and
/// green are a half in the mean.
fn bumps(texels: impl ExactSizeIterator<Item = [f32; 4]> + Clone, width: u32) -> Option<Vec<[f16; 4]>> {
    let wide = |[r, g, b, _]: [f32; 4]| Vec3::new(r, g, b).as_dvec3();
    let mean = texels.clone().map(wide).sum::<DVec3>() / texels.len().max(1) as f64;
    let is_half = |x: f64| (x - 0.5).abs() < 0.15;
    if is_half(mean.x) && is_half(mean.y) && mean.z > 0.65 {
        return None;
    }
    let heights: Vec<f32> = texels.map(|texel| luminance(wide(texel)) as f32).collect();
    Some(normals(&heights, width))
}

/// The normals of heights, of which 1 is as high as a texel is wide; encoded as in an image, which repeats.
fn normals(heights: &[f32], width: u32) -> Vec<[f16; 4]> {
    let width = width as usize;
    let height = heights.len() / width;
    let at = |x: usize, y: usize| heights[y % height * width + x % width];
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let along = (at(x + 1, y) - at(x + width - 1, y)) / 2.0;
        let up = (at(x, y + height - 1) - at(x, y + 1)) / 2.0;
        let [r, g, b] = Vec3::new(-along, -up, 1.0).normalize().to_array().map(|x| f16::from_f32(x.mul_add(0.5, 0.5)));
        [r, g, b, f16::ONE]
    };
    (0..heights.len()).map(texel).collect()
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// What is read, and how.
type Key = (Vec<Option<Channel>>, Encoding);

/// The textures so far.
#[derive(Debug, Default)]
pub struct Textures {
    /// In the order in which they were named first.
    pub all: Vec<Arc<Texture>>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
    numbers: HashMap<Key, usize>,
}

impl Textures {
    /// The number in [`Textures::all`] of an image, which is read unless it was before.
    pub fn open(&mut self, files: Files, image: &Image, warnings: &mut Vec<String>) -> Result<usize> {
        let whole = |path| vec![Some(Channel { path, number: None })];
        let identity = match &image.source {
            ImageSource::File(path) => whole(files.identity(path)),
            ImageSource::Embedded { name, .. } => whole(name.clone()),
            ImageSource::Finish(channels) => {
                let identity = |one: &Channel| Channel { path: files.identity(&one.path), number: one.number };
                channels.iter().map(|one| one.as_ref().map(identity)).collect()
            }
        };
        let key = (identity, image.encoding);
        if let Some(&number) = self.numbers.get(&key) {
            return Ok(number);
        }
        let mut read = |path: &Path| -> Result<Texture> {
            let texture = Texture::decode(path, &files.read(path)?, image.encoding, warnings)?;
            self.files.push(path.into());
            Ok(texture)
        };
        let texture = match &image.source {
            ImageSource::File(path) => read(path)?,
            ImageSource::Embedded { name, bytes } => Texture::decode(name, bytes, image.encoding, warnings)?,
            ImageSource::Finish([rough, metal]) => {
                let mut channel = |one: &Option<Channel>| match one {
                    Some(Channel { path, number }) => read(path).map(|image| Some((image, *number))),
                    None => Ok(None),
                };
                Texture::finish([channel(rough)?, channel(metal)?])
            }
        };
        self.all.push(Arc::new(texture));
        self.numbers.insert(key, self.all.len() - 1);
        Ok(self.all.len() - 1)
    }
}
