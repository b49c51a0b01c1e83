//! OpenEXR files. Out of a [`FloatImage`] flows the same bytes each time, channels named as Blender and tev read them;
//! in flows any flat EXR with red, green and blue or luminance.

use std::io::Cursor;

use exr::block::chunk::CompressedBlock;
use exr::meta::BlockDescription;
use exr::meta::header::Header;
use exr::prelude::*;

use super::read::{Unreadable, check_size};
use super::{FloatImage, Layer, Metadata};

/// An EXR of one part: `R`, `G`, `B` and `LAYER.CHANNEL`, 32-bit float, ZIP, `metadata` as text attributes.
pub fn encode(image: &FloatImage, metadata: &Metadata) -> std::io::Result<Vec<u8>> {
    let channel =
        |name: String, samples: Vec<f32>| AnyChannel::new(Text::from(name.as_str()), FlatSamples::F32(samples));
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(index, name)| channel(name.into(), image.pixels.iter().map(|pixel| pixel[index]).collect()))
        .collect();
    for layer in &image.layers {
        for (name, samples) in &layer.channels {
            channels.push(channel(format!("{}.{name}", layer.name), samples.clone()));
        }
    }
    let mut attributes = LayerAttributes::default();
    for (key, value) in metadata {
        attributes.other.insert(latin(key), AttributeValue::Text(latin(value)));
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (image.width as usize, image.height as usize);
    let layer = exr::image::Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    exr::image::Image::from_layer(layer).write().to_buffered(&mut bytes).map_err(std::io::Error::other)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Text as EXR can hold it: characters beyond Latin-1 are written as escapes.
fn latin(text: &str) -> Text {
    let escaped: String = text
        .chars()
        .map(|c| if u32::from(c) < 0x100 { c.to_string() } else { c.escape_unicode().to_string() })
        .collect();
    Text::from(escaped.as_str())
}

/// Puts the attributes of the header into the order of their names: the `exr` crate writes them in a random one.
fn sort_attributes(file: &mut [u8]) {
    const AFTER_VERSION: usize = 8;
    let mut attributes = Vec::new();
    let mut start = AFTER_VERSION;
    while file[start] != 0 {
        // A name, a type, both ended by a zero, the length of the value in four bytes, the value.
        let word = |from: usize| from + file[from..].iter().position(|&byte| byte == 0).unwrap_or(0) + 1;
        let length = word(word(start));
        let value = length + 4;
        let bytes = u32::from_le_bytes([file[length], file[length + 1], file[length + 2], file[length + 3]]);
        let end = value + bytes as usize;
        attributes.push(file[start..end].to_vec());
        start = end;
    }
    attributes.sort();
    file[AFTER_VERSION..start].copy_from_slice(&attributes.concat());
}

/// A file as [`encode`] makes them: colours, layers and texts.
pub fn decode_whole(bytes: &[u8]) -> std::result::Result<(FloatImage, Vec<(String, String)>), Unreadable> {
    // It refuses what is not as it claims to be.
    let colors = decode(bytes)?;
    let wrong = |error: exr::error::Error| Unreadable(error.to_string());
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let image = read.first_valid_layer().all_attributes().from_buffered(Cursor::new(bytes)).map_err(wrong)?;
    let layer = image.layer_data;
    if layer.size.area() != colors.pixels.len() {
        return Err(Unreadable("holds layers of another size than the image".into()));
    }
    let mut layers: Vec<Layer> = Vec::new();
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        let Some((of, name)) = name.rsplit_once('.') else { continue };
        let values = channel.sample_data.values_as_f32().collect();
        match layers.iter_mut().find(|layer| layer.name == of) {
            Some(layer) => layer.channels.push((name.into(), values)),
            None => layers.push(Layer { name: of.into(), channels: vec![(name.into(), values)] }),
        }
    }
    let text = |(key, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(value) => Some((key.to_string(), value.to_string())),
        _ => None,
    };
    let mut texts: Vec<_> = layer.attributes.other.iter().filter_map(text).collect();
    texts.sort();
    Ok((FloatImage { layers, ..colors }, texts))
}

