//! Each command does what its help says; results follow their schema and do not depend on threads.

use crate::support::{held_arm, json, ndof, refuse, shared, succeed, trial, violation};
use serde_json::Value;

#[test]
fn an_estimate_finds_the_oscillator_and_follows_its_schema() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["estimate", "trial.csv", "--nperseg", "1024", "--band", "0.4-20", "--spectra"]);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "estimate"])).expect("JSON");
    let of = |name: &str| succeed(folder.path(), &["schema", name]);
    assert_eq!(["diagnose", "study", "simulate", "cohort"].map(of), ["diagnosis", "study-result", "truth", "fit"].map(of));
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    assert_eq!(
        (result["schema"].as_str(), result["command"].as_str(), result["response"].as_str()),
        (Some("ndof/estimate/1"), Some("estimate"), Some("compliance"))
    );
    let hz = result["frequency_hz"].as_array().expect("a grid");
    assert!(hz.iter().all(|f| (0.4..=20.0).contains(&f.as_f64().expect("a number"))));
    let f = hz.iter().position(|f| f.as_f64().expect("a number") > 5.0).expect("5 Hz");
    let w = std::f64::consts::TAU * hz[f].as_f64().expect("a number");
    let truth = 1.0 / (300.0 - 2.0 * w * w).hypot(12.0 * w);
    let gain = result["direct"]["re"][0][0][f].as_f64().expect("re").hypot(result["direct"]["im"][0][0][f].as_f64().expect("im"));
    let sd = result["direct"]["gain_std_error"][0][0][f].as_f64().expect("an error");
    // Four standard errors, and a half per mille for the window's bias at 5 Hz (b = σ_W² H''/2, T = 2 s).
    assert!((gain - truth).abs() < 4.0 * sd + 2e-2 * truth, "{gain} against {truth} ± {sd}");
}

#[test]
fn a_fit_finds_the_oscillator_and_follows_its_schema() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["fit", "trial.csv", "--nperseg", "1024", "--band", "0.6-15"]);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "fit"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    for (k, (name, truth)) in [("M", 2.0), ("B", 12.0), ("K", 300.0)].into_iter().enumerate() {
        let p = &result["parameters"][k];
        assert_eq!(p["name"].as_str(), Some(name));
        let value = p["value"].as_f64().expect("a value");
        // The window's leakage is all the noise there is: four standard errors.
        assert!((value - truth).abs() < 4.0 * p["std_error"].as_f64().expect("an error"), "{name} = {value}");
        assert_eq!(result["matrices"][name][0][0].as_f64(), Some(value));
    }
}

#[test]
fn the_response_can_be_asked_for_by_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let compliance = json(folder.path(), &["estimate", "trial.csv", "--nperseg", "512"]);
    let stiffness = json(folder.path(), &["estimate", "trial.csv", "--nperseg", "512", "--response", "dynamic-stiffness"]);
    assert_eq!((compliance["inputs"][0].as_str(), stiffness["inputs"][0].as_str()), (Some("force_x"), Some("pos_x")));
    let at = |result: &Value, f: usize| {
        let part = |name: &str| result["direct"][name][0][0][f].as_f64().expect("a number");
        (part("re"), part("im"))
    };
    let ((a, b), (c, d)) = (at(&compliance, 9), at(&stiffness, 9));
    assert!((a * c - b * d - 1.0).abs() < 1e-12 && (a * d + b * c).abs() < 1e-12, "the product is one");
}

