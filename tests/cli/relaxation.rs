//! A limb that relaxes, behind a force transducer that gives way: `examples/experiments/hidden-relaxation.toml` as anybody would run it.

use crate::support::{json, succeed};
use std::path::Path;

#[test]
fn a_fractional_damping_is_told_with_its_numbers_in_any_band_and_beside_the_transducer() {
    let folder = tempfile::tempdir().expect("a folder");
    let experiment = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/experiments/hidden-relaxation.toml");
    succeed(folder.path(), &["simulate", &experiment.display().to_string(), "--out", "relaxing.csv", "--quiet"]);
    let files = ["relaxing-1.csv", "relaxing-2.csv", "relaxing-3.csv"];
    for band in [&[][..], &["--band", "0.3-12"], &["--band", "1-12"]] {
        let d = json(folder.path(), &[&["diagnose"], &files[..], band].concat());
        assert_eq!((d["causes"][0]["effect"].as_str(), d["causes"].as_array().map(Vec::len)), (Some("viscoelastic"), Some(1)), "{band:?}");
        let inside = |list: &serde_json::Value, name: &str, truth: f64| {
            let parameter = list.as_array().expect("a list").iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{band:?}: no {name}"));
            let of = |name: &str| parameter[name].as_f64();
            let by_error = || of("value").zip(of("std_error")).map(|(value, error)| [-1.96, 1.96].map(|z| value + z * error));
            let ci95 = parameter["ci95"].as_array().map(|ends| [0, 1].map(|k| ends[k].as_f64().expect("an end")));
            let [low, high] = ci95.or_else(by_error).expect("an interval");
            // An interval that says something: a quarter of the value to either side at most.
            assert!(low < truth && truth < high && high - low < 0.5 * truth, "{band:?} {name}: {low} … {high}, {truth} is true");
        };
        inside(&d["causes"][0]["parameters"], "coefficient", 60.0);
        inside(&d["causes"][0]["parameters"], "order", 0.31);
        inside(&d["extended"]["parameters"], "K_x_x", 300.0);
    }
}
