//! Every file is explained: what it is, what was understood, what would make it readable.

use ndof_io::{Explanation, Holds, explain};
use std::path::{Path, PathBuf};

fn told(path: &Path) -> Explanation {
    explain(path).unwrap_or_else(|e| panic!("{e}"))
}

fn of(name: &str, content: &[u8]) -> Explanation {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("written");
    told(&path)
}

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

#[test]
fn each_format_is_recognised_by_its_content() {
    for (name, format, trials) in [
        ("foreign/plain.c3d", "C3D", 1),
        ("foreign/kinarm.zip", "KINARM archive of C3D", 2),
        ("foreign/streams.xdf", "XDF", 1),
        ("foreign/trials.tdms", "TDMS", 2),
        ("foreign/expected.csv", "CSV", 1),
        ("plain.npz", "NPZ", 1),
    ] {
        // Without its suffix, too.
        let bytes = std::fs::read(fixture(name)).unwrap();
        for told in [told(&fixture(name)), of("nameless", &bytes)] {
            assert_eq!((told.format, told.holds, told.trials.len(), told.readable), (Some(format), Holds::Recording, trials, true), "{name}: {told:?}");
            assert!(!told.trials[0].channels.is_empty() && told.trials[0].sample_rate_hz == Some(200.0) || name.ends_with("xdf"), "{told:?}");
        }
    }
}

#[test]
fn what_cannot_be_read_says_which_option_would_help() {
    for (name, content, not, remedy) in [
        ("log.asc", &b"1 2 3\n4 5 6\n"[..], "no line of channel names", "--columns"),
        ("log.csv", b"force_x [N],pos_x [m]\n1,2\n3,4\n", "how fast the samples were taken", "--sample-rate"),
        ("log.csv", b"t,force_x [N]\n0,1\n0.01,2\n0.05,3\n0.06,4\n", "gaps", "--resample"),
        ("log.csv", b"t,force_x\n0,1\n0.01,\n0.02,3\n", "misses 1 of 3", "--exclude"),
        ("log.csv", b"t,a,b\n0,1,2\n0.01,2,3\n", "the unit of a, b", "--channels"),
        ("log.bag", b"#ROSBAG V2.0\n", "ROS 1", "mcap convert"),
        ("log.h5", b"\x89HDF\r\n\x1a\nnothing", "", ""),
        ("log.bin", b"\x00\x01\x02", "binary", "CSV"),
    ] {
        let told = of(name, content);
        assert!(told.not_understood.iter().any(|text| text.contains(not)), "{name}: {told:?}");
        assert!(told.remedies.iter().any(|text| text.contains(remedy)), "{name}: {told:?}");
    }
    // The channels are told even where the rate is not known.
    let told = of("log.csv", b"force_x [N],pos_x [m]\n1,2\n3,4\n");
    assert_eq!((told.readable, told.trials[0].sample_rate_hz, told.trials[0].channels[1].unit.as_str()), (false, None, "m"));
}

#[test]
fn a_response_is_told_from_a_recording() {
    let told = of("frf.csv", b"frequency_hz,re_x_f,im_x_f\n1,2,3\n2,3,4\n");
    assert_eq!((told.holds, told.readable), (Holds::Response, true));
    assert!(told.understood[0].contains("x to f, 2 frequencies from 1 to 2 Hz"), "{told:?}");
    let told = self::told(&fixture("foreign/frf.uff"));
    assert!(told.holds == Holds::Response && told.understood.iter().any(|t| t.contains("coherences")), "{told:?}");
}
