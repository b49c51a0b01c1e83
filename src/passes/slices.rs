//! Pictures in slices of rows: a GPU's watchdog stays calm, and so does whoever waits at the screen.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::gpu::Commands;

/// Hears after each slice how many rows are done, and says whether to go on.
pub(super) type AfterRows<'a> = dyn FnMut(&mut Commands, u32) -> crate::Result<ControlFlow<()>> + 'a;

/// Rows of a workgroup.
pub(super) const GROUP: u32 = 8;

/// How high the next slice is: as the last one's time suggests.
pub(super) struct Slices {
    rows: u32,
}

impl Slices {
    pub(super) fn new() -> Self {
        Self { rows: 2 * GROUP }
    }

    /// Rows of the next slice, a multiple of [`GROUP`], if so many are left.
    pub(super) fn next(&self, left: u32) -> u32 {
        self.rows.min(left.next_multiple_of(GROUP))
    }

    /// Learns from a slice of so many rows of a picture of such a height, where one should take `aim`.
    pub(super) fn took(&mut self, rows: u32, time: Duration, height: u32, aim: Duration) {
        if time < aim / 2 {
            self.rows = rows.saturating_mul(2).min(height.next_multiple_of(GROUP));
        } else if time > aim * 2 {
            self.halve(rows);
        }
    }

    /// Makes slices half as high as one of so many rows.
    pub(super) fn halve(&mut self, rows: u32) {
        self.rows = (rows / 2).next_multiple_of(GROUP).max(GROUP);
    }
}
