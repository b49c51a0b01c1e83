//! The rough dielectric: microfacets that reflect and refract, Walter et al. 2007, with GGX and separable Smith masking. As
//! `shaders/rough.glsl`: the surface's normal is +z, `wi` lies on its side, values carry radiance towards `wi`.

use glam::{DVec2, DVec3};

use super::fresnel::{fresnel_dielectric, fresnel_transmittance};
use super::microfacet::{masking_ggx, sample_visible_normal, sin_squared, visible_normal_density};

/// Below this alpha, and between equal indices, an interface is smooth.
pub const LEAST_ALPHA: f64 = 1e-10;

/// The highest roughness that still counts as smooth: the original's default.
pub const SMOOTH: f64 = 0.01;

/// A surface's alpha and the indices on its two sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughInterface {
    /// Roughness squared.
    pub alpha: f64,
    /// Index on the side that light is seen from.
    pub eta_i: f64,
    /// Index beyond.
    pub eta_t: f64,
}

/// One pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoughValue {
    /// The BSDF times the absolute cosine of `wo`.
    pub value: f64,
    /// Density per steradian of [`RoughInterface::sample`] choosing `wo`.
    pub pdf: f64,
}

/// A direction, chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughSample {
    /// The direction; +z where no light comes this way.
    pub wo: DVec3,
    /// Value over density; 0: no light comes this way.
    pub weight: f64,
    /// Density per steradian; where the interface is smooth, the probability.
    pub pdf: f64,
}

impl RoughInterface {
    /// Whether directions are spread: else there is no density.
    pub fn is_spread(&self) -> bool {
        self.alpha >= LEAST_ALPHA && self.eta_i != self.eta_t
    }

    /// Value and density of one pair of directions, equations 20 and 21.
    pub fn evaluate(&self, wi: DVec3, wo: DVec3) -> RoughValue {
        let Self { alpha, eta_i, eta_t } = *self;
        if !self.is_spread() || wi.z <= 0.0 || wo.z == 0.0 {
            return RoughValue::default();
        }
        let reflected = wo.z > 0.0;
        let halfway = if reflected { wi + wo } else { eta_i * wi + eta_t * wo };
        let wm = halfway.normalize_or_zero() * if halfway.z < 0.0 { -1.0 } else { 1.0 };
        let (cos_i, cos_o) = (wi.dot(wm), wo.dot(wm));
        if wm.z <= 0.0 || cos_i <= 0.0 || (cos_o > 0.0) != reflected {
            return RoughValue::default();
        }
        let share = if reflected {
            fresnel_dielectric(cos_i, eta_i, eta_t).reflectance
        } else {
            fresnel_transmittance(cos_i, -cos_o, eta_i, eta_t)
        };
        // Solid angle of facets over that of directions, equations 14 and 17.
        let jacobian = if reflected { 1.0 / (4.0 * cos_i) } else { eta_t * eta_t * -cos_o / halfway.length_squared() };
        let pdf = share * visible_normal_density(wi, wm, alpha) * jacobian;
        let weight = masking_ggx(wo.z.abs(), sin_squared(wo), alpha) * self.radiance(reflected);
        RoughValue { value: pdf * weight, pdf }
    }

    /// A direction: `u.xy` choose the facet, `u.z` between reflection and transmission.
    pub fn sample(&self, wi: DVec3, u: DVec3) -> RoughSample {
        let Self { alpha, eta_i, eta_t } = *self;
        let nothing = RoughSample { wo: DVec3::Z, weight: 0.0, pdf: 0.0 };
        if wi.z <= 0.0 {
            return nothing;
        }
        let wm = if self.is_spread() { sample_visible_normal(wi, alpha, DVec2::new(u.x, u.y)) } else { DVec3::Z };
        let cos_i = wi.dot(wm);
        let facet = fresnel_dielectric(cos_i, eta_i, eta_t);
        let reflected = facet.total || u.z < facet.reflectance;
        let wo = match reflected {
            true => 2.0 * cos_i * wm - wi,
            false => self.refract_through_facet(wi, wm, cos_i, facet.cos_theta_t),
        };
        if !self.is_spread() {
            let pdf = if reflected { facet.reflectance } else { facet.transmittance };
            return RoughSample { wo, weight: self.radiance(reflected), pdf };
        }
        if (wo.z > 0.0) != reflected {
            return nothing;
        }
        let pdf = self.evaluate(wi, wo).pdf;
        RoughSample { wo, weight: masking_ggx(wo.z.abs(), sin_squared(wo), alpha) * self.radiance(reflected), pdf }
    }

    /// The direction beyond a facet. As a change of the direction seen: no terms cancel close to index 1.
    fn refract_through_facet(&self, wi: DVec3, wm: DVec3, cos_i: f64, cos_theta_t: f64) -> DVec3 {
        let share = (self.eta_i + self.eta_t) / (self.eta_i * cos_i + self.eta_t * cos_theta_t);
        -wi + (self.eta_t - self.eta_i) / self.eta_t * (wi - share * wm)
    }

    fn radiance(&self, reflected: bool) -> f64 {
        if reflected { 1.0 } else { (self.eta_i / self.eta_t).powi(2) }
    }

    /// The shares of power that leave the surface, reflected and transmitted, when light comes at `cos_theta_i`, above 0, and
    /// bounces once: means over visible normals, `count` points of a lattice, most even for a Fibonacci number. What is missing
    /// from 1 is what a single bounce loses.
    pub fn albedo(&self, cos_theta_i: f64, count: u32) -> (f64, f64) {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let Self { alpha, eta_i, eta_t } = *self;
        let wi = DVec3::new((1.0 - cos_theta_i * cos_theta_i).max(0.0).sqrt(), 0.0, cos_theta_i);
        let (mut reflected, mut transmitted) = (0.0, 0.0);
        for i in 0..count {
            // Facets left and right of the plane of incidence are alike: half a turn is enough.
            let u = DVec2::new(0.5 * (0.5 + f64::from(i) * GOLDEN).fract(), (f64::from(i) + 0.5) / f64::from(count));
            let wm = sample_visible_normal(wi, alpha, u);
            let cos_i = wi.dot(wm);
            // A mean does not need the digits that `fresnel_dielectric` keeps at a price.
            let squared = (eta_t - eta_i) * (eta_t + eta_i) + (eta_i * cos_i).powi(2);
            let cos_t = squared.max(0.0).sqrt() / eta_t;
            let through = if cos_t > 0.0 { fresnel_transmittance(cos_i, cos_t, eta_i, eta_t) } else { 0.0 };
            let mirrored = 2.0 * cos_i * wm - wi;
            if mirrored.z > 0.0 {
                reflected += (1.0 - through) * masking_ggx(mirrored.z, sin_squared(mirrored), alpha);
            }
            if through > 0.0 {
                let refracted = self.refract_through_facet(wi, wm, cos_i, cos_t);
                if refracted.z < 0.0 {
                    transmitted += through * masking_ggx(-refracted.z, sin_squared(refracted), alpha);
                }
            }
        }
        (reflected / f64::from(count), transmitted / f64::from(count))
    }
}
