//! A CSV file of inputs, and the same with a function's outputs beside them.

use std::path::{Path, PathBuf};

use super::{Function, Probe};
use crate::gpu::Gpu;
use crate::{Error, Result};

/// The rows of a file.
pub struct Table {
    function: &'static Function,
    path: PathBuf,
    header: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
    /// The inputs of each row, packed.
    inputs: Vec<f32>,
}

impl Table {
    /// Reads and checks every row.
    pub fn read(function: &'static Function, path: &Path) -> Result<Self> {
        let text = std::fs::read(path).map_err(|source| Error::file(path, "read", source))?;
        let wrong = |error: &csv::Error| {
            let line = error.position().map_or(0, |position| position.line() as usize);
            let message = match error.kind() {
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    let values = if *len == 1 { "value" } else { "values" };
                    format!("{len} {values}; the header has {expected_len} columns")
                }
                csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text".to_owned(),
                _ => error.to_string(),
            };
            Error::input(path, line, message)
        };
        let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text);
        let mut reader = csv::Reader::from_reader(text);
        let header = reader.headers().map_err(|error| wrong(&error))?.clone();
        if header.is_empty() {
            let wanted = function.inputs.join(",");
            return Err(Error::input(path, 1, format!("no header; the first line names columns: {wanted}")));
        }
        let column = |name: &&str| {
            let mut places = header.iter().enumerate().filter(|(_, column)| column.trim() == *name);
            match (places.next(), places.next()) {
                (Some((place, _)), None) => Ok(place),
                (None, _) => {
                    let wanted = function.inputs.join(",");
                    let one = header.len() == 1 && header[0].contains([';', '\t']);
                    let hint = if one { ", separated by commas" } else { "" };
                    Err(Error::input(path, 1, format!("no column {name:?}; {} needs {wanted}{hint}", function.name)))
                }
                _ => Err(Error::input(path, 1, format!("column {name:?} is there twice; leave one"))),
            }
        };
        let columns = function.inputs.iter().map(column).collect::<Result<Vec<_>>>()?;
        let (mut rows, mut inputs) = (Vec::new(), Vec::new());
        for row in reader.records() {
            let row = row.map_err(|error| wrong(&error))?;
            let line = row.position().map_or(0, |position| position.line() as usize);
            let first = inputs.len();
            for (&place, name) in columns.iter().zip(function.inputs) {
                let text = row[place].trim();
                let value = text.parse::<f32>();
                inputs.push(value.map_err(|_| Error::input(path, line, format!("{name} {text:?} is not a number")))?);
            }
            function.check(&inputs[first..]).map_err(|message| Error::input(path, line, message))?;
            rows.push(row);
        }
        Ok(Self { function, path: path.into(), header, rows, inputs })
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Columns of the file that are called as an output is: they are passed through, and the outputs follow them.
    pub fn shadowed(&self) -> impl Iterator<Item = &'static str> {
        let outputs = self.function.outputs.iter().copied();
        outputs.filter(|name| self.header.iter().any(|column| column.trim() == *name))
    }

    /// The file with the outputs of the device beside the columns, as they were given.
    pub fn evaluate(&self, gpu: &Gpu) -> Result<String> {
        let outputs = Probe::new(gpu, self.function)?.evaluate(&self.inputs)?;
        let mut writer = csv::Writer::from_writer(Vec::new());
        let wrong = |error: csv::Error| Error::file(&self.path, "copy", std::io::Error::other(error));
        writer.write_record(self.header.iter().chain(self.function.outputs.iter().copied())).map_err(wrong)?;
        for (row, values) in self.rows.iter().zip(outputs.chunks(self.function.outputs.len())) {
            let values: Vec<_> = values.iter().copied().map(number).collect();
            writer.write_record(row.iter().chain(values.iter().map(String::as_str))).map_err(wrong)?;
        }
        let bytes = writer.into_inner().map_err(|error| Error::file(&self.path, "copy", error.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// The shortest text that reads back as the same 32-bit float.
fn number(value: f32) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_exactly() {
        for value in [0.0, -0.0, 1.0, 0.1, 1e-45, f32::MIN_POSITIVE, 16_777_217.0, f32::MAX, 1.0 / 3.0, -2.5e-8] {
            assert_eq!(number(value).parse().map(f32::to_bits), Ok(value.to_bits()), "{}", number(value));
        }
        assert_eq!([0.0, 1.0, 0.5].map(number), ["0", "1", "0.5"]);
    }
}
