//! A recording that is damaged or written in another way gives the right answer or the right error, never a silent wrong one.

use crate::support::{json, ndof, noise, oscillator, refuse, succeed};
use serde_json::Value;
use std::path::Path;

const SAMPLES: usize = 25_000;
const OPTIONS: [&str; 4] = ["--nperseg", "1024", "--band", "0.5-20"];

/// 50 s at 500 Hz of the oscillator as rows of text.
fn rows() -> Vec<[String; 3]> {
    let force = noise(11, SAMPLES);
    let motion = oscillator(&force);
    (0..SAMPLES).map(|k| [format!("{:.3}", k as f64 * 0.002), format!("{:.5}", force[k]), format!("{:.9}", motion[k])]).collect()
}

fn text(rows: &[[String; 3]]) -> String {
    rows.iter().fold("t [s],force_x [N],pos_x [m]\n".to_owned(), |text, row| text + &row.join(",") + "\n")
}

fn response(folder: &Path, name: &str) -> Value {
    let result = json(folder, &[&["estimate", name], &OPTIONS[..]].concat());
    serde_json::json!([result["direct"], result["frequency_hz"], result["sample_rate_hz"]])
}

#[test]
fn cut_off_at_any_byte_it_is_the_whole_lines_or_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = text(&rows());
    let head = all.find('\n').expect("a line") + 1;
    // Every seventh byte of the head and of the first rows, 39 places spread over the file, and each of the last 25.
    let cuts: Vec<usize> = (0..head + 60).step_by(7).chain((1..40).map(|k| all.len() * k / 40 + k % 29)).chain(all.len() - 25..all.len()).collect();
    for cut in cuts {
        std::fs::write(folder.path().join("cut.csv"), &all[..cut]).expect("written");
        let output = ndof(folder.path(), &[&["estimate", "cut.csv", "--quiet", "--json", "cut.json"], &OPTIONS[..]].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.code() == Some(2) {
            let too_short = cut < head + 40_000;
            let in_a_line = message.contains("line") && (message.contains("middle of a line") || message.contains("not a number"));
            assert!(message.contains("cut.csv") && (too_short || in_a_line), "{cut}: {message}");
            continue;
        }
        assert!(output.status.success(), "{cut}: {message}");
        let result: Value = serde_json::from_slice(&std::fs::read(folder.path().join("cut.json")).expect("written")).expect("JSON");
        // The last line may be incomplete in a way that nothing shows: it counts only with its end.
        let whole = &all[..all[..cut].rfind('\n').expect("lines") + 1];
        let warned = result["warnings"].as_array().expect("a list").iter().any(|warning| warning["code"] == "unterminated-line");
        assert_eq!(warned, whole.len() < cut, "{cut}");
        std::fs::write(folder.path().join("whole.csv"), whole).expect("written");
        let own = serde_json::json!([result["direct"], result["frequency_hz"], result["sample_rate_hz"]]);
        assert!(own == response(folder.path(), "whole.csv"), "{cut}");
    }
}

#[test]
fn a_file_that_says_its_length_is_refused_if_it_is_shorter() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = format!("# samples: {SAMPLES}\n{}", text(&rows()));
    for share in [0.3, 0.7, 0.99] {
        let cut = all[..(all.len() as f64 * share) as usize].rfind('\n').expect("lines") + 1;
        std::fs::write(folder.path().join("cut.csv"), &all[..cut]).expect("written");
        let message = refuse(folder.path(), &["estimate", "cut.csv"]);
        assert!(message.contains("cut.csv") && message.contains("25000 samples"), "{message}");
    }
}

#[test]
fn other_line_ends_a_byte_order_mark_decimal_commas_and_other_orders_of_columns_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = rows();
    let plain = text(&rows);
    std::fs::write(folder.path().join("plain.csv"), &plain).expect("written");
    let truth = response(folder.path(), "plain.csv");
    let reordered = rows.iter().fold("pos_x [m],t [s],force_x [N]\n".to_owned(), |text, [t, f, x]| text + &[x.as_str(), t, f].join(",") + "\n");
    let variants = [
        ("crlf", plain.replace('\n', "\r\n")),
        ("bom", format!("\u{feff}{}", plain.replace('\n', "\r\n"))),
        ("cr", plain.replace('\n', "\r")),
        ("semicolon", plain.replace(',', ";")),
        ("comma", plain.replace(',', ";").replace('.', ",")),
        ("tab", plain.replace(',', "\t")),
        ("tabcomma", plain.replace(',', "\t").replace('.', ",")),
        ("order", reordered),
        ("ms", rows.iter().enumerate().fold("t [ms],force_x [N],pos_x [m]\n".to_owned(), |text, (k, [_, f, x])| text + &format!("{},{f},{x}\n", 2 * k))),
    ];
    for (name, variant) in variants {
        let file = format!("{name}.csv");
        std::fs::write(folder.path().join(&file), variant).expect("written");
        assert!(response(folder.path(), &file) == truth, "{name}");
    }
    // A decimal comma between commas cannot be told from two columns.
    std::fs::write(folder.path().join("ambiguous.csv"), plain.replace('.', ",")).expect("written");
    let message = refuse(folder.path(), &["estimate", "ambiguous.csv"]);
    assert!(message.contains("line 2") && message.contains("decimal"), "{message}");
    // Half with points and half with commas.
    let mixed: String =
        plain.replace(',', ";").lines().enumerate().map(|(k, line)| if k < 9000 { format!("{line}\n") } else { line.replace('.', ",") + "\n" }).collect();
    std::fs::write(folder.path().join("mixed.csv"), mixed).expect("written");
    assert!(refuse(folder.path(), &["estimate", "mixed.csv"]).contains("decimal comma"));
}