#[test]
fn an_inverse_has_the_coherences_of_its_own_direction_and_keeps_the_measured_ones_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = [crate::support::noise(3, 8000), crate::support::noise(4, 8000)];
    let own = force.clone().map(|f| crate::support::oscillator(&f));
    let mixed = |a: usize, b: usize| -> Vec<f64> {
        own[a].iter().zip(&own[b]).zip(crate::support::noise(5 + a as u64, 8000)).map(|((x, y), e)| x + 0.3 * y + 3e-4 * e).collect()
    };
    crate::support::csv(
        &folder.path().join("two.csv"),
        "# sample_rate_hz: 500\n",
        &[("force_x [N]", &force[0]), ("force_y [N]", &force[1]), ("pos_x [m]", &mixed(0, 1)), ("pos_y [m]", &mixed(1, 0))],
    );
    let estimate = |extra: &[&str]| json(folder.path(), &[&["estimate", "two.csv", "--nperseg", "512"], extra].concat());
    let (compliance, stiffness) = (estimate(&[]), estimate(&["--response", "dynamic-stiffness"]));
    assert!(compliance["measured_direction"].is_null());
    assert_eq!(stiffness["measured_direction"]["direct"], compliance["direct"]["coherence"]);
    assert_eq!(stiffness["measured_direction"]["inputs"], compliance["inputs"]);
    let number = |value: &Value| value.as_f64().expect("a number");
    let (forward, backward) = (&compliance["direct"]["coherence"], &stiffness["direct"]["coherence"]);
    assert!((number(&forward["ordinary"][0][1][9]) - number(&backward["ordinary"][1][0][9])).abs() < 1e-12, "a pair has one ordinary coherence");
    assert!((number(&forward["multiple"][0][9]) - number(&backward["multiple"][0][9])).abs() > 1e-3, "the multiple ones differ");
    let local = estimate(&["--method", "local-polynomial", "--response", "dynamic-stiffness"]);
    assert!(local["direct"]["coherence"]["partial"][0][0][9].is_null() && local["measured_direction"]["direct"]["partial"][0][0][9].is_f64());
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "estimate"])).expect("JSON");
    assert_eq!(violation(&stiffness, &schema, &schema, ""), None);
}

