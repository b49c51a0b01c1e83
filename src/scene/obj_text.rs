//! Tidies the text of an OBJ file for `tobj`. In flow the text as found, out flows one that `tobj` reads right, or the
//! line that is wrong.
//!
//! `tobj` takes polylines for polygons, mixes up normals and texture coordinates where some corners have none, divides
//! by w, overflows on hostile indices, and has no line numbers. So indices are resolved and checked here, all vertices
//! come first, corners without a normal get one of zero, and those without texture coordinates NaN: [`super::mesh`]
//! replaces both.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use super::mesh::FARTHEST;

/// What an OBJ file says, in a form without traps.
#[derive(Debug, Default)]
pub struct Tidy {
    /// OBJ text of `mtllib`, `v`, `vt`, `vn`, `o`, `usemtl` and `f` lines, each with absolute indices.
    pub text: String,
    /// File names after `mtllib`, each line once.
    pub libraries: Vec<String>,
    /// Names after `usemtl`, each once.
    pub materials: Vec<String>,
    /// What was left out, one line each.
    pub remarks: Vec<String>,
    /// Whether there are smoothing groups and no normals: that of each corner is the number of its group then, those of faces in none being
    /// groups of their own.
    pub grouped: bool,
    /// How many groups there are.
    groups: usize,
}

/// Smoothing groups, as lines that begin with `s` open them.
#[derive(Default)]
struct Groups {
    /// In the order of their first faces.
    numbers: HashMap<String, usize>,
    current: Option<String>,
    /// Faces in none so far.
    flat: usize,
}

impl Groups {
    fn open(&mut self, name: &str) {
        self.current = Some(name).filter(|name| !["", "0", "off"].contains(name)).map(str::to_owned);
    }

    /// The number of the next face's group, or that it is in none and how many were before it.
    fn face(&mut self) -> Result<usize, usize> {
        match &self.current {
            Some(name) => {
                let next = self.numbers.len();
                Ok(*self.numbers.entry(name.clone()).or_insert(next))
            }
            None => {
                self.flat += 1;
                Err(self.flat - 1)
            }
        }
    }
}

/// A line, from 1, and what is wrong with it.
pub type Fault = (usize, String);

/// How many vertices, texture coordinates and normals there are.
type Counts = [usize; 3];

/// A kind of line that faces refer to.
struct Kind {
    keyword: &'static str,
    /// How it is written, for messages.
    form: &'static str,
    /// How many of its numbers count.
    kept: usize,
    /// How many must be there; the rest are 0.
    needed: usize,
}

/// In the order of [`Counts`].
const KINDS: [Kind; 3] = [
    Kind { keyword: "v", form: "v X Y Z", kept: 3, needed: 3 },
    // A third number is for images with depth.
    Kind { keyword: "vt", form: "vt U V", kept: 2, needed: 1 },
    Kind { keyword: "vn", form: "vn X Y Z", kept: 3, needed: 3 },
];

/// Keywords that say nothing about triangles.
const SILENT: [&str; 11] =
    ["vp", "g", "mg", "lod", "bevel", "c_interp", "d_interp", "usemap", "maplib", "shadow_obj", "trace_obj"];

/// Keywords of geometry that is no polygon.
const FREE_FORM: [&str; 14] =
    ["cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con"];

impl Tidy {
    /// Tidies `text`.
    pub fn new(text: &str) -> Result<Self, Fault> {
        let mut tidy = Self { text: String::with_capacity(text.len() + 64), ..Self::default() };
        tidy.text.push_str("mtllib -\n");
        let totals = tidy.vertices(text)?;
        tidy.faces(text, totals)?;
        Ok(tidy)
    }

    /// Writes the lines of vertices, texture coordinates and normals, and behind them those for corners without.
    fn vertices(&mut self, text: &str) -> Result<Counts, Fault> {
        let mut counts = [0; 3];
        let mut blocks = [std::mem::take(&mut self.text), String::new(), String::new()];
        let mut groups = Groups::default();
        for (number, line) in lines(text) {
            let (keyword, rest) = split_keyword(&line);
            match keyword {
                "s" => groups.open(rest),
                "f" | "fo" => drop(groups.face()),
                _ => {}
            }
            let Some((index, kind)) = kind_of(keyword) else { continue };
            counts[index] += 1;
            let out = &mut blocks[index];
            out.push_str(keyword);
            let mut numbers = rest.split_ascii_whitespace();
            for place in 0..kind.kept {
                let Some(word) = numbers.next().or((place >= kind.needed).then_some("0")) else {
                    return Err((number, format!("{:?} lacks a number; expected {}", excerpt(&line), kind.form)));
                };
                out.push(' ');
                out.push_str(word);
            }
            out.push('\n');
        }
        let [vertices, coordinates, normals] = blocks;
        self.text = vertices;
        for rest in [&coordinates, "vt nan nan\n", &normals, "vn 0 0 0\n"] {
            self.text.push_str(rest);
        }
        self.grouped = counts[2] == 0 && !groups.numbers.is_empty();
        if self.grouped {
            // One is there already. By their numbers they are known again.
            for number in 1..groups.numbers.len() + groups.flat {
                let _ = writeln!(self.text, "vn {number} 0 0");
            }
            self.groups = groups.numbers.len();
        }
        Ok(counts)
    }

