//! The table of functions: names, columns, valid inputs, and the 64-bit reference of each.

use glam::DVec3;

use crate::optics::fresnel::{fresnel_dielectric, refract};
use crate::optics::microfacet::{distribution_ggx, masking_ggx, sample_visible_normal, sin_squared};
use crate::optics::offset::offset_ray_origin;
use crate::optics::original::fresnel_bsdf;
use crate::optics::rough::{RoughInterface, RoughSample};
use crate::optics::{fresnel, medium};

/// An optics function of `shaders/`. Directions are in the local frame (the normal is +z) and point away from the surface;
/// `eta` is the index on the side of -z over that on the side of +z.
pub struct Function {
    /// What the command line calls it.
    pub name: &'static str,
    /// Its number in `shaders/probe.comp`.
    pub id: u32,
    /// What it computes.
    pub about: &'static str,
    /// Names of its inputs.
    pub inputs: &'static [&'static str],
    /// Names of its outputs.
    pub outputs: &'static [&'static str],
    /// The same in 64 bits: `outputs.len()` values at `inputs.len()` values.
    pub reference: fn(&[f64]) -> Vec<f64>,
}

/// Every function, by its number.
pub static FUNCTIONS: [Function; 14] = [
    Function {
        name: "fresnel",
        id: 0,
        about: "a smooth interface: reflectance and transmitted cosine",
        inputs: &["cos_i", "eta"],
        outputs: &["reflectance", "cos_t", "total"],
        reference: |x| {
            let crossed = interface(x[0], x[1]);
            vec![crossed.reflectance, crossed.cos_theta_t, f64::from(u8::from(crossed.total))]
        },
    },
    Function {
        name: "refract",
        id: 1,
        about: "the refracted direction; zero where light is totally reflected",
        inputs: &["wi_x", "wi_y", "wi_z", "eta"],
        outputs: &["wt_x", "wt_y", "wt_z", "total"],
        reference: |x| {
            let wi = vector(&x[..3]);
            let (eta_i, eta_t) = indices(wi.z, x[3]);
            let wt = refract(upright(wi, wi.z), DVec3::Z, eta_i, eta_t);
            let total = f64::from(u8::from(wt.is_none()));
            let wt = upright(wt.unwrap_or(DVec3::ZERO), wi.z);
            vec![wt.x, wt.y, wt.z, total]
        },
    },
    Function {
        name: "rough_eval",
        id: 2,
        about: "the rough dielectric: value times cosine, and density",
        inputs: &["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z", "alpha", "eta"],
        outputs: &["value", "pdf"],
        reference: |x| {
            let (wi, wo) = (vector(&x[..3]), vector(&x[3..6]));
            let found = rough(wi, x[6], x[7]).evaluate(upright(wi, wi.z), upright(wo, wi.z));
            vec![found.value, found.pdf]
        },
    },
    Function {
        name: "rough_sample",
        id: 3,
        about: "a direction that the rough dielectric scatters light from",
        inputs: &["wi_x", "wi_y", "wi_z", "alpha", "eta", "u1", "u2", "u3"],
        outputs: &["wo_x", "wo_y", "wo_z", "weight", "pdf"],
        reference: |x| {
            let wi = vector(&x[..3]);
            let RoughSample { wo, weight, pdf } = rough(wi, x[3], x[4]).sample(upright(wi, wi.z), vector(&x[5..8]));
            let wo = upright(wo, wi.z);
            vec![wo.x, wo.y, wo.z, weight, pdf]
        },
    },
    Function {
        name: "original_fresnel",
        id: 4,
        about: "the reflectance of the original, as model single shows it",
        inputs: &["cos_i", "eta"],
        outputs: &["reflectance"],
        reference: |x| vec![if x[1] == 1.0 { 0.0 } else { fresnel_bsdf(x[0], 1.0, x[1]) }],
    },
    Function {
        name: "distribution",
        id: 5,
        about: "GGX distribution of facets with the normal wm",
        inputs: &["wm_x", "wm_y", "wm_z", "alpha"],
        outputs: &["distribution"],
        reference: |x| vec![distribution_ggx(x[2], sin_squared(vector(&x[..3])), x[3])],
    },
    Function {
        name: "masking",
        id: 6,
        about: "the share of facets that w sees",
        inputs: &["w_x", "w_y", "w_z", "alpha"],
        outputs: &["masking"],
        reference: |x| vec![masking_ggx(x[2], sin_squared(vector(&x[..3])), x[3])],
    },
    Function {
        name: "visible_normal",
        id: 7,
        about: "the normal of a facet that wi sees",
        inputs: &["wi_x", "wi_y", "wi_z", "alpha", "u1", "u2"],
        outputs: &["wm_x", "wm_y", "wm_z"],
        reference: |x| sample_visible_normal(vector(&x[..3]), x[3], (x[4], x[5]).into()).to_array().to_vec(),
    },
    Function {
        name: "transmittance",
        id: 8,
        about: "the share of light left in an absorbing medium",
        inputs: &["absorption", "distance"],
        outputs: &["transmittance"],
        reference: |x| vec![medium::transmittance(x[0], x[1])],
    },
    Function {
        name: "dispersed_index",
        id: 9,
        about: "the index at a wavelength in nanometres",
        inputs: &["ior", "dispersion", "wavelength"],
        outputs: &["index"],
        reference: |x| vec![medium::dispersed_index(x[0], x[1], x[2])],
    },
    Function {
        name: "offset_origin",
        id: 10,
        about: "where a ray starts that leaves a surface towards w",
        inputs: &["p_x", "p_y", "p_z", "error_x", "error_y", "error_z", "n_x", "n_y", "n_z", "w_x", "w_y", "w_z"],
        outputs: &["origin_x", "origin_y", "origin_z"],
        reference: |x| {
            let origin = offset_ray_origin(vector(&x[..3]), vector(&x[3..6]), vector(&x[6..9]), vector(&x[9..12]));
            origin.to_array().to_vec()
        },
    },
    Function {
        name: "fresnel_transmittance",
        id: 11,
        about: "what a smooth interface lets through",
        inputs: &["cos_i", "eta"],
        outputs: &["transmittance"],
        reference: |x| vec![interface(x[0], x[1]).transmittance],
    },
    Function {
        name: "refract_about",
        id: 12,
        about: "the refracted direction about any normal n, on the side of wi, where the index is 1",
        inputs: &["wi_x", "wi_y", "wi_z", "n_x", "n_y", "n_z", "eta"],
        outputs: &["wt_x", "wt_y", "wt_z", "total"],
        reference: |x| {
            let wt = refract(vector(&x[..3]), vector(&x[3..6]), 1.0, x[6]);
            let total = f64::from(u8::from(wt.is_none()));
            let wt = wt.unwrap_or(DVec3::ZERO);
            vec![wt.x, wt.y, wt.z, total]
        },
    },
    Function {
        name: "basis",
        id: 13,
        about: "axes of a local frame about the normal n",
        inputs: &["n_x", "n_y", "n_z"],
        outputs: &["x_x", "x_y", "x_z", "y_x", "y_y", "y_z", "z_x", "z_y", "z_z"],
        // Any right-handed frame about n will do.
        reference: |x| {
            let n = vector(x).normalize();
            let (across, along) = n.any_orthonormal_pair();
            [across, along, n].iter().flat_map(|axis| axis.to_array()).collect()
        },
    },
];

