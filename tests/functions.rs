//! The shaders' optics functions on the device against their 64-bit counterparts, at the inputs where they break.

mod common;

use std::sync::Arc;

use common::Validated;
use vitrum::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Format, Gpu, ImageDesc, SamplePush,
    Specialization, Use, shaders,
};
use vitrum::optics::original;

/// The probe's four outputs for each (cosine, index, roughness).
fn probe(gpu: &Gpu, inputs: &[[f32; 3]]) -> vitrum::gpu::Result<Vec<[f32; 4]>> {
    let mut commands = Commands::new(gpu)?;
    let padded: Vec<[f32; 4]> = inputs.iter().map(|&[a, b, c]| [a, b, c, 0.0]).collect();
    let size = 16 * inputs.len() as u64;
    let output = Arc::new(Buffer::new(gpu, &BufferDesc { name: "outputs", size, usage: BufferUse::Storage })?);
    let readback = Buffer::new(gpu, &BufferDesc { name: "readback", size, usage: BufferUse::Readback })?;
    // The functions share a file with others that see the scene.
    let mut bindings = Vec::new();
    for _ in 0..7 {
        bindings.push(Bind::Buffer(Arc::new(commands.upload_buffer("unused", &[0.0_f32; 64])?)));
    }
    let uses = &[Use::CopyTarget, Use::Sampled];
    let desc = ImageDesc { name: "unused", width: 1, height: 1, format: Format::Rgba32Float, uses };
    let image = Arc::new(commands.upload_image(&desc, &[0; 16])?);
    bindings.push(Bind::Sampled(image.clone()));
    bindings.push(Bind::Buffer(Arc::new(commands.upload_buffer("inputs", &padded)?)));
    bindings.push(Bind::Buffer(output.clone()));
    let group = BindGroup::new(gpu, "probe", bindings)?;
    let push = SamplePush::default();
    let shader = &shaders::PROBE_ORIGINAL_COMP;
    let pipeline =
        ComputePipeline::new(gpu, shader, &group, size_of::<SamplePush>() as u32, &Specialization::default())?;
    commands.run(|cmd| {
        cmd.use_image(&image, Use::Sampled);
        cmd.dispatch(&pipeline, &group, &push, [inputs.len().div_ceil(64) as u32, 1, 1]);
        cmd.wait_for_buffers();
        cmd.copy_buffer(&output, &readback);
    })?;
    Ok(bytemuck::allocation::pod_collect_to_vec(readback.bytes()))
}

fn evaluate(inputs: &[[f32; 3]]) -> Option<Vec<[f32; 4]>> {
    let validated = Validated::open()?;
    let outputs = probe(&validated.gpu, inputs).expect("the probe runs");
    validated.verdict();
    Some(outputs)
}

/// Cosines from grazing to normal.
fn cosines() -> impl Iterator<Item = f32> {
    let grazing = (0..=60).map(|i| 10_f32.powf(-f32::from(i as u8) / 6.0));
    grazing.chain((0..1000).map(|i| (i as f32 + 0.5) / 1000.0))
}

#[test]
fn reflectance_holds_at_grazing_angles_and_close_to_index_one() {
    let indices = [1.0, 1.0 + f32::EPSILON, 1.000001, 1.00001, 1.0003, 1.01, 1.33, 1.5, 2.0, 2.42, 100.0, 1e6];
    let inputs: Vec<_> = indices.iter().flat_map(|&index| cosines().map(move |cosine| [cosine, index, 0.0])).collect();
    let Some(outputs) = evaluate(&inputs) else { return };
    let mut worst = (0.0, [0.0; 3]);
    for (input, output) in inputs.iter().zip(outputs) {
        let [cosine, index, _] = input.map(f64::from);
        let expected = original::fresnel_bsdf(cosine, 1.0, index);
        let found = f64::from(output[0]);
        if index == 1.0 {
            assert_eq!(found, 0.0, "{input:?}");
            continue;
        }
        let error = (found / expected - 1.0).abs();
        assert!(error < 1e-5, "{input:?}: {found}, expected {expected}");
        if error > worst.0 {
            worst = (error, *input);
        }
        let cosine = original::get_cos_theta_tr(cosine, 1.0, index);
        assert!((f64::from(output[1]) - cosine).abs() < 1e-6, "{input:?}: {}, expected {cosine}", output[1]);
    }
    println!("reflectance: worst relative error {:.1e} at {:?}", worst.0, worst.1);
}

