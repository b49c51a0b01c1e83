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

/// How many bytes of pixels a byte of a file can stand for at most: DEFLATE reaches 1032, JPEG and EXR's codecs a few
/// times that on uniform images. A header that claims more is a lie, and its pixels are not allocated.
const LARGEST_RATIO: usize = 1 << 12;

/// Pixels of this many bytes are allocated without looking at the size of the file.
const ALWAYS_FINE: usize = 64 << 20;

/// Why an image cannot be read.
#[derive(Debug)]
pub struct Unreadable(pub String);

/// Pixels as a file stores them.
#[derive(Clone, Debug)]
pub enum Stored {
    /// 8 bits a channel, encoded as sRGB.
    Srgb {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Red, green and blue, row by row from the top.
        pixels: Vec<[u8; 3]>,
    },
    /// Anything else: linear.
    Linear(FloatImage),
}

/// Red, green, blue and alpha, row by row from the top, as numbers of a file.
#[derive(Clone, Debug)]
pub enum Numbers {
    /// 8 bits a channel.
    Eight {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// 255 stands for 1.
        pixels: Vec<[u8; 4]>,
    },
    /// 16 bits a channel.
    Sixteen {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// 65535 stands for 1.
        pixels: Vec<[u16; 4]>,
    },
    /// Linear, without alpha.
    Float(FloatImage),
}

impl Stored {
    /// The same pixels, linear.
    pub fn into_linear(self) -> FloatImage {
        match self {
            Self::Linear(image) => image,
            Self::Srgb { width, height, pixels } => {
                // Up to 8 bits a table is exact and fast.
                let table: Vec<f32> = (0..=255u8).map(decode_srgb).collect();
                let pixels = pixels.into_iter().map(|pixel| pixel.map(|code| table[usize::from(code)])).collect();
                FloatImage { width, height, pixels, layers: Vec::new() }
            }
        }
    }
}

/// The pixels of the file at `path`, whose content is `bytes`: linear, sRGB files decoded. The content decides what it
/// is, the extension where the content is no help.
pub fn decode(path: &Path, bytes: &[u8]) -> Result<FloatImage> {
    decode_stored(path, bytes).map(Stored::into_linear)
}

/// As [`decode`], but images of 8 bits a channel are left as they are.
pub fn decode_stored(path: &Path, bytes: &[u8]) -> Result<Stored> {
    Ok(match decode_numbers(path, bytes)? {
        Numbers::Eight { width, height, pixels } => {
            Stored::Srgb { width, height, pixels: pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect() }
        }
        Numbers::Sixteen { width, height, pixels } => {
            let decode = |code: u16| from_srgb(f64::from(code) / 65535.0);
            let pixels = pixels.into_iter().map(|[r, g, b, _]| [r, g, b].map(decode)).collect();
            Stored::Linear(FloatImage { width, height, pixels, layers: Vec::new() })
        }
        Numbers::Float(image) => Stored::Linear(image),
    })
}

/// The pixels of the file at `path` as it has them, encoded or not.
pub fn decode_numbers(path: &Path, bytes: &[u8]) -> Result<Numbers> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    let kind = kind_of(bytes).or(match extension.as_deref() {
        Some("exr") => Some(Kind::Exr),
        Some("hdr") => Some(Kind::Other(Format::Hdr)),
        Some("png") => Some(Kind::Other(Format::Png)),
        Some("jpg" | "jpeg") => Some(Kind::Other(Format::Jpeg)),
        _ => None,
    });
    let decoded = match kind {
        Some(Kind::Exr) => exr::decode(bytes).map(Numbers::Float),
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
        // Decoders may spread their reasons over several lines.
        let why: Vec<_> = why.split_whitespace().collect();
        Error::input(path, 0, format!("cannot be read{kind}: {}", why.join(" ")))
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
    if width * height * bytes_per_pixel > file.saturating_mul(LARGEST_RATIO).max(ALWAYS_FINE) {
        return Err(Unreadable(format!("{width}x{height} pixels cannot be in {file} bytes; the file is damaged")));
    }
    Ok(())
}