impl Function {
    /// The function that the command line calls `name`.
    pub fn named(name: &str) -> Result<&'static Self, String> {
        FUNCTIONS.iter().find(|function| function.name == name).ok_or_else(|| {
            let known: Vec<_> = FUNCTIONS.iter().map(|function| function.name).collect();
            format!("unknown function {name:?}; known: {}", known.join(", "))
        })
    }

    /// Why these inputs are none, naming the column.
    pub fn check(&self, inputs: &[f32]) -> Result<(), String> {
        for (&name, &value) in self.inputs.iter().zip(inputs) {
            let (ok, wanted) = match name {
                "cos_i" => ((-1.0..=1.0).contains(&value), "a cosine from -1 to 1"),
                "eta" | "ior" => ((1e-6..=1e6).contains(&value), "an index from 1e-6 to 1e6"),
                "alpha" if self.name.starts_with("rough") => ((0.0..=1.0).contains(&value), "an alpha from 0 to 1"),
                "alpha" => ((1e-10..=1.0).contains(&value), "an alpha from 1e-10 to 1"),
                "wi_z" if self.name == "visible_normal" => (value > 0.0, "a direction with z above 0"),
                "w_z" | "wm_z" => (value >= 0.0, "a direction with z from 0"),
                "u1" | "u2" | "u3" => ((0.0..=1.0).contains(&value), "a number from 0 to 1"),
                "absorption" | "distance" => (value >= 0.0 && value.is_finite(), "a finite number from 0"),
                "wavelength" => ((1.0..=1e6).contains(&value), "a wavelength in nanometres from 1 to 1e6"),
                "error_x" | "error_y" | "error_z" => (value >= 0.0 && value.is_finite(), "a finite number from 0"),
                _ => (value.is_finite(), "a finite number"),
            };
            if !ok {
                return Err(format!("{name} {value:?}: expected {wanted}"));
            }
        }
        for (names, vector) in self.inputs.windows(3).zip(inputs.windows(3)) {
            let Some(direction) = names[0].strip_suffix("_x").filter(|name| !matches!(*name, "p" | "error")) else {
                continue;
            };
            let length = vector.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
            // Three digits a component are enough to be taken for one.
            if (length - 1.0).abs() > 1e-3 {
                return Err(format!(
                    "{direction} has length {length:.4}: expected a direction of length 1, within 0.001"
                ));
            }
        }
        if self.name == "refract_about" && (0..3).map(|i| inputs[i] * inputs[i + 3]).sum::<f32>() < 0.0 {
            return Err("wi lies behind the surface: expected it on the side of n".into());
        }
        Ok(())
    }
}

