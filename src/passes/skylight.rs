//! The environment as a light: a table that chooses directions by how bright it is there. In flows a panorama, out flow numbers for
//! `shaders/skylight.glsl`.

use std::f64::consts::PI;

use glam::DVec3;

use crate::optics::spectrum::luminance;
use crate::scene::Panorama;

/// The most cells of a table; a panorama of more texels is halved.
const MOST_CELLS: u32 = 1 << 19;

/// The table of an environment that is not looked for.
pub(super) fn none() -> Vec<f32> {
    header(0, 0)
}

/// `cellCount`, and the padding behind it.
fn header(columns: u32, rows: u32) -> Vec<f32> {
    [columns, rows, 0, 0].map(f32::from_bits).to_vec()
}

/// Shares of the light that comes from each row of a panorama, and of each row's from each column, added up; none of one without
/// light.
pub(super) fn table(panorama: &Panorama) -> Vec<f32> {
    let halved = |panorama: &Panorama| (panorama.width * panorama.height > MOST_CELLS).then(|| panorama.halved());
    let smaller = std::iter::successors(halved(panorama), halved).last();
    let panorama = smaller.as_ref().unwrap_or(panorama);
    let light = light(panorama);
    let rows: Vec<&[f64]> = light.chunks(panorama.width as usize).collect();
    let edge = |row: usize| (PI * row as f64 / rows.len() as f64).cos();
    let of_rows: Vec<f64> =
        rows.iter().enumerate().map(|(i, row)| row.iter().sum::<f64>() * (edge(i) - edge(i + 1))).collect();
    let whole: f64 = of_rows.iter().sum();
    if whole.is_nan() || whole <= 0.0 {
        return none();
    }
    let mut table = header(panorama.width, panorama.height);
    add_up(&mut table, &of_rows);
    for row in rows {
        add_up(&mut table, row);
    }
    table
}

/// What lies before each part and at the end, as shares of the whole; even ones of nothing.
fn add_up(table: &mut Vec<f32>, parts: &[f64]) {
    let whole: f64 = parts.iter().sum();
    let count = parts.len() as f64;
    let mut sum = 0.0;
    table.push(0.0);
    for (i, part) in (1..).zip(parts) {
        sum += part;
        table.push(if whole > 0.0 { sum / whole } else { f64::from(i) / count } as f32);
    }
}

/// The mean luminance of each texel's part of the sphere, interpolation with its neighbours included: above 0 wherever light comes
/// from.
fn light(panorama: &Panorama) -> Vec<f64> {
    let (width, height) = (panorama.width as usize, panorama.height as usize);
    let wide = |&texel: &[f32; 3]| DVec3::from_array(texel.map(f64::from));
    let texels: Vec<f64> = panorama.texels.iter().map(|texel| luminance(wide(texel))).collect();
    // Of a line between texels' centres 3/4 of what lies in a texel is its own, and 1/8 that of each neighbour.
    let mean = |before: f64, own: f64, after: f64| 0.75 * own + 0.125 * (before + after);
    let across = |y: usize, x: usize| {
        let row = &texels[y * width..][..width];
        mean(row[(x + width - 1) % width], row[x], row[(x + 1) % width])
    };
    (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            mean(across(y.saturating_sub(1), x), across(y, x), across((y + 1).min(height - 1), x))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_their_shares_of_the_light() {
        let (width, height) = (13, 7);
        let texel = |i: u32| [0.1 * (i % 5) as f32, 0.2, 0.05 * (i % 7) as f32];
        let mut texels: Vec<[f32; 3]> = (0..width * height).map(texel).collect();
        texels[13 * 2 + 5] = [500.0; 3];
        let panorama = Panorama::new(width, height, texels);
        let light = light(&panorama);
        let table = table(&panorama);
        assert_eq!([table[0].to_bits(), table[1].to_bits()], [width, height]);
        let (rows, columns) = table[4..].split_at(8);
        let edge = |row: usize| (PI * row as f64 / 7.0).cos();
        let weight = |i: usize| light[i] * (edge(i / 13) - edge(i / 13 + 1));
        let whole: f64 = (0..13 * 7).map(weight).sum();
        for i in 0..13 * 7 {
            let (row, column) = (i / 13, i % 13);
            let own = &columns[14 * row..][..14];
            let share = f64::from(rows[row + 1] - rows[row]) * f64::from(own[column + 1] - own[column]);
            assert!((share - weight(i) / whole).abs() < 1e-6, "{i}: {share}");
        }
        assert_eq!((rows[7], columns[13]), (1.0, 1.0));
    }

    #[test]
    fn a_black_environment_is_not_looked_for() {
        assert_eq!(table(&Panorama::new(4, 2, vec![[0.0; 3]; 8])), none());
        assert_eq!(none()[0].to_bits(), 0);
    }
}
