//! In 64-bit arithmetic what `shaders/` computes in 32, under the same names: the reference that devices are held against.
//!
//! In flow directions of unit length, cosines and indices; out flow directions and shares of light, from 0 to 1 unless said.

pub mod compensation;
pub mod fresnel;
pub mod medium;
pub mod microfacet;
pub mod offset;
pub mod original;
mod pair;
pub mod rough;
pub mod spectrum;
