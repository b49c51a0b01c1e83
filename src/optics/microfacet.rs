//! A rough surface as a landscape of tiny smooth facets: GGX, after Walter, Marschner, Li & Torrance, "Microfacet Models for
//! Refraction through Rough Surfaces" (EGSR 2007). As `shaders/microfacet.glsl`; alpha is roughness squared, above 0.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// Distribution of the normals of facets per steradian, equation 33. The square of the sine has its own digits.
pub fn distribution_ggx(cos_theta: f64, sin_theta_squared: f64, alpha: f64) -> f64 {
    let ratio = alpha / (alpha * alpha * cos_theta * cos_theta + sin_theta_squared);
    ratio * ratio / PI
}

/// Smith's masking for one direction, equation 34: the share of facets that it sees.
pub fn masking_ggx(cos_theta: f64, sin_theta_squared: f64, alpha: f64) -> f64 {
    // The equation, multiplied by the cosine, which may be 0.
    2.0 * cos_theta / (cos_theta + (cos_theta * cos_theta + alpha * alpha * sin_theta_squared).sqrt())
}

/// The last of the 32-bit numbers below 1: `u` stays below 1, where facets end.
pub const LAST_BELOW_ONE: f64 = 1.0 - f64::EPSILON * (1_u64 << 28) as f64;

/// The square of the sine of the angle between `w` and +z.
pub fn sin_squared(w: DVec3) -> f64 {
    w.x * w.x + w.y * w.y
}

/// The normal of a facet as `wi` sees them, `wi.z` above 0: Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical Caps"
/// (HPG 2023), listing 3. `u` from 0 to 1.
pub fn sample_visible_normal(wi: DVec3, alpha: f64, u: DVec2) -> DVec3 {
    let stretched = DVec3::new(alpha * wi.x, alpha * wi.y, wi.z).normalize();
    let v = u.y.min(LAST_BELOW_ONE);
    let below = v * (1.0 + stretched.z);
    let sine = (below * (2.0 - below)).max(0.0).sqrt();
    let halfway = sine * DVec2::from_angle(TAU * u.x) + stretched.truncate();
    let height = (1.0 - v) * (1.0 + stretched.z);
    (alpha * halfway).extend(height).normalize()
}

/// Density of [`sample_visible_normal`] per steradian: E. Heitz, "Sampling the GGX Distribution of Visible Normals" (JCGT 2018).
pub fn visible_normal_density(wi: DVec3, wm: DVec3, alpha: f64) -> f64 {
    let masking = masking_ggx(wi.z, sin_squared(wi), alpha);
    masking * wi.dot(wm).max(0.0) * distribution_ggx(wm.z, sin_squared(wm), alpha) / wi.z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walter 2007, before equation 33: the facets' projected areas sum to 1; and those that a direction sees to its own cosine.
    #[test]
    fn areas_sum_to_one() {
        for alpha in [0.05_f64, 0.3, 1.0] {
            for degrees in [0.0_f64, 30.0, 60.0, 85.0] {
                let wi = DVec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
                let (mut area, mut seen) = (0.0, 0.0);
                // tan = alpha s / sqrt(1 - s^2) spreads steps as the distribution does.
                let (rings, sectors) = (2000, 256);
                let mut before = 0.0;
                for ring in 0..rings {
                    let edge = |i: f64| (alpha * (i / (f64::from(rings) - i)).sqrt()).atan();
                    let (theta, next) = (edge(f64::from(ring) + 0.5), edge(f64::from(ring) + 1.0));
                    let solid = (f64::cos(before) - next.min(PI / 2.0).cos()) * TAU / f64::from(sectors);
                    before = next;
                    for sector in 0..sectors {
                        let phi = TAU * (f64::from(sector) + 0.5) / f64::from(sectors);
                        let wm = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                        area += distribution_ggx(wm.z, sin_squared(wm), alpha) * wm.z * solid;
                        seen += visible_normal_density(wi, wm, alpha) * solid;
                    }
                }
                assert!((area - 1.0).abs() < 1e-3, "alpha {alpha}: {area}");
                assert!((seen - 1.0).abs() < 2e-3, "alpha {alpha}, {degrees} degrees: {seen}");
            }
        }
    }

    #[test]
    fn the_last_facets_are_nearly_upright() {
        assert_eq!(LAST_BELOW_ONE, f64::from(1.0_f32.next_down()));
        for u in [LAST_BELOW_ONE, 1.0] {
            assert!(sample_visible_normal(DVec3::Z, 0.5, DVec2::new(0.3, u)).z < 1e-3);
        }
    }

    #[test]
    fn closed_forms() {
        // At the pole 1 / (pi alpha^2); a direction along the normal sees everything, one along the surface nothing.
        assert!((distribution_ggx(1.0, 0.0, 0.1) * PI * 0.01 - 1.0).abs() < 1e-15);
        assert_eq!(masking_ggx(1.0, 0.0, 0.7), 1.0);
        assert_eq!(masking_ggx(0.0, 1.0, 0.7), 0.0);
        // Walter's equation 34 as it stands.
        let tan_squared: f64 = 3.0;
        let expected = 2.0 / (1.0 + (1.0 + 0.25 * tan_squared).sqrt());
        assert!((masking_ggx(0.5, 0.75, 0.5) - expected).abs() < 1e-15);
    }
}
