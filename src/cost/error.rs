//! Errors against a truth of which two independent, noisy pictures are known.

/// What keeps dark pixels from counting for all, as in relMSE everywhere.
const DARK: f64 = 0.01;

/// A mean over pixels of the means of their channels, and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean: of what has mean 0 it may be below.
    pub value: f64,
    /// Its standard error, as if pixels were independent.
    pub error: f64,
}

impl Estimate {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
        for value in values {
            count += 1.0;
            let before = value - mean;
            mean += before / count;
            squares += before * (value - mean);
        }
        Self { value: mean, error: (squares / (count - 1.0_f64).max(1.0) / count).sqrt() }
    }

    /// The value, or where that is not above its uncertainty, the uncertainty.
    pub fn at_least(self) -> f64 {
        self.value.max(self.error)
    }
}

/// The mean over the channels of a pixel: their noise is much the same.
fn of_channels(value: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(value).sum::<f64>() / 3.0
}

/// relMSE of `picture`, which is independent of both halves of the reference; `mean` is theirs.
pub fn relmse(picture: &[[f32; 3]], first: &[[f32; 3]], second: &[[f32; 3]], mean: &[[f32; 3]]) -> Estimate {
    let all = picture.iter().zip(first).zip(second.iter().zip(mean));
    Estimate::of(all.map(|((x, a), (b, r))| {
        of_channels(|i| {
            let [x, a, b, r] = [x, a, b, r].map(|pixel| f64::from(pixel[i]));
            (x - a) * (x - b) / (r * r + DARK)
        })
    }))
}

/// relMSE of the mean of two halves that is noise: they differ by twice as much as it does from the truth.
pub fn noise(first: &[[f32; 3]], second: &[[f32; 3]], mean: &[[f32; 3]]) -> f64 {
    let all = first.iter().zip(second).zip(mean);
    Estimate::of(all.map(|((a, b), r)| {
        of_channels(|i| {
            let [a, b, r] = [a, b, r].map(|pixel| f64::from(pixel[i]));
            0.25 * (a - b).powi(2) / (r * r + DARK)
        })
    }))
    .value
}

/// The mean of two pictures.
pub fn mean(first: &[[f32; 3]], second: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let middle = |a: &[f32; 3], b: &[f32; 3]| std::array::from_fn(|i| a[i].midpoint(b[i]));
    first.iter().zip(second).map(|(a, b)| middle(a, b)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a picture off by 0.1 everywhere the noise of the reference, as large, hides nothing.
    #[test]
    fn noise_of_the_reference_drops_out() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut noisy = |size: f32| -> Vec<[f32; 3]> {
            (0..20_000).map(|_| [0; 3].map(|_| 1.0 + size * (random.f32() + random.f32() - 1.0))).collect()
        };
        let (first, second) = (noisy(0.1), noisy(0.1));
        let middle = mean(&first, &second);
        // Of the sum of two even numbers the variance is 1/6; the halves share it, and so does their mean.
        let expected = 0.01 / 6.0 / 2.0 / 1.01;
        assert!((noise(&first, &second, &middle) / expected - 1.0).abs() < 0.1);
        let off = relmse(&vec![[1.1; 3]; 20_000], &first, &second, &middle);
        assert!((off.value - 0.01 / 1.01).abs() < 4.0 * off.error + 5e-4, "{off:?}");
        let right = relmse(&vec![[1.0; 3]; 20_000], &first, &second, &middle);
        assert!(right.value.abs() < 4.0 * right.error && right.error < 0.1 * expected, "{right:?}");
    }
}
