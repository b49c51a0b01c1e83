//! What surrounds a scene. In flows an image file or a colour, out flows radiance by direction, every texel finite and
//! not negative.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::files::Files;
use crate::Result;
use crate::image;

/// Surroundings and how they are shown.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Where the light comes from.
    pub light: Surroundings,
    /// Factor of the radiance.
    pub intensity: f64,
    /// Radians about +y: turns the surroundings anticlockwise seen from above.
    pub rotation: f64,
    /// False: black where the camera sees it directly.
    pub visible: bool,
}

/// Radiance by direction.
#[derive(Clone, Debug)]
pub enum Surroundings {
    /// An equirectangular image.
    Image(Panorama),
    /// The same from everywhere, linear Rec. 709.
    Color(DVec3),
}

/// An equirectangular image: u = atan2(d.x, -d.z) / 2 pi, v = acos(d.y) / pi.
#[derive(Clone, Debug)]
pub struct Panorama {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance in linear Rec. 709, row by row from +y; finite and not negative.
    pub texels: Arc<Vec<[f32; 3]>>,
    /// What was not.
    pub repaired: Repairs,
}

/// Texels that no renderer can use, as counts; a texel may be of several kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Texels changed.
    pub texels: usize,
    /// With a NaN, which became 0.
    pub nan: usize,
    /// With an infinity, which became the largest finite half.
    pub infinite: usize,
    /// With a negative value, which became 0.
    pub negative: usize,
}

/// What an infinite texel becomes.
pub const LARGEST_HALF: f32 = 65504.0;

impl Panorama {
    /// Reads and repairs the image at `path`; a repair is told in `warnings`.
    pub fn read(files: Files, path: &Path, warnings: &mut Vec<String>) -> Result<Self> {
        let image = image::decode(path, &files.read(path)?)?;
        let panorama = Self::new(image.width, image.height, image.pixels);
        let Repairs { texels, nan, infinite, negative } = panorama.repaired;
        if texels > 0 {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            let what = if texels == 1 { "texel" } else { "texels" };
            warnings.push(format!(
                "{name}: repaired {texels} {what} ({nan} NaN, {infinite} infinite, {negative} negative)"
            ));
        }
        Ok(panorama)
    }

    /// A panorama out of `width` * `height` texels as found.
    pub fn new(width: u32, height: u32, mut texels: Vec<[f32; 3]>) -> Self {
        let mut repaired = Repairs::default();
        for texel in &mut texels {
            let nan = texel.iter().any(|value| value.is_nan());
            let infinite = texel.contains(&f32::INFINITY);
            let negative = texel.iter().any(|&value| value < 0.0);
            if nan || infinite || negative {
                repaired.texels += 1;
                repaired.nan += usize::from(nan);
                repaired.infinite += usize::from(infinite);
                repaired.negative += usize::from(negative);
                *texel = texel.map(|value| match value {
                    f32::INFINITY => LARGEST_HALF,
                    // Neither NaN nor below zero.
                    value if value >= 0.0 => value,
                    _ => 0.0,
                });
            }
        }
        Self { width, height, texels: Arc::new(texels), repaired }
    }

    /// The next level of a mip chain: half as wide and high, rounded down, and at least 1; texels are means over the solid angle
    /// that they cover.
    #[must_use]
    pub fn halved(&self) -> Self {
        // A row between v and v + dv covers cos(pi v) - cos(pi (v + dv)).
        let (width, height, texels) =
            image::halved(&self.texels, self.width, self.height, |edge| -(edge * std::f64::consts::PI).cos());
        Self { width, height, texels: Arc::new(texels), repaired: Repairs::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_keep_the_light() {
        // Odd sides and a bright spot: the light over the whole sphere stays, down to one texel.
        let light = |panorama: &Panorama| {
            let edge = |row: u32| -(std::f64::consts::PI * f64::from(row) / f64::from(panorama.height)).cos();
            let row_light = |row: u32| {
                let texels = &panorama.texels[(row * panorama.width) as usize..((row + 1) * panorama.width) as usize];
                let mean = texels.iter().map(|texel| f64::from(texel[1])).sum::<f64>() / f64::from(panorama.width);
                mean * (edge(row + 1) - edge(row)) / 2.0
            };
            (0..panorama.height).map(row_light).sum::<f64>()
        };
        let mut texels = vec![[0.5; 3]; 13 * 7];
        texels[13 * 2 + 5] = [100.0; 3];
        let mut panorama = Panorama::new(13, 7, texels);
        let whole = light(&panorama);
        let mut sizes = Vec::new();
        while panorama.width > 1 {
            panorama = panorama.halved();
            sizes.push((panorama.width, panorama.height));
            assert!((light(&panorama) / whole - 1.0).abs() < 1e-6, "{sizes:?}");
        }
        assert_eq!(sizes, [(6, 3), (3, 1), (1, 1)]);
        let white = Panorama::new(5, 3, vec![[1.0; 3]; 15]).halved();
        assert!(white.texels.iter().flatten().all(|value| (value - 1.0).abs() < 1e-6));
    }

    #[test]
    fn texels_are_repaired_and_counted() {
        let (nan, infinite) = (f32::NAN, f32::INFINITY);
        let texels =
            vec![[1.0, 2.0, 3.0], [nan, 1.0, 1.0], [infinite, -1.0, 0.0], [-infinite, 70000.0, -0.0], [nan; 3]];
        let panorama = Panorama::new(5, 1, texels);
        assert_eq!(panorama.repaired, Repairs { texels: 4, nan: 2, infinite: 1, negative: 2 });
        let expected = [[1.0, 2.0, 3.0], [0.0, 1.0, 1.0], [65504.0, 0.0, 0.0], [0.0, 70000.0, 0.0], [0.0; 3]];
        assert_eq!(*panorama.texels, expected);
    }
}
