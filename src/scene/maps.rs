//! How images lie on surfaces, and what they say there: what flows in are the textures of a scene file, an MTL or a glTF, what
//! flows out is part of a [`super::Material`].

use glam::{DMat2, DVec2};

/// An image as a material wears it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureMap {
    /// Index into [`super::Scene::textures`].
    pub texture: usize,
    /// From the coordinates of a mesh, v downwards, to those of the image; before the offset. As KHR_texture_transform.
    pub turn: DMat2,
    /// After the turn.
    pub offset: DVec2,
    /// Beyond the image, horizontally and vertically.
    pub wrap: [Wrap; 2],
}

/// What lies beyond an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image again, every other time mirrored.
    Mirror,
    /// Its outermost texels.
    Clamp,
}

/// A map of normals, in the frame of the texture's coordinates, as glTF has it: red to the right, green upwards, blue along the
/// normal, from -1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The image.
    pub map: TextureMap,
    /// What red and green are multiplied by, of any sign.
    pub scale: f64,
}

/// Where a surface is not there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutout {
    /// How much of it is there, 0 to 1.
    pub alpha: f64,
    /// Alpha is multiplied with that.
    pub map: Option<TextureMap>,
    /// The surface is there from this alpha on, and nowhere else; `None`: it is there as often as alpha says.
    pub cutoff: Option<f64>,
}

impl TextureMap {
    /// The image as it is.
    pub fn of(texture: usize) -> Self {
        Self { texture, turn: DMat2::IDENTITY, offset: DVec2::ZERO, wrap: [Wrap::Repeat; 2] }
    }
}
