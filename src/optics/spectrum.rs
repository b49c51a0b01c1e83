//! Light of one wavelength as a colour, and which wavelengths stand for white light where an index depends on them.

use glam::{DMat3, DVec3};

/// The wavelengths that carry colour, in nanometres: beyond them less than 0.1 % of each primary.
pub const VISIBLE: [f64; 2] = [390.0, 710.0];

/// Wavelengths that one sample of a pixel takes.
pub const WAVELENGTHS: usize = 4;

/// From CIE 1931 XYZ to linear Rec. 709: ITU-R BT.709, white D65.
const TO_REC709: DMat3 = DMat3::from_cols_array(&[
    3.240_969_941_904_523,
    -0.969_243_636_280_879_6,
    0.055_630_079_696_993_66,
    -1.537_383_177_570_094,
    1.875_967_501_507_720_2,
    -0.203_976_958_888_976_52,
    -0.498_610_760_293_003_4,
    0.041_555_057_407_175_59,
    1.056_971_514_242_878_6,
]);

/// The CIE 1931 colour matching functions: the fit of Wyman, Sloan & Shirley, "Simple Analytic Approximations to the CIE XYZ
/// Color Matching Functions", JCGT 2013, within 1 % of the peak.
pub fn color_matching(wavelength: f64) -> DVec3 {
    let lobe = |mean: f64, below: f64, above: f64| {
        let scaled = (wavelength - mean) * if wavelength < mean { below } else { above };
        (-0.5 * scaled * scaled).exp()
    };
    DVec3::new(
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    )
}

/// Luminance of a colour in linear Rec. 709: ITU-R BT.709.
pub fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// The colour of light of one wavelength in linear Rec. 709, scaled so that all of them together, evenly over
/// [`VISIBLE`], are white: the mean over it is 1 in each channel. Outside of the gamut channels are below 0.
pub fn color_of(wavelength: f64) -> DVec3 {
    TO_REC709 * color_matching(wavelength) / white()
}

/// The mean colour over [`VISIBLE`] before it is scaled: light of the same power at every wavelength.
fn white() -> DVec3 {
    static WHITE: std::sync::OnceLock<DVec3> = std::sync::OnceLock::new();
    *WHITE.get_or_init(|| {
        let [low, high] = VISIBLE;
        let steps = 320;
        let at = |i: i32| low + (f64::from(i) + 0.5) / f64::from(steps) * (high - low);
        (0..steps).map(|i| TO_REC709 * color_matching(at(i))).sum::<DVec3>() / f64::from(steps)
    })
}

/// A wavelength and its share of each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Nanometres.
    pub wavelength: f64,
    /// What light of that wavelength adds to linear Rec. 709.
    pub weight: DVec3,
}

/// The wavelengths of one sample: evenly spaced over [`VISIBLE`], moved by `shift`, 0 to below 1, of their distance. Their weights
/// sum to exactly what white light has, so that what no index bends apart has no colour: what a few wavelengths miss is
/// shared among them.
pub fn lines(shift: f64) -> [Line; WAVELENGTHS] {
    let [low, high] = VISIBLE;
    let count = WAVELENGTHS as f64;
    let mut lines = std::array::from_fn(|k| {
        let wavelength = low + (k as f64 + shift) / count * (high - low);
        Line { wavelength, weight: color_of(wavelength) / count }
    });
    let missing = (DVec3::ONE - lines.iter().map(|line: &Line| line.weight).sum::<DVec3>()) / count;
    lines.iter_mut().for_each(|line| line.weight += missing);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_matching_functions_have_the_published_peaks_and_areas() {
        assert!((color_matching(555.0).y - 1.0).abs() < 0.01);
        assert!((color_matching(600.0).x - 1.0622).abs() < 0.02);
        assert!((color_matching(450.0).z - 1.77211).abs() < 0.03);
        let area: DVec3 = (360..830).map(|nanometre| color_matching(f64::from(nanometre))).sum();
        assert!((area - DVec3::splat(106.86)).abs().max_element() < 1.0, "{area}");
    }

    /// `shaders/spectrum.glsl` chooses by bands of the spectrum.
    #[test]
    fn shaders_choose_wavelengths_by_the_length_of_their_colours() {
        let shader = include_str!("../../shaders/spectrum.glsl");
        let list = shader.split("float[](").nth(1).and_then(|rest| rest.split(')').next()).expect("a list");
        let edges: Vec<f64> = list.split(',').map(|edge| edge.trim().parse().expect("a number")).collect();
        let [low, high] = VISIBLE;
        assert!(shader.contains(&format!("SHORTEST = {low:?};")) && shader.contains(&format!("LONGEST = {high:?};")));
        let steps = 3200;
        let at = |i: usize| low + (i as f64 + 0.5) / steps as f64 * (high - low);
        let lengths: Vec<f64> = (0..steps).map(|i| color_of(at(i)).length()).collect();
        let whole: f64 = lengths.iter().sum();
        let bands = edges.len() - 1;
        for (i, band) in lengths.chunks(steps / bands).enumerate() {
            let share = band.iter().sum::<f64>() / whole;
            assert!((edges[i + 1] - edges[i] - share).abs() < 3e-4, "band {i}: {share}");
        }
    }

    #[test]
    fn every_sample_is_white() {
        for i in 0..16 {
            let lines = lines((f64::from(i) + 0.5) / 16.0);
            let sum: DVec3 = lines.iter().map(|line| line.weight).sum();
            assert!((sum - DVec3::ONE).abs().max_element() < 1e-12);
        }
        let [blue, .., red] = lines(0.5);
        assert!(blue.weight.z > blue.weight.x && red.weight.x > red.weight.z);
    }
}
