//! The inputs that are tried, region by region, and what may come out: the table of bounds.

use fastrand::Rng;
use glam::{DVec2, DVec3};

use super::measures::{Case, Measure, ulps};
use crate::optics::rough::RoughInterface;

use Measure::{Absolute, Length, MeanRelative, Other, Relative, Ulp, Wrong};

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
const ROUGH_VALUE: f64 = 1e-6;
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
    region("original_fresnel", "in front, indices 1 to 2.42", original_front, &[(Ulp(0), 20.0)]),
    region("original_fresnel", "from behind, at least 1", original_behind, &[(ORIGINAL_FINITE, 0.0)]),
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
    region("rough_sample", "any bits: alpha 0 to 1, index 1e-6 to 1e6", sample_wild, &[(Length(0), 1e-5)]),
    region("transmittance", "optical depths to 80", transmittance_ordinary, &[(TRANSMITTED, 1e-6)]),
    region("dispersed_index", "300 to 1000 nm, Abbe numbers from 20", dispersed_ordinary, &[(Ulp(0), 3.0)]),
    region("offset_origin", "points to 1e4, errors of 32-bit rounding", offset_ordinary, OFFSET),
    region("offset_origin", "points close to 0", offset_tiny, OFFSET),
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
    (Relative(0, ROUGH_VALUE), CRITICAL_FACET),
    (MeanRelative(0, ROUGH_VALUE), 1e-6),
    (Relative(1, ROUGH_VALUE), CRITICAL_FACET),
    (MeanRelative(1, ROUGH_VALUE), 1e-6),
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

// ---- measures of single functions -----------------------------------------------------------------------------------

/// Reflectance and transmitted cosine as textbooks have them, in 32 bits: Pharr, Jakob & Humphreys (4th ed.), 9.3.5.
fn textbook(cosine: f32, eta: f32) -> (f32, f32) {
    let eta = if cosine < 0.0 { 1.0 / eta } else { eta };
    let cosine = cosine.abs().clamp(0.0, 1.0);
    let sine_squared = (1.0 - cosine * cosine) / (eta * eta);
    if sine_squared >= 1.0 {
        return (1.0, 0.0);
    }
    let transmitted = (1.0 - sine_squared).max(0.0).sqrt();
    let parallel = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let perpendicular = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    ((parallel * parallel + perpendicular * perpendicular) / 2.0, transmitted)
}

const TEXTBOOK_REFLECTANCE: Measure = Other {
    name: "reflectance, absolute, textbook",
    share: false,
    error: |case| (f64::from(textbook(case.inputs[0], case.inputs[1]).0) - case.expected[0]).abs(),
};
const TEXTBOOK_COSINE: Measure = Other {
    name: "cos_t, ULP, textbook",
    share: false,
    // Where the decision is right; the next measure counts the others.
    error: |case| match textbook(case.inputs[0], case.inputs[1]).1 {
        cosine if cosine > 0.0 && case.expected[1] > 0.0 => ulps(cosine, case.expected[1]),
        _ => 0.0,
    },
};
const TEXTBOOK_TOTAL: Measure = Other {
    name: "total, share wrong, textbook",
    share: true,
    error: |case| f64::from(u8::from((textbook(case.inputs[0], case.inputs[1]).1 == 0.0) != (case.expected[2] == 1.0))),
};

/// From behind the original's reflectance is at least 1, and finite where the reference's is not.
const ORIGINAL_FINITE: Measure = Other {
    name: "reflectance below 1 or beyond reason",
    share: false,
    error: |case| {
        let found = f64::from(case.outputs[0]);
        let wanted = case.expected[0];
        let is_close = wanted > 1e4 || (found / wanted - 1.0).abs() < 1e-3;
        f64::from(u8::from(case.inputs[1] != 1.0 && !(found >= 1.0 - 1e-6 && is_close)))
    },
};

/// The error of a facet's slope, in units of alpha or of the slope itself. Facets at the end of the distribution, u2 close to 1, lie
/// apart from each other: there one step of u2 in 32 bits is a step of the slope, by 1 / (1 - u2).
const FACET: Measure = Other {
    name: "slope over alpha or itself, times 1 - u2",
    share: false,
    error: |case| {
        let slope = |n: DVec3| DVec2::new(n.x, n.y) / n.z;
        let (found, wanted) = (slope(found(case, 0)), slope(expected(case, 0)));
        (found - wanted).length() / wanted.length().max(f64::from(case.inputs[3])) * (1.0 - f64::from(case.inputs[5]))
    },
};

