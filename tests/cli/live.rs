//! A trial is watched while it is measured; Ctrl-C ends every command without a half file.

use crate::support::{csv, json, noise, oscillator, oscillator_that_changes, refuse, succeed, violation};
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

/// A minute of 300 N/m and one of 450 N/m, with the limb's own force of a fifth of the one that moves it.
fn change(folder: &Path) {
    let force = noise(1, 60_000);
    let moved: Vec<f64> = force.iter().zip(noise(2, 60_000)).map(|(force, own)| force + 0.2 * own).collect();
    let motion = oscillator_that_changes(|at| [2.0, 12.0, if at < 30_000 { 300.0 } else { 450.0 }], &moved);
    csv(&folder.join("change.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
}

/// Options of live and fit alike.
const ALIKE: [&str; 4] = ["--band", "0.6-8", "--nperseg", "1024"];

/// Every look at a file.
fn looks(folder: &Path, file: &str, options: &[&str]) -> Vec<Value> {
    let lines = succeed(folder, &[&["live", file, "--wait", "0.1", "--json", "-"], &ALIKE[..], options].concat());
    lines.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
}

#[test]
fn the_last_seconds_follow_a_stiffness_that_changes_and_the_whole_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    change(folder.path());
    // Deviation of K from what is true then, in half widths of its 95 % interval, at each look.
    let deviations = |looks: &[Value], of: &dyn Fn(f64) -> Option<f64>| -> Vec<f64> {
        let one = |look: &Value| {
            let truth = of(look["duration_s"].as_f64().expect("a number"))?;
            let k = &look["parameters"][2];
            assert_eq!(k["name"], "K");
            let [low, high] = [0, 1].map(|end| k["ci95"][end].as_f64());
            let (low, high) = (low?, high?);
            Some(((low + high) / 2.0 - truth).abs() / ((high - low) / 2.0))
        };
        looks.iter().filter_map(one).collect()
    };
    let [followed, whole] = [&["--last", "20"][..], &[]].map(|options| looks(folder.path(), "change.csv", options));
    // Looks whose last seconds lie on one side of the change.
    let here = |s: f64| (s <= 60.0).then_some(300.0).or((s >= 80.0).then_some(450.0));
    let found = deviations(&followed, &here);
    // Twice the half width, four standard errors; they are correlated, and one in twenty lies outside one.
    assert!(found.len() > 25 && found.iter().all(|d| *d < 2.0), "{found:?}");
    assert!(found.iter().filter(|d| **d < 1.0).count() as f64 > 0.8 * found.len() as f64, "{found:?}");
    let late = deviations(&whole, &|s| (s >= 80.0).then_some(450.0));
    assert!(late.len() > 10 && late.iter().all(|d| *d > 2.0), "{late:?}");
    let last = &followed[followed.len() - 1];
    assert_eq!((last["duration_s"].as_f64(), last["used_s"].as_f64()), (Some(120.0), Some(20.0)));
    // What follows can be read without JSON, too.
    let text = succeed(folder.path(), &[&["live", "change.csv", "--wait", "0.1", "--last", "20"], &ALIKE[..]].concat());
    let line = text.lines().find(|line| line.starts_with("120.0 s")).expect("a last look");
    assert!(line.contains("(the last 20.0 s count)") && line.contains("; K ") && line.ends_with(" N/m"), "{line}");
}

#[test]
fn a_rest_ends_no_watch() {
    let folder = tempfile::tempdir().expect("a folder");
    let resting = |from: usize, to: usize| move |k: usize| if (from..to).contains(&k) { 0.0 } else { 1.0 };
    // At rest from 20 to 50 s of 70, and up to 20 s of 60.
    for (file, samples, moves, options) in
        [("pause.csv", 35_000, resting(10_000, 25_000), &["--last", "10"][..]), ("begin.csv", 30_000, resting(0, 10_000), &[])]
    {
        let force: Vec<f64> = noise(1, samples).into_iter().enumerate().map(|(k, f)| f * moves(k)).collect();
        let motion: Vec<f64> = oscillator(&force).into_iter().enumerate().map(|(k, x)| x * moves(k)).collect();
        csv(&folder.path().join(file), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
        let looks = looks(folder.path(), file, options);
        let live = &looks[looks.len() - 1];
        assert_eq!(live["duration_s"].as_f64(), Some(samples as f64 / 500.0), "{file}");
        assert!((live["parameters"][2]["value"].as_f64().expect("a number") / 300.0 - 1.0).abs() < 0.05, "{file}: {}", live["parameters"][2]);
    }
    // What never moves is said at the end.
    let still = vec![1.0; 10_000];
    csv(&folder.path().join("still.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &still), ("pos_x [m]", &still)]);
    assert!(refuse(folder.path(), &[&["live", "still.csv", "--wait", "0.1"], &ALIKE[..]].concat()).contains("is constant"));
}

#[test]
fn the_last_look_has_the_numbers_of_a_fit_of_what_counts() {
    let folder = tempfile::tempdir().expect("a folder");
    change(folder.path());
    // With a band that is asked for and with the one that is excited; of everything and of the last 50 s.
    for (options, last, from) in [(&ALIKE[..], &[][..], &[][..]), (&ALIKE[2..], &[], &[]), (&ALIKE[..], &["--last", "50"], &["--start", "70"])] {
        let live = json(folder.path(), &[&["live", "change.csv", "--wait", "0.1", "--every", "1000"], options, last].concat());
        let fit = json(folder.path(), &[&["fit", "change.csv", "--method", "welch"], options, from].concat());
        assert_eq!(live["fitted_hz"], fit["band_hz"]);
        let [ours, theirs] = [&live, &fit].map(|result| result["parameters"].as_array().expect("a list"));
        assert_eq!(ours.len(), theirs.len());
        for (our, their) in ours.iter().zip(theirs) {
            let numbers = |p: &Value| [&p["value"], &p["std_error"], &p["ci95"][0], &p["ci95"][1]].map(|n| n.as_f64().expect("a number"));
            for (a, b) in numbers(our).into_iter().zip(numbers(their)) {
                assert!(our["name"] == their["name"] && (a / b - 1.0).abs() < 1e-9, "{options:?} {last:?}: {our} {their}");
            }
        }
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
    let message = refuse(folder.path(), &["live", "short.csv", "--wait", "0.1", "--nperseg", "512", "--last", "1"]);
    assert!(message.contains("the last 1 s") && message.contains("--last") && message.contains("1.024 s"), "{message}");
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
