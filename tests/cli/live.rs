//! A trial is watched while it is measured; Ctrl-C ends every command without a half file.

use crate::support::{csv, json, noise, oscillator, refuse, succeed, violation};
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A trial that is long enough, as text: head, and one line a sample.
fn lines(samples: usize) -> (String, Vec<String>) {
    let force = noise(1, samples);
    let motion = oscillator(&force);
    let rows = (0..samples).map(|k| format!("{:.3},{},{}\n", k as f64 * 0.002, force[k], motion[k] * 1e3)).collect();
    ("t [s],force_x [N],pos_x [mm]\n".to_owned(), rows)
}

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_ndof"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}

const OPTIONS: [&str; 6] = ["--band", "0.6-8", "--nperseg", "1024", "--within", "0.3"];

#[test]
fn samples_on_standard_input_are_judged_as_they_come() {
    let folder = tempfile::tempdir().expect("a folder");
    let (head, rows) = lines(30_000);
    let mut child = start(folder.path(), &[&["live", "-", "--json", "-", "--until-enough"], &OPTIONS[..]].concat());
    let mut stdin = child.stdin.take().expect("piped");
    let mut stdout = BufReader::new(child.stdout.take().expect("piped"));
    stdin.write_all(head.as_bytes()).expect("taken");
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "live"])).expect("JSON");
    let mut states: Vec<Value> = Vec::new();
    for part in rows.chunks(3000) {
        // The program ends by itself once it is enough: then nobody takes what is written.
        if stdin.write_all(part.concat().as_bytes()).is_err() {
            break;
        }
        let mut line = String::new();
        if stdout.read_line(&mut line).expect("text") == 0 {
            break;
        }
        states.push(serde_json::from_str(&line).expect("a line of JSON"));
        assert_eq!(violation(&states[states.len() - 1], &schema, &schema, ""), None);
    }
    drop(stdin);
    assert!(child.wait().expect("ends").success());
    let (first, last) = (&states[0], &states[states.len() - 1]);
    assert!(states.len() > 1 && first["enough"] == false && last["enough"] == true, "{} looks", states.len());
    assert!(first["needed_s"].as_f64().expect("a number") > first["duration_s"].as_f64().expect("a number"));
    assert!(last["duration_s"].as_f64().expect("a number") < 60.0, "it ended before the samples did");
    for (k, truth) in [2.0, 12.0, 300.0].into_iter().enumerate() {
        let [low, high] = [0, 1].map(|end| last["parameters"][k]["ci95"][end].as_f64().expect("an interval"));
        // Twice the interval: four standard errors.
        assert!(((low + high) / 2.0 - truth).abs() < high - low, "{}: {low} to {high}, not {truth}", last["parameters"][k]["name"]);
    }
}

#[test]
fn the_last_look_is_the_estimate_of_the_whole_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (head, rows) = lines(15_000);
    std::fs::write(folder.path().join("a.csv"), head + &rows.concat()).expect("written");
    let options = ["--nperseg", "1024", "--band", "0.6-8", "--response", "compliance"];
    let live = json(folder.path(), &[&["live", "a.csv", "--wait", "0.2", "--every", "1000"], &options[..]].concat());
    let whole = json(folder.path(), &[&["estimate", "a.csv"], &options[..]].concat());
    assert_eq!(live["frequency_hz"], whole["frequency_hz"]);
    let part = |name: &str, f: usize| whole["direct"][name][0][0][f].as_f64().expect("a number");
    for f in 0..live["frequency_hz"].as_array().expect("a grid").len() {
        let (gain, truth) = (live["gain"][0][0][f].as_f64().expect("a number"), part("re", f).hypot(part("im", f)));
        // Two roundings in reading decimal numbers.
        assert!((gain / truth - 1.0).abs() <= 4.0 * f64::EPSILON, "{f}: {gain}, not {truth}");
    }
}

#[test]
fn a_file_that_grows_is_followed_and_ctrl_c_ends_with_what_is_known() {
    let folder = tempfile::tempdir().expect("a folder");
    let (head, rows) = lines(12_000);
    let path = folder.path().join("growing.csv");
    std::fs::write(&path, head + &rows[..6000].concat()).expect("written");
    let mut child = start(folder.path(), &[&["live", "growing.csv", "--wait", "60", "--json", "live.json"], &OPTIONS[..]].concat());
    let mut stdout = BufReader::new(child.stdout.take().expect("piped"));
    let mut look = || {
        let mut line = String::new();
        assert!(stdout.read_line(&mut line).expect("text") > 0, "it ended by itself");
        line
    };
    while !look().starts_with("12.0 s") {}
    let mut file = std::fs::OpenOptions::new().append(true).open(&path).expect("there");
    file.write_all(rows[6000..].concat().as_bytes()).expect("written");
    while !look().starts_with("24.0 s") {}
    interrupt(&child);
    assert_eq!(child.wait().expect("ends").code(), Some(130));
    let result: Value = serde_json::from_slice(&std::fs::read(folder.path().join("live.json")).expect("written")).expect("JSON");
    assert_eq!(result["duration_s"].as_f64(), Some(24.0));
}

#[test]
fn too_little_for_a_look_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = noise(1, 1500);
    csv(&folder.path().join("short.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &oscillator(&force))]);
    let message = refuse(folder.path(), &["live", "short.csv", "--wait", "0.1"]);
    assert!(message.contains("short.csv") && message.contains("3.000 s") && message.contains("--nperseg"), "{message}");
    assert!(refuse(folder.path(), &["live", "none.csv"]).contains("none.csv"));
    assert!(refuse(folder.path(), &["live", "short.csv", "--share", "2"]).contains("--share"));
}

#[test]
fn an_interrupt_leaves_whole_files_only() {
    let folder = tempfile::tempdir().expect("a folder");
    // Interrupted at several moments: while it simulates, estimates and writes.
    let mut interrupted = 0;
    for (k, milliseconds) in [20_u64, 200, 600, 1200].into_iter().enumerate() {
        let out = format!("out{k}");
        let mut child = start(folder.path(), &["study", "arm", "--out", &out, "--quiet"]);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(milliseconds) && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        if child.try_wait().expect("a child").is_some() {
            continue;
        }
        interrupt(&child);
        let code = child.wait().expect("ends").code();
        assert!(code == Some(130) || code == Some(0), "{code:?}");
        interrupted += usize::from(code == Some(130));
        let mut folders = vec![folder.path().join(&out)];
        while let Some(next) = folders.pop() {
            for entry in std::fs::read_dir(&next).into_iter().flatten().map(|entry| entry.expect("an entry").path()) {
                match entry.extension().map(|suffix| suffix.to_string_lossy().into_owned()).as_deref() {
                    None => folders.push(entry),
                    Some("json") => drop(serde_json::from_slice::<Value>(&std::fs::read(&entry).expect("there")).expect("a whole file")),
                    Some("csv") => assert!(std::fs::read(&entry).expect("there").ends_with(b"\n"), "{}", entry.display()),
                    suffix => assert_ne!(suffix, Some("tmp"), "{}", entry.display()),
                }
            }
        }
    }
    assert!(interrupted > 0, "no run was slow enough to be interrupted");
}

#[test]
fn segments_that_see_no_frequency_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.csv"), {
        let (head, lines) = lines(2000);
        head + &lines.concat()
    })
    .expect("written");
    for nperseg in ["1", "4", "15"] {
        let message = refuse(folder.path(), &["live", "a.csv", "--nperseg", nperseg, "--wait", "0.1"]);
        assert!(message.contains("--nperseg") && !message.contains("panicked"), "{message}");
    }
}
