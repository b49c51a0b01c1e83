//! Measures of single functions: what an absolute or a relative error of one output does not say.

use glam::{DVec2, DVec3};

use super::measures::Measure::{self, Other};
use super::measures::{Case, ulps};
use crate::optics::offset::offset_distance;
use crate::optics::rough::RoughInterface;

/// Values and densities below this are held to errors relative to it.
pub(super) const FLOOR: f64 = 1e-6;

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

pub(super) const TEXTBOOK_REFLECTANCE: Measure = Other {
    name: "reflectance, absolute, textbook",
    on_mean: false,
    error: |case| (f64::from(textbook(case.inputs[0], case.inputs[1]).0) - case.expected[0]).abs(),
};
pub(super) const TEXTBOOK_COSINE: Measure = Other {
    name: "cos_t, ULP, textbook",
    on_mean: false,
    // Where the decision is right; the next measure counts the others.
    error: |case| match textbook(case.inputs[0], case.inputs[1]).1 {
        cosine if cosine > 0.0 && case.expected[1] > 0.0 => ulps(cosine, case.expected[1]),
        _ => 0.0,
    },
};
pub(super) const TEXTBOOK_TOTAL: Measure = Other {
    name: "total, share wrong, textbook",
    on_mean: true,
    error: |case| f64::from(u8::from((textbook(case.inputs[0], case.inputs[1]).1 == 0.0) != (case.expected[2] == 1.0))),
};

/// From behind the original's reflectance is at least 1, and that of the reference where that is not close to infinite.
pub(super) const ORIGINAL_BEHIND: Measure = Other {
    name: "reflectance below 1 or beyond reason",
    on_mean: false,
    error: |case| {
        let found = f64::from(case.outputs[0]);
        let wanted = case.expected[0];
        let is_close = wanted > 1e4 || (found / wanted - 1.0).abs() < 1e-3;
        f64::from(u8::from(case.inputs[1] != 1.0 && !(found >= 1.0 - 1e-6 && is_close)))
    },
};

/// The largest scalar product of two axes that should be perpendicular, and the distance of the third from the normal; and
/// whether the axes are right-handed.
pub(super) const BASIS_SKEW: Measure = Other {
    name: "axes not perpendicular, or not right-handed",
    on_mean: false,
    error: |case| {
        let (x, y, z) = (found(case, 0), found(case, 3), found(case, 6));
        let normal = DVec3::new(case.inputs[0].into(), case.inputs[1].into(), case.inputs[2].into());
        let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()).max((z - normal).length());
        if x.cross(y).dot(z) > 0.0 { skew } else { 1.0 }
    },
};

/// The error of a facet's slope, in units of alpha or of the slope itself. Facets at the end of the distribution, u2 close to 1, lie
/// apart from each other: there one step of u2 in 32 bits is a step of the slope, by 1 / (1 - u2).
pub(super) const FACET: Measure = Other {
    name: "slope over alpha or itself, times 1 - u2",
    on_mean: false,
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

pub(super) const SAMPLED_DIRECTION: Measure = Other {
    name: "wo, absolute, times 1 - u2",
    on_mean: false,
    error: |case| match is_comparable(case) {
        true => (found(case, 0) - expected(case, 0)).length() * (1.0 - f64::from(case.inputs[6])),
        false => 0.0,
    },
};
pub(super) const SAMPLED_WEIGHT: Measure = Other {
    name: "weight over radiance's scale, times 1 - u2",
    on_mean: false,
    error: |case| {
        let (interface, _, wo) = sampled(case);
        let scale = if wo.z > 0.0 { 1.0 } else { (interface.eta_i / interface.eta_t).powi(2) };
        let near_one = 1.0 - f64::from(case.inputs[6]);
        if is_comparable(case) { (f64::from(case.outputs[3]) - case.expected[3]).abs() / scale * near_one } else { 0.0 }
    },
};
/// The decision between the branches, or whether light comes, fell otherwise than in 64 bits: u3 was as close to the reflectance
/// as 32 bits can tell, or the direction as close to the surface.
pub(super) const SAMPLED_OTHERWISE: Measure = Other {
    name: "share decided otherwise",
    on_mean: true,
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

pub(super) const SAMPLED_PDF: Measure = Other {
    name: "pdf against the reference at wo, relative",
    on_mean: false,
    error: |case| {
        let (interface, wi, wo) = sampled(case);
        if case.outputs[3] == 0.0 || !interface.is_spread() {
            return 0.0;
        }
        let wanted = interface.evaluate(wi, wo).pdf;
        if wanted == 0.0 {
            return 0.0; // the lobe is narrower than 32-bit directions
        }
        (f64::from(case.outputs[4]) - wanted).abs() / wanted.max(FLOOR)
    },
};
pub(super) const SAMPLED_VALUE: Measure = Other {
    name: "weight times pdf against value, relative",
    on_mean: false,
    error: |case| {
        let (interface, wi, wo) = sampled(case);
        if case.outputs[3] == 0.0 || !interface.is_spread() {
            return 0.0;
        }
        let wanted = interface.evaluate(wi, wo).value;
        if wanted == 0.0 {
            return 0.0;
        }
        (f64::from(case.outputs[3]) * f64::from(case.outputs[4]) - wanted).abs() / wanted.max(FLOOR)
    },
};

/// Relative to the share itself or, where that is small, to the rounding of the exponent.
pub(super) const TRANSMITTED: Measure = Other {
    name: "transmittance, relative over 1 + depth",
    on_mean: false,
    error: |case| {
        let depth = f64::from(case.inputs[0]) * f64::from(case.inputs[1]);
        let wanted = case.expected[0];
        // Below the least normal number devices may flush to 0.
        if wanted < 2e-38 { 0.0 } else { (f64::from(case.outputs[0]) / wanted - 1.0).abs() / (1.0 + depth) }
    },
};

/// How much of the distance that the error asks for is missing, in 64 bits.
pub(super) const OFFSET_INSIDE: Measure = Other {
    name: "short of the error's distance, relative",
    on_mean: false,
    error: |case| {
        let (along, wanted) = offset(case);
        ((wanted - along) / wanted.max(1e-300)).max(0.0)
    },
};
/// The distance beyond what is needed, in units of the point's last place and of that distance.
pub(super) const OFFSET_TOO_FAR: Measure = Other {
    name: "beyond it, in ULP of the point",
    on_mean: false,
    error: |case| {
        let (along, wanted) = offset(case);
        let largest = case.outputs[..3].iter().fold(0.0_f32, |most, x| most.max(x.abs())).max(f32::MIN_POSITIVE);
        (along - wanted).max(0.0) / (f64::from(largest) * f64::from(f32::EPSILON))
    },
};

/// The distance along the normal, on the side of the direction, and the least that it should be.
fn offset(case: &Case) -> (f64, f64) {
    let input = |i: usize| DVec3::new(case.inputs[i].into(), case.inputs[i + 1].into(), case.inputs[i + 2].into());
    let (position, error, n, w) = (input(0), input(3), input(6), input(9));
    let side = if w.dot(n) < 0.0 { -1.0 } else { 1.0 };
    (side * (found(case, 0) - position).dot(n), offset_distance(error, n) * n.length_squared())
}

fn found(case: &Case, i: usize) -> DVec3 {
    DVec3::new(case.outputs[i].into(), case.outputs[i + 1].into(), case.outputs[i + 2].into())
}

fn expected(case: &Case, i: usize) -> DVec3 {
    DVec3::new(case.expected[i], case.expected[i + 1], case.expected[i + 2])
}
