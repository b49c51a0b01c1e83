//! Averages of images, for look-ups that are wider than a texel.

/// The next level of a mip chain: half as wide and high, rounded down, and at least 1. `measure` says how much of the image lies above
/// a height from 0 to 1, up to a constant.
pub(crate) fn halved<const CHANNELS: usize>(
    texels: &[[f32; CHANNELS]],
    width: u32,
    height: u32,
    measure: impl Fn(f64) -> f64,
) -> (u32, u32, Vec<[f32; CHANNELS]>) {
    let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
    let columns = shares(width, half_width, |edge| edge);
    let rows = shares(height, half_height, measure);
    let mean = |row: &[(u32, f64)], column: &[(u32, f64)]| {
        let mut sum = [0.0; CHANNELS];
        for &(y, across) in row {
            for &(x, along) in column {
                let texel = texels[(y * width + x) as usize];
                (0..CHANNELS).for_each(|i| sum[i] += across * along * f64::from(texel[i]));
            }
        }
        sum.map(|value| value as f32)
    };
    let means = rows.iter().flat_map(|row| columns.iter().map(|column| mean(row, column))).collect();
    (half_width, half_height, means)
}

/// For each of `to` intervals of equal length the intervals of `from` that it overlaps, each with its share of it; `measure` says how
/// much lies before a point from 0 to 1.
fn shares(from: u32, to: u32, measure: impl Fn(f64) -> f64) -> Vec<Vec<(u32, f64)>> {
    let (many, few) = (f64::from(from), f64::from(to));
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) / few, f64::from(i + 1) / few);
            let whole = measure(end) - measure(start);
            let last = ((end * many).ceil() as u32).min(from);
            ((start * many) as u32..last)
                .map(|j| {
                    let (low, high) = ((f64::from(j) / many).max(start), (f64::from(j + 1) / many).min(end));
                    (j, (measure(high) - measure(low)) / whole)
                })
                .collect()
        })
        .collect()
}
