//! The device against the 64-bit referee, pixel by pixel.

use glam::DVec2;

use vitrum::options::Size;

use crate::bodies::{ball, built_in, hollow, in_the_city, made_prism, slab, water_in_a_glass};
use crate::device::{Device, Shot};
use crate::reference::{Referee, Settings};

/// How much may differ: radiance, relative to the pixel's or to 1, what is discarded, and pixels of other paths.
struct Bounds {
    radiance: f64,
    discarded: f64,
    other: usize,
}

#[test]
fn the_device_agrees_with_the_referee() {
    let Some(device) = Device::open() else { return };
    let within = |radiance, discarded, other| Bounds { radiance, discarded, other };
    // Curved walls spread rounding as they spread light; each interface once more.
    for (name, scene, bounds) in [
        ("ball", ball(), within(1e-3, 2e-4, 0)),
        ("slab", slab(), within(1e-4, 1e-5, 0)),
        ("prism", made_prism(), within(1e-4, 1e-5, 0)),
        ("hollow ball", hollow(), within(5e-3, 1e-3, 6)),
        ("water in a glass", water_in_a_glass(), within(1e-4, 1e-5, 6)),
        ("teapot and cups", built_in(), within(1e-2, 1e-2, 15)),
    ] {
        let scene = in_the_city(scene);
        // Cut by the depth alone: a cut-off falls on either side of a throughput that is rounded.
        let (depth, cutoff) = (6, 1e-12);
        let size = Size { width: 64, height: 48 };
        let found = device.picture(&scene, Shot { size, depth, cutoff, ..Shot::default() });
        let referee = Referee::new(&scene, Settings { max_depth: depth, cutoff, ..Settings::default() });
        let expected = referee.picture(size, &[DVec2::ZERO]);
        let (mut same, mut worst, mut place, mut worst_of_others, mut cut) = (0, 0.0, 0, 0.0, 0.0_f64);
        for (i, sample) in expected.iter().enumerate() {
            let radiance = sample.radiance + sample.stand_in;
            let difference = (found.radiance[i] - radiance).abs().max_element() / radiance.max_element().max(1.0);
            if found.interfaces[i] == sample.events as f64 && difference <= bounds.radiance {
                same += 1;
                if difference > worst {
                    (worst, place) = (difference, i);
                }
                cut = cut.max((found.discarded[i] - sample.discarded).abs());
            } else {
                worst_of_others = f64::max(worst_of_others, difference);
            }
        }
        let other = expected.len() - same;
        let (x, y) = (place % size.width as usize, place / size.width as usize);
        let figures = format!(
            "{name}: largest difference {worst:.1e} at {x}, {y}, of what is discarded {cut:.1e}; {other} of {} pixels \
             took another path and differ by up to {worst_of_others:.1e}",
            expected.len()
        );
        println!("{figures}");
        assert!(cut <= bounds.discarded && other <= bounds.other, "{figures}");
    }
    device.verdict();
}