#[test]
fn a_robust_estimate_names_the_segments_that_a_knock_has_wrecked() {
    let folder = tempfile::tempdir().expect("a folder");
    let force = crate::support::noise(7, 20_000);
    let mut motion: Vec<f64> = crate::support::oscillator(&force).iter().zip(crate::support::noise(8, 20_000)).map(|(x, e)| x + 1e-4 * e).collect();
    let write = |name: &str, motion: &[f64]| {
        crate::support::csv(&folder.path().join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", motion)])
    };
    write("clean.csv", &motion);
    motion[12_000..12_030].iter_mut().for_each(|x| *x += 0.5);
    write("knocked.csv", &motion);
    let estimate = |file: &str, extra: &[&str]| json(folder.path(), &[&["estimate", file, "--nperseg", "512", "--band", "1-15"], extra].concat());
    let (clean, knocked, robust) = (estimate("clean.csv", &[]), estimate("knocked.csv", &[]), estimate("knocked.csv", &["--robust"]));
    assert!(clean["robust"].is_null());
    let rejected = robust["robust"]["rejected"].as_array().expect("a list");
    assert!(!rejected.is_empty() && rejected.len() <= 4, "{rejected:?}");
    for r in rejected {
        let at = |name: &str| r[name].as_f64().expect("seconds");
        assert!(at("start_s") < 24.06 && at("end_s") > 24.0, "{r}");
    }
    let distance = |other: &Value| {
        let part =
            |r: &Value, name: &str| r["direct"][name][0][0].as_array().expect("a spectrum").iter().map(|v| v.as_f64().expect("a number")).collect::<Vec<f64>>();
        ["re", "im"].iter().flat_map(|n| part(other, n).into_iter().zip(part(&clean, n)).map(|(a, b)| (a - b).powi(2))).sum::<f64>().sqrt()
    };
    assert!(distance(&robust) < 0.1 * distance(&knocked), "{} against {}", distance(&robust), distance(&knocked));
    let message = crate::support::refuse(folder.path(), &["estimate", "clean.csv", "--robust", "--method", "multitaper"]);
    assert!(message.contains("welch"), "{message}");
}

#[test]
fn what_changes_with_time_shows_in_windows_and_between_trials() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, seed: u64, gain: &dyn Fn(usize) -> f64| {
        let force = crate::support::noise(seed, 8000);
        let motion: Vec<f64> = crate::support::oscillator(&force)
            .iter()
            .zip(crate::support::noise(seed + 50, 8000))
            .enumerate()
            .map(|(k, (x, e))| gain(k) * x + 2e-4 * e)
            .collect();
        crate::support::csv(&folder.path().join(name), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    };
    write("a.csv", 11, &|_| 1.0);
    write("b.csv", 12, &|_| 1.0);
    write("c.csv", 13, &|_| 1.5);
    // A spring alone, so that a window's leakage does not blur the change.
    let force = crate::support::noise(14, 8000);
    let motion: Vec<f64> = force.iter().enumerate().map(|(k, f)| if k < 4000 { f / 300.0 } else { f / 150.0 }).collect();
    crate::support::csv(&folder.path().join("change.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &motion)]);
    let spread = |files: &[&str]| json(folder.path(), &[&["estimate"], files, &["--nperseg", "256", "--band", "1-10"]].concat());
    let (same, other) = (spread(&["a.csv", "b.csv"]), spread(&["a.csv", "b.csv", "c.csv"]));
    let ratio = |r: &Value| r["trial_spread"]["ratio"].as_f64().expect("a ratio");
    assert!(ratio(&other) > 1.5 && ratio(&same) < 1.4, "{} and {}", ratio(&other), ratio(&same));
    let warned = |r: &Value| r["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "trials-differ");
    assert!(warned(&other) && !warned(&same));
    let course = json(folder.path(), &["estimate", "change.csv", "--nperseg", "256", "--band", "3-5", "--sliding", "4"])["course"].clone();
    let times: Vec<f64> = course["time_s"].as_array().expect("a list").iter().map(|t| t.as_f64().expect("a time")).collect();
    assert_eq!(times, [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]);
    let gain = |k: usize| {
        let part = |name: &str| course["response"][k][name][0][0][0].as_f64().expect("a number");
        part("re").hypot(part("im"))
    };
    for (k, expected) in [(0, 300.0), (1, 300.0), (2, 300.0), (4, 150.0), (5, 150.0), (6, 150.0)] {
        assert!((gain(k) * expected - 1.0).abs() < 1e-9, "window {k}: {}", gain(k));
    }
}

#[test]
fn both_window_conventions_and_the_rational_method_are_there_to_choose() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let estimate = |extra: &[&str]| json(folder.path(), &[&["estimate", "trial.csv"], extra].concat());
    let (periodic, symmetric) = (estimate(&["--nperseg", "512", "--spectra"]), estimate(&["--nperseg", "512", "--spectra", "--window-symmetric"]));
    assert_eq!((&periodic["method"]["window_symmetric"], &symmetric["method"]["window_symmetric"]), (&false.into(), &true.into()));
    assert_ne!(periodic["spectra"]["re"][0][0][20], symmetric["spectra"]["re"][0][0][20]);
    let rational = estimate(&["--method", "local-rational", "--denominator", "2", "--half-width", "9", "--band", "0.5-10"]);
    let method = &rational["method"];
    assert_eq!((&method["name"], &method["order"], &method["denominator"], &method["half_width"]), (&"local-rational".into(), &2.into(), &2.into(), &9.into()));
    let hz = rational["frequency_hz"][60].as_f64().expect("a frequency");
    let w = std::f64::consts::TAU * hz;
    let part = |name: &str| rational["direct"][name][0][0][60].as_f64().expect("a number");
    // The oscillator's interval means lag by half a sample; its gain is 1e-4 below.
    assert!((part("re").hypot(part("im")) * (300.0 - 2.0 * w * w).hypot(12.0 * w) - 1.0).abs() < 5e-3, "{hz} Hz");
    assert!(estimate(&["--method", "local-polynomial", "--leave-one-out"])["method"]["name"] == "local-polynomial");
}

#[test]
fn check_says_what_estimates_take_for_granted() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["check", "trial.csv", "trial.csv"]);
    let force = &result["assumptions"][0];
    assert_eq!((force["name"].as_str(), force["mean_squares"][0].as_array().map(Vec::len)), (Some("force_x"), Some(20)));
    assert!((force["squared_correlation"][0][1].as_f64().expect("R²") - 1.0).abs() < 1e-12, "the same trial twice");
    // Uniform noise has an excess kurtosis of −1.2.
    assert!((force["excess_kurtosis"][0].as_f64().expect("a number") + 1.2).abs() < 0.1);
    assert!(force["trend_p_value"][0].as_f64().expect("p") > 0.001 && force["normal_p_value"][0].as_f64().expect("p") < 0.001);
}

#[test]
fn nothing_exists_at_zero_frequency_after_mean_removal() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["estimate", "trial.csv"]);
    assert_eq!(result["frequency_hz"][0].as_f64(), Some(0.0));
    assert!(result["direct"]["re"][0][0][0].is_null());
}

