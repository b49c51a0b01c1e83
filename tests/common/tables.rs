//! The tables in `tests/data`; its SOURCES.md says where they come from.

use std::path::Path;

/// A table by columns' names.
pub struct Table {
    header: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
}

impl Table {
    fn read(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
        let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let header = reader.headers().expect("a header").clone();
        Self { header, rows: reader.records().map(|row| row.expect("a row as long as the header")).collect() }
    }

    fn column(&self, name: &str) -> usize {
        self.header.iter().position(|column| column == name).unwrap_or_else(|| panic!("no column {name}"))
    }

    fn numbers<const N: usize>(&self, names: [&str; N]) -> impl Iterator<Item = [f64; N]> {
        let columns = names.map(|name| self.column(name));
        self.rows.iter().map(move |row| columns.map(|i| row[i].parse().expect("a number")))
    }
}

/// A row of `fresnel_exact.csv`.
#[derive(Clone, Debug)]
pub struct ExactFresnel {
    pub kind: String,
    pub eta: f64,
    pub cos_i: f64,
    pub reflectance: f64,
    pub transmittance: f64,
    pub cos_t: f64,
}

impl ExactFresnel {
    pub fn all() -> Vec<Self> {
        let table = Table::read("fresnel_exact.csv");
        let kind = table.column("kind");
        let numbers = table.numbers(["eta", "cos_i", "F", "one_minus_F", "cos_t"]);
        let row = |(row, [eta, cos_i, reflectance, transmittance, cos_t]): (&csv::StringRecord, [f64; 5])| Self {
            kind: row[kind].to_owned(),
            eta,
            cos_i,
            reflectance,
            transmittance,
            cos_t,
        };
        table.rows.iter().zip(numbers).map(row).collect()
    }

    /// Light is totally reflected: nothing passes, though the indices differ and light does not graze.
    pub fn is_total(&self) -> bool {
        self.cos_t == 0.0 && self.eta != 1.0
    }
}

/// A row of `rough_albedo.csv`.
#[derive(Clone, Copy, Debug)]
pub struct Albedo {
    pub alpha: f64,
    pub eta: f64,
    pub cos_i: f64,
    pub reflected: f64,
    pub transmitted: f64,
}

impl Albedo {
    /// Samples behind each row.
    pub const SAMPLES: f64 = 65536.0;

    pub fn all() -> Vec<Self> {
        let table = Table::read("rough_albedo.csv");
        let numbers = table.numbers(["alpha", "eta", "cos_i", "albedo_R", "albedo_T"]);
        let row =
            |[alpha, eta, cos_i, reflected, transmitted]: [f64; 5]| Self { alpha, eta, cos_i, reflected, transmitted };
        numbers.map(row).collect()
    }
}

/// How far a mean of `samples` numbers from 0 to 1 may be from `mean`: so many standard errors, of which a yes or no has the
/// largest, and 4 single samples, for means so small that few samples see anything. By Bernstein's inequality more than 5 errors
/// happen once in a million.
pub fn noise(mean: f64, samples: f64, errors: f64) -> f64 {
    errors * (mean * (1.0 - mean).max(0.0) / samples).sqrt() + 4.0 / samples
}