#[test]
fn a_tenth_of_the_samples_missing_is_told_in_every_form() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows = rows();
    let flags: Vec<bool> = noise(77, SAMPLES).iter().map(|draw| *draw > 0.8).collect();
    let count = flags.iter().filter(|flag| **flag).count();
    assert!((2300..2700).contains(&count), "a tenth: {count}");
    for (name, cell) in [("nan", "NaN"), ("empty", ""), ("na", "N/A")] {
        let holey: Vec<[String; 3]> =
            rows.iter().zip(&flags).map(|([t, f, x], lost)| [t.clone(), f.clone(), if *lost { cell.to_owned() } else { x.clone() }]).collect();
        let file = format!("{name}.csv");
        std::fs::write(folder.path().join(&file), text(&holey)).expect("written");
        let message = refuse(folder.path(), &["estimate", &file]);
        assert!(message.contains(&file) && message.contains("pos_x"), "{message}");
        let finding = json(folder.path(), &["check", &file])["findings"][0].clone();
        assert_eq!(finding["code"], "missing-samples");
        assert!(finding["message"].as_str().expect("text").contains(&format!("{count} of 25000")), "{finding}");
    }
    // Rows that are gone: the time shows it, and interpolation says what it did.
    let kept: Vec<[String; 3]> = rows.iter().zip(&flags).filter(|(_, lost)| !**lost).map(|(row, _)| row.clone()).collect();
    std::fs::write(folder.path().join("gone.csv"), text(&kept)).expect("written");
    assert!(refuse(folder.path(), &["estimate", "gone.csv"]).contains("irregular time"));
    let repaired = json(folder.path(), &[&["fit", "gone.csv", "--resample"], &OPTIONS[..2], &["--band", "0.6-10"]].concat());
    assert!(repaired["warnings"].as_array().expect("a list").iter().any(|warning| warning["code"] == "resampled"));
    // Without a time column nothing could show it, unless the file says how many samples it has.
    let untimed: String = kept.iter().map(|[_, f, x]| format!("{f},{x}\n")).collect();
    std::fs::write(folder.path().join("untimed.csv"), format!("# sample_rate_hz: 500\n# samples: {SAMPLES}\nforce_x [N],pos_x [m]\n{untimed}"))
        .expect("written");
    assert!(refuse(folder.path(), &["estimate", "untimed.csv"]).contains("25000 samples"));
}

#[test]
fn a_conversion_to_every_format_gives_the_same_bytes_of_result() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("trial.csv"), text(&rows()[..8000])).expect("written");
    let result = |name: &str| {
        succeed(folder.path(), &[&["estimate", name, "--quiet", "--spectra", "--json", "out.json"], &OPTIONS[..]].concat());
        std::fs::read(folder.path().join("out.json")).expect("written")
    };
    let truth = result("trial.csv");
    for suffix in ["csv", "tsv", "npz", "parquet"] {
        let name = format!("copy.{suffix}");
        let output = ndof(folder.path(), &["convert", "trial.csv", &name]);
        if !output.status.success() {
            // A build without the format says so, and by which feature it comes.
            assert!(suffix == "parquet" && String::from_utf8_lossy(&output.stderr).contains("--features parquet"), "{suffix}");
            println!("skipped: parquet is not built in");
            continue;
        }
        assert!(result(&name) == truth, "{suffix}");
    }
}

#[test]
fn the_same_recording_in_every_format_gives_the_same_bytes_of_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/io/tests/fixtures");
    for name in ["plain.npz", "plain.mat", "pandas.parquet", "plain.h5"] {
        std::fs::copy(fixtures.join(name), folder.path().join(name)).expect("a fixture of NumPy, SciPy, pandas and h5py");
    }
    for suffix in ["csv", "tsv"] {
        succeed(folder.path(), &["convert", "plain.npz", &format!("own.{suffix}")]);
    }
    let result = |name: &str| {
        let output = ndof(folder.path(), &["estimate", name, "--nperseg", "8", "--spectra", "--quiet", "--json", "out.json"]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        if message.contains("--features") {
            println!("skipped: {message}");
            return None;
        }
        assert!(output.status.success(), "{name}: {message}");
        let text = std::fs::read_to_string(folder.path().join("out.json")).expect("written");
        // What was inferred on the way is told, and differs: a unit is written in our CSV and not in NumPy's file.
        let mut value: Value = serde_json::from_str(&text).expect("JSON");
        let read = |warning: &Value| ["unit-inferred", "ignored-arrays"].iter().any(|code| warning["code"] == *code);
        value["warnings"].as_array_mut().expect("a list").retain(|warning| !read(warning));
        Some(value.to_string())
    };
    let truth = result("plain.npz");
    for name in ["plain.mat", "own.csv", "own.tsv", "pandas.parquet", "plain.h5"] {
        let found = result(name);
        assert!(found.is_none() || found == truth, "{name}");
    }
}

#[test]
fn an_archive_that_is_cut_off_is_called_an_incomplete_zip() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("trials.zip"), [&b"PK\x03\x04"[..], &[0; 200]].concat()).expect("written");
    let message = refuse(folder.path(), &["estimate", "trials.zip"]);
    assert!(message.contains("damaged ZIP file: it is incomplete") && !message.contains("NPZ"), "{message}");
}