#[test]
fn from_behind_reflectance_is_the_reports_and_finite() {
    let brewster = [1.0003_f32, 1.33, 1.5, 2.42].map(|index| [-(1.0 / (1.0 + index * index)).sqrt(), index, 0.0]);
    let grid = [1.0003, 1.33, 1.5, 2.42].into_iter().flat_map(|index| cosines().map(move |c| [-c, index, 0.0]));
    let inputs: Vec<_> = brewster.into_iter().chain(grid).collect();
    let Some(outputs) = evaluate(&inputs) else { return };
    for (input, output) in inputs.iter().zip(outputs) {
        let [cosine, index, _] = input.map(f64::from);
        let expected = original::fresnel_bsdf(cosine, 1.0, index);
        let found = f64::from(output[0]);
        assert!(found.is_finite() && found >= 1.0 - 1e-6, "{input:?}: {found}");
        // A ratio of amplitudes known to 1e-6 next to the angle where it is 0.
        if expected < 1e4 {
            assert!((found / expected - 1.0).abs() < 1e-3, "{input:?}: {found}, expected {expected}");
        }
    }
}

#[test]
fn below_index_one_light_is_totally_reflected_beyond_the_critical_angle() {
    let indices = [1e-6, 0.4132, 0.5, 0.75, 0.9997];
    let inputs: Vec<_> = indices.iter().flat_map(|&index| cosines().map(move |cosine| [cosine, index, 0.0])).collect();
    let Some(outputs) = evaluate(&inputs) else { return };
    for (input, output) in inputs.iter().zip(outputs) {
        let [cosine, index, _] = input.map(f64::from);
        let found = f64::from(output[0]);
        assert!((0.0..=1.0 + 1e-6).contains(&found), "{input:?}: {found}");
        let critical = (1.0 - index * index).sqrt();
        if (cosine - critical).abs() > 1e-4 * critical {
            let expected = original::fresnel_bsdf(cosine, 1.0, index);
            assert!((found - expected).abs() < 2e-3, "{input:?}: {found}, expected {expected}");
        }
    }
}

#[test]
fn the_highlight_is_finite_and_right_from_smooth_to_rough() {
    let roughnesses = [0.0, 0.003, 0.01, 0.03, 0.1, 0.5, 1.0];
    let inputs: Vec<_> = roughnesses.iter().flat_map(|&r| cosines().map(move |cosine| [cosine, 1.5, r])).collect();
    let Some(outputs) = evaluate(&inputs) else { return };
    for (input, output) in inputs.iter().zip(outputs) {
        let [cosine, _, roughness] = input.map(f64::from);
        let alpha = roughness * roughness;
        let [_, _, distribution, masking] = output.map(f64::from);
        assert!(distribution.is_finite() && masking.is_finite() && distribution >= 0.0, "{input:?}: {output:?}");
        if roughness == 0.0 {
            assert_eq!(distribution, 0.0, "{input:?}");
            continue;
        }
        let expected = original::distribution_ggx(cosine, alpha);
        // The sine that the probe derives from a 32-bit cosine is off by 3e-4 at most.
        if alpha > 0.1 {
            assert!((distribution / expected - 1.0).abs() < 1e-4, "{input:?}: {distribution}, expected {expected}");
        }
        let expected = original::masking_ggx(cosine, alpha) / (2.0 * cosine);
        assert!((masking / expected - 1.0).abs() < 1e-5, "{input:?}: {masking}, expected {expected}");
    }
}
