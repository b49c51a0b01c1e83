//! PNG files. In flow display values, out flow the same bytes each time, marked as sRGB, with text about their making.

use super::Metadata;

/// A PNG of 8 bits a channel out of `pixels`, row by row, three or four bytes each.
///
/// Keys of `metadata` are 1 to 79 Latin characters; a longer rest is cut off.
pub fn encode<const CHANNELS: usize>(
    width: u32,
    height: u32,
    pixels: &[[u8; CHANNELS]],
    metadata: &Metadata,
) -> std::io::Result<Vec<u8>> {
    const { assert!(CHANNELS == 3 || CHANNELS == 4) };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(if CHANNELS == 3 { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    for (key, value) in metadata {
        encoder.add_itxt_chunk(key.chars().take(79).collect(), value.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}