/// The same branch was taken, and light came.
fn is_comparable(case: &Case) -> bool {
    case.outputs[3] != 0.0 && case.expected[3] != 0.0 && f64::from(case.outputs[2]) * case.expected[2] > 0.0
}

const SAMPLED_DIRECTION: Measure = Other {
    name: "wo, absolute, times 1 - u2",
    share: false,
    error: |case| match is_comparable(case) {
        true => (found(case, 0) - expected(case, 0)).length() * (1.0 - f64::from(case.inputs[6])),
        false => 0.0,
    },
};
const SAMPLED_WEIGHT: Measure = Other {
    name: "weight over radiance's scale, times 1 - u2",
    share: false,
    error: |case| {
        let (interface, _, wo) = sampled(case);
        let scale = if wo.z > 0.0 { 1.0 } else { (interface.eta_i / interface.eta_t).powi(2) };
        let near_one = 1.0 - f64::from(case.inputs[6]);
        if is_comparable(case) { (f64::from(case.outputs[3]) - case.expected[3]).abs() / scale * near_one } else { 0.0 }
    },
};
/// The decision between the branches, or whether light comes, fell otherwise than in 64 bits: u3 was as close to the reflectance
/// as 32 bits can tell, or the direction as close to the surface.
const SAMPLED_OTHERWISE: Measure = Other {
    name: "share decided otherwise",
    share: true,
    error: |case| f64::from(u8::from(!is_comparable(case) && (case.outputs[3] != 0.0 || case.expected[3] != 0.0))),
};

/// The interface of a sample, upright, and its direction as the device rounded it.
fn sampled(case: &Case) -> (RoughInterface, DVec3, DVec3) {
    let x = |i: usize| f64::from(case.inputs[i]);
    let side = if x(2) < 0.0 { -1.0 } else { 1.0 };
    let (eta_i, eta_t) = if x(2) < 0.0 { (x(4), 1.0) } else { (1.0, x(4)) };
    let flip = DVec3::new(1.0, 1.0, side);
    (RoughInterface { alpha: x(3), eta_i, eta_t }, DVec3::new(x(0), x(1), x(2)) * flip, found(case, 0) * flip)
}

const SAMPLED_PDF: Measure = Other {
    name: "pdf against the reference at wo, relative",
    share: false,
    error: |case| {
        let (interface, wi, wo) = sampled(case);
        if case.outputs[3] == 0.0 || !interface.is_spread() {
            return 0.0;
        }
        let wanted = interface.evaluate(wi, wo).pdf;
        if wanted == 0.0 {
            return 0.0; // the lobe is narrower than 32-bit directions
        }
        (f64::from(case.outputs[4]) - wanted).abs() / wanted.max(ROUGH_VALUE)
    },
};
const SAMPLED_VALUE: Measure = Other {
    name: "weight times pdf against value, relative",
    share: false,
    error: |case| {
        let (interface, wi, wo) = sampled(case);
        if case.outputs[3] == 0.0 || !interface.is_spread() {
            return 0.0;
        }
        let wanted = interface.evaluate(wi, wo).value;
        if wanted == 0.0 {
            return 0.0;
        }
        (f64::from(case.outputs[3]) * f64::from(case.outputs[4]) - wanted).abs() / wanted.max(ROUGH_VALUE)
    },
};

/// Relative to the share itself or, where that is small, to the rounding of the exponent.
const TRANSMITTED: Measure = Other {
    name: "transmittance, relative over 1 + depth",
    share: false,
    error: |case| {
        let depth = f64::from(case.inputs[0]) * f64::from(case.inputs[1]);
        let wanted = case.expected[0];
        // Below the least normal number devices may flush to 0.
        if wanted < 2e-38 { 0.0 } else { (f64::from(case.outputs[0]) / wanted - 1.0).abs() / (1.0 + depth) }
    },
};

