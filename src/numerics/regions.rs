//! The inputs that are tried, region by region, and what may come out: the table of bounds.

use fastrand::Rng;

use super::checks::*;
use super::inputs::*;
use super::measures::Measure::{self, Absolute, Length, MeanRelative, Relative, Ulp, Wrong};

/// A part of a function's domain.
pub struct Region {
    /// The function.
    pub function: &'static str,
    /// What is special about it.
    pub name: &'static str,
    /// Fills in the inputs of one evaluation.
    pub generate: fn(&mut Rng, &mut [f32]),
    /// What is measured, and the bound on it; infinite: for comparison only.
    pub bounds: &'static [(Measure, f64)],
}

const fn region(
    function: &'static str,
    name: &'static str,
    generate: fn(&mut Rng, &mut [f32]),
    bounds: &'static [(Measure, f64)],
) -> Region {
    Region { function, name, generate, bounds }
}

const FRESNEL: &[(Measure, f64)] = &[(Ulp(0), 4.0), (Absolute(0), 2e-6), (Ulp(1), 4.0), (Wrong(2), 0.0)];
const FRESNEL_AND_TEXTBOOK: &[(Measure, f64)] = &[
    (Ulp(0), 4.0),
    (Absolute(0), 2e-6),
    (Ulp(1), 4.0),
    (Wrong(2), 0.0),
    (TEXTBOOK_REFLECTANCE, f64::INFINITY),
    (TEXTBOOK_COSINE, f64::INFINITY),
    (TEXTBOOK_TOTAL, f64::INFINITY),
];
const REFRACT: &[(Measure, f64)] =
    &[(Absolute(0), 3e-7), (Absolute(1), 3e-7), (Absolute(2), 3e-7), (Length(0), 5e-7), (Wrong(3), 0.0)];
const TRANSMITTED_SHARE: &[(Measure, f64)] = &[(Ulp(0), 10.0), (Absolute(0), 5e-7)];
const VISIBLE_NORMAL: &[(Measure, f64)] = &[(FACET, 3e-6), (Length(0), 5e-7)];

/// The table. The cases are those of `docs/numerics.md`.
pub static REGIONS: &[Region] = &[
    region("fresnel", "indices to 2.42, both sides", fresnel_ordinary, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "grazing, cosines down to 0", fresnel_grazing, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "index within 1e-3 of 1, and 1 exactly", fresnel_near_one, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "critical angle within 3 ULP", fresnel_critical_ulps, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "critical angle within 1e-6", fresnel_critical::<-8, -6>, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "critical angle 1e-6 to 1e-5 away", fresnel_critical::<-6, -5>, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "critical angle 1e-5 to 1e-4 away", fresnel_critical::<-5, -4>, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "critical angle 1e-4 to 1e-2 away", fresnel_critical::<-4, -2>, FRESNEL_AND_TEXTBOOK),
    region("fresnel", "any bits: index 1e-6 to 1e6", fresnel_wild, FRESNEL),
    region("fresnel_transmittance", "indices to 2.42, both sides", transmittance_of::<0>, TRANSMITTED_SHARE),
    region("fresnel_transmittance", "grazing, cosines down to 0", transmittance_of::<1>, TRANSMITTED_SHARE),
    region("fresnel_transmittance", "critical angle within 3 ULP", transmittance_of::<2>, TRANSMITTED_SHARE),
    region("fresnel_transmittance", "any bits: index 1e-6 to 1e6", transmittance_of::<3>, TRANSMITTED_SHARE),
    region("refract", "indices to 2.42, both sides", refract_ordinary, REFRACT),
    region("refract", "index within 1e-3 of 1, and 1 exactly", refract_near_one, REFRACT),
    region("refract", "critical angle within 3 ULP", refract_critical_ulps, REFRACT),
    region("refract", "critical angle 1e-7 to 1e-2 away", refract_critical, REFRACT_CRITICAL),
    region("refract", "any bits: index 1e-6 to 1e6", refract_wild, REFRACT),
    region("refract_about", "any normal, indices to 2.42", refract_about_ordinary, REFRACT_ABOUT),
    region("refract_about", "any normal, critical angle 1e-7 to 1e-2 away", refract_about_critical, REFRACT_ABOUT),
    region("basis", "any normal", basis_ordinary, BASIS),
    region("basis", "normals close to -z", basis_near_pole, BASIS),
    region("original_fresnel", "in front, indices 1 to 2.42", original_front, &[(Ulp(0), 20.0)]),
    region("original_fresnel", "from behind, at least 1", original_behind, &[(ORIGINAL_BEHIND, 0.0)]),
    region("distribution", "alpha 1e-4 to 1", distribution_ordinary, &[(Ulp(0), 10.0)]),
    region("distribution", "any bits: alpha 1e-10 to 1", distribution_wild, &[(Ulp(0), 10.0)]),
    region("masking", "alpha 1e-4 to 1", distribution_ordinary, &[(Ulp(0), 4.0)]),
    region("masking", "any bits: alpha 1e-10 to 1", distribution_wild, &[(Ulp(0), 4.0)]),
    region("visible_normal", "alpha 1e-3 to 1", visible_normal_ordinary, VISIBLE_NORMAL),
    region("visible_normal", "grazing, cosines 1e-6 to 1e-2", visible_normal_grazing, VISIBLE_NORMAL),
    region("visible_normal", "any bits: alpha 1e-10 to 1", visible_normal_wild, &[(Length(0), 5e-7)]),
    region("rough_eval", "alpha 0.01 to 1, indices to 2.42", eval_ordinary, EVAL),
    region("rough_eval", "alpha 1e-4 to 0.01", eval_narrow, EVAL),
    region("rough_eval", "grazing, cosines 1e-4 to 1e-2", eval_grazing, EVAL),
    region("rough_eval", "index within 1e-3 of 1", eval_near_one, EVAL),
    region("rough_eval", "any bits: alpha 0 to 1, index 1e-6 to 1e6", eval_wild, &[]),
    region("rough_sample", "alpha 0.01 to 1, indices to 2.42", sample_ordinary, SAMPLE),
    region("rough_sample", "alpha 1e-4 to 0.01", sample_narrow, SAMPLE),
    region("rough_sample", "grazing, cosines 1e-4 to 1e-2", sample_grazing, SAMPLE),
    region("rough_sample", "index within 1e-3 of 1", sample_near_one, SAMPLE),
    region("rough_sample", "smooth: alpha 0, or index 1", sample_smooth, SAMPLE_SMOOTH),
    region("rough_sample", "any bits: alpha 0 to 1, index 1e-6 to 1e6", sample_wild, &[(Length(0), 1e-5)]),
    region("transmittance", "optical depths to 80", transmittance_ordinary, &[(TRANSMITTED, 1e-6)]),
    region("dispersed_index", "300 to 1000 nm, Abbe numbers from 20", dispersed_ordinary, &[(Ulp(0), 3.0)]),
    region("offset_origin", "points to 1e4, errors of 32-bit rounding", offset_ordinary, OFFSET),
    region("offset_origin", "points close to 0", offset_tiny, OFFSET),
    region("offset_origin", "any bits", offset_wild, &[]),
];

