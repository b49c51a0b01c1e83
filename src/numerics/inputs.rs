//! Inputs for the regions: random, from the parts of the domain where functions break.

use std::f64::consts::TAU;

use fastrand::Rng;
use glam::{DVec2, DVec3};

use crate::optics::rough::RoughInterface;

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
    (sine * DVec2::from_angle(turns * TAU)).extend(cosine)
}

fn put(values: &mut [f32], v: DVec3) {
    values[..3].copy_from_slice(&v.as_vec3().to_array());
}

pub(super) fn fresnel_ordinary(rng: &mut Rng, x: &mut [f32]) {
    x[0] = uniform(rng, -1.0, 1.0) as f32;
    x[1] = index(rng) as f32;
}

pub(super) fn fresnel_grazing(rng: &mut Rng, x: &mut [f32]) {
    x[0] = bits(rng, 0.0, 0.01) * sign(rng) as f32;
    x[1] = index(rng) as f32;
}

pub(super) fn fresnel_near_one(rng: &mut Rng, x: &mut [f32]) {
    let cosine = if rng.bool() { rng.f64() } else { spread(rng, 1e-8, 1.0) };
    x[0] = (cosine * sign(rng)) as f32;
    x[1] = index_near_one(rng) as f32;
}

pub(super) fn fresnel_critical_ulps(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    x[0] = side as f32 * moved(cosine as f32, rng.i32(-3..=3));
    x[1] = eta;
}

/// Between 10^LOW and 10^HIGH of the critical angle's cosine away.
pub(super) fn fresnel_critical<const LOW: i32, const HIGH: i32>(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    let away = spread(rng, 10_f64.powi(LOW), 10_f64.powi(HIGH)) * sign(rng);
    x[0] = (side * (cosine * (1.0 + away)).min(1.0)) as f32;
    x[1] = eta;
}

pub(super) fn fresnel_wild(rng: &mut Rng, x: &mut [f32]) {
    x[0] = bits(rng, 0.0, 1.0) * sign(rng) as f32;
    x[1] = bits(rng, 1e-6, 1e6);
}

/// Cosines from 1e-30: the share is proportional to them, and devices may take what is below 1e-38 for 0.
pub(super) fn transmittance_of<const REGION: usize>(rng: &mut Rng, x: &mut [f32]) {
    [fresnel_ordinary, fresnel_grazing, fresnel_critical_ulps, fresnel_wild][REGION](rng, x);
    x[0] = x[0].signum() * x[0].abs().max(1e-30);
}

fn refract_at(rng: &mut Rng, x: &mut [f32], cosine: f64, eta: f32) {
    put(x, direction(cosine, rng.f64()));
    x[3] = eta;
}

pub(super) fn refract_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, eta) = (uniform(rng, -1.0, 1.0), index(rng) as f32);
    refract_at(rng, x, cosine, eta);
}

pub(super) fn refract_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, eta) = (uniform(rng, -1.0, 1.0), index_near_one(rng) as f32);
    refract_at(rng, x, cosine, eta);
}

pub(super) fn refract_critical_ulps(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    refract_at(rng, x, side * cosine, eta);
    x[2] = (x[2].signum()) * moved(x[2].abs(), rng.i32(-3..=3));
}

pub(super) fn refract_critical(rng: &mut Rng, x: &mut [f32]) {
    let (eta, side, cosine) = critical(rng);
    let away = spread(rng, 1e-7, 1e-2) * sign(rng);
    refract_at(rng, x, side * (cosine * (1.0 + away)).min(1.0), eta);
}

pub(super) fn refract_wild(rng: &mut Rng, x: &mut [f32]) {
    let cosine = f64::from(bits(rng, 0.0, 1.0)) * sign(rng);
    let eta = bits(rng, 1e-6, 1e6);
    refract_at(rng, x, cosine, eta);
}

/// A normal, and a direction at an angle of that cosine to it.
fn refract_about_at(rng: &mut Rng, x: &mut [f32], cosine: f64, eta: f32) {
    let n = direction(uniform(rng, -1.0, 1.0), rng.f64());
    let (across, along) = n.any_orthonormal_pair();
    let local = direction(cosine, rng.f64());
    put(x, local.x * across + local.y * along + local.z * n);
    put(&mut x[3..], n);
    x[6] = eta;
}

pub(super) fn refract_about_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, eta) = (uniform(rng, 0.0, 1.0), index(rng) as f32);
    refract_about_at(rng, x, cosine, eta);
}

pub(super) fn refract_about_critical(rng: &mut Rng, x: &mut [f32]) {
    let eta = uniform(rng, 1.0 / DIAMOND, 1.0) as f32;
    let cosine = (1.0 - f64::from(eta).powi(2)).sqrt() * (1.0 + spread(rng, 1e-7, 1e-2) * sign(rng));
    refract_about_at(rng, x, cosine.min(1.0), eta);
}

pub(super) fn basis_ordinary(rng: &mut Rng, x: &mut [f32]) {
    put(x, direction(uniform(rng, -1.0, 1.0), rng.f64()));
}

pub(super) fn basis_near_pole(rng: &mut Rng, x: &mut [f32]) {
    let sine = spread(rng, 1e-12, 1e-2);
    let across = DVec2::from_angle(rng.f64() * TAU) * sine;
    put(x, across.extend(-(1.0 - sine * sine).sqrt()));
}

