//! Tables of a TOML file, read key by key. In flow a parsed table and the keys that are allowed, out flow values in
//! range or errors with file and line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::files::Files;
use crate::{Error, Result};

/// A file and its text, for the lines in errors.
#[derive(Clone, Copy)]
pub struct Document<'a> {
    /// The file.
    pub path: &'a Path,
    /// Its content.
    pub text: &'a str,
}

/// The text of the file at `path`.
pub fn text<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str> {
    std::str::from_utf8(bytes).map_err(|error| {
        let line = bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count() + 1;
        Error::input(path, line, "is not UTF-8 text; save it as UTF-8")
    })
}

impl<'a> Document<'a> {
    /// The whole of it, as TOML.
    pub fn parse(&self) -> Result<Spanned<DeTable<'a>>> {
        DeTable::parse(self.text)
            .map_err(|error| self.error(error.span().unwrap_or(0..0), error.message().replace('\n', ", ")))
    }
}

impl Document<'_> {
    /// An error at the line where `span` starts.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        Error::input(self.path, line, message)
    }
}

/// A value and the key that it stands behind.
#[derive(Clone, Copy)]
pub struct Entry<'a> {
    /// The file it is in.
    pub document: Document<'a>,
    /// The key, for messages.
    pub key: &'a str,
    value: &'a Spanned<DeValue<'a>>,
}

/// A table whose keys are all allowed.
#[derive(Clone, Copy)]
pub struct Table<'a> {
    /// The file it is in.
    pub document: Document<'a>,
    name: &'a str,
    span: (usize, usize),
    entries: &'a DeTable<'a>,
}

/// Which numbers are right, and how to say so.
pub struct Rule {
    /// What is expected.
    pub wanted: &'static str,
    /// Whether a number is.
    pub holds: fn(f64) -> bool,
}

/// Any number but NaN and the infinities.
pub const FINITE: Rule = Rule { wanted: "a finite number", holds: f64::is_finite };
/// Numbers that 32 bits hold as something finite above 0.
pub const POSITIVE: Rule = Rule { wanted: "a number above 0", holds: |x| x > 0.0 && (x as f32).is_normal() };
/// As [`POSITIVE`], or infinity.
pub const POSITIVE_OR_INFINITE: Rule =
    Rule { wanted: "a number above 0, or inf", holds: |x| x == f64::INFINITY || (POSITIVE.holds)(x) };
/// An index of refraction; what lies beyond has squares that 32 bits do not hold.
pub const INDEX: Rule =
    Rule { wanted: "a number above 0, from 1e-6 to 1e6, or the name of a glass", holds: |x| (1e-6..=1e6).contains(&x) };
/// From 0 to 1.
pub const UNIT: Rule = Rule { wanted: "a number from 0 to 1", holds: |x| (0.0..=1.0).contains(&x) };
/// What is wrong with a strength of nothing.
pub const NO_NORMALS: &str = "normal_scale needs a normal_texture, whose strength it is";
/// Factors of slopes.
pub const STRENGTH: Rule = Rule { wanted: "a number from -1000 to 1000", holds: |x| x.abs() <= 1e3 };
/// Radiance, intensity and their factors.
pub const LIGHT: Rule = Rule { wanted: "a number from 0 to 1e9", holds: |x| (0.0..=1e9).contains(&x) };
/// A coordinate.
pub const LENGTH: Rule =
    Rule { wanted: "a number of metres from -1e9 to 1e9", holds: |x| x.abs() <= super::mesh::FARTHEST };
/// A scale, which may mirror.
pub const SCALE: Rule =
    Rule { wanted: "a number other than 0 from -1e9 to 1e9", holds: |x| (1e-9..=1e9).contains(&x.abs()) };
/// An angle off an axis in degrees.
pub const HALF_ANGLE: Rule = Rule { wanted: "an angle from 0 to 90 degrees", holds: |x| (0.0..=90.0).contains(&x) };
/// A field of view in degrees.
pub const FIELD: Rule = Rule { wanted: "an angle above 0 and below 180 degrees", holds: |x| x > 0.0 && x < 180.0 };

