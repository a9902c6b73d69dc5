//! Frequency responses in place of recordings, tables without a header, several trials in a file, and what `check` says of a file.

use crate::support::{csv, json, ndof, noise, oscillator_of, refuse, succeed};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Inertia (kg), damping (N s/m) and stiffness (N/m) of the response that is written.
const TRUTH: [f64; 3] = [2.0, 12.0, 300.0];

/// Compliance at a frequency.
fn compliance([m, b, k]: [f64; 3], hz: f64) -> [f64; 2] {
    let omega = std::f64::consts::TAU * hz;
    let (re, im) = (k - m * omega * omega, b * omega);
    let square = re * re + im * im;
    [re / square, -im / square]
}

/// A response from 0.2 to 12 Hz in mm/N, with circular errors of `share` of the gain and their standard errors where `told`.
fn write(path: &Path, truth: [f64; 3], share: f64, told: bool) {
    let mut text =
        format!("# unit/pos_x: mm\n# unit/force_x: N\nfrequency_hz,re_pos_x_force_x,im_pos_x_force_x{}\n", if told { ",std_pos_x_force_x" } else { "" });
    // The sum of twelve uniform numbers is Gaussian enough, with a variance of 4 for numbers between −1 and 1.
    let gauss: Vec<f64> = noise(5, 12 * 2 * 60).chunks(12).map(|twelve| twelve.iter().sum::<f64>() / 2.0).collect();
    for k in 0..60 {
        let hz = 0.2 * (k + 1) as f64;
        let [re, im] = compliance(truth, hz).map(|part| 1e3 * part);
        let sigma = share * re.hypot(im);
        write!(text, "{hz},{},{}", re + sigma * gauss[2 * k], im + sigma * gauss[2 * k + 1]).expect("a string");
        text += &if told { format!(",{sigma}\n") } else { "\n".to_owned() };
    }
    std::fs::write(path, text).expect("written");
}

fn parameter<'a>(fit: &'a Value, name: &str) -> &'a Value {
    fit["parameters"].as_array().expect("parameters").iter().find(|p| p["name"] == name).expect("a parameter")
}

#[test]
fn a_model_is_fitted_to_a_response_with_the_errors_that_it_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("frf.csv"), TRUTH, 0.05, true);
    let fit = json(folder.path(), &["fit", "frf.csv", "--report", "fit.html"]);
    for (name, truth) in ["M", "B", "K"].iter().zip(TRUTH) {
        let p = parameter(&fit, name);
        let (value, error) = (p["value"].as_f64().expect("a number"), p["std_error"].as_f64().expect("a number"));
        // Four standard errors are exceeded once in 16 000.
        assert!((value - truth).abs() < 4.0 * error && error < 0.05 * truth, "{name}: {value} ± {error}");
    }
    // χ² over its 117 degrees of freedom scatters by √(2/117).
    let chi2 = fit["chi2_reduced"].as_f64().expect("a number");
    assert!((chi2 - 1.0).abs() < 4.0 * (2.0_f64 / 117.0).sqrt(), "{chi2}");
    assert_eq!(fit["estimate"], "file");
    // The file does not say that its frequencies are independent; the program says what it takes for granted.
    assert_eq!(fit["warnings"][0]["code"], "frequencies-taken-as-independent");
    let page = std::fs::read_to_string(folder.path().join("fit.html")).expect("a page");
    assert!(page.contains("frf.csv: 60 frequencies from 0.2") && page.contains("Parameters"));
}

#[test]
fn where_errors_are_not_told_they_follow_from_what_is_left_and_no_chi_square_is_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("told.csv"), TRUTH, 0.05, true);
    write(&folder.path().join("silent.csv"), TRUTH, 0.05, false);
    let [told, silent] = ["told.csv", "silent.csv"].map(|file| json(folder.path(), &["fit", file]));
    assert!(silent["chi2_reduced"].is_null() && silent["warnings"][0]["code"] == "errors-unknown");
    for name in ["M", "B", "K"] {
        // Errors are the same share of each gain, which is what is assumed; the scale is estimated to about √(1/(2·117)), leverage aside.
        let ratio = parameter(&silent, name)["std_error"].as_f64().expect("a number") / parameter(&told, name)["std_error"].as_f64().expect("a number");
        assert!((0.6..1.6).contains(&ratio), "{name}: {ratio}");
    }
    assert!(refuse(folder.path(), &["fit", "silent.csv", "--compare"]).contains("models cannot be compared"));
}

#[test]
fn responses_are_put_beside_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("before.csv"), TRUTH, 0.01, true);
    write(&folder.path().join("after.csv"), [2.0, 12.0, 390.0], 0.01, true);
    let compared = json(folder.path(), &["compare", "before.csv", "after.csv", "--band", "0.5-10"]);
    let of = |name: &str| compared["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == name).expect("compared")["differences"][0].clone();
    let (stiffness, inertia) = (of("K"), of("M"));
    let (difference, error) = (stiffness["value"].as_f64().expect("a number"), stiffness["std_error"].as_f64().expect("a number"));
    assert!((difference - 90.0).abs() < 4.0 * error && stiffness["p_value"].as_f64().expect("a number") < 1e-6, "{stiffness}");
    // The noise is the same in both, and cancels.
    assert!(inertia["p_value"].as_f64().expect("a number") > 0.05, "{inertia}");
    assert!(refuse(folder.path(), &["compare", "fit.json", "fit.json", "--band", "1-2"]).contains("fit.json"));
}