    /// Writes the faces and what names them.
    fn faces(&mut self, text: &str, totals: Counts) -> Result<(), Fault> {
        let mut counts = [0; 3];
        let mut used = vec![false; totals[0]];
        let (mut slivers, mut wires, mut free_form, mut unknown) = (0, 0, 0, Vec::new());
        let (mut libraries, mut materials) = (HashSet::new(), HashSet::new());
        let mut out_of_range: Vec<Fault> = Vec::new();
        let mut groups = Groups::default();
        for (number, line) in lines(text) {
            let (keyword, rest) = split_keyword(&line);
            match keyword {
                "s" => groups.open(rest),
                "f" | "fo" => {
                    let group = groups.face().unwrap_or_else(|flat| self.groups + flat);
                    let corners: Result<Vec<_>, _> =
                        rest.split_ascii_whitespace().map(|corner| Corner::read(corner, counts, totals)).collect();
                    match corners {
                        Err(why) if why.malformed => {
                            return Err((number, format!("{:?}: {}", excerpt(&line), why.message)));
                        }
                        Err(why) => out_of_range.push((number, why.message)),
                        Ok(corners) if corners.len() < 3 => slivers += 1,
                        Ok(corners) => {
                            corners.iter().for_each(|corner| used[corner.vertex] = true);
                            self.face(&corners, totals, group);
                        }
                    }
                }
                "v" => counts[0] += 1,
                "vt" => counts[1] += 1,
                "vn" => counts[2] += 1,
                "o" => self.name("o", rest),
                "usemtl" => {
                    self.name("usemtl", rest);
                    remember(&mut materials, &mut self.materials, rest);
                }
                "mtllib" => remember(&mut libraries, &mut self.libraries, rest),
                "l" | "p" => wires += 1,
                "" => {}
                comment if comment.starts_with('#') => {}
                other if SILENT.contains(&other) => {}
                other if FREE_FORM.contains(&other) => free_form += 1,
                _ => unknown.push(number),
            }
        }
        if let Some((line, message)) = out_of_range.first() {
            let others = out_of_range.len() - 1;
            return Err((
                *line,
                if others == 0 { message.clone() } else { format!("{message}; so do {others} more faces") },
            ));
        }
        for (count, one, many) in [
            (slivers, "face with less than three corners", "faces with less than three corners"),
            (wires, "line or point, as only faces are shown,", "lines and points, as only faces are shown,"),
            (
                free_form,
                "line of free-form geometry, which should be triangles,",
                "lines of free-form geometry, which should be triangles,",
            ),
            (unknown.len(), "line not understood", "lines not understood"),
        ] {
            if count > 0 {
                self.remarks.push(format!("{count} {} left out", if count == 1 { one } else { many }));
            }
        }
        if let (Some(first), Some(remark)) = (unknown.first(), self.remarks.last_mut()) {
            remark.push_str(&format!(", the first is line {first}"));
        }
        Ok(())
    }

    fn name(&mut self, keyword: &str, name: &str) {
        if !name.is_empty() {
            for part in [keyword, " ", name, "\n"] {
                self.text.push_str(part);
            }
        }
    }

    /// A face whose corners without texture coordinates or a normal get those at the end of all.
    fn face(&mut self, corners: &[Corner<'_>], [_, coordinates, normals]: Counts, group: usize) {
        self.text.push('f');
        let has_normals = normals > 0 || self.grouped;
        let other = if self.grouped { group } else { normals };
        for corner in corners {
            self.text.push(' ');
            push_index(&mut self.text, corner.vertex_text, corner.vertex);
            if coordinates > 0 || has_normals {
                self.text.push('/');
            }
            if coordinates > 0 {
                push_index(&mut self.text, corner.coordinate_text, corner.coordinate.unwrap_or(coordinates));
            }
            if has_normals {
                self.text.push('/');
                push_index(&mut self.text, corner.normal_text, corner.normal.unwrap_or(other));
            }
        }
        self.text.push('\n');
    }
}

fn kind_of(keyword: &str) -> Option<(usize, &'static Kind)> {
    KINDS.iter().enumerate().find(|(_, kind)| kind.keyword == keyword)
}

/// Appends the index, from 0, as OBJ counts it; `text` is what stood there.
fn push_index(out: &mut String, text: &str, index: usize) {
    // Copying digits is several times faster than printing them.
    if text.starts_with(|digit: char| digit.is_ascii_digit()) {
        out.push_str(text);
    } else {
        let _ = write!(out, "{}", index + 1);
    }
}

fn remember(known: &mut HashSet<String>, names: &mut Vec<String>, name: &str) {
    if !name.is_empty() && !known.contains(name) {
        known.insert(name.to_owned());
        names.push(name.to_owned());
    }
}

/// One corner of a face: indices from 0, and as they stood.
struct Corner<'a> {
    vertex: usize,
    vertex_text: &'a str,
    coordinate: Option<usize>,
    coordinate_text: &'a str,
    normal: Option<usize>,
    normal_text: &'a str,
}

