//! The rough dielectric on the device: what it samples, and the densities and values that it gives.

#[path = "../common/mod.rs"]
mod common;

mod chi_square;
mod grid;
mod lobes;

use std::sync::OnceLock;

use common::Validated;
use common::tables::{Albedo, noise};
use fastrand::Rng;
use glam::{DVec2, DVec3};
use grid::{Device, Report, SAMPLES, in_parallel, sample_rows, views};
use lobes::{Lobe, View, turns, wide};
use vitrum::optics::rough::RoughInterface;

/// The chance of a correct device to fail the whole of a test.
const LEVEL: f64 = 0.01;

/// The grid's reports, made once.
fn reports() -> Option<&'static [Report]> {
    static REPORTS: OnceLock<Option<Vec<Report>>> = OnceLock::new();
    let reports = REPORTS.get_or_init(|| {
        let validated = Validated::open()?;
        let reports = Device::new(&validated.gpu).compare(&views(), 1.0, |_, _, _, density| density);
        validated.verdict();
        Some(reports)
    });
    reports.as_deref()
}

#[test]
fn samples_follow_their_density() {
    let Some(reports) = reports() else { return };
    let least = chi_square::sidak(LEVEL, reports.len());
    let worst = reports.iter().min_by(|a, b| a.outcome.p.total_cmp(&b.outcome.p)).expect("a view");
    println!(
        "{} views of {SAMPLES} samples, level {least:.1e}, worst {:?}, {:?}",
        reports.len(),
        worst.outcome,
        worst.view
    );
    for report in reports {
        assert!(report.outcome.p >= least, "{report:?}");
    }
    // What is too little for each to see may be too much for all.
    let (statistic, freedom) = reports.iter().fold((0.0, 0.0), |(statistic, freedom), report| {
        (statistic + report.outcome.statistic, freedom + report.outcome.freedom as f64)
    });
    let errors = (statistic - freedom) / (2.0 * freedom).sqrt();
    println!("all together {errors:.2} standard errors above the mean of {freedom} degrees of freedom");
    assert!(errors < 4.0, "{errors}");
}

/// The difference between the share of samples that are lost and what the density leaves for them, over what noise allows.
fn unaccounted(report: &Report) -> f64 {
    let lost = 1.0 - report.integral;
    (report.lost - lost).abs() / noise(lost.clamp(0.0, 1.0), SAMPLES as f64, 5.0)
}

#[test]
fn the_density_integrates_to_the_share_that_is_not_lost() {
    let Some(reports) = reports() else { return };
    let worst = reports.iter().max_by(|a, b| unaccounted(a).total_cmp(&unaccounted(b))).expect("a view");
    println!("worst {:.2} of what noise allows: {worst:?}", unaccounted(worst));
    assert!(unaccounted(worst) <= 1.0, "{worst:?}");
}

/// No sample brings more than it should, and on average as much as the 64-bit reference says.
#[test]
fn in_a_white_furnace_nothing_is_gained() {
    let Some(reports) = reports() else { return };
    let points = 17711;
    let expected = in_parallel(reports, |report| {
        let cosine = report.view.upright_wi().normalize().z;
        let (reflected, transmitted) = report.view.interface().albedo(cosine, points);
        [reflected, transmitted]
    });
    let (mut largest, mut most, mut worst) = (0.0_f64, 0.0_f64, (0.0, None));
    for (report, expected) in reports.iter().zip(expected) {
        assert!(report.largest_weight <= 1.0 + 1e-6, "{report:?}");
        largest = largest.max(report.largest_weight);
        let sum: f64 = report.albedo.iter().sum();
        assert!(sum <= 1.0 + 1e-6, "{report:?}");
        most = most.max(sum);
        for (found, expected) in report.albedo.into_iter().zip(expected) {
            // The reference knows no share better than to a few of its points.
            let allowed = noise(expected, SAMPLES as f64, 5.0) + 2.0 / f64::from(points);
            let share = (found - expected).abs() / allowed;
            assert!(share <= 1.0, "{report:?}: {expected}");
            if share > worst.0 {
                worst = (share, Some(report));
            }
        }
    }
    println!("largest weight 1 + {:.1e}, most power {most:.7}", largest - 1.0);
    println!("worst {:.2} of what noise allows: {:?}", worst.0, worst.1);
}

