//! Snell's law and Fresnel's equations at a smooth interface. Directions point away from the surface; `eta_i` is the index on the
//! side that light is seen from, `eta_t` the index beyond. As `shaders/fresnel.glsl`, with twice the digits.

use glam::DVec3;

use super::pair::Pair;

/// An interface at one angle of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Unpolarised reflectance.
    pub reflectance: f64,
    /// 1 - reflectance, with digits of its own.
    pub transmittance: f64,
    /// Cosine of the transmitted angle; 0 where light is totally reflected.
    pub cos_theta_t: f64,
    /// Total reflection.
    pub total: bool,
}

/// The interface at incidence of cosine `cos_theta_i`, 0 to 1: Fresnel's amplitudes (a - b) / (a + b), their numerators by Snell's
/// law, as Pharr, Jakob & Humphreys (4th ed.), 9.3.5, state them.
pub fn fresnel_dielectric(cos_theta_i: f64, eta_i: f64, eta_t: f64) -> Interface {
    interface(Pair::from(cos_theta_i), eta_i, eta_t)
}

fn interface(cos_theta_i: Pair, eta_i: f64, eta_t: f64) -> Interface {
    if eta_i == eta_t {
        let cos_theta_t = cos_theta_i.value();
        return Interface { reflectance: 0.0, transmittance: 1.0, cos_theta_t, total: false };
    }
    let contrast = Pair::product(eta_t, eta_t) - Pair::product(eta_i, eta_i);
    let i = Pair::from(eta_i) * cos_theta_i;
    let squared = contrast + i * i;
    if squared.value() <= 0.0 {
        return Interface { reflectance: 1.0, transmittance: 0.0, cos_theta_t: 0.0, total: true };
    }
    let t = squared.sqrt();
    let sum = i + t;
    let perpendicular = contrast.value() / (sum * sum).value();
    // eta_t times the cosines of the sum and of the difference of the angles.
    let sines = Pair::from(eta_i) * (Pair::from(1.0) - cos_theta_i * cos_theta_i);
    let (of_sum, of_difference) = ((cos_theta_i * t - sines).value(), (cos_theta_i * t + sines).value());
    let parallel = perpendicular * of_sum / of_difference;
    let through = 2.0 * i.value() * t.value() / (sum * sum).value();
    Interface {
        reflectance: 0.5 * (perpendicular * perpendicular + parallel * parallel),
        transmittance: through * (1.0 + (eta_t / of_difference).powi(2)),
        cos_theta_t: t.value() / eta_t,
        total: false,
    }
}

/// What passes, from both cosines: for directions that are both given, and whose lengths may be rounded, better than asking Snell
/// for the second, who amplifies errors at the critical angle.
pub fn fresnel_transmittance(cos_theta_i: f64, cos_theta_t: f64, eta_i: f64, eta_t: f64) -> f64 {
    let (i, t) = (eta_i * cos_theta_i, eta_t * cos_theta_t);
    let of_difference = cos_theta_i * t + eta_i * (1.0 - cos_theta_i) * (1.0 + cos_theta_i);
    2.0 * i * t / (i + t).powi(2) * (1.0 + (eta_t / of_difference).powi(2))
}

/// The refracted direction of `wi` at a surface whose normal is `n`, on the same side; `None` where light is totally reflected.
/// Lengths other than 1 do not matter.
pub fn refract(wi: DVec3, n: DVec3, eta_i: f64, eta_t: f64) -> Option<DVec3> {
    let dot = |a: DVec3, b: DVec3| Pair::product(a.x, b.x) + Pair::product(a.y, b.y) + Pair::product(a.z, b.z);
    let lengths = (dot(wi, wi) * dot(n, n)).sqrt();
    let projected = dot(wi, n);
    let cosine = projected.value() / lengths.value();
    let rest = projected - lengths * Pair::from(cosine);
    let crossed = interface(Pair { high: cosine, low: rest.value() / lengths.value() }, eta_i, eta_t);
    let (wi, n) = (wi.normalize(), n.normalize());
    (!crossed.total).then(|| -(eta_i / eta_t) * (wi - cosine * n) - crossed.cos_theta_t * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a 32-bit cosine does to the result: the factor by which a relative error of `cos_theta_i` grows in the transmitted
    /// cosine. Infinite at the critical angle.
    fn condition_of_cos_theta_t(cos_theta_i: f64, eta_i: f64, eta_t: f64) -> f64 {
        let crossed = fresnel_dielectric(cos_theta_i, eta_i, eta_t);
        (eta_i * cos_theta_i / (eta_t * crossed.cos_theta_t)).powi(2)
    }

    #[test]
    fn textbook_values() {
        // Hecht, Optics (5th ed.), 4.6.3: 4 % at normal incidence on glass of index 1.5, from either side.
        assert!((fresnel_dielectric(1.0, 1.0, 1.5).reflectance - 0.04).abs() < 1e-16);
        assert!((fresnel_dielectric(1.0, 1.5, 1.0).reflectance - 0.04).abs() < 1e-16);
        // At Brewster's angle the reflected light is all perpendicular.
        let brewster = 1.5_f64.atan().cos();
        let expected = 0.5 * (1.25 / 3.25_f64).powi(2);
        assert!((fresnel_dielectric(brewster, 1.0, 1.5).reflectance - expected).abs() < 1e-15);
        assert_eq!(fresnel_dielectric(0.0, 1.0, 1.5).reflectance, 1.0);
        assert!(fresnel_dielectric(0.7, 1.5, 1.0).total);
        // Equal indices: nothing happens, at grazing angles neither.
        let nothing = Interface { reflectance: 0.0, transmittance: 1.0, cos_theta_t: 0.0, total: false };
        assert_eq!(fresnel_dielectric(0.0, 1.5, 1.5), nothing);
    }

    #[test]
    fn what_is_not_reflected_is_transmitted_and_the_way_back_is_the_same() {
        for eta in [1.0 + 1e-6, 1.0003, 1.33, 1.5, 2.42, 1000.0] {
            for i in 1..=100 {
                let cosine = f64::from(i) / 100.0;
                let there = fresnel_dielectric(cosine, 1.0, eta);
                let back = fresnel_dielectric(there.cos_theta_t, eta, 1.0);
                assert!((there.reflectance + there.transmittance - 1.0).abs() < 1e-14, "{eta} {cosine}");
                // The cosine in between is rounded, which the way back amplifies.
                let allowed = 4.0 * f64::EPSILON * (1.0 + condition_of_cos_theta_t(there.cos_theta_t, eta, 1.0));
                assert!((back.reflectance - there.reflectance).abs() < allowed, "{eta} {cosine}");
                assert!((back.cos_theta_t / cosine - 1.0).abs() < allowed, "{eta} {cosine}");
            }
        }
    }

    #[test]
    fn refraction_obeys_snell() {
        let n = DVec3::new(1.0, 2.0, -0.5).normalize();
        let across = n.any_orthonormal_vector();
        for degrees in [0.0_f64, 10.0, 41.0, 80.0, 89.9] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let wi = cosine * n + sine * across;
            for (eta_i, eta_t) in [(1.0, 1.5), (1.5, 1.0), (1.33, 1.5), (2.42, 2.42)] {
                match refract(wi, n, eta_i, eta_t) {
                    Some(wt) => {
                        assert!((wt.length() - 1.0).abs() < 1e-12 && wt.dot(n) <= 0.0);
                        assert!((eta_t * wt + eta_i * wi).dot(across).abs() < 1e-12, "{degrees}");
                    }
                    None => assert!(eta_i * sine > eta_t),
                }
            }
        }
    }
}
