//! Colours that stand for numbers. In flow what a model counted, out flow pixels and what their ends mean.

use crate::compare::magma;
use crate::passes::{Counts, DARK};

use super::state::Shows;

/// What the darkest and the brightest colour stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Legend {
    pub(super) low: f64,
    pub(super) high: f64,
}

/// The least that errors and what is cut off are told apart from nothing.
const LEAST: f64 = 1e-5;

/// Pixels for what `shows` names, if the model has it.
pub(super) fn colors(shows: Shows, counts: &Counts, radiance: &[[f32; 3]]) -> Option<(Vec<[u8; 4]>, Legend)> {
    let values: Vec<f64> = match shows {
        Shows::Light => return None,
        Shows::Interfaces => counts.interfaces.iter().map(|&count| count.into()).collect(),
        Shows::Discarded => counts.discarded.as_ref()?.iter().map(|&share| share.into()).collect(),
        Shows::Error => {
            let error = |(error, value): (&[f32; 3], &[f32; 3])| {
                let parts = error.iter().zip(value).map(|(&e, &v)| f64::from(e) / (f64::from(v) + DARK));
                parts.sum::<f64>() / 3.0
            };
            counts.stderr.as_ref()?.iter().zip(radiance).map(error).collect()
        }
    };
    let is_count = shows == Shows::Interfaces;
    let most = values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    let legend = match is_count {
        true => Legend { low: 0.0, high: most.ceil().max(1.0) },
        false => Legend { low: LEAST, high: 1.0 },
    };
    let place = |value: f64| match is_count {
        true => value / legend.high,
        // Decades are as wide as each other.
        false => (value.max(LEAST) / LEAST).ln() / (legend.high / LEAST).ln(),
    };
    let pixel = |&value: &f64| {
        let [r, g, b] = magma::color(if value.is_nan() { 1.0 } else { place(value).clamp(0.0, 1.0) as f32 });
        [r, g, b, u8::MAX]
    };
    Some((values.iter().map(pixel).collect(), legend))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_colours_are_the_ends_of_the_values() {
        let counts = Counts {
            discarded: Some(vec![0.0, 1.0, f32::NAN]),
            stderr: None,
            interfaces: vec![0.0, 2.0, 4.0],
            rays: None,
        };
        let (pixels, legend) = colors(Shows::Interfaces, &counts, &[]).expect("interfaces");
        assert_eq!(legend, Legend { low: 0.0, high: 4.0 });
        let [black, white] = [0.0, 1.0].map(magma::color);
        assert_eq!((&pixels[0][..3], &pixels[2][..3]), (&black[..], &white[..]));
        let (pixels, _) = colors(Shows::Discarded, &counts, &[]).expect("discarded");
        assert_eq!((&pixels[0][..3], &pixels[1][..3], &pixels[2][..3]), (&black[..], &white[..], &white[..]));
        assert!(colors(Shows::Error, &counts, &[]).is_none());
        assert!(colors(Shows::Light, &counts, &[]).is_none());
    }
}