/// The device against a table from elsewhere; as the reference is in `tests/optics.rs`.
#[test]
fn the_device_scatters_what_mitsuba_says() {
    let Some(validated) = Validated::open() else { return };
    let mut device = Device::new(&validated.gpu);
    let mut worst = (0.0, None);
    for (i, row) in Albedo::all().into_iter().enumerate() {
        let degrees = row.cos_i.acos().to_degrees();
        let (alpha, eta) = (row.alpha as f32, row.eta as f32);
        let view = View { alpha, eta, leaving: false, degrees, turns: turns(i) };
        let scale = row.eta.powi(-2);
        let (mut reflected, mut transmitted) = (0.0, 0.0);
        for found in device.sample(&sample_rows(&view, Albedo::SAMPLES as usize)).chunks(5) {
            let weight = f64::from(found[3]) / Albedo::SAMPLES;
            if found[2] > 0.0 {
                reflected += weight;
            } else {
                transmitted += weight / scale;
            }
        }
        for (found, expected) in [(reflected, row.reflected), (transmitted, row.transmitted)] {
            let mean = 0.5 * (found + expected);
            let share = (found - expected).abs() / noise(mean.clamp(0.0, 1.0), Albedo::SAMPLES / 2.0, 5.0);
            assert!(share <= 1.0, "{row:?}: {reflected}, {transmitted}, {share:.2} of what noise allows");
            if share > worst.0 {
                worst = (share, Some(row));
            }
        }
    }
    validated.verdict();
    println!("worst {:.2} of what noise allows at {:?}", worst.0, worst.1);
}

/// `rough_eval` at the directions of samples. A lobe that is narrower than directions of 32 bits may leave no facet there.
#[test]
fn values_are_weights_times_densities() {
    let Some(validated) = Validated::open() else { return };
    let mut device = Device::new(&validated.gpu);
    let (mut worst, mut compared, mut without) = ((0.0, None), 0, 0);
    for view in views() {
        let samples = device.sample(&sample_rows(&view, 1 << 13));
        let samples: Vec<_> = samples.chunks(5).filter(|sample| sample[3] != 0.0).collect();
        let row = |sample: &&[f32]| [&view.wi()[..], &sample[..3], &[view.alpha, view.eta]].concat();
        let values = device.eval(&samples.iter().flat_map(row).collect::<Vec<_>>());
        for (sample, value) in samples.iter().zip(values.chunks(2)) {
            let [weight, density, value, again] = [sample[3], sample[4], value[0], value[1]].map(f64::from);
            if again == 0.0 {
                without += 1;
                continue;
            }
            compared += 1;
            let error = (weight * density / value - 1.0).abs().max((density / again - 1.0).abs());
            // The same arithmetic in two shaders, which compilers may round otherwise where a lobe is narrow.
            assert!(error < 1e-3, "{view:?}, {sample:?}: {value}, {again}");
            if error > worst.0 {
                worst = (error, Some(view));
            }
        }
    }
    validated.verdict();
    println!("{compared} compared, {without} without a facet, worst {:.1e} at {:?}", worst.0, worst.1);
    assert!(without < compared / 100_000, "{without} of {compared}");
}

/// The errors of a density that the test of samples has to find, each on every view.
#[test]
fn a_wrong_density_is_rejected() {
    let Some(validated) = Validated::open() else { return };
    let mut device = Device::new(&validated.gpu);
    let view = |alpha, eta, leaving, degrees| View { alpha, eta, leaving, degrees, turns: 0.1 };
    let views = [
        view(0.001, 1.0003, false, 30.0),
        view(0.001, 2.42, true, 80.0),
        view(0.1, 1.5, false, 60.0),
        view(0.1, 1.33, true, 30.0),
        view(0.3, 1.5, true, 0.0),
        view(1.0, 2.42, false, 89.0),
    ];
    let unchanged: grid::Change = |_, _, _, density| density;
    // Each with the views that it changes by more than noise.
    let changes: [(&str, f32, grid::Change, &[View]); 4] = [
        ("alpha times 1.05", 1.05, unchanged, &views),
        ("as radiance is scaled", 1.0, |view, lobe, _, density| density * scale(view, lobe), &views[2..]),
        ("times 1 + cosine / 10", 1.0, |_, _, facet, density| density * (1.0 + 0.1 * turned(facet)), &views),
        ("steep facets too often", 1.0, |_, _, facet, density| density * (0.95 + 0.2 * facet.x), &views),
    ];
    for report in device.compare(&views, 1.0, unchanged) {
        assert!(report.outcome.p > LEVEL / 10.0, "{report:?}");
    }
    for (name, factor, change, views) in changes {
        let reports = device.compare(views, factor, change);
        let best = reports.iter().map(|report| report.outcome.p).fold(0.0, f64::max);
        println!("{name}: p {best:.1e} at most");
        for report in reports {
            assert!(report.outcome.p < chi_square::sidak(LEVEL, grid::views().len()), "{name}: {report:?}");
        }
    }
    for report in device.compare(&views, 1.0, |_, _, _, density| 1.01 * density) {
        assert!(unaccounted(&report) > 1.0, "{report:?}");
    }
    validated.verdict();
}

