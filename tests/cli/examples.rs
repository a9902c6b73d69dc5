//! The examples of the help run as they stand.

use crate::support::{ARM_URDF, held_arm, ndof, succeed};
use std::path::Path;
use std::process::Command;

/// Name of each subcommand with the lines of the example in its help.
fn examples(folder: &Path) -> Vec<(String, Vec<String>)> {
    let page = succeed(folder, &["completions", "markdown"]);
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if let Some(name) = line.strip_prefix("## ").filter(|name| !name.starts_with("Options")) {
            found.push((name.to_owned(), Vec::new()));
        } else if line.starts_with("```") {
            inside = line == "```sh";
        } else if inside && let Some((_, lines)) = found.last_mut() {
            lines.push(line.to_owned());
        }
    }
    found
}

/// Everything that the examples name: trials, an arm, results of two sessions, a folder of subjects.
fn prepare(folder: &Path) {
    let experiment = held_arm("trials = 3\nduration_s = 20.0", "noise = { rms_n = 0.1 }");
    std::fs::write(folder.join("EXPERIMENT.toml"), experiment).expect("written");
    succeed(folder, &["simulate", "EXPERIMENT.toml", "--out", "trial.csv"]);
    std::fs::copy(folder.join("trial-1.csv"), folder.join("trial.csv")).expect("copied");
    let arm = "kind = \"planar-two-link\"\nlink_lengths_m = [0.33, 0.34]\nposture_rad = [0.785, 1.571]\n";
    std::fs::write(folder.join("arm.toml"), arm).expect("written");
    for (k, name) in ["before", "after", "anna", "ben"].into_iter().enumerate() {
        let own = folder.join(if k < 2 { name.to_owned() } else { format!("subjects/{name}") });
        std::fs::create_dir_all(&own).expect("a folder");
        std::fs::copy(folder.join(format!("trial-{}.csv", k % 3 + 1)), own.join("trial.csv")).expect("copied");
        if k < 2 {
            succeed(&own, &["fit", "trial.csv", "--band", "0.5-8", "--json", "fit.json"]);
        }
    }
    std::fs::write(folder.join("arm.urdf"), ARM_URDF).expect("written");
    succeed(folder, &["design", "--robot", "arm.urdf", "--sample-rate", "100", "--speed-limit", "2", "--out", "log.csv", "--quiet"]);
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/io/tests/fixtures/plain.mat"), folder.join("trial.mat")).expect("a file of SciPy");
}

#[test]
fn every_example_of_the_help_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    prepare(folder.path());
    let all = examples(folder.path());
    assert!(all.len() >= 14, "{all:?}");
    let program = Path::new(env!("CARGO_BIN_EXE_ndof"));
    let path = format!("{}:{}", program.parent().expect("a folder").display(), std::env::var("PATH").unwrap_or_default());
    for (name, lines) in all {
        assert!(!lines.is_empty(), "{name} has an example");
        for line in lines {
            assert!(line.starts_with(&format!("ndof {name}")), "{name}: {line}");
            let output = Command::new("sh").args(["-c", &line]).env("PATH", &path).current_dir(folder.path()).output().expect("a shell");
            assert!(output.status.success(), "{line}\n{}", String::from_utf8_lossy(&output.stderr));
        }
    }
}

#[test]
fn there_is_a_man_page_for_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    succeed(folder.path(), &["completions", "man", "--out", "man"]);
    for (name, _) in examples(folder.path()) {
        let page = std::fs::read_to_string(folder.path().join(format!("man/ndof-{name}.1"))).expect("a page");
        assert!(page.contains(".SH SYNOPSIS") && page.contains(".SH DESCRIPTION"), "{name}");
    }
    assert!(folder.path().join("man/ndof.1").exists());
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        assert!(succeed(folder.path(), &["completions", shell]).contains("nperseg"), "{shell}");
    }
    assert_eq!(ndof(folder.path(), &["completions", "bahs"]).status.code(), Some(2));
}