fn decode_other(format: Format, bytes: &[u8]) -> Result<Numbers, Unreadable> {
    let wrong = |error: image::ImageError| Unreadable(error.to_string());
    let decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder().map_err(wrong)?;
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize, decoder.color_type().bytes_per_pixel().into(), bytes.len())?;
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(wrong)?;
    let linear = matches!(format, Format::Hdr);
    let pixels = match decoded {
        image::DynamicImage::ImageRgb32F(pixels) => pixels.pixels().map(|pixel| pixel.0).collect(),
        image::DynamicImage::ImageLuma8(_)
        | image::DynamicImage::ImageLumaA8(_)
        | image::DynamicImage::ImageRgb8(_)
        | image::DynamicImage::ImageRgba8(_) => {
            let pixels = decoded.into_rgba8().into_raw().as_chunks().0.to_vec();
            return Ok(Numbers::Eight { width, height, pixels });
        }
        other if linear => other.into_rgb32f().pixels().map(|pixel| pixel.0).collect(),
        other => {
            let pixels = other.into_rgba16().into_raw().as_chunks().0.to_vec();
            return Ok(Numbers::Sixteen { width, height, pixels });
        }
    };
    Ok(Numbers::Float(FloatImage { width, height, pixels, layers: Vec::new() }))
}

/// From 8 bits as sRGB to linear.
pub fn decode_srgb(code: u8) -> f32 {
    from_srgb(f64::from(code) / 255.0)
}

/// IEC 61966-2-1, display value to linear.
pub fn from_srgb(value: f64) -> f32 {
    (if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }) as f32
}

#[cfg(test)]
mod tests {
    use image::{DynamicImage, ImageBuffer, Luma, Rgb};

    use super::*;

    fn encoded(image: &DynamicImage, format: Format) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn first_pixel(image: impl Into<DynamicImage>, format: Format) -> [f32; 3] {
        let bytes = encoded(&image.into(), format);
        // The content decides, not the name.
        decode(Path::new("sky.hdr"), &bytes).unwrap().pixels[0]
    }

    fn close(found: [f32; 3], expected: [f32; 3], tolerance: f32) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance), "{found:?}, not {expected:?}");
    }

    #[test]
    fn srgb_is_decoded_to_linear() {
        let eight = ImageBuffer::from_pixel(2, 2, Rgb([0_u8, 188, 255]));
        close(first_pixel(eight.clone(), Format::Png), [0.0, 0.502_886_5, 1.0], 1e-6);
        close(first_pixel(ImageBuffer::from_pixel(8, 8, Rgb([188_u8; 3])), Format::Jpeg), [0.503; 3], 0.01);
        let sixteen = ImageBuffer::from_pixel(2, 2, Rgb([0_u16, 32768, 655]));
        close(first_pixel(sixteen, Format::Png), [0.0, 0.214_048_2, 0.000_773_58], 1e-6);
        close(first_pixel(ImageBuffer::from_pixel(2, 2, Luma([188_u8])), Format::Png), [0.502_886_5; 3], 1e-6);
        close(first_pixel(ImageBuffer::from_pixel(2, 2, Luma([32768_u16])), Format::Png), [0.214_048_2; 3], 1e-6);
    }

    #[test]
    fn radiance_files_are_linear() {
        let pixels = ImageBuffer::from_pixel(9, 2, Rgb([0.5_f32, 100.0, 0.25]));
        close(first_pixel(pixels, Format::Hdr), [0.5, 100.0, 0.25], 0.5);
    }

    #[test]
    fn what_is_no_image_says_what_would_be_one() {
        let error = |name: &str, bytes: &[u8]| decode(Path::new(name), bytes).unwrap_err().to_string();
        assert_eq!(
            error("a.txt", b"hello"),
            "a.txt: is no image of a known kind; known: .exr, .hdr, .png, .jpg, .jpeg"
        );
        assert!(error("a.EXR", b"hello").starts_with("a.EXR: cannot be read as OpenEXR: "));
        assert!(error("a.jpeg", b"").starts_with("a.jpeg: cannot be read as JPEG: "));
        assert!(error("a.png", b"GIF89a").starts_with("a.png: cannot be read as PNG: "));
        assert!(error("a.hdr", b"#?RADIANCE\n\n-Y x").starts_with("a.hdr: cannot be read as Radiance HDR: "));
    }

    #[test]
    fn sizes_are_refused_before_pixels_are_allocated() {
        let error = |bytes: &[u8]| decode(Path::new("a"), bytes).unwrap_err().to_string();
        let hdr = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
        assert!(error(&hdr("-Y 100000 +X 100000")).contains("100000x100000 pixels; sides up to 16384 are read"));
        assert!(error(&hdr("-Y 16000 +X 16000")).contains("cannot be in"));
        assert!(error(&hdr("-Y 0 +X 8")).contains("both sides must be at least 1"));
        let mut png = encoded(&ImageBuffer::from_pixel(1, 1, Luma([0_u8])).into(), Format::Png);
        png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        assert!(error(&png).contains("cannot be read as PNG"));
    }
}
