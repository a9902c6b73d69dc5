//! Files made by the reference libraries of their formats (`fixtures/foreign/make_foreign.py`, versions in `versions.txt` there),
//! read to the last bit of what they hold.

use ndof_io::{IoError, ReadOptions, ReadRecording, read, read_trials};
use std::io::Write;
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/foreign").join(name)
}

fn one(name: &str) -> ReadRecording {
    read(&path(name), &ReadOptions { allow_nan: true, ..Default::default() }).unwrap_or_else(|e| panic!("{e}"))
}

fn samples(read: &ReadRecording, name: &str) -> Vec<f64> {
    read.recording.channel(name).unwrap_or_else(|e| panic!("{e}: {:?}", read.recording.names())).samples.clone()
}

/// What the files hold, times `factor` (a unit's, which is one multiplication there too).
fn expected(name: &str, factor: f64) -> Vec<f64> {
    samples(&one("expected.csv"), name).iter().map(|v| v * factor).collect()
}

fn unit<'a>(read: &'a ReadRecording, name: &str) -> &'a str {
    read.recording.channel(name).expect(name).unit.symbol()
}

#[test]
fn c3d_of_one_rate() {
    let read = one("plain.c3d");
    assert_eq!((read.recording.sample_rate_hz(), read.recording.start_s()), (200.0, 0.0));
    assert_eq!(read.recording.names(), ["HAND_x", "HAND_y", "HAND_z", "Fx", "EMG 1"]);
    assert_eq!(samples(&read, "HAND_x"), expected("pos", 1e-3));
    assert_eq!(samples(&read, "HAND_y"), expected("pos", 2.0).iter().map(|v| v * 1e-3).collect::<Vec<_>>());
    assert_eq!(samples(&read, "Fx"), expected("force", 1.0));
    assert_eq!(samples(&read, "EMG 1"), expected("angle", 1.0));
    assert_eq!((unit(&read, "HAND_x"), unit(&read, "Fx"), unit(&read, "EMG 1")), ("m", "N", "V"));
    let metadata = read.recording.metadata();
    assert_eq!(metadata.get("SUBJECTS.NAMES").map(String::as_str), Some("S 07"));
    assert_eq!(metadata.get("event/Right HOLD").map(String::as_str), Some("0.125, 0.25"));
}

#[test]
fn c3d_of_two_rates_is_on_the_clock_of_the_faster() {
    let read = one("two_rates.c3d");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(samples(&read, "Fx")[..117], expected("force", 1.0)[..117]);
    // Every fourth sample is a frame's own.
    let pos = expected("pos", 1e-3);
    for (k, value) in samples(&read, "HAND_x").iter().enumerate().step_by(4) {
        assert_eq!(*value, pos[k], "{k}");
    }
    let elbow = samples(&read, "ELBOW_x");
    assert!(elbow[..20].iter().all(|v| v.is_nan()) && elbow[24..].iter().all(|v| (v - 1e-3).abs() < 1e-17), "{elbow:?}");
    assert!(read.notes.iter().any(|n| n.code == "clocks-joined" && n.message.contains("points (50.000000 Hz)")), "{:?}", read.notes);
}