fn vector(x: &[f64]) -> DVec3 {
    DVec3::new(x[0], x[1], x[2])
}

/// Indices on the side that light is seen from and beyond.
fn indices(side: f64, eta: f64) -> (f64, f64) {
    if side < 0.0 { (eta, 1.0) } else { (1.0, eta) }
}

/// The functions take the side of light as +z.
fn upright(w: DVec3, side: f64) -> DVec3 {
    if side < 0.0 { DVec3::new(w.x, w.y, -w.z) } else { w }
}

fn interface(cosine: f64, eta: f64) -> fresnel::Interface {
    let (eta_i, eta_t) = indices(cosine, eta);
    fresnel_dielectric(cosine.abs(), eta_i, eta_t)
}

fn rough(wi: DVec3, alpha: f64, eta: f64) -> RoughInterface {
    let (eta_i, eta_t) = indices(wi.z, eta);
    RoughInterface { alpha, eta_i, eta_t }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_numbered_and_named_as_the_probe_does() {
        let text = include_str!("../../shaders/probe.comp");
        for (i, function) in FUNCTIONS.iter().enumerate() {
            assert_eq!(function.id as usize, i, "{}", function.name);
            let (inputs, outputs) = (function.inputs.len(), function.outputs.len());
            let name = function.name.to_uppercase();
            assert!(text.contains(&format!("const uint {name} = {i};")), "{name}");
            let case = text.split(&format!("case {name}: {{")).nth(1).expect("a case");
            assert!(case.trim_start().starts_with(&format!("Open(i, {inputs}, {outputs});")), "{name}");
        }
    }

    #[test]
    fn inputs_out_of_range_are_named() {
        let fresnel = Function::named("fresnel").expect("a function");
        assert!(fresnel.check(&[0.5, 1.5]).is_ok());
        assert_eq!(fresnel.check(&[f32::NAN, 1.5]), Err("cos_i NaN: expected a cosine from -1 to 1".into()));
        assert_eq!(fresnel.check(&[0.5, 0.0]), Err("eta 0.0: expected an index from 1e-6 to 1e6".into()));
        let refract = Function::named("refract").expect("a function");
        let error = refract.check(&[0.5, 0.5, 0.5, 1.5]).expect_err("not a direction");
        assert!(error.starts_with("wi has length 0.866"), "{error}");
        assert!(Function::named("magic").is_err());
        let check = |name, inputs: &[f32]| Function::named(name).expect("a function").check(inputs);
        assert!(
            check("visible_normal", &[0.0, 0.0, -1.0, 0.5, 0.5, 0.5])
                .is_err_and(|error| error.starts_with("wi_z -1.0"))
        );
        assert!(check("masking", &[0.0, 0.0, -1.0, 0.5]).is_err());
        assert!(check("distribution", &[0.0, 0.0, 1.0, 1e-19]).is_err());
        assert!(check("refract_about", &[0.6, 0.0, -0.8, 0.0, 0.0, 1.0, 1.5]).is_err());
        assert!(check("rough_eval", &[0.6, 0.0, -0.8, 0.0, 0.0, 1.0, 0.0, 1.5]).is_ok());
    }
}
