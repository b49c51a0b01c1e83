//! Pixels and their files. In flow radiance and what it was made with, out flow EXR and PNG files; or in flows a file,
//! out flow pixels.

mod exr;
mod levels;
mod output;
mod png;
mod read;

pub use self::exr::{decode_whole as decode_whole_exr, encode as encode_exr};
pub(crate) use levels::halved;
pub use output::{FolderLock, ImageFormat, LOCK, OutputFile, check_folder, make_folder};
pub use png::encode as encode_png;
pub use read::{
    KNOWN_FORMATS, LARGEST_SIDE, Numbers, Stored, Unreadable, decode, decode_numbers, decode_srgb, decode_stored,
    from_srgb,
};

/// Scene-linear radiance and whatever else is known about each pixel; row 0 is the top row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FloatImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue, row by row.
    pub pixels: Vec<[f32; 3]>,
    /// Extra layers.
    pub layers: Vec<Layer>,
}

/// Named channels of the size of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name; a channel `X` of the layer `normal` is called `normal.X` in an EXR.
    pub name: String,
    /// Names and values, row by row.
    pub channels: Vec<(String, Vec<f32>)>,
}

/// What a file says about its making: pairs of a key, such as `vitrum:version`, and a text.
pub type Metadata = [(String, String)];