#[test]
fn auto_says_what_it_chose_and_why() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let method = |extra: &[&str]| json(folder.path(), &[&["estimate", "trial.csv"], extra].concat())["method"].clone();
    let auto = method(&[]);
    assert_eq!(auto["name"], "local-polynomial");
    assert!(auto["why"].as_str().expect("a sentence").contains("not periodic"), "{auto}");
    // Other estimators are defined on spectra of segments.
    assert_eq!(method(&["--estimator", "h2"])["name"], "welch");
    let welch = method(&["--nperseg", "500"]);
    assert_eq!((&welch["name"], &welch["noverlap"], &welch["nfft"], &welch["window"]), (&"welch".into(), &250.into(), &500.into(), &"hann".into()));
    assert_eq!((&auto["order"], &method(&["--order", "4"])["order"]), (&2.into(), &4.into()));
    assert_eq!(method(&["--tapers", "5"])["name"], "multitaper");
}

#[test]
fn a_periodic_excitation_is_averaged_over_its_periods() {
    let folder = tempfile::tempdir().expect("a folder");
    succeed(folder.path(), &["design", "--kind", "multisine", "--axes", "x", "--duration", "40", "--period", "5", "--out", "cmd.csv"]);
    let text = std::fs::read_to_string(folder.path().join("cmd.csv")).expect("written");
    let force: Vec<f64> =
        text.lines().filter(|line| !line.starts_with('#')).skip(1).map(|line| line.rsplit(',').next().expect("a cell").parse().expect("a number")).collect();
    assert_eq!(force.len(), 20_000);
    crate::support::csv(
        &folder.path().join("p.csv"),
        "# sample_rate_hz: 500\n",
        &[("force_x [N]", &force), ("pos_x [m]", &crate::support::oscillator(&force))],
    );
    let result = json(folder.path(), &["estimate", "p.csv"]);
    assert_eq!((&result["method"]["name"], &result["method"]["period"]), (&"periodic".into(), &2500.into()));
    let hz = result["frequency_hz"].as_array().expect("a grid");
    // Periods have no leakage, so the response is exact but for the integration's steps of 40 µs: 1e-3 of the damping.
    for f in 0..hz.len() {
        let Some(re) = result["direct"]["re"][0][0][f].as_f64() else { continue };
        let w = std::f64::consts::TAU * hz[f].as_f64().expect("a number");
        let truth = 1.0 / (300.0 - 2.0 * w * w).hypot(12.0 * w);
        let gain = re.hypot(result["direct"]["im"][0][0][f].as_f64().expect("im"));
        assert!((gain / truth - 1.0).abs() < 5e-3, "{} Hz: {gain} against {truth}", hz[f]);
    }
}

#[test]
fn a_hidden_hysteresis_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let hidden = r#"noise = { rms_n = 0.1 }
        [[effects]]
        name = "hysteresis"
        side = "limb"
        axis = "x"
        parameters = { stiffness_n_per_m = 300.0, yield_m = 0.003 }"#;
    let experiment = held_arm("trials = 2\nduration_s = 40.0", hidden);
    std::fs::write(folder.path().join("e.toml"), experiment).expect("written");
    succeed(folder.path(), &["simulate", "e.toml", "--out", "h.csv"]);
    let all = ["diagnose", "h-1.csv", "h-2.csv", "--exit-code", "--quiet", "--json", "d.json"];
    assert_eq!(ndof(folder.path(), &all).status.code(), Some(1), "a cause is found");
    let result: Value = serde_json::from_slice(&std::fs::read(folder.path().join("d.json")).expect("written")).expect("JSON");
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "diagnosis"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    let cause = &result["causes"][0];
    assert_eq!((&cause["effect"], &cause["site"]["side"], &cause["site"]["axis"]), (&"hysteresis".into(), &"limb".into(), &"x".into()));
}

