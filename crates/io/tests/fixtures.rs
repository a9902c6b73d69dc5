//! Files made by NumPy, SciPy, pandas, pyarrow and h5py (`fixtures/make_fixtures.py`, versions in `fixtures/versions.txt`).

use ndof_io::{ReadOptions, ReadRecording, encode, read, read_bytes};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use std::path::PathBuf;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

fn fixture(name: &str) -> ReadRecording {
    read(&folder().join(name), &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn expected(name: &str) -> Vec<f64> {
    fixture("expected.csv").recording.channel(name).expect(name).samples.clone()
}

#[test]
fn each_file_of_numpy_and_scipy_holds_the_same_recording() {
    for (file, force, pos, ignored) in [
        ("plain.npz", "force_x", "pos_x", false),
        ("time_deflated.npz", "force_x", "pos_x", false),
        ("types.npz", "force_int", "pos_single", true),
        ("plain.mat", "force_x", "pos_x", false),
        ("types.mat", "force_int", "pos_single", true),
    ] {
        let read = fixture(file);
        assert_eq!(read.recording.sample_rate_hz(), 200.0, "{file}");
        assert_eq!(read.recording.channel("force_x").expect(file).samples, expected(force), "{file}");
        assert_eq!(read.recording.channel("pos_x").expect(file).samples, expected(pos), "{file}");
        assert_eq!(read.recording.channel("pos_x").expect(file).unit, Unit::si(Quantity::Displacement, false), "{file}");
        assert_eq!(read.recording.channels().len(), 2, "{file}: {:?}", read.recording.names());
        assert_eq!(read.notes.iter().any(|n| n.code == "ignored-arrays"), ignored, "{file}: {:?}", read.notes);
    }
    assert_eq!(fixture("types.npz").recording.metadata().get("subject").map(String::as_str), Some("S 07"));
}

#[test]
fn a_struct_with_units_is_read_as_its_fields() {
    let read = fixture("struct_compressed.mat");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(read.recording.metadata().get("trial.subject").map(String::as_str), Some("S 07"));
    for (mm, m) in read.recording.channel("pos_x").expect("pos_x").samples.iter().zip(expected("pos_x")) {
        assert!((mm - m).abs() <= 2.0 * f64::EPSILON * m.abs(), "{mm} {m}");
    }
    let codes: Vec<_> = read.notes.iter().map(|n| n.code.as_str()).collect();
    assert!(codes.contains(&"unit-converted") && codes.contains(&"ignored-arrays"), "{codes:?}");
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_of_pandas_and_of_pyarrow_is_read() {
    let read = fixture("pandas.parquet");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(read.recording.names(), ["force_x", "pos_x"]);
    assert_eq!(read.recording.channel("force_x").expect("force_x").samples, expected("force_x"));
    assert_eq!(read.recording.channel("pos_x").expect("pos_x").samples, expected("pos_x"));
    assert!(read.recording.metadata().is_empty(), "{:?}", read.recording.metadata());

    let path = folder().join("types.parquet");
    let error = ndof_io::read(&path, &ReadOptions::default()).expect_err("a value is missing");
    assert!(error.to_string().contains("sample 7, channel \"force_x\""), "{error}");
    let read = ndof_io::read(&path, &ReadOptions { allow_nan: true, ..Default::default() }).expect("types.parquet");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(read.recording.metadata().get("subject").map(String::as_str), Some("S 07"));
    assert_eq!(read.recording.names(), ["force_x", "pos_x"]);
    let whole = expected("pos_single").iter().map(|p| p * 1024.0).map(|p| if p < 0.0 { p + 65536.0 } else { p }).collect::<Vec<_>>();
    assert_eq!(read.recording.channel("pos_x").expect("pos_x").samples, whole);
    for (k, (kilo, newton)) in expected("force_int").iter().zip(&read.recording.channel("force_x").expect("force_x").samples).enumerate() {
        assert!(if k == 7 { newton.is_nan() } else { *newton == kilo * 1000.0 }, "{k}: {newton}");
    }
    assert!(read.notes.iter().any(|n| n.code == "ignored-arrays" && n.message.contains("stamp")), "{:?}", read.notes);
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_format_that_is_not_built_in_names_its_feature() {
    for name in ["pandas.parquet", "types.parquet"] {
        let error = read(&folder().join(name), &ReadOptions::default()).expect_err("not built in");
        assert!(error.to_string().contains("--features parquet"), "{error}");
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn a_struct_of_matlab_7_3_is_read_as_its_fields() {
    let read = fixture("v73.mat");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(read.recording.names(), ["force_x", "pos_x"]);
    assert_eq!(read.recording.channel("force_x").expect("force_x").samples, expected("force_x"));
    for (mm, m) in read.recording.channel("pos_x").expect("pos_x").samples.iter().zip(expected("pos_x")) {
        assert!((mm - m).abs() <= 2.0 * f64::EPSILON * m.abs(), "{mm} {m}");
    }
    assert_eq!(read.recording.metadata().get("trial.subject").map(String::as_str), Some("S 07"));
}

#[cfg(feature = "hdf5")]
#[test]
fn a_group_of_hdf5_with_attributes_is_read() {
    let read = fixture("group.h5");
    assert_eq!(read.recording.sample_rate_hz(), 200.0);
    assert_eq!(read.recording.channel("force_x").expect("force_x").samples, expected("force_x"));
    for (mm, m) in read.recording.channel("pos_x").expect("pos_x").samples.iter().zip(expected("pos_single")) {
        assert!((mm - m).abs() <= 2.0 * f64::from(f32::EPSILON) * m.abs(), "{mm} {m}");
    }
    assert_eq!(read.recording.metadata().get("subject").map(String::as_str), Some("S 07"));
    let error = ndof_io::read(&folder().join("broken_off.h5"), &ReadOptions::default()).expect_err("never written");
    assert!(error.to_string().contains("3 of its 8 chunks were never written"), "{error}");
    for name in ["loop.h5", "billion.h5"] {
        let error = ndof_io::read(&folder().join(name), &ReadOptions::default()).expect_err(name);
        assert!(matches!(error, ndof_io::IoError::TooLarge { .. }), "{error}");
    }
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn hdf5_and_matlab_7_3_that_are_not_built_in_name_their_feature() {
    for name in ["v73.mat", "group.h5", "plain.h5", "loop.h5", "billion.h5", "broken_off.h5"] {
        let error = read(&folder().join(name), &ReadOptions::default()).expect_err("not built in");
        assert!(error.to_string().contains("--features hdf5"), "{error}");
    }
}

#[test]
fn every_fixture_is_used_here() {
    let tests = [include_str!("fixtures.rs"), include_str!("foreign.rs"), include_str!("response.rs")].concat();
    for folder in [folder(), folder().join("foreign")] {
        for entry in std::fs::read_dir(folder).expect("folder") {
            let name = entry.expect("entry").file_name().to_string_lossy().into_owned();
            let beside = name == "make_fixtures.py" || name == "make_foreign.py" || name == "versions.txt" || name == "foreign";
            assert!(tests.contains(&format!("\"{name}\"")) || beside, "{name}");
        }
    }
}

#[test]
fn npz_comes_back_bit_for_bit() {
    let values = vec![0.0, -0.0, 1.0 / 3.0, 5e-324, f64::MAX, 1e-300];
    let channel = |name: &str, unit: Unit| Channel::new(name, unit, values.clone());
    let channels = vec![
        channel("force_x", Unit::si(Quantity::Effort, false)),
        channel("pos_x", Unit::other("")),
        channel("emg, left/right [mV]", Unit::other("mV")),
        channel("größe", Unit::si(Quantity::Velocity, true)),
    ];
    let metadata = [("arm".to_owned(), "left".to_owned()), ("remark".to_owned(), " two\nlines ".to_owned())].into();
    let recording = Recording::new(1000.0 / 3.0, channels).expect("valid").starting_at(0.1).with_metadata(metadata);
    let bytes = encode(&recording, "a.npz").expect("npz");
    let back = read_bytes(&bytes, "a.npz", &ReadOptions::default()).expect("npz").recording;
    assert_eq!(back, recording);
    assert!(back.channels().iter().all(|c| c.samples.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits())));
    assert_eq!(encode(&recording, "a.npz").expect("npz"), bytes);
}
