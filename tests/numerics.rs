//! `vitrum numerics` from outside: what functions are at inputs checked by hand, how bad inputs end, and a report.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use common::Validated;

fn numerics(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vitrum"));
    command.arg("numerics").args(args).current_dir(folder).output().expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn has_device() -> bool {
    Validated::open().is_some()
}

/// The CSV file that `function` makes of `text`.
fn evaluate(function: &str, text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.csv"), text).expect("a fixture");
    let args = ["--validation", "--function", function, "--inputs", "in.csv", "-o", "out.csv"];
    let output = numerics(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let rows = text.trim_end().lines().count() - 1;
    assert!(output.stdout.is_empty());
    assert_eq!(stderr(&output), format!("out.csv: {function} at {rows} inputs\n"));
    fs::read_to_string(folder.path().join("out.csv")).expect("the results")
}

/// The last `N` columns of each row.
fn outputs<const N: usize>(function: &str, columns: &str, rows: &[&str]) -> Vec<[f32; N]> {
    let text = evaluate(function, &format!("{columns}\n{}\n", rows.join("\n")));
    let numbers = |line: &str| {
        let fields: Vec<_> = line.split(',').collect();
        let last = &fields[fields.len() - N..];
        std::array::from_fn(|i| last[i].parse().expect("a number"))
    };
    text.lines().skip(1).map(numbers).collect()
}

fn assert_close<const N: usize>(found: [f32; N], wanted: [f64; N], tolerance: f64) {
    for (found, wanted) in found.into_iter().zip(wanted) {
        assert!((f64::from(found) - wanted).abs() <= tolerance * wanted.abs().max(1e-3), "{found} is not {wanted}");
    }
}

#[test]
fn fresnel_is_that_of_textbooks() {
    if !has_device() {
        return;
    }
    let rows = ["1,1.5", "-1,1.5", "0,1.5", "0.5,1", "-0.7,1.5", "0.5547002,1.5", "1e-3,1", "0.5,1.5"];
    let found = outputs::<3>("fresnel", "cos_i,eta", &rows);
    // 4 % at normal incidence, from both sides; everything at grazing incidence; nothing at equal indices.
    assert_eq!(found[0], [0.04, 1.0, 0.0]);
    assert_eq!(found[1], [0.04, 1.0, 0.0]);
    assert_eq!(found[2][0], 1.0);
    assert_close(found[2], [1.0, 5_f64.sqrt() / 3.0, 0.0], 1e-6);
    assert_eq!(found[3], [0.0, 0.5, 0.0]);
    assert_eq!(found[4], [1.0, 0.0, 1.0], "beyond the critical angle");
    // Brewster's angle, tan = n: half of ((n^2 - 1) / (n^2 + 1))^2, and the refracted angle is its complement.
    assert_close(found[5], [0.5 * (1.25_f64 / 3.25).powi(2), 1.5 / 3.25_f64.sqrt(), 0.0], 1e-6);
    assert_eq!(found[6], [0.0, 1e-3, 0.0]);
    // 60 degrees: sin t = sin 60 / 1.5, cos t = sqrt(2/3).
    let t = (2.0 / 3.0_f64).sqrt();
    let (s, p) = ((0.5 - 1.5 * t) / (0.5 + 1.5 * t), (0.75 - t) / (0.75 + t));
    assert_close(found[7], [0.5 * (s * s + p * p), t, 0.0], 1e-6);
}

#[test]
fn refraction_obeys_snell() {
    if !has_device() {
        return;
    }
    let rows = [
        "0,0,1,1.5",
        "0,0,-1,1.5",
        "0.6,0,0.8,1.5",
        "0.6,0,-0.8,1.5",
        "0,0.8,-0.6,1.5",
        "0.6,0,0.8,1",
        "0.6,0,0.8,0.5",
    ];
    let found = outputs::<4>("refract", "wi_x,wi_y,wi_z,eta", &rows);
    assert_eq!(found[0], [0.0, 0.0, -1.0, 0.0]);
    assert_eq!(found[1], [0.0, 0.0, 1.0, 0.0]);
    assert_close(found[2], [-0.4, 0.0, -0.84_f64.sqrt(), 0.0], 1e-6);
    // From below, where the index is 1.5: sin t = 0.9.
    assert_close(found[3], [-0.9, 0.0, 0.19_f64.sqrt(), 0.0], 1e-6);
    assert_eq!(found[4], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(found[5], [-0.6, 0.0, -0.8, 0.0]);
    assert_eq!(found[6], [0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn the_rough_dielectric_is_walters() {
    if !has_device() {
        return;
    }
    let columns = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,alpha,eta";
    let rows = [
        "0,0,1,0,0,1,0.5,1.5",
        "0,0,1,0,0,-1,0.5,1.5",
        "0,0,-1,0,0,1,0.5,1.5",
        "0,0,1,0,0,1,0,1.5",
        "0,0,1,0,0,1,0.5,1",
    ];
    let found = outputs::<2>("rough_eval", columns, &rows);
    // Straight up all masking is 1 and D is 1 / (pi alpha^2); the density is F D / 4.
    let d = 4.0 / std::f64::consts::PI;
    assert_close(found[0], [0.04 * d / 4.0; 2], 1e-6);
    // Straight through: (1 - F) D etaT^2 / (etaT - etaI)^2; radiance shrinks by (etaI / etaT)^2 on the way.
    assert_close(found[1], [0.96 * d * 4.0, 0.96 * d * 9.0], 1e-6);
    assert_close(found[2], [0.96 * d * 9.0, 0.96 * d * 4.0], 1e-6);
    assert_eq!(found[3..], [[0.0; 2]; 2], "where nothing is spread there is no density");

    let columns = "wi_x,wi_y,wi_z,alpha,eta,u1,u2,u3";
    let rows = [
        "0,0,1,0.5,1.5,0.3,0,0.01",
        "0,0,1,0.5,1.5,0.3,0,0.99",
        "0.6,0,0.8,0,1.5,0.3,0.7,0.99",
        "0.6,0,0.8,0,1.5,0.3,0.7,0",
        "0.8,0,-0.6,0,1.5,0.3,0.7,0.5",
    ];
    let found = outputs::<5>("rough_sample", columns, &rows);
    assert_close(found[0], [0.0, 0.0, 1.0, 1.0, 0.04 * d / 4.0], 1e-6);
    assert_close(found[1], [0.0, 0.0, -1.0, 4.0 / 9.0, 0.96 * d * 9.0], 1e-6);
    // Smooth: the direction that refracts or reflects, with its probability.
    let t = 0.84_f64.sqrt();
    let (s, p) = ((0.8 - 1.5 * t) / (0.8 + 1.5 * t), (1.2 - t) / (1.2 + t));
    let reflectance = 0.5 * (s * s + p * p);
    assert_close(found[2], [-0.4, 0.0, -t, 4.0 / 9.0, 1.0 - reflectance], 1e-6);
    assert_close(found[3], [-0.6, 0.0, 0.8, 1.0, reflectance], 1e-6);
    assert_close(found[4], [-0.8, 0.0, -0.6, 1.0, 1.0], 1e-6);
}

#[test]
fn the_original_is_as_its_report_has_it() {
    if !has_device() {
        return;
    }
    let found = outputs::<1>("original_fresnel", "cos_i,eta", &["1,1.5", "0,1.5", "-1,1.5", "0.5,1", "-0.5,1"]);
    assert_close(found[0], [0.04], 1e-6);
    assert_eq!(found[1], [1.0]);
    // From behind indices are not swapped: amplitudes are inverted.
    assert_close(found[2], [25.0], 1e-6);
    assert_eq!(found[3..], [[0.0]; 2]);
}

#[test]
fn columns_pass_through_and_numbers_read_back() {
    if !has_device() {
        return;
    }
    let text = "\u{feff}note,eta, cos_i ,eta_note\r\n\"a, b\",1.50, 0.9999999 ,\r\n q,+2e0,-0.25,\"say \"\"x\"\"\"\r\n";
    let found = evaluate("fresnel", text);
    let mut lines = found.lines();
    assert_eq!(lines.next(), Some("note,eta, cos_i ,eta_note,reflectance,cos_t,total"));
    let first = lines.next().expect("a row");
    assert!(first.starts_with("\"a, b\",1.50, 0.9999999 ,,0.04"), "{first}");
    let second = lines.next().expect("a row");
    assert!(second.starts_with(" q,+2e0,-0.25,\"say \"\"x\"\"\",1,0,1"), "{second}");
    assert_eq!(lines.next(), None);
    assert_eq!(evaluate("fresnel", "cos_i,eta\n"), "cos_i,eta,reflectance,cos_t,total\n");

    // A column that is called as an output is stays what it was; the device's comes last.
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.csv"), "cos_i,eta,cos_t\n1,1.5,given\n").expect("a fixture");
    let output = numerics(folder.path(), &["--function", "fresnel", "--inputs", "in.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("\"cos_t\""), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(text.lines().next(), Some("cos_i,eta,cos_t,reflectance,cos_t,total"));
    assert!(text.lines().nth(1).is_some_and(|row| row.starts_with("1,1.5,given,") && row.ends_with(",1,0")), "{text}");

    // What was written, read back and written again is the same text: no digit is missing, none too many.
    let rows: Vec<_> = (1..=500).map(|i| format!("{},{}", f64::from(i) / 500.0, 0.4 + f64::from(i) / 250.0)).collect();
    let found = outputs::<3>("fresnel", "cos_i,eta", &rows.iter().map(String::as_str).collect::<Vec<_>>());
    let text = evaluate("fresnel", &format!("cos_i,eta\n{}\n", rows.join("\n")));
    for (line, values) in text.lines().skip(1).zip(found) {
        let again = values.map(|value| format!("{value:?}").trim_end_matches(".0").to_owned()).join(",");
        assert!(line.ends_with(&format!(",{again}")), "{line}");
    }
}

#[test]
fn bad_usage_and_bad_input_end_with_2_and_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("a fixture");
    write("good.csv", b"cos_i,eta\n1,1.5\n");
    write("empty.csv", b"");
    write("missing.csv", b"cos_i\n1\n");
    write("twice.csv", b"cos_i,eta,eta\n1,1.5,1.5\n");
    write("word.csv", b"cos_i,eta\n1,1.5\n1,glass\n");
    write("nan.csv", b"cos_i,eta\nnan,1.5\n");
    write("range.csv", b"cos_i,eta\n1,1.5\n1.5,1.5\n");
    write("short.csv", b"cos_i,eta\n1,1.5\n1\n");
    write("comma.csv", b"cos_i,eta\n0,5,1.5\n");
    write("void.csv", b"cos_i,eta\n1,\n");
    write("binary.csv", b"\xff\xfe\x00\x01");
    write("length.csv", b"wi_x,wi_y,wi_z,eta\n0,0,2,1.5\n");
    let before = files(folder.path());

    let file = |name: &'static str| vec!["--function", "fresnel", "--inputs", name, "-o", "out.csv"];
    let cases: Vec<(Vec<&str>, &[&str])> = vec![
        (vec!["--function", "magic"], &["magic", "fresnel, refract"]),
        (vec!["--inputs", "good.csv"], &["--function", "fresnel, refract"]),
        (vec!["--count", "0"], &["--count", "1 to"]),
        (vec!["--count", "-5"], &["-5", "1 to"]),
        (vec!["--seed", "x"], &["--seed", "whole number"]),
        (vec!["--bogus"], &["--bogus", "--help"]),
        (vec!["--count", "1", "-o", "good.csv"], &["good.csv", "folder"]),
        (vec!["--function", "fresnel", "-o", "out.csv"], &["out.csv", "folder", "--inputs"]),
        (vec!["--count", "1", "-o", "good.csv/report"], &["good.csv", "folder"]),
        (vec!["--function", "refract", "--inputs", "length.csv"], &["length.csv:2", "wi has length 2"]),
        (vec!["--function", "fresnel", "--inputs", "good.csv", "-o", "good.csv"], &["good.csv", "replaced"]),
        (vec!["--function", "fresnel", "--inputs", "good.csv", "-o", "./good.csv"], &["good.csv", "replaced"]),
        (vec!["--function", "fresnel", "--inputs", "good.csv", "-o", "no/out.csv"], &["\"no\"", "create it"]),
        (vec!["--function", "fresnel", "--inputs", "good.csv", "-o", "."], &["names no file"]),
        (file("none.csv"), &["none.csv", "cannot read"]),
        (file("."), &[".: cannot read"]),
        (file("empty.csv"), &["empty.csv:1", "cos_i,eta"]),
        (file("missing.csv"), &["missing.csv:1", "\"eta\"", "cos_i,eta"]),
        (file("twice.csv"), &["twice.csv:1", "\"eta\"", "twice"]),
        (file("word.csv"), &["word.csv:3", "eta \"glass\"", "not a number"]),
        (file("nan.csv"), &["nan.csv:2", "cos_i NaN", "-1 to 1"]),
        (file("range.csv"), &["range.csv:3", "cos_i 1.5", "-1 to 1"]),
        (file("short.csv"), &["short.csv:3", "1 value;", "2 columns"]),
        (file("comma.csv"), &["comma.csv:2", "3 values", "2 columns"]),
        (file("void.csv"), &["void.csv:2", "eta \"\""]),
        (file("binary.csv"), &["binary.csv", "UTF-8"]),
    ];
    for (args, wanted) in cases {
        let output = numerics(folder.path(), &args);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        let mut lines = text.lines();
        assert!(lines.next().is_some_and(|line| line.starts_with("error: ")), "{args:?}: {text}");
        assert!(lines.all(|line| line.starts_with("Caused by: ")), "{args:?}: {text}");
        for part in wanted {
            assert!(text.contains(part), "{args:?} does not name {part:?}: {text}");
        }
        assert!(output.stdout.is_empty(), "{args:?} printed something");
        assert_eq!(files(folder.path()), before, "{args:?} left something behind");
    }
}

#[test]
fn without_a_device_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.csv"), "cos_i,eta\n1,1.5\n").expect("a fixture");
    for args in [&["-o", "new"][..], &["--function", "fresnel", "--inputs", "in.csv", "-o", "out.csv"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_vitrum"))
            .arg("numerics")
            .args(args)
            .current_dir(folder.path())
            .env("VK_DRIVER_FILES", "/nowhere.json")
            .env("VK_ICD_FILENAMES", "/nowhere.json")
            .output()
            .expect("the program starts");
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        assert_eq!(files(folder.path()), ["in.csv"]);
    }
    if has_device() {
        let output = numerics(folder.path(), &["--device", "abacus", "-o", "new"]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert_eq!(files(folder.path()), ["in.csv"]);
    }
}

#[test]
fn options_without_effect_are_named_unless_quiet() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("in.csv"), "cos_i,eta\n1,1.5\n").expect("a fixture");
    let args = ["--function", "fresnel", "--inputs", "in.csv", "--count", "5", "--seed", "1"];
    let output = numerics(folder.path(), &args);
    assert_eq!(output.stdout, b"cos_i,eta,reflectance,cos_t,total\n1,1.5,0.04,1,0\n");
    let text = stderr(&output);
    assert!(text.contains("note: --count changes nothing") && text.contains("note: --seed changes nothing"), "{text}");
    assert_eq!(stderr(&numerics(folder.path(), &[&args[..], &["-q"]].concat())), "");
}

#[test]
fn a_report_is_complete_and_the_same_from_run_to_run() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let mut texts = Vec::new();
    for name in ["one", "deep/two"] {
        let output = numerics(folder.path(), &["--count", "3000", "--validation", "-o", name]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(files(&folder.path().join(name)), ["index.html", "numerics.json", "numerics.svg"]);
        texts.push(fs::read_to_string(folder.path().join(name).join("numerics.json")).expect("JSON"));
        let table = String::from_utf8(output.stdout).expect("text");
        assert!(table.lines().all(|line| line.len() <= 110) && !table.contains("BROKEN"), "{table}");
    }
    assert!(texts[0] == texts[1], "reports differ from run to run");
    let json: serde_json::Value = serde_json::from_str(&texts[0]).expect("JSON");
    assert_eq!((&json["schema"], &json["passed"], &json["non_finite"]), (&1.into(), &true.into(), &0.into()));
    let regions = json["regions"].as_array().expect("regions");
    assert_eq!(json["inputs"], 3000 * regions.len());
    for name in ["fresnel", "refract", "rough_eval", "rough_sample", "original_fresnel"] {
        assert!(regions.iter().any(|region| region["function"] == name), "{name}");
    }
    let finding = &regions[0]["findings"][0];
    assert_eq!((&finding["statistic"], &finding["holds"]), (&"worst".into(), &true.into()));
    assert_eq!(finding["by_angle_worst"].as_array().map(Vec::len), Some(90));
    // The cause, evaluated again, is what was told of it.
    let cause = |column: &str| finding["cause"][column].to_string();
    let [row] = outputs::<3>("fresnel", "cos_i,eta", &[&format!("{},{}", cause("cos_i"), cause("eta"))])[..] else {
        panic!("one row");
    };
    let number = |column: &str| finding["cause"][column].as_f64().map(|x| f64::from(x as f32)).expect("a number");
    let (cosine, eta) = (number("cos_i"), number("eta"));
    let (eta_i, eta_t) = if cosine < 0.0 { (eta, 1.0) } else { (1.0, eta) };
    let wanted = vitrum::optics::fresnel::fresnel_dielectric(cosine.abs(), eta_i, eta_t).reflectance;
    assert_eq!(finding["worst"].as_f64(), Some(vitrum::numerics::ulps(row[0], wanted)));
}
