//! `ndof estimate --stream`: recordings piece by piece.

use crate::support::{csv, json, noise, oscillator, refuse, succeed};
use std::fmt::Write;

#[test]
fn a_streamed_estimate_is_the_estimate() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, seed) in [("one.csv", 1), ("two.csv", 2)] {
        let force = noise(seed, 30_000);
        let motion = oscillator(&force);
        let mut text = "# sample_rate_hz: 500\nforce_x [N],pos_x [m]\n".to_owned();
        force.iter().zip(&motion).for_each(|(f, x)| writeln!(text, "{f},{x}").expect("text"));
        // The last line of the second has no end.
        std::fs::write(folder.path().join(name), if seed == 2 { text.trim_end() } else { text.as_str() }).expect("written");
    }
    let settings = ["--method", "welch", "--nperseg", "2048", "--band", "0.5-20"];
    let estimate = |first: &[&str]| json(folder.path(), &[&["estimate"], first, &settings[..]].concat());
    let whole = estimate(&["one.csv", "two.csv"]);
    let streamed = estimate(&["--stream", "one.csv", "two.csv"]);
    for part in ["direct", "method", "trials", "frequency_hz", "inputs", "units"] {
        assert_eq!(whole[part], streamed[part], "{part}");
    }
    if cfg!(feature = "parquet") {
        succeed(folder.path(), &["convert", "one.csv", "one.parquet"]);
        assert_eq!(estimate(&["--stream", "one.parquet"])["direct"], estimate(&["one.csv"])["direct"]);
    }
    // Without --nperseg nobody knows the length of the whole: about 4 s.
    let free = json(folder.path(), &["estimate", "--stream", "one.csv"]);
    assert_eq!(free["method"]["nperseg"], 2048);
}

#[test]
fn what_needs_whole_recordings_is_refused_with_stream() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.csv"), "# sample_rate_hz: 500\nforce_x [N],pos_x [m]\n1,2\n").expect("written");
    for option in [&["--robust"][..], &["--sliding", "5"], &["--report", "r.html"], &["--start", "1"]] {
        assert!(refuse(folder.path(), &[&["estimate", "a.csv", "--stream"], option].concat()).contains("--stream reads them piece by piece"), "{option:?}");
    }
    assert!(refuse(folder.path(), &["estimate", "a.csv", "--stream", "--method", "multitaper"]).contains("--method welch"));
    assert!(refuse(folder.path(), &["estimate", "a.csv", "--stream"]).contains("a.csv"));
}

#[test]
fn a_stream_refuses_what_a_whole_read_refuses() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(3, 20_000);
    let motion = oscillator(&force);
    let time: Vec<f64> = (0..force.len()).map(|k| (k + if k < 12_000 { 0 } else { 500 }) as f64 * 0.002).collect();
    let jittered: Vec<f64> = (0..force.len()).map(|k| k as f64 * 0.002 + if k < 12_000 || k % 2 == 0 { 0.0 } else { 0.0007 }).collect();
    let write = |name: &str, head: &str, columns: &[(&str, &[f64])]| csv(&folder.path().join(name), head, columns);
    write("gap.csv", "", &[("t [s]", &time), ("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("jitter.csv", "", &[("t [s]", &jittered), ("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("count.csv", "# sample_rate_hz: 500\n# samples: 40000\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("good.csv", "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    write("volt.csv", "# sample_rate_hz: 500\n", &[("force_x [V]", &time), ("pos_x [m]", &motion)]);
    for (file, words) in [("gap.csv", "line 12002"), ("jitter.csv", "irregular"), ("count.csv", "40000")] {
        for stream in [&[][..], &["--stream"]] {
            let message = refuse(folder.path(), &[&["estimate", file], stream].concat());
            assert!(message.contains(file) && message.contains(words), "{stream:?}: {message}");
        }
    }
    for stream in [&[][..], &["--stream"]] {
        let message = refuse(folder.path(), &[&["estimate", "good.csv", "volt.csv"], stream].concat());
        assert!(message.contains("force_x [V]") && message.contains("force_x [N]"), "{stream:?}: {message}");
    }
}
