//! FLIP beside NVIDIA's own: constants out of its tool, and its C++ code by way of the crate `nv-flip`.

use vitrum::compare::flip::{self, Flip};

const SIZE: [usize; 2] = [96, 64];

/// 0 to 255, by the mixer `lowbias32` of C. Wellons.
fn noise(x: usize, y: usize, channel: usize, salt: usize) -> i32 {
    let mut n = (x + 1024 * (y + 1024 * (channel + 4 * salt))) as u32;
    n = (n ^ n >> 16).wrapping_mul(0x7feb_352d);
    n = (n ^ n >> 15).wrapping_mul(0x846c_a68b);
    ((n ^ n >> 16) >> 24) as i32
}

/// A formula of column, row and channel: display values of 8 bits.
type Codes = fn(usize, usize, usize) -> i32;
/// The same: radiance.
type Radiance = fn(usize, usize, usize) -> f32;

fn blocks(x: usize, y: usize, c: usize) -> i32 {
    noise(x / 8, y / 8, c, 0)
}

fn board(x: usize, y: usize, c: usize) -> i32 {
    if (x / 6 + y / 6) % 2 == 1 { 255 } else { (2 * x + 20 * c) as i32 }
}

fn ramp(x: usize, y: usize) -> i32 {
    (2 * x + y) as i32
}

fn tinted(x: usize, y: usize, c: usize) -> i32 {
    let ramp = ramp(x, y);
    [ramp + 12, ramp, ramp - ramp / 16][c]
}

/// Test and reference, of a name and a size.
const DISPLAY: [(&str, [usize; 2], Codes, Codes); 4] = [
    ("grain", SIZE, |x, y, c| blocks(x, y, c) + noise(x, y, c, 1) / 8 - 16, blocks),
    ("shift", SIZE, |x, y, c| board(x + 1, y, c), board),
    ("tint", SIZE, tinted, |x, y, _| ramp(x, y)),
    // Smaller than the filters.
    ("stamp", [7, 5], |x, y, c| blocks(x, y, c) + noise(x, y, c, 1) / 8 - 16, blocks),
];

fn bright_blocks(x: usize, y: usize, c: usize) -> f32 {
    noise(x / 4, y / 4, c, 2) as f32 / 256.0 * ((noise(x / 16, y / 16, 0, 3) / 32 - 3) as f32).exp2()
}

fn slope(x: usize, y: usize, c: usize) -> f32 {
    (x + 2 * y + 10 * c + 1) as f32 / 256.0
}

fn windows(x: usize, y: usize) -> f32 {
    if (x / 8 + y / 8).is_multiple_of(4) { ramp(x, y) as f32 / 64.0 } else { 0.0 }
}

const RADIANCE: [(&str, Radiance, Radiance); 3] = [
    ("blocks", |x, y, c| bright_blocks(x, y, c) * (1.0 + (noise(x, y, c, 4) - 128) as f32 / 512.0), bright_blocks),
    ("fireflies", |x, y, c| if noise(x, y, 0, 5) < 4 { 64.0 } else { slope(x, y, c) }, slope),
    // Mostly black: many exposures.
    ("night", |x, y, c| windows(x, y) + noise(x, y, c, 6) as f32 / 65536.0, |x, y, _| windows(x, y)),
];

fn pixels<T>([width, height]: [usize; 2], value: impl Fn(usize, usize, usize) -> T) -> Vec<[T; 3]> {
    (0..width * height).map(|i| [0, 1, 2].map(|c| value(i % width, i / width, c))).collect()
}

fn codes(size: [usize; 2], formula: Codes) -> Vec<[u8; 3]> {
    pixels(size, |x, y, c| formula(x, y, c).clamp(0, 255) as u8)
}

fn decoded(codes: &[[u8; 3]]) -> Vec<[f32; 3]> {
    let decode = |code: u8| {
        let value = f64::from(code) / 255.0;
        (if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }) as f32
    };
    codes.iter().map(|pixel| pixel.map(decode)).collect()
}