/// How much of the distance that the error asks for is missing, in 64 bits.
const OFFSET_INSIDE: Measure = Other {
    name: "short of the error's distance, relative",
    share: false,
    error: |case| {
        let (along, wanted) = offset(case);
        ((wanted - along) / wanted.max(1e-300)).max(0.0)
    },
};
/// The distance beyond what is needed, in units of the point's last place and of that distance.
const OFFSET_TOO_FAR: Measure = Other {
    name: "beyond it, in ULP of the point",
    share: false,
    error: |case| {
        let (along, wanted) = offset(case);
        let largest = case.outputs[..3].iter().fold(0.0_f32, |most, x| most.max(x.abs())).max(f32::MIN_POSITIVE);
        (along - wanted) / (f64::from(largest) * f64::from(f32::EPSILON))
    },
};

/// The distance along the normal, on the side of the direction, and the least that it should be.
fn offset(case: &Case) -> (f64, f64) {
    let input = |i: usize| DVec3::new(case.inputs[i].into(), case.inputs[i + 1].into(), case.inputs[i + 2].into());
    let (position, error, n, w) = (input(0), input(3), input(6), input(9));
    let side = if w.dot(n) < 0.0 { -1.0 } else { 1.0 };
    (side * (found(case, 0) - position).dot(n), crate::optics::offset::offset_distance(error, n) * n.length_squared())
}

fn found(case: &Case, i: usize) -> DVec3 {
    DVec3::new(case.outputs[i].into(), case.outputs[i + 1].into(), case.outputs[i + 2].into())
}

fn expected(case: &Case, i: usize) -> DVec3 {
    DVec3::new(case.expected[i], case.expected[i + 1], case.expected[i + 2])
}

// ---- inputs ---------------------------------------------------------------------------------------------------------

/// The highest index of the report: diamond.
const DIAMOND: f64 = 2.42;

fn uniform(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + rng.f64() * (high - low)
}

/// Even in the logarithm.
fn spread(rng: &mut Rng, low: f64, high: f64) -> f64 {
    uniform(rng, low.ln(), high.ln()).exp()
}

/// Any bit pattern between two floats from 0 up, denormals included.
fn bits(rng: &mut Rng, low: f32, high: f32) -> f32 {
    f32::from_bits(rng.u32(low.to_bits()..=high.to_bits()))
}

fn sign(rng: &mut Rng) -> f64 {
    if rng.bool() { 1.0 } else { -1.0 }
}

/// From 1 / 2.42 to 2.42.
fn index(rng: &mut Rng) -> f64 {
    spread(rng, 1.0 / DIAMOND, DIAMOND)
}

/// 1 in one of 8, else 1 +- 1e-8 to 1e-3.
fn index_near_one(rng: &mut Rng) -> f64 {
    match rng.u8(..8) {
        0 => 1.0,
        1 => 1.0 + 1e-6 * sign(rng),
        _ => 1.0 + sign(rng) * spread(rng, 1e-8, 1e-3),
    }
}

/// An index such that light is totally reflected from the side that is returned, and the critical cosine there.
fn critical(rng: &mut Rng) -> (f32, f64, f64) {
    if rng.bool() {
        let eta = uniform(rng, 1.0 / DIAMOND, 1.0) as f32;
        (eta, 1.0, (1.0 - f64::from(eta).powi(2)).sqrt())
    } else {
        let eta = uniform(rng, 1.0, DIAMOND) as f32;
        (eta, -1.0, (1.0 - f64::from(eta).powi(-2)).max(0.0).sqrt())
    }
}

/// Some floats up or down.
fn moved(x: f32, steps: i32) -> f32 {
    f32::from_bits(x.to_bits().saturating_add_signed(steps)).clamp(0.0, 1.0)
}

fn direction(cosine: f64, turns: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    (sine * DVec2::from_angle(turns * std::f64::consts::TAU)).extend(cosine)
}

fn put(values: &mut [f32], v: DVec3) {
    values[..3].copy_from_slice(&v.as_vec3().to_array());
}

fn fresnel_ordinary(rng: &mut Rng, x: &mut [f32]) {
    x[0] = uniform(rng, -1.0, 1.0) as f32;
    x[1] = index(rng) as f32;
}

fn fresnel_grazing(rng: &mut Rng, x: &mut [f32]) {
    x[0] = bits(rng, 0.0, 0.01) * sign(rng) as f32;
    x[1] = index(rng) as f32;
}

