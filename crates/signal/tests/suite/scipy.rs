//! Agreement with SciPy on the files of `tests/reference`, which `make_reference.py` there wrote (versions inside).

use ndof_signal::{Chirp, CrossSpectra, Detrend, Passband, SosFilter, Sweep, Welch, Window, slepian_tapers};
use num_complex::Complex64;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

/// Two implementations in double precision of a few hundred operations each, on inputs kept with 15 digits: they
/// differ by round-off alone, and 1e-10 of the largest entry leaves room for another order of summation.
const SCIPY_RELATIVE: f64 = 1e-10;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference")
}

fn reference(name: &str) -> Value {
    let text = fs::read_to_string(folder().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The four channels of `signals.csv` and their rate.
fn signals() -> (f64, Vec<Vec<f64>>) {
    let text = fs::read_to_string(folder().join("signals.csv")).expect("signals.csv");
    let rate = text.lines().find_map(|l| l.strip_prefix("# sample_rate_hz: ")).expect("rate").parse().expect("number");
    let mut channels = vec![Vec::new(); 4];
    for row in text.lines().filter(|l| !l.starts_with('#')).skip(1) {
        for (channel, cell) in channels.iter_mut().zip(row.split(',')) {
            channel.push(cell.parse().expect("number"));
        }
    }
    (rate, channels)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("array").iter().map(|v| v.as_f64().expect("number")).collect()
}

fn complex_numbers(re: &Value, im: &Value) -> Vec<Complex64> {
    numbers(re).into_iter().zip(numbers(im)).map(|(re, im)| Complex64::new(re, im)).collect()
}

fn size(value: &Value) -> usize {
    value.as_u64().expect("count") as usize
}

#[track_caller]
fn assert_close(what: &str, found: &[Complex64], expected: &[Complex64]) {
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let largest = expected.iter().map(|e| e.norm()).fold(0.0, f64::max);
    for (k, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).norm() <= SCIPY_RELATIVE * largest, "{what} at {k}: {f} against {e}");
    }
}

#[track_caller]
fn assert_close_real(what: &str, found: &[f64], expected: &[f64]) {
    let complex = |x: &[f64]| x.iter().map(|&v| Complex64::from(v)).collect::<Vec<_>>();
    assert_close(what, &complex(found), &complex(expected));
}

fn welch(settings: &Value) -> Welch {
    Welch {
        nperseg: size(&settings["nperseg"]),
        noverlap: size(&settings["noverlap"]),
        nfft: size(&settings["nfft"]),
        window: settings["window"].as_str().expect("name").parse().expect("window"),
        window_symmetric: settings["symmetric"].as_bool().expect("flag"),
        detrend: match settings["detrend"].as_str() {
            Some("none") => Detrend::None,
            Some("linear") => Detrend::Linear,
            _ => Detrend::Constant,
        },
    }
}

