//! Limits on metrics. In flows text such as `flip=0.05`, out flows what broke it.

use std::str::FromStr;

use super::{Comparison, Metric, NonFinite};

/// The most that a metric may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    metric: Metric,
    most: f64,
}

impl Limit {
    /// What is above the limit, in words. What is not finite is above every limit.
    pub fn broken(&self, comparison: &Comparison) -> Option<String> {
        let (name, value, most) = (self.metric.name(), comparison.get(self.metric), self.most);
        if !value.is_finite() {
            let (NonFinite { test, reference }, [x, y]) = (comparison.non_finite, comparison.max_at);
            let pixels = format!("{test} pixels of the image and {reference} of the reference");
            return Some(format!("{name} is not finite, limit {most} ({pixels} are not, the first at {x},{y})"));
        }
        (value > most).then(|| format!("{name} is {value:.4e}, limit {most}"))
    }
}

/// `METRIC=VALUE`. PSNR has no upper limit that makes sense: it falls where errors grow.
impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let limited = Metric::ALL.into_iter().filter(|&metric| metric != Metric::Psnr);
        let names: Vec<_> = limited.clone().map(Metric::name).collect();
        let known = names.join(", ");
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("expected METRIC=VALUE, as in flip=0.05; metrics: {known}"))?;
        if name == Metric::Psnr.name() {
            return Err("psnr falls where errors grow; limit mse, which is 10^(-psnr/10)".into());
        }
        let metric = limited.into_iter().find(|metric| metric.name() == name);
        let metric = metric.ok_or_else(|| format!("unknown metric {name:?}; known: {known}"))?;
        let most = value.trim().parse().ok().filter(|most: &f64| most.is_finite() && *most >= 0.0);
        let most = most.ok_or_else(|| format!("{value:?} is no limit of {name}; expected a number from 0"))?;
        Ok(Self { metric, most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::compare;
    use crate::image::{FloatImage, Stored};

    fn limit(text: &str) -> Result<Limit, String> {
        text.parse()
    }

    #[test]
    fn what_is_no_limit_says_what_would_be_one() {
        for (text, wanted) in [
            ("flip", "METRIC=VALUE, as in flip=0.05; metrics: relmse, mse, p99, max, flip"),
            ("ssim=0.1", "unknown metric \"ssim\"; known: relmse, mse, p99, max, flip"),
            ("=1", "unknown metric \"\""),
            ("psnr=40", "limit mse, which is 10^(-psnr/10)"),
            ("mse=", "\"\" is no limit of mse"),
            ("mse=nan", "expected a number from 0"),
            ("mse=inf", "expected a number from 0"),
            ("mse=-1", "expected a number from 0"),
        ] {
            let error = limit(text).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }

    #[test]
    fn limits_hold_up_to_their_value() {
        let image = |value: f32| {
            Stored::Linear(FloatImage { width: 1, height: 1, pixels: vec![[value; 3]], layers: Vec::new() })
        };
        let found = compare(image(1.5), image(1.0)).unwrap();
        assert_eq!(limit("max=0.5").unwrap().broken(&found), None);
        assert_eq!(limit("mse=0.2").unwrap().broken(&found).as_deref(), Some("mse is 2.5000e-1, limit 0.2"));
        let found = compare(image(f32::NAN), image(1.0)).unwrap();
        assert_eq!(
            limit("mse=1").unwrap().broken(&found).as_deref(),
            Some("mse is not finite, limit 1 (1 pixels of the image and 0 of the reference are not, the first at 0,0)")
        );
    }
}
