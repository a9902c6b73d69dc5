//! When the machine fails: a full disk, a closed pipe, a folder in the way, a killed process. Nothing is lost, the exit code says who is to blame.

use crate::support::{csv, ndof, noise, oscillator, succeed, trial};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const ESTIMATE: [&str; 5] = ["estimate", "trial.csv", "--nperseg", "1024", "--quiet"];

fn with(extra: &[&'static str]) -> Vec<&'static str> {
    ESTIMATE.into_iter().chain(extra.iter().copied()).collect()
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_standard_output_is_the_machines_fault() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let output = Command::new(env!("CARGO_BIN_EXE_ndof"))
        .args(with(&["--json", "-"]))
        .current_dir(folder.path())
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .expect("the program starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("error: ") && !message.contains("panicked"), "{message}");
}

#[test]
fn a_pipe_that_is_closed_early_is_no_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let mut child = Command::new(env!("CARGO_BIN_EXE_ndof"))
        .args(with(&["--spectra", "--json", "-"]))
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn a_folder_in_the_place_of_a_result_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    std::fs::create_dir(folder.path().join("out.json")).expect("a folder");
    let output = ndof(folder.path(), &with(&["--json", "out.json"]));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(2 | 3)), "{message}");
    assert!(message.contains("out.json") && !message.contains("panicked"), "{message}");
    assert!(folder.path().join("out.json").is_dir());
    assert_eq!(leftovers(folder.path()), Vec::<String>::new());
}

/// Files that no one asked for.
fn leftovers(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "trial.csv" && name != "out.json")
        .collect()
}

#[test]
fn an_earlier_result_survives_a_process_that_is_killed_at_any_moment() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    succeed(folder.path(), &with(&["--spectra", "--json", "out.json"]));
    let earlier = std::fs::read(folder.path().join("out.json")).expect("a result");
    for wait_ms in [0, 5, 10, 20, 40, 80, 160] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_ndof"))
            .args(with(&["--spectra", "--json", "out.json"]))
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(Duration::from_millis(wait_ms));
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");
        assert_eq!(std::fs::read(folder.path().join("out.json")).expect("a result"), earlier, "killed after {wait_ms} ms");
    }
}

#[test]
fn a_recording_that_is_a_folder_is_refused_with_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("trial.csv")).expect("a folder");
    let output = ndof(folder.path(), &ESTIMATE);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(2 | 3)), "{message}");
    assert!(message.contains("trial.csv") && !message.contains("panicked"), "{message}");
}

/// Files may grow to so many blocks of 512 bytes and no further, as on a disk that fills up.
#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_fills_up_while_a_result_is_written_keeps_the_earlier_one() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    succeed(folder.path(), &with(&["--json", "out.json", "--report", "out.html", "--plots", "plots"]));
    let names = ["out.json", "out.html", "plots/bode.svg"];
    let earlier = names.map(|name| std::fs::read(folder.path().join(name)).expect("a result"));
    for extra in [&["--spectra", "--json", "out.json"][..], &["--report", "out.html"], &["--plots", "plots"]] {
        let script = "trap '' XFSZ; ulimit -f 2; exec \"$0\" \"$@\"";
        let output = Command::new("sh")
            .args(["-c", script, env!("CARGO_BIN_EXE_ndof")])
            .args(with(&[]))
            .args(extra)
            .current_dir(folder.path())
            .output()
            .expect("a shell");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{extra:?}: {message}");
        assert!(message.contains("error: ") && message.contains("out") | message.contains("plots") && !message.contains("panicked"), "{message}");
    }
    assert_eq!(names.map(|name| std::fs::read(folder.path().join(name)).expect("a result")), earlier);
    let mut left: Vec<String> = leftovers(folder.path());
    left.sort();
    assert_eq!(left, ["out.html", "plots"], "no half file stays");
}

#[test]
fn a_clock_that_jumps_neither_hides_a_change_nor_makes_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = folder.path().join("subjects");
    std::fs::create_dir(&own).expect("a folder");
    let write = |name: &str, seed: u64| {
        let force = noise(seed, 4000);
        csv(&own.join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &oscillator(&force))]);
    };
    write("anna.csv", 1);
    write("ben.csv", 2);
    let all = ["cohort", "subjects", "--nperseg", "512", "--band", "1-15", "--quiet", "--out", "out"];
    succeed(folder.path(), &all);
    let result = |name: &str| {
        let path = folder.path().join("out/subjects").join(name);
        (std::fs::read(&path).expect("a result"), std::fs::metadata(&path).and_then(|m| m.modified()).expect("a time"))
    };
    let before = (result("anna.json"), result("ben.json"));
    let moved = |name: &str, seconds: i64| {
        let file = std::fs::OpenOptions::new().append(true).open(own.join(name)).expect("there");
        let now = std::time::SystemTime::now();
        let step = Duration::from_secs(seconds.unsigned_abs());
        file.set_modified(if seconds < 0 { now - step } else { now + step }).expect("a time");
    };
    // Anna was measured anew on a machine whose clock is ten years behind; Ben's file has only got a date of the future.
    write("anna.csv", 3);
    moved("anna.csv", -315_000_000);
    moved("ben.csv", 315_000_000);
    succeed(folder.path(), &all);
    assert_ne!(result("anna.json").0, before.0.0, "the change is seen");
    assert_eq!(result("ben.json"), before.1, "what did not change is not done again");
}

#[test]
#[cfg(target_os = "linux")]
fn a_file_that_cannot_be_read_and_a_folder_that_cannot_be_written_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    // Permissions do not hold for root; these fail for everyone.
    let output = ndof(folder.path(), &["estimate", "/proc/self/mem", "--quiet"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("/proc/self/mem"), "{message}");
    for extra in [&["--json", "/sys/out.json"], &["--report", "/sys/out.html"], &["--plots", "/sys/plots"]] {
        let output = ndof(folder.path(), &with(extra));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(3), "{extra:?}: {message}");
        assert!(message.contains(extra[1]), "{message}");
    }
}