#[test]
fn a_session_of_kinarm_is_its_trials() {
    let trials = read_trials(&path("kinarm.zip"), &ReadOptions::default()).unwrap();
    let names: Vec<_> = trials.iter().map(|t| t.trial.as_deref().unwrap()).collect();
    assert_eq!(names, ["01_01", "02_01"], "by the number of the trial, not by the archive");
    for (trial, scale) in trials.iter().zip([1.0, 2.0]) {
        assert_eq!(samples(trial, "Right_HandX"), expected("pos", scale));
        assert_eq!(samples(trial, "Right_FS_ForceX"), expected("force", 1.0));
        assert_eq!((unit(trial, "Right_HandX"), unit(trial, "Right_FS_ForceX"), unit(trial, "Right_L1Ang")), ("m", "N", "rad"));
        assert_eq!(trial.recording.metadata().get("TARGET_TABLE.X").map(String::as_str), Some("0, 10"), "of common.c3d");
        assert_eq!(trial.recording.metadata().get("event/REACHED").and_then(|t| t.parse::<f64>().ok()).map(|t| t as f32), Some(0.3));
    }
    let error = read(&path("kinarm.zip"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(&error, IoError::SeveralTrials { trials, .. } if trials == &["01_01", "02_01"]), "{error}");
    for wanted in ["02_01", "2"] {
        let options = ReadOptions { trial: Some(wanted.to_owned()), ..Default::default() };
        assert_eq!(samples(&read(&path("kinarm.zip"), &options).unwrap(), "Right_HandX"), expected("pos", 2.0));
    }
    let options = ReadOptions { trial: Some("9".to_owned()), ..Default::default() };
    assert!(read(&path("kinarm.zip"), &options).unwrap_err().to_string().contains("it has: 01_01, 02_01"));
}

/// macOS puts a shadow of its own beside each file of an archive.
#[test]
fn a_session_that_a_mac_zipped_has_the_same_trials() {
    let folder = tempfile::tempdir().unwrap();
    let zipped = folder.path().join("mac.zip");
    let mut archive = zip::ZipWriter::new_append(std::io::Cursor::new(std::fs::read(path("kinarm.zip")).unwrap())).unwrap();
    archive.start_file("__MACOSX/S01/._01_01.c3d", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(b"Mac OS X        ").unwrap();
    std::fs::write(&zipped, archive.finish().unwrap().into_inner()).unwrap();
    let [own, plain] = [&zipped, &path("kinarm.zip")].map(|file| read_trials(file, &ReadOptions::default()).unwrap());
    assert_eq!(own.iter().map(|t| &t.trial).collect::<Vec<_>>(), plain.iter().map(|t| &t.trial).collect::<Vec<_>>());
}

#[test]
fn tdms_of_several_segments() {
    let read = one("plain.tdms");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!((samples(&read, "force_x"), samples(&read, "pos_x")), (expected("force", 1.0), expected("pos", 1e-3)));
    assert_eq!(read.recording.metadata().get("operator").map(String::as_str), Some("S 07"));
    assert!(read.notes.iter().any(|n| n.code == "ignored-arrays" && n.message.contains("lab.note")), "{:?}", read.notes);
}

#[test]
fn groups_of_tdms_are_trials_or_rates() {
    let trials = read_trials(&path("trials.tdms"), &ReadOptions::default()).unwrap();
    assert_eq!(trials.iter().map(|t| t.trial.as_deref().unwrap()).collect::<Vec<_>>(), ["trial 1", "trial 2"]);
    assert_eq!(samples(&trials[1], "force_x"), expected("force", 2.0));
    assert_eq!(trials[0].recording.metadata().get("trial 2.load").map(String::as_str), Some("3"));
    let rates = one("rates.tdms");
    assert_eq!(samples(&rates, "force_x")[..117], expected("force", 1.0)[..117]);
    // A ramp, which interpolation gives exactly.
    for (k, value) in samples(&rates, "elbow").iter().enumerate().take(117) {
        assert!((value - 0.25 * k as f64 / 4.0).abs() < 1e-12, "{k}: {value}");
    }
}

#[test]
fn streams_of_xdf_are_joined_by_their_clocks() {
    let read = one("streams.xdf");
    assert!((read.recording.sample_rate_hz() - 200.0).abs() < 1e-9, "{}", read.recording.sample_rate_hz());
    assert!((read.recording.start_s() - 1000.0).abs() < 1e-9);
    assert_eq!(samples(&read, "force_x")[..119], expected("force", 1.0)[..119]);
    assert_eq!(samples(&read, "pos_x")[..119], expected("pos", 1e-3)[..119]);
    for (k, value) in samples(&read, "biceps").iter().enumerate().take(119) {
        // The stamps are of the order of 1000 s, a step of 0.01 s: 2e-13 s of rounding is 1e-8 of the value of one step.
        assert!((value - 1.5 * k as f64).abs() < 1e-6, "{k}: {value}");
    }
    assert_eq!(unit(&read, "biceps"), "microvolts");
    let times: Vec<f64> = read.recording.metadata()["event/HOLD"].split(", ").map(|t| t.parse().unwrap()).collect();
    assert!((times[0] - 1000.1).abs() < 1e-9 && (times[1] - 1000.3).abs() < 1e-9, "{times:?}");
}

#[cfg(feature = "mcap")]
#[test]
fn messages_of_ros_in_every_compression() {
    for name in ["plain.mcap", "lz4.mcap", "zstd.mcap"] {
        let read = one(name);
        assert_eq!(read.recording.sample_rate_hz(), 200.0, "{name}");
        assert_eq!(read.recording.names()[..4], ["angle_shoulder", "angle_elbow", "torque_shoulder", "torque_elbow"], "{name}");
        assert_eq!(samples(&read, "angle_shoulder")[..117], expected("angle", 1.0)[..117], "{name}");
        assert_eq!(samples(&read, "torque_shoulder")[..117], expected("force", 1.0)[..117], "{name}");
        assert_eq!((unit(&read, "angle_elbow"), unit(&read, "torque_elbow"), unit(&read, "force_x"), unit(&read, "torque_x")), ("rad", "N m", "N", "N m"));
        for (k, value) in samples(&read, "force_x").iter().enumerate() {
            assert!((value - 0.25 * k as f64).abs() < 1e-9, "{name} {k}: {value}");
        }
        let note = |code: &str| read.notes.iter().find(|n| n.code == code).map(|n| n.message.clone()).unwrap_or_default();
        assert!(note("clocks-joined").contains("ft_sensor (50.000000 Hz)"), "{:?}", read.notes);
        assert!(note("clock-of-messages").contains("headers") && note("ignored-streams").is_empty(), "{:?}", read.notes);
        assert_eq!(read.recording.metadata()["start_unix_ns"], "1700000000000000000");
    }
}

#[cfg(feature = "parquet")]
#[test]
fn lists_of_parquet_are_channels_and_episodes_are_trials() {
    let trials = read_trials(&path("lerobot.parquet"), &ReadOptions { allow_nan: true, ..Default::default() }).unwrap();
    assert_eq!(trials.iter().map(|t| t.trial.as_deref().unwrap()).collect::<Vec<_>>(), ["episode 0", "episode 1"]);
    for (trial, half) in trials.iter().zip([0..60, 60..120]) {
        assert_eq!(trial.recording.sample_rate_hz(), 200.0);
        assert_eq!(samples(trial, "observation.state_0"), expected("angle", 1.0)[half.clone()]);
        assert_eq!(samples(trial, "observation.state_2"), expected("force", 1.0)[half.clone()]);
        assert_eq!(samples(trial, "action_1"), expected("angle", 1.0)[half.clone()]);
        assert_eq!(samples(trial, "pose.x"), expected("pos", 1.0)[half]);
        assert!(samples(trial, "pose.y").iter().all(|v| v.is_nan()));
        assert!(trial.notes.iter().any(|n| n.message.contains("ragged (lists of several lengths)")), "{:?}", trial.notes);
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn an_array_of_matlab_structs_is_trials() {
    let trials = read_trials(&path("struct_array.mat"), &ReadOptions::default()).unwrap();
    assert_eq!(trials.iter().map(|t| t.trial.as_deref().unwrap()).collect::<Vec<_>>(), ["trial_1", "trial_2"]);
    assert_eq!(samples(&trials[0], "force_x"), expected("force", 1.0));
    assert_eq!(samples(&trials[1], "pos_x"), expected("pos", 2.0));
    assert_eq!(trials[0].recording.sample_rate_hz(), 200.0);
}
