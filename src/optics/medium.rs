//! What the inside of a body does to light. As `shaders/medium.glsl`.

/// Absorption per metre such that `attenuation_color`, 0 to 1, is left of white light after `attenuation_distance` metres, as
/// KHR_materials_volume has it. Infinite for colour 0.
pub fn absorption(attenuation_color: f64, attenuation_distance: f64) -> f64 {
    if attenuation_color >= 1.0 { 0.0 } else { -attenuation_color.ln() / attenuation_distance }
}

/// The share of light left after `distance`: Beer and Lambert.
pub fn transmittance(absorption: f64, distance: f64) -> f64 {
    (-absorption * distance).exp()
}

/// The index at `wavelength` in nanometres: `ior` at 587.6 nm, `dispersion` = 20 / Abbe number, as KHR_materials_dispersion.
pub fn dispersed_index(ior: f64, dispersion: f64, wavelength: f64) -> f64 {
    ior + (ior - 1.0) * (dispersion / 20.0) * (523_655.0 / (wavelength * wavelength) - 1.5168)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_is_left_after_the_distance_of_a_half() {
        let coefficient = absorption(0.5, 0.2);
        assert!((transmittance(coefficient, 0.2) - 0.5).abs() < 1e-15);
        assert!((transmittance(coefficient, 0.6) - 0.125).abs() < 1e-15);
        assert_eq!(absorption(1.0, 0.2), 0.0);
        assert_eq!(absorption(0.3, f64::INFINITY), 0.0);
        assert_eq!(transmittance(absorption(0.0, 1.0), 1.0), 0.0);
    }

    /// The Abbe number is (n_d - 1) / (n_F - n_C), at the lines d, F and C.
    #[test]
    fn the_index_has_the_abbe_number_that_was_asked_for() {
        let index = |wavelength| dispersed_index(1.5168, 20.0 / 64.17, wavelength);
        assert!((index(587.56) - 1.5168).abs() < 1e-5);
        let abbe = (index(587.56) - 1.0) / (index(486.13) - index(656.27));
        assert!((abbe / 64.17 - 1.0).abs() < 1e-3, "{abbe}");
    }
}