impl<'a> Table<'a> {
    /// The table that is the whole document.
    pub fn root(document: Document<'a>, table: &'a Spanned<DeTable<'a>>, allowed: &[&str]) -> Result<Self> {
        let span = table.span();
        Self { document, name: "", span: (span.start, span.end), entries: table.get_ref() }.allowing(allowed)
    }

    fn allowing(self, allowed: &[&str]) -> Result<Self> {
        // Tables are sorted by key; the reader looks for the first fault in the file.
        let unknown = self.entries.keys().filter(|key| !allowed.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(self),
            Some(key) => {
                let message =
                    format!("unknown key {:?}{}; allowed here: {}", key.get_ref(), self.place(), allowed.join(", "));
                Err(self.document.error(key.span(), message))
            }
        }
    }

    /// ` in [camera]`, or nothing at the root.
    fn place(&self) -> String {
        if self.name.is_empty() { String::new() } else { format!(" in [{}]", self.name) }
    }

    /// An error about the table as a whole.
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.document.error(self.span.0..self.span.1, message)
    }

    /// The value of `key`, if there is one.
    pub fn get(&self, key: &'a str) -> Option<Entry<'a>> {
        let (_, value) = self.entries.iter().find(|(known, _)| known.get_ref() == key)?;
        Some(Entry { document: self.document, key, value })
    }

    /// The value of `key`, or an error that asks for it.
    pub fn require(&self, key: &'a str) -> Result<Entry<'a>> {
        self.get(key).ok_or_else(|| self.error(format!("missing key {key:?}{}", self.place())))
    }

    /// The value of `key` read with `read`, or `default`.
    pub fn or<T>(&self, key: &'a str, default: T, read: impl FnOnce(Entry<'a>) -> Result<T>) -> Result<T> {
        self.get(key).map_or(Ok(default), read)
    }

    /// Keys and values, in the order of the file.
    pub fn entries(&self) -> Vec<Entry<'a>> {
        let mut entries: Vec<_> = self.entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let entry = |(key, value): (&'a Spanned<_>, _)| {
            let key: &'a std::borrow::Cow<'a, str> = key.get_ref();
            Entry { document: self.document, key: key.as_ref(), value }
        };
        entries.into_iter().map(entry).collect()
    }
}

impl<'a> Entry<'a> {
    /// An error at this value.
    pub fn error(&self, message: impl Into<String>) -> Error {
        self.document.error(self.value.span(), message)
    }

