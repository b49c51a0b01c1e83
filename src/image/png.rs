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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_srgb_mark_and_texts_come_back() {
        let metadata = [("vitrum:version".to_owned(), "0.1 \u{3b1}".to_owned()), ("k".repeat(99), "cut".to_owned())];
        let pixels = [[1, 2, 3, 255], [4, 5, 6, 0]];
        let bytes = encode(2, 1, &pixels, &metadata).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut decoded = vec![0; 8];
        reader.next_frame(&mut decoded).unwrap();
        assert_eq!(decoded, pixels.as_flattened());
        let info = reader.info();
        assert_eq!(info.srgb, Some(png::SrgbRenderingIntent::Perceptual));
        assert_eq!(info.utf8_text[0].keyword, "vitrum:version");
        assert_eq!(info.utf8_text[0].get_text().unwrap(), "0.1 \u{3b1}");
        assert_eq!(info.utf8_text[1].keyword, "k".repeat(79));
        assert_eq!(encode(2, 1, &pixels, &metadata).unwrap(), bytes);
        assert!(encode(1, 1, &[[1, 2, 3]], &[]).is_ok());
    }
}