fn fresnel_near_one(rng: &mut Rng, x: &mut [f32]) {
    let cosine = if rng.bool() { rng.f64() } else { spread(rng, 1e-8, 1.0) };
    x[0] = (cosine * sign(rng)) as f32;
    x[1] = index_near_one(rng) as f32;
}

fn fresnel_critical_ulps(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    x[0] = side as f32 * moved(cosine as f32, rng.i32(-3..=3));
    x[1] = eta;
}

/// Between 10^LOW and 10^HIGH of the critical angle's cosine away.
fn fresnel_critical<const LOW: i32, const HIGH: i32>(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    let away = spread(rng, 10_f64.powi(LOW), 10_f64.powi(HIGH)) * sign(rng);
    x[0] = (side * (cosine * (1.0 + away)).min(1.0)) as f32;
    x[1] = eta;
}

fn fresnel_wild(rng: &mut Rng, x: &mut [f32]) {
    x[0] = bits(rng, 0.0, 1.0) * sign(rng) as f32;
    x[1] = bits(rng, 1e-6, 1e6);
}

/// Cosines from 1e-30: the share is proportional to them, and devices may take what is below 1e-38 for 0.
fn transmittance_of<const REGION: usize>(rng: &mut Rng, x: &mut [f32]) {
    [fresnel_ordinary, fresnel_grazing, fresnel_critical_ulps, fresnel_wild][REGION](rng, x);
    x[0] = x[0].signum() * x[0].abs().max(1e-30);
}

fn refract_at(rng: &mut Rng, x: &mut [f32], cosine: f64, eta: f32) {
    put(x, direction(cosine, rng.f64()));
    x[3] = eta;
}

fn refract_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, eta) = (uniform(rng, -1.0, 1.0), index(rng) as f32);
    refract_at(rng, x, cosine, eta);
}

fn refract_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, eta) = (uniform(rng, -1.0, 1.0), index_near_one(rng) as f32);
    refract_at(rng, x, cosine, eta);
}

fn refract_critical_ulps(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    refract_at(rng, x, side * cosine, eta);
    x[2] = (x[2].signum()) * moved(x[2].abs(), rng.i32(-3..=3));
}

fn refract_critical(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    let away = spread(rng, 1e-7, 1e-2) * sign(rng);
    refract_at(rng, x, side * (cosine * (1.0 + away)).min(1.0), eta);
}

fn refract_wild(rng: &mut Rng, x: &mut [f32]) {
    let cosine = f64::from(bits(rng, 0.0, 1.0)) * sign(rng);
    let eta = bits(rng, 1e-6, 1e6);
    refract_at(rng, x, cosine, eta);
}

fn original_front(rng: &mut Rng, x: &mut [f32]) {
    x[0] = if rng.bool() { rng.f32() } else { bits(rng, 1e-8, 1.0) };
    x[1] = if rng.bool() { uniform(rng, 1.0, DIAMOND) as f32 } else { 1.0 + spread(rng, 1e-7, 1e-3) as f32 };
}

fn original_behind(rng: &mut Rng, x: &mut [f32]) {
    original_front(rng, x);
    x[0] = -x[0];
}

fn alpha(rng: &mut Rng, low: f64, high: f64) -> f32 {
    spread(rng, low, high) as f32
}

/// As facets are distributed, or anywhere.
fn facet(rng: &mut Rng, alpha: f32) -> DVec3 {
    let cosine = if rng.bool() {
        let u = rng.f64();
        1.0 / (1.0 + f64::from(alpha).powi(2) * u / (1.0 - u)).sqrt()
    } else {
        rng.f64()
    };
    direction(cosine, rng.f64())
}

fn distribution_ordinary(rng: &mut Rng, x: &mut [f32]) {
    x[3] = alpha(rng, 1e-4, 1.0);
    put(x, facet(rng, x[3]));
}

fn distribution_wild(rng: &mut Rng, x: &mut [f32]) {
    x[3] = bits(rng, 1e-10, 1.0);
    put(x, facet(rng, x[3]));
}

fn visible_normal_at(rng: &mut Rng, x: &mut [f32], cosine: f64, alpha: f32) {
    put(x, direction(cosine, rng.f64()));
    (x[3], x[4], x[5]) = (alpha, rng.f32(), rng.f32());
}

fn visible_normal_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0));
    visible_normal_at(rng, x, cosine, alpha);
}

