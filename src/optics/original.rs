//! The original's equations, as its report states them: A. Ferreira Gomes, "Glass Refraction Using BSDF for Smooth
//! Dielectrics" (2025), section 3. `shaders/bsdf.glsl` computes the same.
//!
//! Indices are not swapped where a surface is seen from behind: the cosine is negative there. Written as the report writes it, not
//! as the shader arranges it: 64 bits bear the cancellations.

use glam::DVec3;

use super::microfacet::{distribution_ggx, masking_ggx};

/// Cosine of the transmitted angle by Snell's law, E(3); 0 where light is totally reflected.
pub fn get_cos_theta_tr(cos_theta_in: f64, eta_i: f64, eta_t: f64) -> f64 {
    let sin_theta_in = (1.0 - cos_theta_in * cos_theta_in).max(0.0).sqrt();
    let sin_theta_tr = sin_theta_in * eta_i / eta_t;
    (1.0 - sin_theta_tr * sin_theta_tr).max(0.0).sqrt()
}

/// Unpolarised Fresnel reflectance, E(4). With a negative cosine it is at least 1, and infinite at Brewster's angle, where
/// the shader's stays finite.
pub fn fresnel_bsdf(cos_theta_in: f64, eta_in: f64, eta_tr: f64) -> f64 {
    let cos_theta_in = cos_theta_in.clamp(-1.0, 1.0);
    let cos_theta_tr = get_cos_theta_tr(cos_theta_in, eta_in, eta_tr);
    if cos_theta_tr <= 0.0 {
        return 1.0;
    }
    let f0 = (eta_tr * cos_theta_in - eta_in * cos_theta_tr) / (eta_tr * cos_theta_in + eta_in * cos_theta_tr);
    let f90 = (eta_in * cos_theta_in - eta_tr * cos_theta_tr) / (eta_in * cos_theta_in + eta_tr * cos_theta_tr);
    (f0 * f0 + f90 * f90) / 2.0
}

/// Direction of the mirrored light; `view_dir` points to the viewer.
pub fn reflection_dir(view_dir: DVec3, normal: DVec3) -> DVec3 {
    2.0 * view_dir.dot(normal) * normal - view_dir
}

/// Direction of the refracted light, E(5), or `None` where light is totally reflected. With `flipped`, as in the report's
/// figure 3, it is not of unit length.
pub fn transmission_dir(view_dir: DVec3, normal: DVec3, refraction_index: f64, flipped: bool) -> Option<DVec3> {
    let cos_theta_in = normal.dot(view_dir).clamp(-1.0, 1.0);
    let eta_i_over_t = 1.0 / refraction_index;
    let cos_theta_tr = get_cos_theta_tr(cos_theta_in, 1.0, refraction_index);
    if cos_theta_tr <= 0.0 {
        return None;
    }
    let ratio = if flipped { refraction_index } else { eta_i_over_t };
    Some(ratio * -view_dir + (ratio * cos_theta_in - cos_theta_tr) * normal)
}

/// Light of a point light mirrored by the surface, per unit of irradiance on a plane that faces the light: the GGX BRDF
/// without its Fresnel factor, times the cosine at the light.
pub fn specular_reflection_direct(view_dir: DVec3, light_dir: DVec3, normal: DVec3, roughness: f64) -> f64 {
    let (cos_view, cos_light) = (normal.dot(view_dir), normal.dot(light_dir));
    if cos_view <= 0.0 || cos_light <= 0.0 || roughness == 0.0 {
        return 0.0;
    }
    let alpha = roughness * roughness;
    let half_dir = (view_dir + light_dir).normalize();
    let sin_squared = |w: DVec3| normal.cross(w).length_squared();
    let masking =
        masking_ggx(cos_view, sin_squared(view_dir), alpha) * masking_ggx(cos_light, sin_squared(light_dir), alpha);
    let distribution = distribution_ggx(normal.dot(half_dir), sin_squared(half_dir), alpha);
    distribution * masking / (4.0 * cos_view * cos_light) * cos_light
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_values() {
        // Hecht, Optics (5th ed.), 4.6.3: 4 % at normal incidence on glass of index 1.5.
        assert!((fresnel_bsdf(1.0, 1.0, 1.5) - 0.04).abs() < 1e-15);
        // At Brewster's angle, tan = n, the reflected light is all perpendicular: half of ((n^2 - 1) / (n^2 + 1))^2.
        let brewster = 1.5_f64.atan().cos();
        let expected = 0.5 * ((2.25 - 1.0) / (2.25 + 1.0_f64)).powi(2);
        assert!((fresnel_bsdf(brewster, 1.0, 1.5) - expected).abs() < 1e-15);
        assert_eq!(fresnel_bsdf(0.0, 1.0, 1.5), 1.0);
        // From the dense side, beyond the critical angle.
        assert_eq!(fresnel_bsdf(0.7, 1.5, 1.0), 1.0);
    }

    #[test]
    fn seen_from_behind_the_original_reflects_more_than_everything() {
        for cosine in [-0.1, -0.5, -0.9, -1.0] {
            assert!(fresnel_bsdf(cosine, 1.0, 1.5) >= 1.0);
        }
    }

    #[test]
    fn refraction_obeys_snell() {
        let normal = DVec3::Y;
        for degrees in [0.0_f64, 10.0, 45.0, 80.0, 89.9] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let refracted =
                transmission_dir(DVec3::new(sine, cosine, 0.0), normal, 1.5, false).expect("no total reflection");
            assert!((refracted.length() - 1.0).abs() < 1e-12);
            assert!((refracted.x + sine / 1.5).abs() < 1e-12 && refracted.y < 0.0);
        }
    }
}
