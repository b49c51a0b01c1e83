//! OpenEXR files. Out of a [`FloatImage`] flows the same bytes each time, channels named as Blender and tev read them;
//! in flows any flat EXR with red, green and blue or luminance.

use std::io::Cursor;

use exr::meta::header::Header;
use exr::prelude::*;

use super::read::{Unreadable, check_size};
use super::{FloatImage, Metadata};

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
        attributes.other.insert(Text::from(key.as_str()), AttributeValue::Text(Text::from(value.as_str())));
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
        let display = header.shared_attributes.display_window.size;
        check_size(display.width(), display.height(), 1, bytes.len())?;
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
