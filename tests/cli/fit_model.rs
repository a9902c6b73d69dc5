//! `ndof fit --model`: extensions by name, with what they are worth.

use crate::support::{json, noise, oscillator, refuse, succeed, trial, violation};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Three trials of an oscillator whose force channel is three samples (6 ms) late, with 20 µm of noise on the motion.
fn late_trials(folder: &Path) -> Vec<String> {
    (0..3)
        .map(|seed| {
            let force: Vec<f64> = noise(10 + seed, 12_000).iter().map(|f| 6.0 * f).collect();
            let (motion, own) = (oscillator(&force), noise(50 + seed, 12_000));
            let mut text = "# sample_rate_hz: 500\nforce_x [N],pos_x [m]\n".to_owned();
            for k in 3..force.len() {
                writeln!(text, "{},{}", force[k - 3], motion[k] + 2e-5 * own[k]).expect("a string");
            }
            let name = format!("late-{seed}.csv");
            std::fs::write(folder.join(&name), text).expect("written");
            name
        })
        .collect()
}

#[test]
fn a_late_force_channel_is_measured_by_its_model_and_wins_against_every_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = late_trials(folder.path());
    let options = ["--model", "inertia-damping-stiffness+delay", "--compare", "--nperseg", "1024", "--band", "0.6-15"];
    let arguments: Vec<&str> = ["fit"].into_iter().chain(files.iter().map(String::as_str)).chain(options).collect();
    let result = json(folder.path(), &arguments);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "fit"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    assert_eq!(result["model"].as_str(), Some("inertia-damping-stiffness+delay"));
    let parameters = result["parameters"].as_array().expect("parameters");
    let delay = parameters.iter().find(|p| p["name"] == "delay_s").expect("a delay");
    let (value, error) = (delay["value"].as_f64().expect("a value"), delay["std_error"].as_f64().expect("an error"));
    // A 50th of a sample for the mean over an interval against the sample.
    assert!((value - 0.006).abs() < 4.0 * error + 4e-5, "{value} ± {error}");
    assert_eq!((delay["site"]["side"].as_str(), result["matrices"]["delay_s"].as_f64()), (Some("sensor"), Some(value)));
    let compared = result["comparison"].as_array().expect("a comparison");
    assert!(compared.len() > 7 && compared[0]["likelihood_ratio"].is_null());
    let bic = |m: &Value| m["bic"].as_f64().expect("a number");
    let best = compared.iter().min_by(|a, b| bic(a).total_cmp(&bic(b))).expect("some");
    assert_eq!(best["model"], result["model"]);
    assert!(best["likelihood_ratio"]["p_value"].as_f64().expect("p") < 1e-6 && best["likelihood_ratio"]["degrees_of_freedom"] == 1);
    let wide = json(folder.path(), &[arguments.as_slice(), &["--systematic"]].concat());
    let wider = |k: usize| wide["parameters"][k]["std_error"].as_f64().expect("an error");
    // 0.5 % of M and 0.1 ms.
    assert!(wider(0) >= 0.005 * 1.9 && (wider(3) - error.hypot(1e-4)).abs() < 1e-12);
    let table = succeed(folder.path(), &arguments);
    assert!(table.contains("likelihood ratio") && table.contains("against inertia-damping-stiffness"), "{table}");
}

/// A motion that is five samples late: from the fit without a delay the search ends in another minimum.
#[test]
fn the_model_that_is_fitted_is_compared_as_it_is_fitted() {
    let folder = tempfile::tempdir().expect("a folder");
    let force: Vec<f64> = noise(10, 25_000).iter().map(|f| 6.0 * f).collect();
    let (motion, own) = (oscillator(&force), noise(50, 25_000));
    let mut text = "# sample_rate_hz: 500\nforce_x [N],pos_x [m]\n".to_owned();
    (5..force.len()).for_each(|k| writeln!(text, "{},{}", force[k], motion[k - 5] + 2e-5 * own[k]).expect("a string"));
    std::fs::write(folder.path().join("late.csv"), text).expect("written");
    let result = json(folder.path(), &["fit", "late.csv", "--model", "inertia-damping-stiffness+delay"]);
    let compared = result["comparison"].as_array().expect("a comparison").last().expect("the model itself");
    let [fitted, beside] = [&result["chi2_reduced"], &compared["chi2_reduced"]].map(|x| x.as_f64().expect("a number"));
    assert!(compared["model"] == result["model"] && (fitted - beside).abs() < 1e-3 * fitted && fitted < 2.0, "{fitted} {beside}");
}

#[test]
fn a_model_that_there_is_not_is_refused_with_the_name_it_may_have_been() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = late_trials(folder.path());
    let message = refuse(folder.path(), &["fit", &files[0], "--model", "inertia-damping-stiffness+dealy"]);
    assert!(message.contains("did you mean \"delay\"") && message.contains("series-compliance"), "{message}");
}

#[test]
fn a_rival_that_the_band_cannot_carry_is_said_and_a_block_twice_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["fit", "trial.csv", "--nperseg", "1024", "--band", "1-3", "--compare"]);
    let models = result["comparison"].as_array().expect("a list");
    assert!(models[0]["failed"].is_null() && models[0]["chi2"].is_f64(), "{models:?}");
    let failed: Vec<_> = models.iter().filter(|m| m["failed"].is_string()).collect();
    assert!(!failed.is_empty() && failed.iter().all(|m| m["chi2"].is_null()), "{models:?}");
    let message = refuse(folder.path(), &["fit", "trial.csv", "--model", "inertia-damping-stiffness+delay+delay"]);
    assert!(message.contains("delay twice"), "{message}");
}
