//! Regression renders: a suite of pictures, each held against a reference.
//!
//! In flow a [`Suite`] and a device, out flows a [`Record`] of each picture. Pictures that are computed are compared strictly, those that
//! are sampled at random by a test of each pixel against mean and variance. What is done is kept in a folder, so that a run that was
//! interrupted goes on, and those of several machines can be joined.

mod judge;
mod pictures;
mod record;
mod reference;
mod run;
mod suite;

pub use judge::{Limits, Measure, Sampled, chance};
pub use record::{Device, Measured, Outcome, Record, Report, Shard};
pub use reference::Reference;
pub use run::{Run, Wishes};
pub use suite::{Driver, Fault, Picture, SCHEMA, Suite, default_suite};

pub(crate) use pictures::shown;
pub(crate) use record::{Folder, PICTURES, merged};
