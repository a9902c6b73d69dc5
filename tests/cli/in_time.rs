//! `ndof fit --law`: matrices with force laws, by free runs.

use crate::support::{csv, json, noise, refuse, succeed};

/// A limb of 2 kg, 12 N s/m and 300 N/m with a law, pushed by forces that go straight from sample to sample, at 500 Hz: by leapfrog in steps of 0.04 ms.
fn moved(force: &[f64], law: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    const STEPS: usize = 50;
    let h = 0.002 / STEPS as f64;
    let (mut x, mut v) = (0.0, 0.0);
    let mut out = vec![0.0];
    for pair in force.windows(2) {
        for k in 0..STEPS {
            let f = pair[0] + (pair[1] - pair[0]) * k as f64 / STEPS as f64;
            v += h * (f - 12.0 * v - 300.0 * x - law(x, v)) / 2.0;
            x += h * v;
        }
        out.push(x);
    }
    out
}

/// Smooth forces of some newtons.
fn push(seed: u64, samples: usize) -> Vec<f64> {
    let (mut low, mut lower) = (0.0, 0.0);
    let smooth = |f: &f64| {
        low += 0.06 * (f - low);
        lower += 0.06 * (low - lower);
        12.0 * lower
    };
    noise(seed, samples).iter().map(smooth).collect()
}

#[test]
fn a_hardening_spring_is_fitted_in_time_and_foretells_what_it_has_not_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    const K3: f64 = 2e6;
    for (seed, name) in [(1, "one.csv"), (2, "two.csv"), (3, "three.csv")] {
        let force = push(seed, 10_000);
        let motion: Vec<f64> = moved(&force, |x, _| K3 * x.powi(3)).iter().zip(noise(10 + seed, force.len())).map(|(x, e)| 0.05 + x + 2e-5 * e).collect();
        csv(&folder.path().join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    }
    let files = ["one.csv", "two.csv", "three.csv"];
    let found = json(folder.path(), &[&["fit"][..], &files, &["--law", "cubic-stiffness"]].concat());
    let in_time = &found["in_time"];
    assert_eq!((in_time["laws"][0].as_str(), in_time["held_out"]["what"].as_str()), (Some("cubic-stiffness:x"), Some("three.csv")));
    // Held at 5 cm: laws count from there.
    assert!((in_time["origin"][0].as_f64().expect("a place") - 0.05).abs() < 1e-3);
    for (name, truth) in [("M", 2.0), ("B", 12.0), ("K", 300.0), ("k3_n_per_m3", K3)] {
        let parameters = in_time["parameters"].as_array().expect("a list");
        let p = parameters.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("no {name}"));
        let (value, error) = (p["value"].as_f64().expect("a number"), p["std_error"].as_f64().expect("an error"));
        // Four parameters within four standard errors, which are small.
        assert!((value - truth).abs() < 4.0 * error && error < 0.02 * truth, "{name}: {value} ± {error}, {truth} is true");
    }
    let share = |name: &str| in_time["held_out"][name][0].as_f64().expect("a share");
    assert!(share("nrmse") < 0.2 * share("nrmse_without_laws"), "{in_time}");
    let text = succeed(folder.path(), &[&["fit"][..], &files, &["--law", "cubic-stiffness:x", "--report", "fit.html"]].concat());
    assert!(text.contains("in time, with cubic-stiffness:x, from force_x") && text.contains("k3_n_per_m3"), "{text}");
    let page = std::fs::read_to_string(folder.path().join("fit.html")).expect("a page");
    assert!(page.contains("In time") && page.contains("Held out, without the laws"));
}

/// A robot answers the limb's noise: what a fit in time makes of that is no interval.
#[test]
fn where_there_is_a_command_a_fit_in_time_warns_and_has_no_intervals() {
    let folder = tempfile::tempdir().expect("a folder");
    let (force, other) = (push(5, 6000), noise(6, 6000));
    let motion: Vec<f64> = moved(&force, |_, _| 0.0).iter().zip(noise(7, force.len())).map(|(x, e)| x + 2e-5 * e).collect();
    let command: Vec<f64> = force.iter().zip(other).map(|(f, e)| f + 0.2 * e).collect();
    let columns: [(&str, &[f64]); 3] = [("cmd_x [N]", &command), ("force_x [N]", &force), ("pos_x [m]", &motion)];
    csv(&folder.path().join("open.csv"), "# sample_rate_hz: 500\n", &columns[1..]);
    csv(&folder.path().join("loop.csv"), "# sample_rate_hz: 500\n", &columns);
    for (file, in_loop) in [("open.csv", false), ("loop.csv", true)] {
        let found = json(folder.path(), &["fit", file, "--law", "cubic-stiffness"]);
        assert_eq!(found["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "in-time-in-a-loop"), in_loop, "{file}");
        let parameters = found["in_time"]["parameters"].as_array().expect("a list");
        assert!(
            parameters.iter().all(|p| p["value"].is_f64() && p["ci95"].is_null() == in_loop && p["std_error"].is_null() == in_loop),
            "{file}: {parameters:?}"
        );
    }
}

#[test]
fn a_law_that_is_not_there_is_refused_with_what_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = push(4, 5000);
    let motion = moved(&force, |_, _| 0.0);
    csv(&folder.path().join("a.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    let velocity: Vec<f64> = motion.windows(2).map(|x| 500.0 * (x[1] - x[0])).chain([0.0]).collect();
    csv(&folder.path().join("v.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("vel_x [m/s]", &velocity)]);
    for (file, law, words) in [
        ("a.csv", "bouc-wenn", "did you mean \"bouc-wen\"?"),
        ("a.csv", "bouc-wen:y", "there is no axis \"y\"; the recordings have x"),
        ("v.csv", "bouc-wen", "one position (or angle) an axis"),
    ] {
        let message = refuse(folder.path(), &["fit", file, "--law", law]);
        assert!(message.contains(words), "{law}: {message}");
    }
}
