//! Files of every kind that the program reads.

use ndof_analysis::check::result::CheckResult;
use ndof_analysis::compare::result::CompareResult;
use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_analysis::estimate::result::EstimateResult;
use ndof_analysis::fit::result::FitResult;
use ndof_analysis::live::result::LiveResult;
use ndof_analysis::{RoleNames, Roles, compare_fits};
use ndof_devices::RobotConfig;
use ndof_io::{CsvStream, ReadOptions, Resample, encode, read_bytes};
use ndof_study::file::{BaselineFile, ChannelsFile, ExperimentFile, KinematicsFile, StudyFile, parse};

/// Reads a recording; what can be read has numbers where it says so, and comes back from our own file as it was.
pub fn recording(file: &str, data: &[u8]) {
    let repair = ReadOptions { sample_rate_hz: Some(200.0), allow_nan: true, resample: Some(Resample::Auto), ..ReadOptions::default() };
    let Ok(read) = read_bytes(data, file, &ReadOptions::default()).or_else(|_| read_bytes(data, file, &repair)) else {
        return;
    };
    let recording = &read.recording;
    assert!(recording.sample_rate_hz().is_finite() && recording.sample_rate_hz() > 0.0);
    assert!(recording.len() <= 16 * data.len() + 16, "{recording} from {} bytes", data.len());
    let _ = Roles::find(recording, file, &RoleNames::default());
    if file.ends_with(".csv") {
        let mut stream = CsvStream::new(file, ReadOptions::default());
        for piece in data.chunks(7) {
            if stream.push(piece).is_err() {
                break;
            }
        }
        let _ = stream.finish();
    }
    if let Ok(bytes) = encode(recording, "again.csv") {
        let again = read_bytes(&bytes, "again.csv", &ReadOptions { allow_nan: true, ..ReadOptions::default() }).expect("our own file");
        let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
        for (one, other) in recording.channels().iter().zip(again.recording.channels()) {
            assert!(one.samples.iter().zip(&other.samples).all(|(a, b)| same(*a, *b)), "{} comes back otherwise", one.name);
        }
    }
}

/// Every kind of TOML that people write; the first byte says which.
pub fn toml(data: &[u8]) {
    let Some((kind, rest)) = data.split_first() else { return };
    let Ok(text) = std::str::from_utf8(rest) else { return };
    match kind % 5 {
        0 => {
            if let Ok(study) = StudyFile::parse(text, "fuzz.toml") {
                let _ = study.each_case();
            }
        }
        1 => {
            if let Ok(experiment) = parse::<ExperimentFile>(text, "fuzz.toml") {
                let _ = experiment.check("fuzz.toml");
            }
        }
        2 => {
            if let Ok(kinematics) = parse::<KinematicsFile>(text, "fuzz.toml") {
                let _ = kinematics.check("fuzz.toml");
            }
        }
        3 => {
            if let Ok(channels) = parse::<ChannelsFile>(text, "fuzz.toml") {
                let _ = channels.check("fuzz.toml");
            }
            let _ = ChannelsFile::from_pairs(text);
        }
        _ => {
            if let Ok(baseline) = parse::<BaselineFile>(text, "fuzz.toml") {
                let _ = baseline.check("fuzz.toml");
            }
        }
    }
}

/// A robot in TOML, URDF or MJCF, and the device that it makes.
pub fn robot(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Ok(config) = RobotConfig::parse("fuzz.urdf", text, None) {
        let _ = config.build();
    }
}

/// Results as other programs hand them back, the fits among them compared with themselves.
pub fn json(data: &[u8]) {
    if let Ok(fit) = serde_json::from_slice::<FitResult>(data) {
        let _ = compare_fits(&[fit.clone(), fit]);
    }
    let _ = serde_json::from_slice::<EstimateResult>(data);
    let _ = serde_json::from_slice::<DiagnosisResult>(data);
    let _ = serde_json::from_slice::<CheckResult>(data);
    let _ = serde_json::from_slice::<CompareResult>(data);
    let _ = serde_json::from_slice::<LiveResult>(data);
}