    fn unexpected(&self, wanted: &str) -> Error {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("{text:?}"),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Datetime(_) => "a date".into(),
            DeValue::Array(array) => format!("an array of {}", array.len()),
            DeValue::Table(_) => "a table".into(),
        };
        self.error(format!("{}: expected {wanted}, found {found}", self.key))
    }

    /// A table with these keys; `name` is what stands in its header.
    pub fn table(&self, name: &'a str, allowed: &[&str]) -> Result<Table<'a>> {
        match self.value.get_ref() {
            DeValue::Table(entries) => {
                let span = self.value.span();
                Table { document: self.document, name, span: (span.start, span.end), entries }.allowing(allowed)
            }
            _ => Err(self.unexpected(&format!("a table, [{name}]"))),
        }
    }

    /// The keys of the table with the name `name`, whatever they are.
    pub fn any_table(&self, name: &'a str) -> Result<Table<'a>> {
        match self.value.get_ref() {
            DeValue::Table(entries) => {
                let span = self.value.span();
                Ok(Table { document: self.document, name, span: (span.start, span.end), entries })
            }
            _ => Err(self.unexpected(&format!("a table, [{name}]"))),
        }
    }

    /// The values of an array of tables.
    pub fn tables(&self) -> Result<Vec<Entry<'a>>> {
        match self.value.get_ref() {
            DeValue::Array(array) => Ok(array.iter().map(|value| Entry { value, ..*self }).collect()),
            _ => Err(self.unexpected(&format!("tables, each headed [[{}]]", self.key))),
        }
    }

    fn as_number(&self) -> Option<f64> {
        match self.value.get_ref() {
            DeValue::Float(number) => number.as_str().parse().ok(),
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix()).ok().map(|n| n as f64),
            _ => None,
        }
    }

    /// A number that `rule` holds for.
    pub fn number(&self, rule: &Rule) -> Result<f64> {
        self.as_number().filter(|&number| (rule.holds)(number)).ok_or_else(|| self.unexpected(rule.wanted))
    }

    /// Three numbers that `rule` holds for.
    pub fn triple(&self, rule: &Rule) -> Result<DVec3> {
        let DeValue::Array(array) = self.value.get_ref() else {
            return Err(self.unexpected(&format!("three numbers, each {}", rule.wanted)));
        };
        if array.len() != 3 {
            return Err(self.unexpected("three numbers"));
        }
        let mut numbers = [0.0; 3];
        for (number, value) in numbers.iter_mut().zip(array) {
            *number = Entry { value, ..*self }.number(rule)?;
        }
        Ok(numbers.into())
    }

    /// One number for all three axes, or three.
    pub fn number_or_triple(&self, rule: &Rule) -> Result<DVec3> {
        match self.value.get_ref() {
            DeValue::Array(_) => self.triple(rule),
            _ => self.number(rule).map(DVec3::splat),
        }
    }

    fn as_integer(&self) -> Option<i64> {
        match self.value.get_ref() {
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        }
    }

    /// A whole number of 32 bits.
    pub fn integer(&self) -> Result<i32> {
        let integer = self.as_integer().and_then(|integer| integer.try_into().ok());
        integer.ok_or_else(|| self.unexpected("a whole number from -2147483648 to 2147483647"))
    }

    /// A whole number, or an array of `N` where `N` is not 1.
    pub fn integers<const N: usize>(&self, wanted: &str) -> Result<[i64; N]> {
        let integers: Option<Vec<i64>> = match self.value.get_ref() {
            DeValue::Array(array) if N != 1 => {
                array.iter().map(|value| Entry { value, ..*self }.as_integer()).collect()
            }
            _ => self.as_integer().map(|integer| vec![integer]),
        };
        integers.and_then(|integers| integers.try_into().ok()).ok_or_else(|| self.unexpected(wanted))
    }

    /// A text, or several.
    pub fn texts(&self, wanted: &str) -> Result<Vec<&'a str>> {
        let texts: Option<Vec<&str>> = match self.value.get_ref() {
            DeValue::Array(array) => array.iter().map(|value| value.get_ref().as_str()).collect(),
            _ => self.as_text().map(|text| vec![text]),
        };
        texts.ok_or_else(|| self.unexpected(wanted))
    }

    /// True or false.
    pub fn boolean(&self) -> Result<bool> {
        self.value.get_ref().as_bool().ok_or_else(|| self.unexpected("true or false"))
    }

    /// The text, if it is one.
    pub fn as_text(&self) -> Option<&'a str> {
        self.value.get_ref().as_str()
    }

    /// A text that is not empty.
    pub fn text(&self, wanted: &str) -> Result<&'a str> {
        self.as_text().filter(|text| !text.is_empty()).ok_or_else(|| self.unexpected(wanted))
    }

    /// A file that exists, in `folder` where its name does not say otherwise.
    pub fn file(&self, files: Files, folder: &Path) -> Result<PathBuf> {
        let path = folder.join(self.text("a file name")?);
        if files.exists(&path) {
            return Ok(path);
        }
        let why = match path.metadata() {
            Ok(metadata) if metadata.is_dir() => "is a folder, not a file",
            Ok(_) => "is no regular file",
            Err(_) => "does not exist",
        };
        Err(self.error(format!("{}: {:?} {why}", self.key, path.display().to_string())))
    }

    /// One of the words of `choices`.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T> {
        let chosen = self.as_text().and_then(|text| choices.iter().find(|(word, _)| *word == text));
        chosen.map(|&(_, choice)| choice).ok_or_else(|| {
            let words: Vec<_> = choices.iter().map(|(word, _)| format!("{word:?}")).collect();
            self.unexpected(&words.join(" or "))
        })
    }
}
