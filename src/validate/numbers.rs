//! The numerics table of the device.

use super::session::{Session, Trouble, Verdict};
use crate::numerics::suite;
use crate::report::{NumericsFiles, NumericsReport};

/// Inputs in each region: a sample of what `vitrum numerics` tries.
const COUNT: u64 = 20_000;

/// Every bound holds.
pub fn numerics(session: &mut Session<'_>) -> Verdict {
    let gpu = session.open()?;
    let regions = suite::run(&gpu, None, COUNT, 0, &mut |_| {})?;
    let report = NumericsReport::new(gpu.info(), 0, regions);
    report.write(&NumericsFiles::new(&session.place.folder.join("numerics"))?)?;
    session.fact(report.summary());
    report.verdict().map_err(Trouble::Failed)
}
