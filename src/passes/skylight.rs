//! The environment as a light: a table that chooses directions by how bright it is there. In flows a panorama, out flow cells for
//! `shaders/skylight.glsl`.

use std::f64::consts::{PI, TAU};

use bytemuck::{Pod, Zeroable};

use crate::scene::Panorama;

/// The most cells of a table; a panorama of more texels is halved.
const MOST_CELLS: u32 = 1 << 19;

/// `Cell` of `shaders/skylight.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct Cell {
    other: u32,
    share: f32,
    density: f32,
    padding: u32,
}

/// What stands before the cells, and they: none where there is no light to look for.
pub(super) fn table(panorama: &Panorama) -> Vec<Cell> {
    let halved = |panorama: &Panorama| (panorama.width * panorama.height > MOST_CELLS).then(|| panorama.halved());
    let smaller = std::iter::successors(halved(panorama), halved).last();
    let panorama = smaller.as_ref().unwrap_or(panorama);
    let (columns, rows) = (panorama.width, panorama.height);
    let light = light(panorama);
    let solid_angle = |row: u32| {
        let edge = |row: u32| (PI * f64::from(row) / f64::from(rows)).cos();
        TAU / f64::from(columns) * (edge(row) - edge(row + 1))
    };
    let solid_angles: Vec<f64> = (0..rows).map(solid_angle).collect();
    let weights: Vec<f64> =
        light.iter().enumerate().map(|(i, light)| light * solid_angles[i / columns as usize]).collect();
    let whole: f64 = weights.iter().sum();
    if whole.is_nan() || whole <= 0.0 {
        return vec![Cell::default()];
    }
    let mut cells = aliases(&weights, whole);
    for (i, cell) in cells.iter_mut().enumerate() {
        cell.density = (light[i] / whole) as f32;
    }
    // `cellCount`.
    cells.insert(0, bytemuck::cast([columns, rows, 0, 0]));
    cells
}

/// The mean radiance that each texel's part of the sphere sends, interpolation with its neighbours included: above 0 wherever light
/// comes from.
fn light(panorama: &Panorama) -> Vec<f64> {
    let (width, height) = (panorama.width as usize, panorama.height as usize);
    let luminance =
        |&[r, g, b]: &[f32; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
    let texels: Vec<f64> = panorama.texels.iter().map(luminance).collect();
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

/// Walker's alias method, set up as by M. D. Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution"
/// (1991).
fn aliases(weights: &[f64], whole: f64) -> Vec<Cell> {
    let mean = whole / weights.len() as f64;
    let mut shares: Vec<f64> = weights.iter().map(|weight| weight / mean).collect();
    let mut cells: Vec<Cell> = (0..).zip(weights).map(|(other, _)| Cell { other, share: 1.0, ..Cell::default() }).collect();
    let (mut dark, mut bright): (Vec<usize>, Vec<usize>) = (0..shares.len()).partition(|&i| shares[i] < 1.0);
    while let (Some(&low), Some(&high)) = (dark.last(), bright.last()) {
        dark.pop();
        cells[low] = Cell { other: high as u32, share: shares[low] as f32, ..Cell::default() };
        shares[high] -= 1.0 - shares[low];
        if shares[high] < 1.0 {
            bright.pop();
            dark.push(high);
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panorama() -> Panorama {
        let mut texels: Vec<[f32; 3]> = (0..13 * 7).map(|i| [0.1 * (i % 5) as f32, 0.2, 0.05 * (i % 7) as f32]).collect();
        texels[13 * 2 + 5] = [500.0; 3];
        Panorama::new(13, 7, texels)
    }

    #[test]
    fn cells_are_chosen_as_often_as_their_density_says() {
        let table = table(&panorama());
        let [columns, rows, ..]: [u32; 4] = bytemuck::cast(table[0]);
        assert_eq!((columns, rows), (13, 7));
        let cells = &table[1..];
        let mut chances = vec![0.0; cells.len()];
        for (i, cell) in cells.iter().enumerate() {
            chances[i] += f64::from(cell.share) / cells.len() as f64;
            chances[cell.other as usize] += (1.0 - f64::from(cell.share)) / cells.len() as f64;
        }
        let mut sum = 0.0;
        for (i, (chance, cell)) in chances.iter().zip(cells).enumerate() {
            let edge = |row: usize| (PI * row as f64 / 7.0).cos();
            let solid_angle = TAU / 13.0 * (edge(i / 13) - edge(i / 13 + 1));
            assert!((chance - f64::from(cell.density) * solid_angle).abs() < 1e-6, "{i}: {chance} {cell:?}");
            sum += chance;
        }
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }

    #[test]
    fn a_black_environment_has_no_cells() {
        let black = Panorama::new(4, 2, vec![[0.0; 3]; 8]);
        assert_eq!(table(&black), [Cell::default()]);
    }
}