#[test]
fn check_finds_a_clipped_channel() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let good = json(folder.path(), &["check", "trial.csv"]);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "check"])).expect("JSON");
    assert_eq!(violation(&good, &schema, &schema, ""), None);
    assert_ne!(good["verdict"], "faulty");
    let force = crate::support::noise(9, 5000);
    let clipped: Vec<f64> = crate::support::oscillator(&force).iter().map(|x| x.clamp(-2e-4, 2e-4)).collect();
    crate::support::csv(&folder.path().join("c.csv"), "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &clipped)]);
    let bad = json(folder.path(), &["check", "c.csv"]);
    assert_eq!((&bad["verdict"], &bad["findings"][0]["code"], &bad["findings"][0]["channel"]), (&"faulty".into(), &"clipped".into(), &"pos_x".into()));
    assert_eq!(ndof(folder.path(), &["check", "c.csv", "--exit-code"]).status.code(), Some(1));
}

#[test]
fn two_halves_of_one_record_do_not_differ() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    succeed(folder.path(), &["fit", "trial.csv", "--stop", "10", "--band", "0.6-15", "--json", "a.json"]);
    succeed(folder.path(), &["fit", "trial.csv", "--start", "10", "--band", "0.6-15", "--json", "b.json"]);
    let result = json(folder.path(), &["compare", "a.json", "b.json"]);
    let schema: Value = serde_json::from_str(&succeed(folder.path(), &["schema", "compare"])).expect("JSON");
    assert_eq!(violation(&result, &schema, &schema, ""), None);
    for parameter in result["parameters"].as_array().expect("a list") {
        let p = parameter["differences"][0]["p_value"].as_f64().expect("a number");
        assert!(p > 0.01, "{parameter}");
    }
    succeed(folder.path(), &["compare", "a.json", "b.json", "--report", "compare.html"]);
    let page = std::fs::read_to_string(folder.path().join("compare.html")).expect("written");
    assert!(page.contains("by more than chance explains") && page.contains("b.json less a.json"));
    crate::support::refuse(folder.path(), &["compare", "a.json", "trial.csv"]);
}

#[test]
fn a_cohort_goes_on_where_it_was_and_lists_what_failed() {
    let folder = tempfile::tempdir().expect("a folder");
    for subject in ["anna", "ben"] {
        let own = folder.path().join("subjects").join(subject);
        std::fs::create_dir_all(&own).expect("a folder");
        trial(&own);
    }
    std::fs::write(folder.path().join("subjects/carl.csv"), "not,a\nrecording,at all\n").expect("written");
    let all = ["cohort", "subjects", "--out", "out", "--band", "0.6-15", "--quiet"];
    succeed(folder.path(), &all);
    let table = std::fs::read_to_string(folder.path().join("out/cohort.csv")).expect("written");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[0].starts_with("subject,M,M_std_error,B,") && rows.len() == 4, "{table}");
    assert!(rows[3].starts_with("carl,,") && rows[3].contains("carl.csv"), "{table}");
    // Only what is missing is done again: a result that another hand changed stays as it is.
    let (anna, ben) = (folder.path().join("out/subjects/anna.json"), folder.path().join("out/subjects/ben.json"));
    let marked = std::fs::read_to_string(&anna).expect("written").replace("\"cohort\"", "\"marked\"");
    std::fs::write(&anna, &marked).expect("written");
    std::fs::remove_file(&ben).expect("there");
    succeed(folder.path(), &all);
    assert_eq!(std::fs::read_to_string(&anna).expect("there"), marked);
    assert_eq!(std::fs::read_to_string(folder.path().join("out/cohort.csv")).expect("written"), table);
    let mounted = [&all[..], &["--transducer-stiffness", "2e4"]].concat();
    assert!(crate::support::refuse(folder.path(), &mounted).contains("other options"));
    // A subject is fitted as `ndof fit` would.
    succeed(folder.path(), &["cohort", "subjects", "--out", "mounted", "--band", "0.6-15", "--transducer-stiffness", "2e4"]);
    let fitted = json(folder.path(), &["fit", "subjects/anna/trial.csv", "--band", "0.6-15", "--transducer-stiffness", "2e4"]);
    let subject = std::fs::read_to_string(folder.path().join("mounted/subjects/anna.json")).expect("written");
    let subject: serde_json::Value = serde_json::from_str(&subject).expect("JSON");
    assert_eq!(subject["parameters"], fitted["parameters"]);
}

