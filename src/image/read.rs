//! Reading images. In flow bytes and a file name, out flow linear pixels. Sizes are read and refused before pixels are
//! allocated.

use std::io::Cursor;
use std::path::Path;

use image::{ImageDecoder, ImageFormat as Format, ImageReader};

use super::{FloatImage, exr};
use crate::{Error, Result};

/// The most columns or rows an image may have.
pub const LARGEST_SIDE: usize = 16384;

/// What can be read, for messages.
pub const KNOWN_FORMATS: &str = ".exr, .hdr, .png, .jpg, .jpeg";

/// How many bytes of pixels a byte of a file can stand for at most: DEFLATE reaches 1032, JPEG and EXR's codecs more
/// on uniform images. A header that claims more is a lie, and its pixels are not allocated.
const LARGEST_RATIO: usize = 1 << 14;

/// Why an image cannot be read.
pub struct Unreadable(pub String);

/// The pixels of the file at `path`, whose content is `bytes`: linear, sRGB files decoded. The content decides what it
/// is, the extension where the content is no help.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<FloatImage> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let kind = kind_of(bytes).or(match extension.as_deref() {
        Some("exr") => Some(Kind::Exr),
        Some("hdr") => Some(Kind::Other(Format::Hdr)),
        Some("png") => Some(Kind::Other(Format::Png)),
        Some("jpg" | "jpeg") => Some(Kind::Other(Format::Jpeg)),
        _ => None,
    });
    let decoded = match kind {
        Some(Kind::Exr) => exr::decode(bytes),
        Some(Kind::Other(format)) => decode_other(format, bytes),
        None => Err(Unreadable(format!("is no image of a known kind; known: {KNOWN_FORMATS}"))),
    };
    decoded.map_err(|Unreadable(why)| {
        let kind = match kind {
            Some(Kind::Exr) => " as OpenEXR",
            Some(Kind::Other(Format::Hdr)) => " as Radiance HDR",
            Some(Kind::Other(Format::Png)) => " as PNG",
            Some(Kind::Other(_)) => " as JPEG",
            None => return Error::input(path, 0, why),
        };
        Error::input(path, 0, format!("cannot be read{kind}: {why}"))
    })
}

#[derive(Clone, Copy)]
enum Kind {
    Exr,
    Other(Format),
}

fn kind_of(bytes: &[u8]) -> Option<Kind> {
    match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => Some(Kind::Exr),
        [0x89, b'P', b'N', b'G', ..] => Some(Kind::Other(Format::Png)),
        [0xff, 0xd8, 0xff, ..] => Some(Kind::Other(Format::Jpeg)),
        _ if bytes.starts_with(b"#?") => Some(Kind::Other(Format::Hdr)),
        _ => None,
    }
}

/// Refuses what is empty, too large, or larger than `file` bytes can hold.
pub fn check_size(width: usize, height: usize, bytes_per_pixel: usize, file: usize) -> Result<(), Unreadable> {
    if width == 0 || height == 0 {
        return Err(Unreadable(format!("{width}x{height} pixels; both sides must be at least 1")));
    }
    if width > LARGEST_SIDE || height > LARGEST_SIDE {
        return Err(Unreadable(format!("{width}x{height} pixels; sides up to {LARGEST_SIDE} are read, scale it down")));
    }
    if width * height * bytes_per_pixel > file.saturating_mul(LARGEST_RATIO) {
        return Err(Unreadable(format!("{width}x{height} pixels cannot be in {file} bytes; the file is damaged")));
    }
    Ok(())
}

fn decode_other(format: Format, bytes: &[u8]) -> Result<FloatImage, Unreadable> {
    let wrong = |error: image::ImageError| Unreadable(error.to_string());
    let decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder().map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize, decoder.color_type().bytes_per_pixel().into(), bytes.len())?;
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(wrong)?;
    let linear = matches!(format, Format::Hdr);
    let pixels = match decoded {
        image::DynamicImage::ImageRgb32F(pixels) => pixels.pixels().map(|pixel| pixel.0).collect(),
        // Up to 8 bits a table is exact and fast; 16 bits are decoded one by one.
        image::DynamicImage::ImageLuma8(_)
        | image::DynamicImage::ImageLumaA8(_)
        | image::DynamicImage::ImageRgb8(_)
        | image::DynamicImage::ImageRgba8(_) => {
            let table: Vec<f32> = (0..=255u8).map(|code| from_srgb(f64::from(code) / 255.0)).collect();
            decoded.into_rgb8().pixels().map(|pixel| pixel.0.map(|code| table[usize::from(code)])).collect()
        }
        other if linear => other.into_rgb32f().pixels().map(|pixel| pixel.0).collect(),
        other => {
            let decode = |code: u16| from_srgb(f64::from(code) / 65535.0);
            other.into_rgb16().pixels().map(|pixel| pixel.0.map(decode)).collect()
        }
    };
    Ok(FloatImage { width, height, pixels, layers: Vec::new() })
}

/// IEC 61966-2-1, display value to linear.
fn from_srgb(value: f64) -> f32 {
    (if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }) as f32
}
