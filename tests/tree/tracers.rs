//! Both ways of tracing give the same picture.

use vitrum::options::Size;

use crate::bodies::{self, in_the_city};
use crate::device::{Device, Shot};

#[test]
fn hardware_and_software_give_the_same_picture() {
    let Some(device) = Device::open() else { return };
    let [software, hardware] = device.tracers()[..] else { return device.verdict() };
    for (name, scene) in bodies::all() {
        let scene = in_the_city(scene);
        let [hardware, software] = [hardware, software].map(|trace| {
            let size = Size { width: 64, height: 48 };
            device.picture(&scene, Shot { size, cutoff: 1e-3, trace: Some(trace), footprints: true, ..Shot::default() })
        });
        let (rmse, worst) = (hardware.rmse(&software), hardware.largest_difference(&software));
        let differing = hardware.differing(&software, 1e-3);
        println!("{name}: RMSE {rmse:.1e}, {differing} pixels differ, the worst by {worst:.1e}");
        assert!(rmse < 1e-3, "{name}: RMSE {rmse:e}, {differing} pixels differ, the worst by {worst:e}");
    }
    device.verdict();
}