struct BadCorner {
    malformed: bool,
    message: String,
}

impl<'a> Corner<'a> {
    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`. Negative indices count back from `so_far`.
    fn read(text: &'a str, so_far: Counts, totals: Counts) -> Result<Self, BadCorner> {
        let mut fields = text.split('/');
        let [vertex_text, coordinate_text, normal_text] = [(); 3].map(|()| fields.next().unwrap_or(""));
        if fields.next().is_some() || vertex_text.is_empty() {
            let message = format!("{text:?} is no corner; expected V, V/VT, V//VN or V/VT/VN");
            return Err(BadCorner { malformed: true, message });
        }
        let index = |text: &str, kind: usize| {
            resolve(text, ["vertex", "texture coordinate", "normal"][kind], so_far[kind], totals[kind])
        };
        let vertex = index(vertex_text, 0)?;
        let coordinate = if coordinate_text.is_empty() { None } else { Some(index(coordinate_text, 1)?) };
        let normal = if normal_text.is_empty() { None } else { Some(index(normal_text, 2)?) };
        Ok(Self { vertex, vertex_text, coordinate, coordinate_text, normal, normal_text })
    }
}

fn resolve(text: &str, what: &str, so_far: usize, total: usize) -> Result<usize, BadCorner> {
    let number: i64 = text.parse().map_err(|_| BadCorner {
        malformed: true,
        message: format!("{text:?} is no index; expected a whole number from 1, or below 0 to count back"),
    })?;
    let index = if number < 0 { so_far as i64 + number } else { number - 1 };
    if (0..total as i64).contains(&index) {
        return Ok(index as usize);
    }
    let message = format!("a face names {what} {number}, which does not exist (the file has {total})");
    Err(BadCorner { malformed: false, message })
}

/// The first line of a vertex, texture coordinate or normal that holds no number or, for a vertex, one that cannot be
/// used.
pub fn bad_number(text: &str) -> Option<Fault> {
    let mut first: Option<Fault> = None;
    let mut count = 0;
    for (number, line) in lines(text) {
        let (keyword, rest) = split_keyword(&line);
        let Some((_, kind)) = kind_of(keyword) else { continue };
        for word in rest.split_ascii_whitespace().take(kind.kept) {
            match word.parse::<f32>() {
                Err(_) => return Some((number, format!("{:?} is no number; expected {}", excerpt(word), kind.form))),
                Ok(value) if keyword == "v" && (value.is_nan() || f64::from(value.abs()) > FARTHEST) => {
                    count += 1;
                    first.get_or_insert_with(|| {
                        let wanted = format!("coordinates must be finite and not beyond {FARTHEST:e}");
                        (number, format!("vertex coordinate {}: {wanted}", excerpt(word)))
                    });
                    break;
                }
                Ok(_) => {}
            }
        }
    }
    let (line, message) = first?;
    Some((line, if count == 1 { message } else { format!("{message}; so in {count} vertices") }))
}

/// Lines with their number from 1; a backslash at the end joins the next one.
fn lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, line) = lines.next()?;
        let Some(start) = line.strip_suffix('\\') else { return Some((index + 1, Cow::Borrowed(line))) };
        let mut joined = start.to_owned();
        for (_, next) in lines.by_ref() {
            joined.push(' ');
            match next.strip_suffix('\\') {
                Some(middle) => joined.push_str(middle),
                None => {
                    joined.push_str(next);
                    break;
                }
            }
        }
        Some((index + 1, Cow::Owned(joined)))
    })
}

/// The first word and the rest, both without space around.
fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(|c: char| c.is_ascii_whitespace()).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim()))
}

/// Enough of a line to recognise it in a message.
fn excerpt(line: &str) -> String {
    const LONGEST: usize = 60;
    match line.trim().char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &line.trim()[..end]),
        None => line.trim().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    fn tidy(text: &str) -> Tidy {
        Tidy::new(text).unwrap()
    }

    fn fault(text: &str) -> Fault {
        Tidy::new(text).unwrap_err()
    }

    #[test]
    fn what_tobj_misreads_is_rewritten() {
        let text = "v 0 0 0 1 2 3 9\nv 1 0 0 5\nv 0 1 \\\n0\nvt 0 0\nvn 0 0 1\nf -3/1/1 -2 +3//-1\nl 1 2 3\n";
        let expected = "mtllib -\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt nan nan\nvn 0 0 1\nvn 0 0 0\n\
            f 1/1/1 2/2/2 3/2/1\n";
        assert_eq!(tidy(text).text, expected);
        assert_eq!(tidy(text).remarks, ["1 line or point, as only faces are shown, left out"]);
    }

    #[test]
    fn corners_name_what_the_file_has() {
        let last = |text: &str| tidy(&format!("{text}{TRIANGLE}")).text.lines().last().map(str::to_owned).unwrap();
        assert_eq!(last("f 1 2 3\n"), "f 1 2 3");
        assert_eq!(last("vt 0 0\nf 1/1 2 3\n"), "f 1/1 2/2 3/2");
        assert_eq!(last("vn 0 0 1\nf 1//1 2 3\n"), "f 1//1 2//2 3//2");
        assert_eq!(last("vt 0\nvn 0 0 1\nf 1/1 2//-1 3/-1/1\n"), "f 1/1/2 2/2/1 3/1/1");
    }

    #[test]
    fn texture_coordinates_have_two_numbers() {
        assert!(tidy(&format!("vt 0.5\nvt 1 2 3\n{TRIANGLE}")).text.contains("\nvt 0.5 0\nvt 1 2\nvt nan nan\n"));
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        let text = format!("usemtl red\tglass\nf 1 2 3\n{TRIANGLE}");
        assert!(tidy(&text).text.ends_with("vn 0 0 0\nusemtl red\tglass\nf 1 2 3\n"));
        assert_eq!(tidy(&text).materials, ["red\tglass"]);
    }

    #[test]
    fn indices_out_of_range_are_counted_with_the_first_line() {
        let (line, message) = fault(&format!("{TRIANGLE}f 1 2 3\nf 1 2 4\nf 0 1 2\nf 1 2 3//1\n"));
        assert_eq!(line, 5);
        assert_eq!(message, "a face names vertex 4, which does not exist (the file has 3); so do 2 more faces");
        assert!(fault(&format!("f -1 2 3\n{TRIANGLE}")).1.contains("vertex -1"));
        assert!(fault(&format!("{TRIANGLE}f 1/1 2/1 3/1\n")).1.contains("texture coordinate 1"));
    }

    #[test]
    fn malformed_lines_are_named() {
        for (line, expected) in [
            ("f 1 2 x", "\"f 1 2 x\": \"x\" is no index"),
            ("f 1 2 99999999999999999999", "is no index"),
            ("f 1/1/1/1 2 3", "is no corner"),
            ("f /1 2 3", "is no corner"),
            ("v 1 2", "\"v 1 2\" lacks a number; expected v X Y Z"),
            ("vn", "expected vn X Y Z"),
            ("vt", "\"vt\" lacks a number; expected vt U V"),
        ] {
            let (number, message) = fault(&format!("{TRIANGLE}{line}\n"));
            assert_eq!(number, 4);
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn what_is_left_out_is_counted() {
        let text = format!("{TRIANGLE}v 5 5 5\nf 1 2\nf\nf 1 2 3\np 1\ncurv 0 1 1 2\n% hello\n\u{1}\u{2}\n");
        assert_eq!(
            tidy(&text).remarks,
            [
                "2 faces with less than three corners left out",
                "1 line or point, as only faces are shown, left out",
                "1 line of free-form geometry, which should be triangles, left out",
                "2 lines not understood left out, the first is line 10",
            ]
        );
    }

    #[test]
    fn bad_numbers_are_found_with_their_count() {
        let (line, message) = bad_number("v 0 0 0\nv 0 nan 0\nv 1e39 0 -inf\nv 2e9 0 0\n").unwrap();
        assert_eq!(
            (line, message.as_str()),
            (2, "vertex coordinate nan: coordinates must be finite and not beyond 1e9; so in 3 vertices")
        );
        assert_eq!(bad_number("v 0 0 0\nvn 0 nan 0\n"), None);
        assert_eq!(
            bad_number("v 0 0 0\nvn 0 zero 0\n").unwrap(),
            (2, "\"zero\" is no number; expected vn X Y Z".into())
        );
        let (line, message) = bad_number("vt 0 nan depth\nvt 1e99\nvt 0 right\n").unwrap();
        assert_eq!((line, message.as_str()), (3, "\"right\" is no number; expected vt U V"));
    }
}
