//! A folder of subjects, killed at a random moment and started again; and sessions compared.

use crate::support::{csv, json, noise, oscillator_of, refuse, succeed, violation};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

const SUBJECTS: usize = 200;

/// Two hundred short recordings of oscillators that differ, one of them broken.
fn subjects(folder: &Path) {
    let own = folder.join("subjects");
    std::fs::create_dir_all(&own).expect("a folder");
    for k in 0..SUBJECTS {
        let path = own.join(format!("s{k:03}.csv"));
        let force = noise(k as u64 + 1, 2000);
        let motion = oscillator_of([1.5 + 0.005 * k as f64, 12.0, 200.0 + k as f64], &force);
        csv(&path, "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    }
    std::fs::write(own.join("s050.csv"), "not,a\nrecording,at all\n").expect("written");
}

const OPTIONS: [&str; 8] = ["--nperseg", "512", "--band", "1-15", "--quiet", "--threads", "2", "--out"];

fn written(folder: &Path) -> BTreeMap<String, SystemTime> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("an entry"));
    // A file that is being written may be gone, under its own name, before it is looked at.
    entries
        .filter_map(|entry| Some((entry.file_name().to_string_lossy().into_owned(), entry.metadata().and_then(|m| m.modified()).ok()?)))
        .filter(|(name, _)| !name.starts_with(".ndof-"))
        .collect()
}

#[test]
fn two_hundred_subjects_killed_at_any_moment_end_in_the_same_table() {
    let folder = tempfile::tempdir().expect("a folder");
    subjects(folder.path());
    let arguments = |out: &str| [&["cohort", "subjects"], &OPTIONS[..], &[out]].concat().into_iter().map(str::to_owned).collect::<Vec<_>>();
    let run = |out: &str| {
        let all = arguments(out);
        succeed(folder.path(), &all.iter().map(String::as_str).collect::<Vec<_>>());
        std::fs::read_to_string(folder.path().join(out).join("cohort.csv")).expect("written")
    };
    let truth = run("whole");
    assert_eq!(truth.lines().count(), SUBJECTS + 1);
    assert!(truth.lines().nth(51).expect("a row").contains("s050.csv"), "a failure is a row that says why");
    let moment = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("a clock").subsec_nanos();
    println!("moments drawn from {moment}");
    let mut killed = 0;
    for (round, signal) in ["-KILL", "-INT", "-KILL"].into_iter().enumerate() {
        let out = format!("killed{round}");
        let results = folder.path().join(&out).join("subjects");
        let mut child = Command::new(env!("CARGO_BIN_EXE_ndof"))
            .args(arguments(&out))
            .current_dir(folder.path())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        // After some of the subjects are done: how many is drawn from the clock.
        let until = 1 + (moment as usize / 7_usize.pow(round as u32)) % 120;
        while written(&results).len() < until && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        if child.try_wait().expect("a child").is_none() {
            Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        }
        let code = child.wait().expect("ends").code();
        assert!(code == (if signal == "-INT" { Some(130) } else { None }) || code == Some(0), "{code:?}");
        killed += usize::from(code != Some(0));
        let before = written(&results);
        assert_eq!(run(&out), truth, "{signal} after {} subjects", before.len());
        let after = written(&results);
        // What was done stays as it was; nothing else is missing.
        assert!(before.iter().all(|(name, time)| after[name] == *time), "{signal}: only what was in flight is done again");
        assert_eq!(after.len(), SUBJECTS);
        assert!(std::fs::read_dir(&results).expect("there").all(|entry| !entry.expect("an entry").file_name().to_string_lossy().ends_with(".tmp")), "{signal}");
    }
    assert!(killed > 0, "no run was slow enough to be killed");
}

#[test]
fn sessions_of_several_subjects_give_reliability_and_the_mean_change() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut files: Vec<String> = Vec::new();
    for subject in 0..4_u64 {
        for session in 0..2_u64 {
            let name = format!("s{subject}-{session}");
            let force = noise(100 + 10 * subject + session, 8000);
            // Subjects differ by 50 N/m, the second session is 20 N/m softer.
            let motion = oscillator_of([2.0, 12.0, 250.0 + 50.0 * subject as f64 - 20.0 * session as f64], &force);
            csv(&folder.path().join(format!("{name}.csv")), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
            let (recording, result) = (format!("{name}.csv"), format!("{name}.json"));
            succeed(folder.path(), &["fit", &recording, "--nperseg", "1024", "--band", "0.6-15", "--quiet", "--json", &result]);
            files.push(result);
        }
    }
    let names: Vec<&str> = files.iter().map(String::as_str).collect();
    let result = json(folder.path(), &[&["compare", "--sessions", "2"], &names[..]].concat());
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "compare"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    let stiffness = result["reliability"].as_array().expect("a list").iter().find(|r| r["name"] == "K").expect("K").clone();
    let number = |value: &Value| value.as_f64().expect("a number");
    // Without noise: MS_subjects = 2·Var(250, 300, 350, 400) = 8333, MS_sessions = 800, MS_error = 0: ICC = 8333/(8333 + 400).
    assert!((number(&stiffness["icc"]) - 8333.0 / 8733.0).abs() < 0.02, "{stiffness}");
    let change = &stiffness["changes"][0];
    assert!((number(&change["mean"]) + 20.0).abs() < 4.0 * number(&change["std_error"]).max(0.5), "{change}");
    let table = succeed(folder.path(), &[&["compare", "--sessions", "2"], &names[..]].concat());
    assert!(table.starts_with("4 subjects") && table.contains("ICC(2,1)"), "{table}");
    assert!(refuse(folder.path(), &[&["compare", "--sessions", "3"], &names[..]].concat()).contains("8 fits"));
}