/// Red, green and blue of the display window of an EXR: where the data window ends the image is black. Luminance alone
/// becomes grey.
pub fn decode(bytes: &[u8]) -> std::result::Result<FloatImage, Unreadable> {
    let wrong = |error: exr::error::Error| Unreadable(error.to_string());
    let chunks = exr::block::read(Cursor::new(bytes), /* pedantic */ false).map_err(wrong)?;
    let headers = chunks.headers();
    for header in headers {
        if header.deep {
            return Err(Unreadable("holds deep pixels; flatten it".into()));
        }
        let samples = header.channels.list.len();
        check_size(header.layer_size.width(), header.layer_size.height(), samples * 4, bytes.len())?;
        // What the `exr` crate allocates for a compressed block, before it knows that the file holds one.
        let (columns, rows) = block_size(header);
        check_size(columns, rows, samples * 4, bytes.len())
            .map_err(|Unreadable(why)| Unreadable(format!("blocks of {why}")))?;
        let display = header.shared_attributes.display_window.size;
        check_size(display.width(), display.height(), 1, bytes.len())?;
    }
    if headers.iter().any(|header| is_dwa(header.compression)) {
        check_dwa_chunks(bytes)?;
    }
    let [red, green, blue] = headers.iter().find_map(color_channels).ok_or_else(|| {
        let found: Vec<_> =
            headers.iter().flat_map(|h| &h.channels.list).map(|channel| channel.name.to_string()).collect();
        Unreadable(format!("holds neither R, G and B nor Y but the channels {}", found.join(", ")))
    })?;
    let window = headers[0].shared_attributes.display_window;
    let place =
        |size: Vec2<usize>, pixels: Vec<[f32; 3]>, position: Vec2<i32>| in_window(size, pixels, position, window);
    let blank = |size: Vec2<usize>| (size.width(), vec![[0.0f32; 3]; size.area()]);
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().specific_channels();
    if red == blue {
        let image = read
            .required(red)
            .collect_pixels(
                |size, _| blank(size),
                |(width, pixels), at, (y,): (f32,)| pixels[at.y() * *width + at.x()] = [y; 3],
            )
            .first_valid_layer()
            .all_attributes()
            .from_chunks(chunks)
            .map_err(wrong)?;
        let layer = image.layer_data;
        return Ok(place(layer.size, layer.channel_data.pixels.1, layer.attributes.layer_position));
    }
    let image = read
        .required(red)
        .required(green)
        .required(blue)
        .collect_pixels(
            |size, _| blank(size),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(chunks)
        .map_err(wrong)?;
    let layer = image.layer_data;
    Ok(place(layer.size, layer.channel_data.pixels.1, layer.attributes.layer_position))
}

/// Columns and rows of a block that is compressed as one, parts outside of the image included.
fn block_size(header: &Header) -> (usize, usize) {
    match header.blocks {
        BlockDescription::ScanLines => (header.layer_size.width(), header.compression.scan_lines_per_block()),
        BlockDescription::Tiles(tiles) => (tiles.tile_size.width(), tiles.tile_size.height()),
    }
}

fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

/// Refuses DWA chunks that claim to become larger than their pixels: the `exr` crate allocates what they claim.
fn check_dwa_chunks(bytes: &[u8]) -> std::result::Result<(), Unreadable> {
    let wrong = |error: exr::error::Error| Unreadable(error.to_string());
    let reader = exr::block::read(Cursor::new(bytes), /* pedantic */ false).map_err(wrong)?;
    let headers: Vec<Header> = reader.headers().to_vec();
    for chunk in reader.filter_chunks(/* pedantic */ false, |_, _, _| true).map_err(wrong)? {
        let chunk = chunk.map_err(wrong)?;
        let Some(header) = headers.get(chunk.layer_index).filter(|header| is_dwa(header.compression)) else { continue };
        let data = match &chunk.compressed_block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            _ => continue,
        };
        let (columns, rows) = block_size(header);
        // 8x8 blocks reach over the edges; twice four bytes a sample, as each section has overhead of its own.
        let side = |pixels: usize, whole: usize| pixels.min(whole) + 8;
        let area = side(columns, header.layer_size.width()) * side(rows, header.layer_size.height());
        let largest = (area * header.channels.list.len() * 8) as u64;
        // A version, then counters: bytes unknown, unknown compressed, AC, DC, RLE compressed, RLE, RLE raw, and
        // counts of AC and DC coefficients of two bytes.
        let counter = |index: usize| {
            data.get(index * 8..index * 8 + 8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes)
        };
        let sizes = [counter(1), counter(6), counter(7), counter(8), counter(9)];
        if sizes.into_iter().flatten().any(|size| size > largest) {
            return Err(Unreadable("a DWA chunk claims more data than it has pixels; the file is damaged".into()));
        }
    }
    Ok(())
}

