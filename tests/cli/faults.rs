//! When the machine fails: a full disk, a closed pipe, a folder in the way, a killed process. Nothing is lost, the exit code says who is to blame.

use crate::support::{ndof, succeed, trial};
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