fn largest(found: &Flip) -> f32 {
    found.map.iter().copied().fold(0.0, f32::max)
}

/// Out of `benches/flip.py` with flip-evaluator 1.7: the mean and the largest of a pixel.
#[test]
fn display_values_have_the_flip_of_nvidias_tool() {
    let theirs = [
        (0.084_701_5, 0.262_067_4),
        (0.276_006_3, 0.789_969_9),
        (0.173_004_8, 0.290_472_9),
        (0.096_493_2, 0.185_968_3),
    ];
    for ((name, size, test, reference), (mean, worst)) in DISPLAY.into_iter().zip(theirs) {
        let found = flip::ldr(size[0], &decoded(&codes(size, test)), &decoded(&codes(size, reference)));
        assert!((found.mean - mean).abs() < 2e-6, "{name}: mean {}, not {mean}", found.mean);
        assert!((largest(&found) - worst).abs() < 1e-4, "{name}: largest {}, not {worst}", largest(&found));
    }
}

/// As above; and the exposures: from, to, how many.
#[test]
fn radiance_has_the_flip_of_nvidias_tool() {
    let theirs = [
        (0.093_765_0, 0.346_174_1, -2.806_57, 2.573_17, 6),
        (0.027_091_4, 0.731_829_4, 1.234_07, 2.169_26, 2),
        (0.870_447_9, 0.990_378_8, -0.805_45, 24.083_30, 25),
    ];
    for ((name, test, reference), (mean, worst, start, stop, count)) in RADIANCE.into_iter().zip(theirs) {
        let found = flip::hdr(SIZE[0], &pixels(SIZE, test), &pixels(SIZE, reference));
        let exposures = found.exposures.expect("exposures");
        assert_eq!(exposures.count, count, "{name}");
        assert!(
            (exposures.start - start).abs() < 1e-4 && (exposures.stop - stop).abs() < 1e-4,
            "{name}: {exposures:?}"
        );
        assert!((found.mean - mean).abs() < 2e-6, "{name}: mean {}, not {mean}", found.mean);
        assert!((largest(&found) - worst).abs() < 1e-4, "{name}: largest {}, not {worst}", largest(&found));
    }
}

/// Pixel by pixel. The crate holds an older version of the code than the tool; its own default is 67.0 pixels per degree.
#[test]
fn display_values_have_the_flip_of_nvidias_code() {
    for (name, size, test, reference) in DISPLAY {
        let (test, reference) = (codes(size, test), codes(size, reference));
        let image = |pixels: &[[u8; 3]]| {
            nv_flip::FlipImageRgb8::with_data(size[0] as u32, size[1] as u32, pixels.as_flattened())
        };
        let theirs = nv_flip::flip(image(&reference), image(&test), flip::PIXELS_PER_DEGREE as f32).to_vec();
        let ours = flip::ldr(size[0], &decoded(&test), &decoded(&reference)).map;
        let apart = ours.iter().zip(&theirs).map(|(ours, theirs)| (ours - theirs).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-4, "{name}: {apart} apart");
    }
}

#[test]
fn swapped_display_values_have_the_same_flip() {
    for (name, size, test, reference) in DISPLAY {
        let (test, reference) = (decoded(&codes(size, test)), decoded(&codes(size, reference)));
        assert_eq!(flip::ldr(size[0], &test, &reference), flip::ldr(size[0], &reference, &test), "{name}");
    }
}

#[test]
fn mirrored_images_have_the_mirrored_flip() {
    let [width, height] = SIZE;
    let [test, reference] = [RADIANCE[0].1, RADIANCE[0].2];
    let found = flip::hdr(width, &pixels(SIZE, test), &pixels(SIZE, reference)).map;
    let mirrored = |formula: Radiance| pixels(SIZE, move |x, y, c| formula(width - 1 - x, height - 1 - y, c));
    let mut back = flip::hdr(width, &mirrored(test), &mirrored(reference)).map;
    back.reverse();
    let apart = found.iter().zip(&back).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-5, "{apart}");
}