#[test]
fn completions_and_the_man_page_come_from_the_same_definitions() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(succeed(folder.path(), &["completions", "bash"]).contains("--nperseg"));
    assert!(succeed(folder.path(), &["completions", "man"]).contains("ndof"));
}

#[test]
fn a_handle_beyond_the_transducer_is_taken_off() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let mass = |extra: &[&str]| json(folder.path(), &[&["fit", "trial.csv", "--nperseg", "1024", "--band", "0.6-15"], extra].concat())["parameters"][0].clone();
    let (all, limb) = (mass(&[]), mass(&["--handle-mass", "0.5"]));
    let difference = all["value"].as_f64().expect("a value") - limb["value"].as_f64().expect("a value");
    assert!((difference - 0.5).abs() < 4.0 * all["std_error"].as_f64().expect("an error"), "{difference}");
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    for threads in ["1", "2"] {
        succeed(folder.path(), &["simulate", "arm", "--out", &format!("s{threads}/arm.csv"), "--threads", threads]);
        let files: Vec<String> = (1..=6).map(|k| format!("s{threads}/arm-{k}.csv")).collect();
        let mut arguments = vec!["fit", "--threads", threads, "--quiet"];
        arguments.extend(files.iter().map(String::as_str));
        let json = format!("fit{threads}.json");
        arguments.extend(["--json", &json]);
        succeed(folder.path(), &arguments);
    }
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("written");
    for file in ["arm-1.csv", "arm-6.csv", "arm.truth.json"] {
        assert!(bytes(&format!("s1/{file}")) == bytes(&format!("s2/{file}")), "{file}");
    }
    assert!(bytes("fit1.json") == bytes("fit2.json"), "the fit");
}

#[test]
fn a_pipe_that_closes_early_is_no_error() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let program = env!("CARGO_BIN_EXE_ndof");
    let script = format!("set -o pipefail; '{program}' estimate trial.csv --spectra --nfft 65536 --quiet --json - | head -c 10 > /dev/null");
    let status = std::process::Command::new("bash").args(["-c", &script]).current_dir(folder.path()).status().expect("a shell");
    assert!(status.success(), "{status}");
}

/// What the other commands would analyse is what is written.
#[test]
fn a_converted_recording_is_cut_and_corrected_as_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let rows = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("written").lines().filter(|line| !line.starts_with('#')).count() - 1;
    succeed(folder.path(), &["convert", "trial.csv", "cut.csv", "--start", "2", "--stop", "6"]);
    succeed(folder.path(), &["convert", "trial.csv", "two.csv", "--exclude", "2-6"]);
    let all = rows("trial.csv");
    assert_eq!((rows("cut.csv"), rows("two-1.csv") + rows("two-2.csv")), (2000, all - 2000));
    succeed(folder.path(), &["convert", "trial.csv", "bare.csv", "--handle-mass", "0.5"]);
    let inertia =
        |name: &str, options: &[&str]| json(folder.path(), &[&["fit", name, "--nperseg", "1024"], options].concat())["parameters"][0]["value"].clone();
    assert_eq!(inertia("bare.csv", &[]), inertia("trial.csv", &["--handle-mass", "0.5"]));
    for [command, option] in [["convert", "--input"], ["simulate", "--json"]] {
        let other = if command == "convert" { ["trial.csv", "other.csv"] } else { ["arm", "--out=arm.csv"] };
        assert!(refuse(folder.path(), &[command, other[0], other[1], option, "x"]).contains("has no use for"), "{command}");
    }
}