#[test]
fn an_estimate_goes_out_as_a_response_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(3, 20_000);
    csv(&folder.path().join("trial.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &oscillator_of(TRUTH, &force))]);
    let stiffness = |file: &str, more: &[&str]| {
        let fit = json(folder.path(), &[&["fit", file, "--band", "1-10"], more].concat());
        // What a file says of its frequencies' independence comes back by CSV alone.
        let told = fit["warnings"].as_array().expect("warnings").iter().any(|w| w["code"] == "frequencies-taken-as-independent");
        assert_eq!(told, file == "frf.npz", "{file}: {}", fit["warnings"]);
        let k = parameter(&fit, "K");
        (k["value"].as_f64().expect("a number"), k["std_error"].as_f64().expect("a number"))
    };
    let (value, error) = stiffness("trial.csv", &["--method", "local-polynomial", "--hold", "band-limited"]);
    for out in ["frf.csv", "frf.npz", "frf.uff", "frf.s1p"] {
        let estimate = json(folder.path(), &["estimate", "trial.csv", "--method", "local-polynomial", "--band", "0.5-20", "--out", out]);
        let (again, its_error) = stiffness(out, &[]);
        match out {
            // Values and errors come back bit for bit, and so does the fit, up to the order of its sums.
            "frf.csv" => assert!((again / value - 1.0).abs() < 1e-10 && (its_error / error - 1.0).abs() < 1e-6, "{again} ± {its_error}"),
            // Without standard errors, or as if all were independent, frequencies weigh otherwise; what the record's leakage moves by 1 % shows.
            _ => assert!((again / value - 1.0).abs() < 0.02, "{out}: {again}"),
        }
        if out == "frf.csv" {
            let text = std::fs::read_to_string(folder.path().join(out)).expect("text");
            let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with(['#', 'f'])).collect();
            let first: Vec<f64> = rows[0].split(',').map(|cell| cell.parse().expect("a number")).collect();
            let json = |of: &str| estimate["direct"][of][0][0][0].as_f64().expect("a number");
            assert_eq!(
                (rows.len(), first[0]),
                (estimate["frequency_hz"].as_array().expect("a list").len(), estimate["frequency_hz"][0].as_f64().expect("a number"))
            );
            assert_eq!(first[1..4], [json("re"), json("im"), json("gain_std_error")]);
        }
    }
    assert!(refuse(folder.path(), &["estimate", "trial.csv", "--out", "a.json", "--json", "a.json"]).contains("overwrite"));
    assert!(refuse(folder.path(), &["estimate", "trial.csv", "--out", "frf.xyz"]).contains(".npz"));
}

#[test]
fn what_only_recordings_have_is_refused_for_a_response() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("frf.csv"), TRUTH, 0.05, true);
    let refused = |more: &[&str]| refuse(folder.path(), &[&["fit", "frf.csv"], more].concat());
    assert!(refused(&["--start", "2"]).contains("--start is about recordings"));
    assert!(refused(&["--nperseg", "512"]).contains("options of the estimate"));
    assert!(refused(&["frf.csv"]).contains("ndof compare"));
    std::fs::write(folder.path().join("arm.toml"), "kind = \"jacobian\"\nmatrix = [[0.3]]\nmean_force_n = \"measured\"\n").expect("written");
    assert!(refused(&["--kinematics", "arm.toml"]).contains("needs recordings"));
    assert!(refuse(folder.path(), &["estimate", "frf.csv"]).contains("frequency response"));
}

#[test]
fn a_table_without_names_is_explained_and_then_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(3, 4000);
    let motion = oscillator_of(TRUTH, &force);
    let rows: String = force.iter().zip(&motion).enumerate().fold(String::new(), |text, (k, (f, x))| text + &format!("{k} {f} 7 {x}\n"));
    std::fs::write(folder.path().join("log.asc"), rows).expect("written");
    let told = ndof(folder.path(), &["check", "log.asc"]);
    let text = String::from_utf8(told.stdout).expect("UTF-8");
    assert_eq!(told.status.code(), Some(2));
    assert!(text.starts_with("log.asc: CSV") && text.contains("what would help") && text.contains("--columns"), "{text}");
    let layout = "sample_rate_hz = 500\n[columns]\nforce_x = { number = 2, unit = \"N\" }\npos_x = { number = 4, unit = \"m\" }\n";
    std::fs::write(folder.path().join("robot.toml"), layout).expect("written");
    csv(&folder.path().join("named.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    let [log, named] = [&["estimate", "log.asc", "--columns", "robot.toml"][..], &["estimate", "named.csv"]].map(|words| json(folder.path(), words));
    assert_eq!(log["direct"], named["direct"]);
    assert!(refuse(folder.path(), &["estimate", "log.asc", "--columns", "none.toml"]).contains("none.toml"));
}

#[test]
fn trials_of_one_file_are_pooled_or_one_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/io/tests/fixtures/foreign/trials.tdms");
    let trials = |more: &[&str]| json(folder.path(), &[&["estimate", file, "--nperseg", "40"], more].concat())["trials"].as_u64();
    assert_eq!((trials(&[]), trials(&["--trial", "2"])), (Some(2), Some(1)));
    assert!(refuse(folder.path(), &["estimate", file, "--trial", "9"]).contains("no trial \"9\""));
    assert!(succeed(folder.path(), &["check", file]).contains("trial 2: 0.600 s"));
}

#[test]
fn check_says_what_is_in_a_response() {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("frf.csv"), TRUTH, 0.05, true);
    let text = succeed(folder.path(), &["check", "frf.csv"]);
    assert!(text.contains("a frequency response of pos_x to force_x, 60 frequencies") && text.contains("there are standard errors"), "{text}");
    assert!(succeed(folder.path(), &["check", concat!(env!("CARGO_MANIFEST_DIR"), "/crates/io/tests/fixtures/foreign/frf.uff")]).contains("Universal File 58"));
}
