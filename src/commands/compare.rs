//! `vitrum compare`: metrics between two images.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Talk, print};
use crate::compare::{Comparison, Limit, compare};
use crate::image::{OutputFile, decode_stored, encode_png};
use crate::report::CompareReport;
use crate::scene::Files;
use crate::{Error, Result};

/// Options of `vitrum compare`.
#[derive(Debug, Args)]
#[command(after_long_help = METRICS)]
pub(super) struct CompareCommand {
    /// The image under test: .exr, .hdr, .png or .jpg
    #[arg(value_name = "A")]
    test: PathBuf,

    /// The reference, of the same size
    #[arg(value_name = "B")]
    reference: PathBuf,

    /// Exit with 1 where METRIC is above VALUE or not finite: relmse, mse, p99, max or flip (psnr falls where errors grow: limit mse);
    /// may be given several times
    #[arg(long, value_name = "METRIC=VALUE")]
    fail_above: Vec<Limit>,

    /// Write FLIP per pixel in the colours of magma: black where there is no error, pale yellow where it is 1
    #[arg(long, value_name = "OUT.png")]
    map: Option<PathBuf>,

    /// JSON instead of a table
    #[arg(long)]
    json: bool,
}

const METRICS: &str = "Metrics, over pixels and channels of linear values x of A and r of B (sRGB files are decoded):
  relmse: mean((x - r)^2 / (r^2 + 0.01))
  mse: mean((x - r)^2)
  psnr: -10 log10(mse), in dB; inf for equal images
  p99: the |x - r| / (|r| + 0.1) that 99 % of the values keep
  max: the largest |x - r|, and the pixel that has it
  flip: the mean of FLIP, 0 to 1, at 67 pixels per degree: LDR-FLIP where both files hold 8-bit sRGB, else HDR-FLIP
Where a pixel is NaN or infinite, no metric is finite: NaN or inf in the table, null in JSON. docs/compare.md has more.";

impl CompareCommand {
    pub(super) fn run(self, talk: Talk) -> Result<()> {
        let map = self.map.as_deref().map(|path| self.map_file(path)).transpose()?;
        let read = |path: &Path| decode_stored(path, &Files::Disk.read(path)?);
        let found = compare(read(&self.test)?, read(&self.reference)?).map_err(|sizes| {
            let reference = self.reference.display();
            Error::input(&self.test, 0, format!("is {sizes} as the reference {reference}; compare images of one size"))
        })?;

        if let Some(map) = &map {
            let bytes = encode_png(found.width, found.height, &found.error_map(), &self.metadata())
                .map_err(|source| Error::file(map.path(), "write", source))?;
            map.write(&bytes)?;
        }
        let report = CompareReport::new(&self.test, &self.reference, &found);
        if self.json {
            print(&report.json())?;
        } else if !talk.quiet {
            print(&report.table())?;
        }
        if let Some(map) = &map {
            talk.note(&format!("{}: FLIP per pixel", map.path().display()));
        }
        self.verdict(&found)
    }

    /// The file of the error map, which must not replace what is compared.
    fn map_file(&self, path: &Path) -> Result<OutputFile> {
        if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
            return Err(Error::input(path, 0, "the error map is a picture in colours; name it .png"));
        }
        let map = OutputFile::new(path)?;
        if map.replaces(&self.test) || map.replaces(&self.reference) {
            let message = "is read by this comparison and would be replaced; name another file";
            return Err(Error::input(path, 0, message));
        }
        Ok(map)
    }

    fn metadata(&self) -> Vec<(String, String)> {
        [
            ("Software", format!("vitrum {}", env!("CARGO_PKG_VERSION"))),
            ("vitrum:test", self.test.display().to_string()),
            ("vitrum:reference", self.reference.display().to_string()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into()
    }

    fn verdict(&self, found: &Comparison) -> Result<()> {
        let broken: Vec<_> = self.fail_above.iter().filter_map(|limit| limit.broken(found)).collect();
        if broken.is_empty() {
            return Ok(());
        }
        Err(Error::Check(format!("{}: {}", self.test.display(), broken.join("; "))))
    }
}