/// What radiance is multiplied by, and densities are not.
fn scale(view: &View, lobe: Lobe) -> f64 {
    let RoughInterface { eta_i, eta_t, .. } = view.interface();
    if lobe == Lobe::Transmitted { (eta_i / eta_t).powi(2) } else { 1.0 }
}

fn turned(facet: DVec2) -> f64 {
    (facet.y * std::f64::consts::TAU).cos()
}

/// Without the cosine, values are the same from either end of a path; but for transmitted radiance, which is concentrated by the
/// square of the index: f(a, b) / eta_a^2 = f(b, a) / eta_b^2. Veach 1997, 5.2.
#[test]
fn light_takes_the_same_way_back() {
    let Some(validated) = Validated::open() else { return };
    let mut device = Device::new(&validated.gpu);
    let mut rng = Rng::with_seed(3);
    let (mut there, mut back) = (Vec::new(), Vec::new());
    while there.len() < 8 << 17 {
        let mut spread = |low: f64, high: f64| low * (high / low).powf(rng.f64());
        let (alpha, eta) = (spread(1e-3, 1.0) as f32, spread(1.0 / 2.42, 2.42) as f32);
        let eta = if rng.u8(..4) == 0 { 1.0003 } else { eta };
        let view = View { alpha, eta, leaving: rng.bool(), degrees: 89.9 * rng.f64(), turns: rng.f64() };
        let u = DVec3::new(rng.f64(), rng.f64(), rng.f64());
        let sampled = view.interface().sample(view.upright_wi(), u);
        let (wi, wo) = (view.wi(), view.upright(sampled.wo).as_vec3().to_array());
        if sampled.weight > 0.0 && wo[2] != 0.0 {
            there.extend([&wi[..], &wo, &[alpha, eta]].concat());
            back.extend([&wo[..], &wi, &[alpha, eta]].concat());
        }
    }
    let (forth, returned) = (device.eval(&there), device.eval(&back));
    validated.verdict();
    // Half way between directions that nearly graze lies a normal that their lengths, rounded, turn: either end sees another angle.
    // That the reference sees as well; what the device adds has a bound of its own.
    let (mut worst, mut worst_added, mut of_reference) = ((0.0, None), 0.0_f64, 0.0_f64);
    let pairs = there.chunks(8).zip(back.chunks(8)).zip(forth.chunks(2).zip(returned.chunks(2)));
    for ((there, back), (forth, returned)) in pairs {
        let wanted = symmetric(there, reference(there)) / symmetric(back, reference(back));
        let found = symmetric(there, forth[0].into()) / symmetric(back, returned[0].into());
        assert!(found.is_finite() && wanted.is_finite(), "{there:?}: {forth:?}, {returned:?}");
        of_reference = of_reference.max((wanted - 1.0).abs());
        worst_added = worst_added.max((found / wanted - 1.0).abs());
        if (found - 1.0).abs() >= worst.0 {
            worst = ((found - 1.0).abs(), Some(there));
        }
    }
    println!("worst {:.1e} at {:?}", worst.0, worst.1);
    println!("of the reference {of_reference:.1e}, added by the device {worst_added:.1e}");
    assert!(worst.0 < 1e-3, "{worst:?}");
    assert!(worst_added < 1e-4, "{worst_added}");
}

fn index(w: &[f32], eta: f32) -> f64 {
    if w[2] < 0.0 { eta.into() } else { 1.0 }
}

/// A value of `rough_eval` such that it is the same from either end.
fn symmetric(row: &[f32], value: f64) -> f64 {
    value / f64::from(row[5].abs()) / index(row, row[7]).powi(2)
}

fn reference(row: &[f32]) -> f64 {
    let (eta_i, eta_t) = if row[2] < 0.0 { (row[7].into(), 1.0) } else { (1.0, row[7].into()) };
    let up = DVec3::new(1.0, 1.0, row[2].signum().into());
    RoughInterface { alpha: row[6].into(), eta_i, eta_t }.evaluate(wide(row) * up, wide(&row[3..]) * up).value
}