/// Two vectors are rounded, and the normal part of the result is no column: its error is that of 32-bit directions.
const REFRACT_ABOUT: &[(Measure, f64)] =
    &[(Absolute(0), 5e-7), (Absolute(1), 5e-7), (Absolute(2), 5e-7), (Length(0), 5e-7), (Wrong(3), 0.0)];
const BASIS: &[(Measure, f64)] = &[(BASIS_SKEW, 5e-7), (Length(0), 5e-7), (Length(3), 5e-7), (Length(6), 5e-7)];
const SAMPLE_SMOOTH: &[(Measure, f64)] = &[
    (Absolute(0), 5e-7),
    (Absolute(1), 5e-7),
    (Absolute(2), 5e-7),
    (Relative(3, 1.0), 1e-6),
    (Relative(4, 1.0), 1e-6),
];
const REFRACT_CRITICAL: &[(Measure, f64)] = &[
    (Absolute(0), 3e-7),
    (Absolute(1), 3e-7),
    (Absolute(2), 1e-7),
    (Relative(2, 1e-6), 1e-6),
    (Length(0), 5e-7),
    (Wrong(3), 0.0),
];
/// Directions are rounded to 6e-8, and so is the cosine at a facet. At the facet's critical angle reflectance, transmittance and the
/// direction of refraction change with the root of the cosine: a step of 6e-8 changes the transmitted cosine by 8e-4 and the
/// reflectance by 9e-3 at index 2.42. The worst is bounded by that, and the mean by what is left elsewhere.
const CRITICAL_FACET: f64 = 1e-2;
const EVAL: &[(Measure, f64)] = &[
    (Relative(0, FLOOR), CRITICAL_FACET),
    (MeanRelative(0, FLOOR), 1e-6),
    (Relative(1, FLOOR), CRITICAL_FACET),
    (MeanRelative(1, FLOOR), 1e-6),
];
const SAMPLE: &[(Measure, f64)] = &[
    (SAMPLED_DIRECTION, 2e-3),
    (SAMPLED_WEIGHT, CRITICAL_FACET),
    (SAMPLED_PDF, CRITICAL_FACET),
    (SAMPLED_VALUE, CRITICAL_FACET),
    (SAMPLED_OTHERWISE, 1e-5),
    (Length(0), 2e-6),
];
const OFFSET: &[(Measure, f64)] = &[(OFFSET_INSIDE, 0.0), (OFFSET_TOO_FAR, 4.0)];
