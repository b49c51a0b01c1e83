//! Options of `render` in a TOML table. In flows the table, out flow [`RenderArgs`].

use std::ffi::OsString;
use std::path::Path;

use super::files::Files;
use super::table::{Entry, FINITE};
use crate::Result;
use crate::options::RenderArgs;

/// Options of `render` in the table `name`: each value is put as on the command line, so that both know the same ranges.
pub fn options(entry: Entry<'_>, name: &str, files: Files, folder: &Path) -> Result<RenderArgs> {
    let names: Vec<_> = RenderArgs::names().iter().map(|name| name.replace('-', "_")).collect();
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    let mut all = RenderArgs::default();
    for entry in entry.table(name, &names)?.entries() {
        let value = option(entry, files, folder)?;
        let option = RenderArgs::one(&entry.key.replace('_', "-"), &value);
        all = option.map_err(|message| entry.error(format!("[{name}]: {message}")))?.or(all);
    }
    Ok(all)
}

fn option(entry: Entry<'_>, files: Files, folder: &Path) -> Result<OsString> {
    let text = match entry.key {
        "env" => return Ok(entry.file(files, folder)?.into()),
        "stats" | "checkpoint" => return Ok(folder.join(entry.text("a file name")?).into()),
        "size" => entry.integers::<2>("width and height, as in [1024, 768]")?.map(|side| side.to_string()).join("x"),
        "effects" | "aov" => entry.texts("names, as in \"a,b\" or [\"a\", \"b\"]")?.join(","),
        "device" => match entry.as_text() {
            Some(name) => name.to_owned(),
            None => entry.integer()?.to_string(),
        },
        "samples" | "max_depth" | "seed" => entry.integers::<1>("a whole number")?[0].to_string(),
        "validation" | "flipped_ratio" | "repair" => entry.boolean()?.to_string(),
        "model" | "tonemap" | "trace" => entry.text("a name")?.to_owned(),
        _ => entry.number(&FINITE)?.to_string(),
    };
    Ok(text.into())
}