#[test]
fn a_recording_comes_back_from_conversion_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    succeed(folder.path(), &["convert", "trial.csv", "trial.npz"]);
    let (csv, npz) = (json(folder.path(), &["estimate", "trial.csv"]), json(folder.path(), &["estimate", "trial.npz"]));
    assert_eq!(csv, npz);
}

#[test]
fn standard_input_is_csv() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = trial(folder.path());
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_ndof"))
        .args(["estimate", "-", "--quiet", "--json", "-"])
        .stdin(std::fs::File::open(path).expect("there"))
        .output()
        .expect("the program starts");
    let piped: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(piped, json(folder.path(), &["estimate", "trial.csv"]));
}

#[test]
fn report_and_plots_are_written_where_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    succeed(folder.path(), &["fit", "trial.csv", "--report", "out.html", "--plots", "plots"]);
    let page = std::fs::read_to_string(folder.path().join("out.html")).expect("written");
    assert!(page.contains("<svg") && !page.contains("src=\"http"), "a page that needs no network");
    assert!(folder.path().join("plots/bode.svg").exists() && folder.path().join("plots/bode.csv").exists());
}

#[test]
fn the_registries_are_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    for (what, word) in [("effects", "hysteresis"), ("devices", "mit-manus"), ("models", "inertia-damping-stiffness"), ("methods", "welch")] {
        assert!(succeed(folder.path(), &["list", what]).contains(word), "{what}");
    }
}

#[test]
fn a_measured_closed_loop_of_two_by_two_is_estimated() {
    let Some(file) = shared("cd_player_arm/cd_player_arm.csv") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = file.display().to_string();
    let result = json(folder.path(), &["estimate", &file, "--sample-rate", "1"]);
    assert_eq!(result["inputs"].as_array().map(Vec::len), Some(2));
    let hz = result["frequency_hz"].as_array().expect("a grid");
    let low: Vec<f64> = (0..hz.len())
        .filter(|&f| (0.01..0.03).contains(&hz[f].as_f64().expect("a number")))
        .map(|f| result["direct"]["coherence"]["multiple"][1][f].as_f64().expect("a number"))
        .collect();
    let mean = low.iter().sum::<f64>() / low.len() as f64;
    assert!(mean > 0.95, "the second output is explained at low frequency: {mean}");
    assert!(result["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "no-reference"));
}

#[test]
fn a_measured_ankle_has_inertia_damping_and_stiffness_once_its_torque_is_turned() {
    let Some(file) = shared("ankle/z_pf.csv") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = file.display().to_string();
    let base = ["fit", &file, "--input", "angle_ankle", "--output", "torque_ankle"];
    let has_sign_warning = |result: &Value| result["warnings"].as_array().expect("a list").iter().any(|w| w["code"] == "force-sign");
    let reaction = json(folder.path(), &base);
    assert!(has_sign_warning(&reaction), "the transducer reads the reaction");
    let turned = json(folder.path(), &[&base[..], &["--negate", "torque_ankle"]].concat());
    assert!(!has_sign_warning(&turned));
    // An ankle with its fixture: hundredths of kg m², about 1 N m s/rad, tens of N m/rad.
    for (k, range) in [0.005..0.05, 0.2..3.0, 20.0..200.0].into_iter().enumerate() {
        let value = turned["parameters"][k]["value"].as_f64().expect("a value");
        assert!(range.contains(&value), "{} = {value}", turned["parameters"][k]["name"]);
    }
}

#[test]
fn a_usage_error_has_exit_code_2_and_help_has_0() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(ndof(folder.path(), &["estimate"]).status.code(), Some(2));
    assert_eq!(ndof(folder.path(), &["nonsense"]).status.code(), Some(2));
    assert_eq!(ndof(folder.path(), &["--version"]).status.code(), Some(0));
}
