//! A force that turns with the motion, as in a curl field, and a wrong gain of one axis: linear, and no symmetric matrix has them.

use crate::support::{held_arm, json, succeed};

#[test]
fn what_turns_between_two_axes_is_told_with_its_matrix_and_nothing_beside_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let experiment = |effect: &str| {
        let hidden = format!("noise = {{ rms_n = 0.1 }}\n[[effects]]\nname = \"cross-coupling\"\nside = \"limb\"\nparameters = {{ {effect} }}");
        held_arm("trials = 2\nduration_s = 40.0", &hidden)
    };
    for (name, effect, letter) in [("damping", "damping = [[0.0, 6.0], [-6.0, 0.0]]", "B"), ("matrix", "matrix = [[0.0, 40.0], [-40.0, 0.0]]", "K")] {
        std::fs::write(folder.path().join("curl.toml"), experiment(effect)).expect("written");
        succeed(folder.path(), &["simulate", "curl.toml", "--out", "curl.csv", "--quiet"]);
        let d = json(folder.path(), &["diagnose", "curl-1.csv", "curl-2.csv"]);
        let causes: Vec<&str> = d["causes"].as_array().expect("a list").iter().filter_map(|c| c["effect"].as_str()).collect();
        assert_eq!(causes, ["cross-coupling"], "{effect}");
        let told = &d["causes"][0]["parameters"][0];
        let truth = if letter == "B" { 6.0 } else { 40.0 };
        let entry = |i: usize, j: usize| told["value"][i][j].as_f64().expect("a number");
        assert_eq!(told["name"], name);
        assert!((entry(0, 1) / truth - 1.0).abs() < 0.05 && entry(1, 0) == -entry(0, 1) && entry(0, 0) == 0.0, "{told}");
        let of =
            |name: String| d["extended"]["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == name).expect("it is there")["value"].as_f64();
        let turned = of(format!("{letter}_x_y")).zip(of(format!("{letter}_y_x"))).map(|(a, b)| 0.5 * (a - b));
        assert!(turned.is_some_and(|t| (t / truth - 1.0).abs() < 0.05), "{turned:?}");
        // The same by a fit that assumes no symmetry: a matrix that is not symmetric beyond chance is one that no passive limb has.
        let free = json(folder.path(), &["fit", "curl-1.csv", "curl-2.csv", "--symmetry", "free"]);
        for mirrored in free["symmetry"].as_array().expect("three matrices") {
            let p = mirrored["p_value"].as_f64().expect("a probability");
            assert_eq!(mirrored["matrix"] == letter, p < 1e-3, "{effect}: {mirrored}");
            if mirrored["matrix"] == letter {
                let half = &mirrored["half_differences"][0];
                let [value, error] = ["value", "std_error"].map(|field| half[field].as_f64().expect("a number"));
                assert!((value - truth).abs() < 4.0 * error && half["name"] == format!("{letter}_x_y"), "{half}");
            }
        }
        let error = |model: &str| d[model]["held_out"]["nrmse"][0].as_f64().expect("a share");
        assert!(error("extended") < 0.7 * error("baseline"), "{} {}", error("baseline"), error("extended"));
    }
}

/// Matrices that are fitted absorb a gain of all channels: symmetric ones tell that of one beside the other.
#[test]
fn a_wrong_gain_of_one_axis_is_told_beside_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    for (channel, gain, factor) in [("force_x", 1.15, 1.0 / 1.15), ("force_y", 0.85, 0.85)] {
        let hidden = format!(
            "noise = {{ rms_n = 0.1 }}\n[[effects]]\nname = \"sensor-scale\"\nside = \"sensor\"\nparameters = {{ factor = {gain}, channel = \"{channel}\" }}"
        );
        std::fs::write(folder.path().join("gain.toml"), held_arm("trials = 3\nduration_s = 40.0", &hidden)).expect("written");
        succeed(folder.path(), &["simulate", "gain.toml", "--out", "gain.csv", "--quiet"]);
        let d = json(folder.path(), &["diagnose", "gain-1.csv", "gain-2.csv", "gain-3.csv"]);
        let causes: Vec<&str> = d["causes"].as_array().expect("a list").iter().filter_map(|c| c["effect"].as_str()).collect();
        assert_eq!(causes, ["sensor-scale"], "{channel}");
        let told = |name: &str| d["causes"][0]["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == name).expect("it is there").clone();
        assert_eq!([told("channel"), told("relative_to")].map(|p| p["value"].clone()), ["force_y", "force_x"]);
        let interval = [0, 1].map(|k| told("factor")["ci95"][k].as_f64().expect("an interval"));
        assert!(interval[0] <= factor && factor <= interval[1] && interval[1] < 1.0, "{channel}: {interval:?} for {factor}");
    }
}