pub(super) fn original_front(rng: &mut Rng, x: &mut [f32]) {
    x[0] = if rng.bool() { rng.f32() } else { bits(rng, 1e-8, 1.0) };
    x[1] = if rng.bool() { uniform(rng, 1.0, DIAMOND) as f32 } else { 1.0 + spread(rng, 1e-7, 1e-3) as f32 };
}

pub(super) fn original_behind(rng: &mut Rng, x: &mut [f32]) {
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

pub(super) fn distribution_ordinary(rng: &mut Rng, x: &mut [f32]) {
    x[3] = alpha(rng, 1e-4, 1.0);
    put(x, facet(rng, x[3]));
}

pub(super) fn distribution_wild(rng: &mut Rng, x: &mut [f32]) {
    x[3] = bits(rng, 1e-10, 1.0);
    put(x, facet(rng, x[3]));
}

fn visible_normal_at(rng: &mut Rng, x: &mut [f32], cosine: f64, alpha: f32) {
    put(x, direction(cosine, rng.f64()));
    (x[3], x[4], x[5]) = (alpha, rng.f32(), rng.f32());
}

pub(super) fn visible_normal_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0));
    visible_normal_at(rng, x, cosine, alpha);
}

pub(super) fn visible_normal_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha) = (spread(rng, 1e-6, 1e-2), alpha(rng, 1e-3, 1.0));
    visible_normal_at(rng, x, cosine, alpha);
}

pub(super) fn visible_normal_wild(rng: &mut Rng, x: &mut [f32]) {
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

pub(super) fn eval_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 0.01, 1.0), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

pub(super) fn eval_narrow(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-4, 0.01), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

pub(super) fn eval_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (spread(rng, 1e-4, 1e-2), alpha(rng, 1e-3, 1.0), away_from_one(rng));
    eval_at(rng, x, cosine, alpha, eta);
}

pub(super) fn eval_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0), index_near_one(rng) as f32);
    eval_at(rng, x, cosine, alpha, eta);
}

pub(super) fn eval_wild(rng: &mut Rng, x: &mut [f32]) {
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

pub(super) fn sample_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 0.01, 1.0), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

pub(super) fn sample_narrow(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-4, 0.01), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

pub(super) fn sample_grazing(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (spread(rng, 1e-4, 1e-2), alpha(rng, 1e-3, 1.0), away_from_one(rng));
    sample_at(rng, x, cosine, alpha, eta);
}

pub(super) fn sample_near_one(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (uniform(rng, 0.01, 1.0), alpha(rng, 1e-3, 1.0), index_near_one(rng) as f32);
    sample_at(rng, x, cosine, alpha, eta);
}

pub(super) fn sample_smooth(rng: &mut Rng, x: &mut [f32]) {
    let cosine = uniform(rng, 0.01, 1.0);
    let (alpha, eta) = if rng.bool() { (0.0, away_from_one(rng)) } else { (rng.f32(), 1.0) };
    sample_at(rng, x, cosine, alpha, eta);
}

pub(super) fn sample_wild(rng: &mut Rng, x: &mut [f32]) {
    let (cosine, alpha, eta) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0), bits(rng, 1e-6, 1e6));
    sample_at(rng, x, cosine.into(), alpha, eta);
    (x[5], x[6], x[7]) = (bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0), bits(rng, 0.0, 1.0));
}

pub(super) fn transmittance_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let depth = if rng.bool() { uniform(rng, 0.0, 80.0) } else { spread(rng, 1e-8, 80.0) };
    let distance = spread(rng, 1e-4, 1e2);
    (x[0], x[1]) = ((depth / distance) as f32, distance as f32);
}

pub(super) fn dispersed_ordinary(rng: &mut Rng, x: &mut [f32]) {
    (x[0], x[1], x[2]) = (uniform(rng, 1.0, DIAMOND) as f32, rng.f32(), uniform(rng, 300.0, 1000.0) as f32);
}

fn offset_at(rng: &mut Rng, x: &mut [f32], size: f64) {
    let position = size * DVec3::new(uniform(rng, -1.0, 1.0), uniform(rng, -1.0, 1.0), uniform(rng, -1.0, 1.0));
    put(x, position);
    put(&mut x[3..], position.abs() * spread(rng, 1e-7, 1e-5));
    put(&mut x[6..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
    put(&mut x[9..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
}

pub(super) fn offset_ordinary(rng: &mut Rng, x: &mut [f32]) {
    let size = spread(rng, 1e-4, 1e4);
    offset_at(rng, x, size);
}

pub(super) fn offset_tiny(rng: &mut Rng, x: &mut [f32]) {
    // Rounding errors of smaller ones are below the least normal number, which devices may take for 0.
    let size = spread(rng, 1e-25, 1e-4);
    offset_at(rng, x, size);
}

/// Finite numbers of any size, and errors up to as large as they are.
pub(super) fn offset_wild(rng: &mut Rng, x: &mut [f32]) {
    for i in 0..3 {
        x[i] = bits(rng, 0.0, f32::MAX) * sign(rng) as f32;
        x[i + 3] = bits(rng, 0.0, f32::MAX);
    }
    put(&mut x[6..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
    put(&mut x[9..], direction(uniform(rng, -1.0, 1.0), rng.f64()));
}
