//! Validation runs: every pass on every Vulkan device under the validation layer, and what goes wrong besides.
//!
//! In flow drivers and devices, out flows a [`Report`] with all evidence. Each device is tested in a process of its own, which does one
//! [`Check`] after the other: where a driver crashes or hangs, that check has failed, and another process goes on with the next. The
//! first checks plant faults: where the layer does not notice those, its silence proves nothing.

mod checks;
mod hardship;
mod known;
mod numbers;
mod pictures;
mod process;
mod record;
mod run;
mod session;

pub use checks::Check;
pub use record::{Listed, Outcome, Picture, Record, Report, Said, Tested};
pub use run::{Run, work};
pub use session::Place;
