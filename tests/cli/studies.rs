//! Studies from the first line to the page.

use crate::support::{refuse, succeed};
use serde_json::Value;
use std::fs;

/// The page and `study.json` of a study that comes with the program.
fn run(name: &str) -> (String, Value) {
    let folder = tempfile::tempdir().expect("a folder");
    succeed(folder.path(), &["study", name, "--out", "out", "--quiet"]);
    let read = |file: &str| fs::read_to_string(folder.path().join("out").join(file)).expect(file);
    (read("report.html"), serde_json::from_str(&read("study.json")).expect("JSON"))
}

#[test]
fn a_study_of_cases_compares_them_on_one_page() {
    let (page, study) = run("masses");
    let names: Vec<&str> = study["cases"].as_array().expect("cases").iter().filter_map(|case| case["name"].as_str()).collect();
    assert_eq!(names, ["arm", "arm + 0.2 kg", "arm + 0.4 kg", "arm + 0.6 kg", "springs", "springs + 0.2 kg", "springs + 0.4 kg", "springs + 0.6 kg"]);
    assert!(names.iter().all(|name| page.contains(name)));
    assert!(page.matches("<svg").count() > names.len() && page.matches("<table").count() > names.len());
}

#[test]
fn what_a_study_hid_stands_after_what_was_found() {
    let (page, study) = run("arm-hidden");
    let [cause, hidden] = ["Cause: ", "What was hidden</h"].map(|heading| page.rfind(heading).unwrap_or_else(|| panic!("{heading}")));
    assert!(cause < hidden, "{cause} {hidden}");
    let told = &page[hidden..];
    assert!(told.contains("the diagnosis did not see it") && told.contains("hysteresis (limb, y)"), "{}", &told[..600.min(told.len())]);
    assert_eq!(study["cases"].as_array().expect("cases").len(), 1);
}

#[test]
fn a_fit_and_a_diagnosis_are_written_as_studies_that_give_the_same_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |words: &str| succeed(folder.path(), &words.split(' ').collect::<Vec<_>>());
    let read = |file: &str| {
        let mut result: Value = serde_json::from_str(&fs::read_to_string(folder.path().join(file)).expect(file)).expect("JSON");
        result["command"] = Value::Null;
        result
    };
    run("simulate arm --out arm.csv --quiet");
    fs::create_dir(folder.path().join("inner")).expect("made");
    fs::copy(folder.path().join("arm-1.csv"), folder.path().join("inner/arm-1.csv")).expect("copied");
    run("fit inner/arm-1.csv arm-2.csv --band 0.5-9 --start 1 --exclude 20-21.5 --resample=600 --input fy,force_x --output pos_y,pos_x --channels fy=force_y \
         --nperseg 2048 --link-lengths 0.33,0.34 --posture 0.7,1.5 --mean-force measured --study inner/fit.toml --json fit.json --quiet");
    run("study inner/fit.toml --out again --quiet");
    assert_eq!(read("fit.json"), read("again/fit.json"));
    let text = fs::read_to_string(folder.path().join("inner/fit.toml")).expect("a study");
    assert!(text.contains("\"arm-1.csv\"") && text.contains("resample = 600.0") && text.lines().count() < 40, "{text}");
    // Other recordings, asked the same.
    run("study inner/fit.toml --recording arm-3.csv --out other --quiet");
    assert_ne!(read("fit.json")["parameters"], read("other/fit.json")["parameters"]);

    run(
        "diagnose arm-1.csv arm-2.csv --held-out arm-3.csv --without reflex-delay --tolerance 0.02 --seed 3 --study diagnosis.toml --json diagnosis.json --quiet",
    );
    run("study diagnosis.toml --out diagnosed --quiet");
    assert_eq!(read("diagnosis.json"), read("diagnosed/diagnosis.json"));

    // What only a study says: other settings beside, and where the joints are.
    let also = "[kinematics]\nkind = \"planar-two-link\"\nlink_lengths_m = [0.33, 0.34]\nposture_rad = [0.7, 1.5]\n[[also]]\nname = \"short\"\nnperseg = 512\n";
    fs::write(folder.path().join("also.toml"), format!("[recordings]\nfiles = [\"arm-1.csv\"]\n{also}")).expect("written");
    run("study also.toml --out beside --quiet");
    let settings = &read("beside/study.json")["cases"][0]["settings"];
    assert!(
        settings[1]["name"] == "short" && settings[1]["parameters"].as_array().expect("parameters").iter().any(|p| p["name"] == "K_elbow_elbow"),
        "{settings}"
    );

    let files = "files = [\"arm-1.csv\"]\n";
    for (wrong, said) in [
        (format!("{files}strat = 1"), "did you mean \"start\""),
        (format!("{files}sample-rate = \"fast\""), "sample-rate"),
        ("files = []".to_owned(), "files"),
        (format!("{files}[[cases]]\nname = \"a\""), "[cases] is for what is simulated"),
        (format!("{files}[experiment]\ntrials = 2"), "[experiment] is for what is simulated"),
    ] {
        fs::write(folder.path().join("wrong.toml"), format!("[recordings]\n{wrong}\n")).expect("written");
        let error = refuse(folder.path(), &["study", "wrong.toml"]);
        assert!(error.contains("wrong.toml") && error.contains(said), "{error}");
    }
    let error = refuse(folder.path(), &["simulate", "diagnosis.toml", "--out", "x.csv"]);
    assert!(error.contains("diagnosis.toml") && error.contains("only an [experiment]"), "{error}");
    let error = refuse(folder.path(), &["study", "diagnosis.toml", "--start", "1"]);
    assert!(error.contains("[recordings]"), "{error}");
}