fn visible_normal_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha) = (spread(rng, 1e-6, 1e-2), alpha(rng, 1e-3, 1.0));
    visible_normal_at(rng, x, cosine, alpha);
}

fn visible_normal_wild(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha) = (bits(rng, 1e-30, 1.0), bits(rng, 1e-10, 1.0));
    visible_normal_at(rng, x, cosine.into(), alpha);
    (x[4], x[5]) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0));
}

/// Half of the directions lie where the surface scatters, the others anywhere.
fn eval_at(rng: &mut Rng, x: &mut [f32], cosine: f64, alpha: f32, eta: f32) {
    let side = sign(rng);
    put(x, direction(cosine * side, rng.f64()));
    (x[6], x[7]) = (alpha, eta);
    let wi = DVec3::new(x[0].into(), x[1].into(), f64::from(x[2].abs()));
    let eta = f64::from(eta);
    let (eta_i, eta_t) = if side < 0.0 { (eta, 1.0) } else { (1.0, eta) };
    let interface = RoughInterface { alpha: alpha.into(), eta_i, eta_t };
    let wo = if rng.bool() {
        interface.sample(wi, DVec3::new(rng.f64(), rng.f64(), rng.f64())).wo
    } else {
        direction(uniform(rng, -1.0, 1.0), rng.f64())
    };
    put(&mut x[3..], wo * DVec3::new(1.0, 1.0, side));
}

fn eval_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 0.01, 1.0), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

fn eval_narrow(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-4, 0.01), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

fn eval_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (spread(rng, 1e-4, 1e-2), alpha(rng, 1e-3, 1.0), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

fn eval_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0), index_near_one(rng) as f32);
    eval_at(rng, x, cosine, alpha, eta);
}

fn eval_wild(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0), bits(rng, 1e-6, 1e6));
    eval_at(rng, x, cosine.into(), alpha, eta);
}

/// Indices to 2.42, at least 1e-3 from 1.
fn away_from_one(rng: &mut Rng) -> f32 {
    let eta = spread(rng, 1.001, DIAMOND);
    (if rng.bool() { eta } else { 1.0 / eta }) as f32
}

fn sample_at(rng: &mut Rng, x: &mut [f32], cosine: f64, alpha: f32, eta: f32) {
    put(x, direction(cosine * sign(rng), rng.f64()));
    (x[3], x[4]) = (alpha, eta);
    (x[5], x[6], x[7]) = (rng.f32(), rng.f32(), rng.f32());
}

fn sample_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 0.01, 1.0), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

fn sample_narrow(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-4, 0.01), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

fn sample_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (spread(rng, 1e-4, 1e-2), alpha(rng, 1e-3, 1.0), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

fn sample_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0), index_near_one(rng) as f32);
    sample_at(rng, x, cosine, alpha, eta);
}

fn sample_wild(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0), bits(rng, 1e-6, 1e6));
    sample_at(rng, x, cosine.into(), alpha, eta);
    (x[5], x[6], x[7]) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0));
}

fn transmittance_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let depth = if rng.bool() { uniform(rng, 0.0, 80.0) } else { spread(rng, 1e-8, 80.0) };
    let distance = spread(rng, 1e-4, 1e2);
    (x[0], x[1]) = ((depth / distance) as f32, distance as f32);
}

fn dispersed_ordinary(rng: &mut Rng, x: &mut [f32]) {
    (x[0], x[1], x[2]) = (uniform(rng, 1.0, DIAMOND) as f32, rng.f32(), uniform(rng, 300.0, 1000.0) as f32);
}

fn offset_at(rng: &mut Rng, x: &mut [f32], size: f64) {
    let position = size * DVec3::new(uniform(rng, -1.0, 1.0), uniform(rng, -1.0, 1.0), uniform(rng, -1.0, 1.0));
    put(x, position);
    put(&mut x[3..], position.abs() * spread(rng, 1e-7, 1e-5));
    put(&mut x[6..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
    put(&mut x[9..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
}

fn offset_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let size = spread(rng, 1e-4, 1e4);
    offset_at(rng, x, size);
}

fn offset_tiny(rng: &mut Rng, x: &mut [f32]) {
    // Rounding errors of smaller ones are below the least normal number, which devices may take for 0.
    let size = spread(rng, 1e-25, 1e-4);
    offset_at(rng, x, size);
}
