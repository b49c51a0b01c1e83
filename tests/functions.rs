//! The shaders' optics functions on the device: the bounds of `vitrum numerics`, and a table from elsewhere.

mod common;

use common::Validated;
use common::tables::ExactFresnel;
use vitrum::numerics::{Function, Probe, suite, ulps};

/// Evaluations of each region: `vitrum numerics` tries more.
const COUNT: u64 = 20_000;

fn probe(validated: &Validated, name: &str) -> Probe {
    Probe::new(&validated.gpu, Function::named(name).expect("a function")).expect("a probe")
}

#[test]
fn every_function_keeps_its_bounds_in_every_region() {
    let Some(validated) = Validated::open() else { return };
    let reports = suite::run(&validated.gpu, None, COUNT, 7, &mut |_| {}).expect("the suite runs");
    assert_eq!(reports.len(), suite::regions(None));
    let mut broken = Vec::new();
    for report in &reports {
        let place = format!("{}, {}", report.function, report.region);
        if report.non_finite > 0 {
            broken.push(format!("{place}: {} not finite, {:?}", report.non_finite, report.non_finite_cause));
        }
        for finding in &report.findings {
            let (measure, found, bound) = (&finding.measure, finding.found(), finding.bound);
            println!("{place}: {measure} {found:.2e} of {bound:.0e}");
            if !finding.holds() {
                broken.push(format!("{place}: {measure} {found:.2e} of {bound:.0e}, {:?}", finding.cause));
            }
        }
    }
    validated.verdict();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Rows whose inputs are exact in 32 bits, some of them within 3 ULP of the critical angle.
#[test]
fn fresnels_equations_are_those_of_a_table_with_fifty_digits() {
    let Some(validated) = Validated::open() else { return };
    let rows: Vec<_> = ExactFresnel::all().into_iter().filter(|row| row.kind.starts_with("f32")).collect();
    assert!(rows.len() > 300);
    let inputs: Vec<f32> = rows.iter().flat_map(|row| [row.cos_i as f32, row.eta as f32]).collect();
    assert!(
        rows.iter().zip(inputs.chunks(2)).all(|(row, x)| row.cos_i == f64::from(x[0]) && row.eta == f64::from(x[1]))
    );
    let outputs = probe(&validated, "fresnel").evaluate(&inputs).expect("the probe runs");
    let passed = probe(&validated, "fresnel_transmittance").evaluate(&inputs).expect("the probe runs");
    validated.verdict();

    let mut worst = [0.0_f64; 4];
    for (row, (found, &transmittance)) in rows.iter().zip(outputs.chunks(3).zip(&passed)) {
        let errors = [
            (f64::from(found[0]) - row.reflectance).abs(),
            ulps(found[0], row.reflectance),
            ulps(found[1], row.cos_t),
            ulps(transmittance, row.transmittance),
        ];
        for (error, (bound, worst)) in errors.into_iter().zip([2e-6, 4.0, 4.0, 10.0].into_iter().zip(&mut worst)) {
            assert!(error <= bound, "{row:?}: {found:?}, {transmittance}; errors {errors:?}");
            *worst = worst.max(error);
        }
        assert_eq!(found[2] == 1.0, row.is_total(), "{row:?}: {found:?}");
    }
    let [absolute, reflectance, cosine, transmittance] = worst;
    println!("{} rows: reflectance within {absolute:.1e}, {reflectance:.2} ULP", rows.len());
    println!("transmitted cosine within {cosine:.2} ULP, transmittance {transmittance:.2} ULP");
}

/// Between equal indices there is no interface, at whatever angle, where textbooks see total reflection.
#[test]
fn at_index_one_nothing_happens() {
    let Some(validated) = Validated::open() else { return };
    // Every power of 2, down to the least denormal number, and what lies between.
    let exponents = (0..=149).map(|i| 2_f64.powi(-i) as f32);
    let cosines: Vec<f32> = exponents.chain((0..1000).map(|i| (i as f32 + 0.5) / 1000.0)).collect();
    let both_sides = || cosines.iter().flat_map(|&cosine| [cosine, -cosine]);

    let inputs: Vec<f32> = both_sides().flat_map(|cosine| [cosine, 1.0]).collect();
    let outputs = probe(&validated, "fresnel").evaluate(&inputs).expect("the probe runs");
    for (x, found) in inputs.chunks(2).zip(outputs.chunks(3)) {
        assert_eq!((found[0], found[2]), (0.0, 0.0), "cosine {:e}: {found:?}", x[0]);
        // Devices may take denormal numbers for 0.
        let is_flushed = x[0].abs() < f32::MIN_POSITIVE && found[1] == 0.0;
        assert!(found[1] == x[0].abs() || is_flushed, "cosine {:e}: {found:?}", x[0]);
    }

    let turned = both_sides().zip(0..).flat_map(|(cosine, i)| {
        let (sine, turn) = ((1.0 - f64::from(cosine).powi(2)).sqrt(), f64::from(i));
        [(sine * turn.cos()) as f32, (sine * turn.sin()) as f32, cosine, 1.0]
    });
    // Devices may flush denormal numbers here as well.
    let inputs: Vec<f32> = turned.map(|x| if x.abs() < f32::MIN_POSITIVE { 0.0 } else { x }).collect();
    let outputs = probe(&validated, "refract").evaluate(&inputs).expect("the probe runs");
    for (x, found) in inputs.chunks(4).zip(outputs.chunks(4)) {
        assert_eq!(found, [-x[0], -x[1], -x[2], 0.0], "{x:?}");
    }
    validated.verdict();
    println!("{} cosines from {:e}", 2 * cosines.len(), f32::from_bits(1));
}
