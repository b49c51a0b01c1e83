//! Pictures in slices: a GPU's watchdog stays calm, and so does whoever waits at the screen.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::gpu::Commands;

/// Rows of a workgroup.
pub(super) const GROUP: u32 = 8;

/// How far a round is: whole rows, and columns of the [`GROUP`] of rows after them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) row: u32,
    pub(super) column: u32,
}

/// Hears after each slice how far the round is, and says whether to go on.
pub(super) type AfterSlice<'a> = dyn FnMut(&mut Commands, Place) -> crate::Result<ControlFlow<()>> + 'a;

/// Some rows, or a part of the columns of one [`GROUP`] of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slice {
    pub(super) at: Place,
    /// A multiple of [`GROUP`]; the last may lie below the picture.
    pub(super) rows: u32,
    pub(super) columns: u32,
    /// Samples of its pixels.
    work: f64,
}

impl Slice {
    /// Where the next one of a picture of that width starts.
    pub(super) fn end(&self, width: u32) -> Place {
        match self.at.column + self.columns {
            column if column < width => Place { column, ..self.at },
            _ => Place { row: self.at.row + self.rows, column: 0 },
        }
    }
}

/// How much the next slice holds: as the last one's time suggests.
pub(super) struct Slices {
    /// Columns come in multiples of this.
    grain: u32,
    /// Samples of pixels.
    most: f64,
}

/// Samples of the first slice.
const FIRST: f64 = 8192.0;

impl Slices {
    pub(super) fn new(grain: u32) -> Self {
        Self { grain, most: FIRST }
    }

    /// The slice at a place of a picture, each of whose pixels takes so many samples.
    pub(super) fn next(&self, at: Place, [width, height]: [u32; 2], samples: u32) -> Slice {
        let pixels = self.most / f64::from(samples);
        let groups = (pixels / f64::from(width) / f64::from(GROUP)) as u32;
        let (rows, columns) = if at.column == 0 && groups > 0 {
            (groups.saturating_mul(GROUP).min((height - at.row).next_multiple_of(GROUP)), width)
        } else {
            let grains = (pixels / f64::from(GROUP * self.grain)) as u32;
            (GROUP, (grains.max(1) * self.grain).min(width - at.column))
        };
        let work = f64::from(rows) * f64::from(columns) * f64::from(samples);
        Slice { at, rows, columns, work }
    }

    /// Learns from the time of a slice, where one should take `aim`.
    pub(super) fn took(&mut self, slice: &Slice, time: Duration, aim: Duration) {
        if time < aim / 2 {
            self.most = self.most.max(2.0 * slice.work);
        } else if time > aim * 2 {
            self.halve(slice);
        }
    }

    /// Makes slices half as large as that one.
    pub(super) fn halve(&mut self, slice: &Slice) {
        self.most = 0.5 * slice.work;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_cover_a_picture_once_and_take_their_time() {
        for (width, height, samples, grain) in [(1280, 720, 16, 8), (33, 17, 1, 64), (1, 1, 4, 8), (200, 9, 4, 64)] {
            let mut slices = Slices::new(grain);
            let mut seen = vec![0; width as usize * (height as usize + 8)];
            let (mut at, mut longest) = (Place::default(), Duration::ZERO);
            while at.row < height {
                let slice = slices.next(at, [width, height], samples);
                for y in at.row..at.row + slice.rows {
                    for x in at.column..at.column + slice.columns {
                        seen[(y * width + x) as usize] += 1;
                    }
                }
                // A sample of a pixel takes 20 microseconds.
                let time = Duration::from_secs_f64(2e-5 * slice.work);
                longest = longest.max(time);
                slices.took(&slice, time, Duration::from_millis(25));
                at = slice.end(width);
            }
            assert!(seen[..(width * height) as usize].iter().all(|&times| times == 1), "{width}x{height}");
            assert!(longest < Duration::from_millis(170), "{longest:?}");
        }
    }
}
