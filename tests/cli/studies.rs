//! Studies from the first line to the page.

use crate::support::succeed;
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