/// The names of red, green and blue, of the unnamed layer before others; three times that of the luminance.
fn color_channels(header: &Header) -> Option<[Text; 3]> {
    let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let has = |name: &String| names.contains(name);
    let layers = names.iter().filter_map(|name| name.strip_suffix('R')).filter(|p| p.is_empty() || p.ends_with('.'));
    let colors = layers.map(|layer| ["R", "G", "B"].map(|channel| format!("{layer}{channel}")));
    let best = colors.filter(|colors| colors.iter().all(has)).min_by_key(|colors| colors[0].len());
    let gray = || has(&"Y".to_owned()).then(|| [(); 3].map(|()| "Y".to_owned()));
    best.or_else(gray).map(|colors| colors.map(|name| Text::from(name.as_str())))
}

/// The pixels in `window`, out of those of a data window of `size` at `position`.
fn in_window(size: Vec2<usize>, pixels: Vec<[f32; 3]>, position: Vec2<i32>, window: IntegerBounds) -> FloatImage {
    let (width, height) = (window.size.width() as u32, window.size.height() as u32);
    if size == window.size && position == window.position {
        return FloatImage { width, height, pixels, layers: Vec::new() };
    }
    let mut placed = vec![[0.0; 3]; window.size.area()];
    let shift = |axis: fn(Vec2<i32>) -> i32| i64::from(axis(position)) - i64::from(axis(window.position));
    let (right, down) = (shift(|at| at.x()), shift(|at| at.y()));
    for (y, row) in pixels.chunks_exact(size.width()).enumerate() {
        let Ok(y) = usize::try_from(y as i64 + down) else { continue };
        for (x, pixel) in row.iter().enumerate() {
            match usize::try_from(x as i64 + right) {
                Ok(x) if x < width as usize && y < height as usize => placed[y * width as usize + x] = *pixel,
                _ => {}
            }
        }
    }
    FloatImage { width, height, pixels: placed, layers: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> FloatImage {
        let pixels =
            vec![[0.0, 1.0, 2.0], [0.5, -1.0, 65504.0], [1e30, 1e-30, 3.0], [7.0, 8.0, 9.0], [0.1, 0.2, 0.3], [4.0; 3]];
        let normal = ["X", "Y", "Z"].map(|name| (name.to_owned(), vec![0.25; 6])).to_vec();
        let layers = vec![
            Layer { name: "normal".into(), channels: normal },
            Layer { name: "depth".into(), channels: vec![("Z".into(), vec![1.5; 6])] },
        ];
        FloatImage { width: 3, height: 2, pixels, layers }
    }

    fn metadata() -> Vec<(String, String)> {
        ["version", "device", "options", "seed", "scene", "model"]
            .map(|key| (format!("vitrum:{key}"), format!("the {key}, \u{e4}")))
            .to_vec()
    }

    #[test]
    fn radiance_comes_back_bit_for_bit() {
        let decoded = decode(&encode(&image(), &metadata()).unwrap()).unwrap();
        assert_eq!((decoded.width, decoded.height), (3, 2));
        assert_eq!(decoded.pixels, image().pixels);
        let (mut whole, texts) = decode_whole(&encode(&image(), &metadata()).unwrap()).unwrap();
        whole.layers.sort_by(|a, b| b.name.cmp(&a.name));
        assert_eq!(whole, image());
        let mut expected = metadata();
        expected.sort();
        assert_eq!(texts, expected);
    }

    #[test]
    fn layers_and_metadata_are_in_the_header() {
        let bytes = encode(&image(), &metadata()).unwrap();
        let meta = MetaData::read_from_buffered(Cursor::new(&bytes), true).unwrap();
        let names: Vec<_> = meta.headers[0].channels.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z"]);
        let key = Text::from("vitrum:device");
        let AttributeValue::Text(device) = &meta.headers[0].own_attributes.other[&key] else { panic!("no text") };
        // Text is stored as Latin 1.
        assert_eq!(device.to_string(), "the device, \u{e4}");
    }

    #[test]
    fn the_same_image_gives_the_same_bytes() {
        let first = encode(&image(), &metadata()).unwrap();
        for _ in 0..16 {
            assert_eq!(encode(&image(), &metadata()).unwrap(), first);
        }
    }

    #[test]
    fn every_layout_of_colour_is_read() {
        for compression in
            [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::PIZ, Compression::PXR24]
        {
            for layout in [["R", "G", "B"], ["beauty.R", "beauty.G", "beauty.B"], ["Y", "A", "Z"]] {
                let channel = |(index, name): (usize, &str)| {
                    let samples = match index {
                        0 => FlatSamples::F16(vec![f16::from_f32(0.5); 4]),
                        1 => FlatSamples::F32(vec![2.0; 4]),
                        _ => FlatSamples::U32(vec![3; 4]),
                    };
                    AnyChannel::new(name, samples)
                };
                let channels = AnyChannels::sort(layout.into_iter().enumerate().map(channel).collect());
                let encoding =
                    Encoding { compression, blocks: Blocks::Tiles(Vec2(2, 2)), line_order: LineOrder::Increasing };
                let layer = exr::image::Layer::new((2, 2), LayerAttributes::default(), encoding, channels);
                let mut bytes = Cursor::new(Vec::new());
                exr::image::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
                let expected = if layout[0] == "Y" { [0.5; 3] } else { [0.5, 2.0, 3.0] };
                assert_eq!(decode(bytes.get_ref()).unwrap().pixels, [expected; 4], "{layout:?}");
            }
        }
    }

    #[test]
    fn the_display_window_is_what_is_seen() {
        let channel = |name| AnyChannel::new(name, FlatSamples::F32(vec![1.0, 2.0, 3.0, 4.0]));
        let channels = AnyChannels::sort(["R", "G", "B"].into_iter().map(channel).collect());
        let attributes = LayerAttributes { layer_position: Vec2(9, 21), ..LayerAttributes::default() };
        let layer = exr::image::Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels);
        let mut image = exr::image::Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::new((10, 20), (2, 3));
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        let decoded = decode(bytes.get_ref()).unwrap();
        assert_eq!((decoded.width, decoded.height), (2, 3));
        assert_eq!(decoded.pixels.iter().map(|pixel| pixel[0]).collect::<Vec<_>>(), [0.0, 0.0, 2.0, 0.0, 4.0, 0.0]);
    }

    #[test]
    fn channels_without_colour_are_listed() {
        let channels = AnyChannels::sort(
            ["A", "X", "Z"].map(|name| AnyChannel::new(name, FlatSamples::F32(vec![1.0]))).into_iter().collect(),
        );
        let layer = exr::image::Layer::new((1, 1), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
        let mut bytes = Cursor::new(Vec::new());
        exr::image::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        assert_eq!(decode(bytes.get_ref()).unwrap_err().0, "holds neither R, G and B nor Y but the channels A, X, Z");
    }

    /// Where the value of the attribute with this name and type starts.
    fn value_of(file: &[u8], name_and_type: &[u8]) -> usize {
        file.windows(name_and_type.len()).position(|window| window == name_and_type).unwrap() + name_and_type.len() + 4
    }

    #[test]
    fn blocks_that_claim_too_much_are_refused() {
        let channels = AnyChannels::sort(
            ["B", "G", "R"]
                .map(|name| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; 64])))
                .into_iter()
                .collect(),
        );
        for (compression, tamper, expected) in [
            (Compression::RLE, "tile", "blocks of 8x1056964616 pixels; sides up to 16384 are read"),
            (Compression::DWAA(None), "chunk", "a DWA chunk claims more data than it has pixels"),
        ] {
            let encoding =
                Encoding { compression, blocks: Blocks::Tiles(Vec2(8, 8)), line_order: LineOrder::Increasing };
            let layer = exr::image::Layer::new((8, 8), LayerAttributes::default(), encoding, channels.clone());
            let mut bytes = Cursor::new(Vec::new());
            exr::image::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            let mut bytes = bytes.into_inner();
            assert_eq!(decode(&bytes).unwrap().pixels.len(), 64);
            let at = match tamper {
                "tile" => value_of(&bytes, b"tiles\0tiledesc\0") + 7,
                // The version, 2, is the first of a chunk's counters; the next one is a size.
                _ => bytes.windows(8).position(|window| window == 2_u64.to_le_bytes()).unwrap() + 15,
            };
            bytes[at] = 0x3f;
            let Unreadable(message) = decode(&bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn a_header_that_lies_about_the_size_is_refused() {
        let mut bytes =
            encode(&FloatImage { width: 1, height: 1, pixels: vec![[1.0; 3]], layers: vec![] }, &[]).unwrap();
        let at = value_of(&bytes, b"dataWindow\0box2i\0");
        for (width, height, expected) in [
            (20000_i32, 1_i32, "20000x1 pixels; sides up to 16384 are read"),
            (16000, 16000, ""),
            (i32::MAX, i32::MAX, ""),
            (0, 1, ""),
        ] {
            bytes[at + 8..at + 12].copy_from_slice(&(width - 1).to_le_bytes());
            bytes[at + 12..at + 16].copy_from_slice(&(height - 1).to_le_bytes());
            let Unreadable(message) = decode(&bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