fn spectra(welch: &Welch) -> CrossSpectra {
    let (rate, channels) = signals();
    welch.spectra(rate, &channels.iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("valid")
}

#[test]
fn windows_are_those_of_get_window() {
    for case in reference("windows.json")["windows"].as_array().expect("list") {
        let name = case["name"].as_str().expect("name");
        let window: Window = name.parse().expect("window");
        let (n, symmetric) = (size(&case["n"]), case["symmetric"].as_bool().expect("flag"));
        assert_close_real(&format!("{name} {n} symmetric {symmetric}"), &window.samples(n, symmetric), &numbers(&case["samples"]));
    }
}

#[test]
fn cross_spectra_are_those_of_csd() {
    for case in reference("csd.json")["cases"].as_array().expect("list") {
        let welch = welch(case);
        let s = spectra(&welch);
        assert_close_real("frequency", s.frequency_hz(), &numbers(&case["frequency_hz"]));
        let mut pair = 0;
        for a in 0..4 {
            for b in 0..=a {
                let found: Vec<Complex64> = (0..s.frequency_hz().len()).map(|f| s.at(f, a, b)).collect();
                let expected = complex_numbers(&case["lower"]["re"][pair], &case["lower"]["im"][pair]);
                assert_close(&format!("S[{a}][{b}] with {welch:?}"), &found, &expected);
                pair += 1;
            }
        }
    }
}

#[test]
fn response_and_coherence_follow_from_the_spectra() {
    let case = reference("response.json");
    let s = spectra(&welch(&case["settings"]));
    let bins = s.frequency_hz().len();
    for i in 0..2 {
        for j in 0..2 {
            let coherence: Vec<f64> = (0..bins).map(|f| s.at(f, 2 + i, j).norm_sqr() / (s.power(f, 2 + i) * s.power(f, j))).collect();
            // At 0 Hz, where each segment lost its mean, the ratio is of round-off.
            let expected = numbers(&case["coherence"]["ordinary"][i][j]);
            assert_close_real("ordinary coherence", &coherence[1..], &expected[1..]);
            let other = 1 - j;
            let h1: Vec<Complex64> = (0..bins)
                .map(|f| {
                    let determinant = s.power(f, 0) * s.power(f, 1) - s.at(f, 0, 1).norm_sqr();
                    (s.at(f, 2 + i, j) * s.power(f, other) - s.at(f, 2 + i, other) * s.at(f, other, j)) / determinant
                })
                .collect();
            let expected = complex_numbers(&case["h1"]["re"][i][j], &case["h1"]["im"][i][j]);
            assert_close("H1", &h1[1..], &expected[1..]);
        }
    }
}

#[test]
fn filters_are_those_of_butter_sosfilt_and_sosfiltfilt() {
    let file = reference("filters.json");
    let x = &signals().1[0][..size(&file["input"]["samples"])];
    for case in file["filters"].as_array().expect("list") {
        let corners = numbers(&case["corners_hz"]);
        let kind = case["kind"].as_str().expect("kind");
        let passband = match kind {
            "lowpass" => Passband::Low(corners[0]),
            "highpass" => Passband::High(corners[0]),
            _ => Passband::Band(corners[0], corners[1]),
        };
        let filter = SosFilter::butterworth(size(&case["order"]), passband, case["sample_rate_hz"].as_f64().expect("rate")).expect("valid");
        let what = format!("{kind} of order {}", case["order"]);
        let sections = case["sos"].as_array().expect("sections");
        assert_eq!(filter.sections().len(), sections.len(), "{what}");
        for (section, expected) in filter.sections().iter().zip(sections) {
            let row = [section.b[0], section.b[1], section.b[2], 1.0, section.a[0], section.a[1]];
            assert_close_real(&what, &row, &numbers(expected));
        }
        assert_close_real(&what, &filter.filter(x), &numbers(&case["sosfilt"]));
        assert_close_real(&what, &filter.filter_zero_phase(x).expect("long enough"), &numbers(&case["sosfiltfilt"]));
    }
}

#[test]
fn tapers_are_those_of_dpss() {
    for case in reference("dpss.json")["dpss"].as_array().expect("list") {
        let expected = case["tapers"].as_array().expect("tapers");
        let slepian = slepian_tapers(size(&case["n"]), case["nw"].as_f64().expect("NW"), expected.len()).expect("valid");
        for (k, (taper, expected)) in slepian.tapers.iter().zip(expected).enumerate() {
            assert_close_real(&format!("taper {k} of {}", case["n"]), taper, &numbers(expected));
        }
        assert_close_real("concentration", &slepian.concentration, &numbers(&case["concentration"]));
    }
}

#[test]
fn sweeps_are_those_of_chirp() {
    let file = reference("chirp.json");
    for case in file["sweeps"].as_array().expect("list") {
        let expected = numbers(&case["samples"]);
        let number = |value: &Value| value.as_f64().expect("number");
        let sweep = if case["method"] == "linear" { Sweep::Linear } else { Sweep::Logarithmic };
        let (from_hz, to_hz) = (number(&case["from_hz"]), number(&case["to_hz"]));
        let chirp = Chirp { samples: expected.len(), sample_rate_hz: number(&file["sample_rate_hz"]), from_hz, to_hz, sweep, amplitude: 1.0 };
        assert_close_real(&format!("{chirp:?}"), &chirp.generate().expect("valid"), &expected);
    }
}

#[test]
fn every_reference_file_is_used_and_says_what_made_it() {
    let source = include_str!("scipy.rs");
    for entry in fs::read_dir(folder()).expect("folder") {
        let name = entry.expect("entry").file_name().into_string().expect("UTF-8");
        if name.ends_with(".py") {
            continue;
        }
        assert!(source.contains(&format!("\"{name}\"")), "no test reads {name}");
        let text = fs::read_to_string(folder().join(&name)).expect("text");
        assert!(text.contains("make_reference.py") && text.contains("\"scipy\""), "{name} does not say what made it");
    }
}
