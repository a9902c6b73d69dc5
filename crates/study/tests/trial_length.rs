//! The length that a design recommends gives the intervals that were wanted: by Monte Carlo.

use ndof_study::file::{EstimateSection, ExperimentFile, parse};
use ndof_study::{DesignSettings, FitSettings, Limits, LooseLimb, RoleNames, Target, Trial, Trials, Trim, design, estimate, fit, simulate};

/// A restless limb on a robot without dry friction, which the theory leaves out.
const EXPERIMENT: &str = r#"
    trials = 2
    duration_s = 50.0
    [device]
    name = "mit-manus"
    parameters = { coulomb_1_nm = 0.0, coulomb_2_nm = 0.0 }
    [limb]
    name = "endpoint-linear"
    M = [[2.1, -0.55], [-0.55, 1.9]]
    B = [[11.0, -2.0], [-2.0, 15.0]]
    K = [[300.0, -60.0], [-60.0, 520.0]]
    noise = { rms_n = 1.5, cutoff_hz = 2.0 }
"#;
const BAND_HZ: [f64; 2] = [0.5, 8.0];
const SEEDS: usize = 40;

fn settings(experiment: &ExperimentFile, duration_s: f64, targets: Vec<Target>) -> DesignSettings {
    DesignSettings {
        excitation: experiment.excitation.clone(),
        axes: vec!["x".to_owned(), "y".to_owned()],
        rotational: false,
        trials: experiment.trials,
        duration_s,
        lead_in_s: experiment.discard_s,
        sample_rate_hz: experiment.sample_rate_hz,
        seed: 1,
        band_hz: (0.25, 15.0),
        experiment: Some(experiment.clone()),
        limbs: LooseLimb::soft_and_stiff(false),
        limits: Limits::default(),
        targets,
        fit_band_hz: BAND_HZ,
    }
}

/// Value and standard error of every parameter, as `ndof fit` reports them for the trials of one seed.
fn fitted(experiment: &ExperimentFile, seed: u64) -> Vec<(String, f64, f64)> {
    let simulated = simulate(&ExperimentFile { seed, ..experiment.clone() }, &|_, _, _| ()).expect("simulated");
    let trials = simulated.recordings.into_iter().map(|recording| Trial { file: "trial".to_owned(), recording, warnings: Vec::new() }).collect();
    let trials = Trials::new(trials, &RoleNames::default(), &Trim::default()).expect("trials");
    let section = EstimateSection { nperseg: Some(2048), noverlap: Some(1536), nfft: Some(8192), ..EstimateSection::default() };
    let estimated = estimate(&trials, &section.settings("test").expect("settings"), "test").expect("estimated");
    let transducer = simulated.linear.transducer;
    let transducer = Some(ndof_models::Transducer { stiffness: transducer.stiffness, damping: transducer.damping });
    let settings = FitSettings { band_hz: Some(BAND_HZ), transducer, ..FitSettings::default() };
    let fit = fit(&trials, &estimated, &settings, "test").expect("fitted").fit;
    fit.parameters.into_iter().map(|p| (p.name, p.value, p.std_error)).collect()
}

#[test]
fn the_recommended_length_gives_the_wanted_interval() {
    let mut experiment: ExperimentFile = parse(EXPERIMENT, "test").expect("an experiment");
    let wanted = 0.15;
    let target = || vec!["K=15%".parse().expect("a target")];
    let plan = design(&settings(&experiment, 50.0, target()), "design", &|_, _, _| ()).expect("designed").result.length.expect("a plan");
    let duration_s = plan.duration_s.expect("within reach");
    assert!((5.0..50.0).contains(&duration_s), "{duration_s}");
    experiment.duration_s = duration_s;
    let plan = design(&settings(&experiment, duration_s, target()), "design", &|_, _, _| ()).expect("designed").result.length.expect("a plan");
    let widest = ["K_x_x", "K_y_y"].map(|name| plan.predicted.iter().find(|p| p.name == name).and_then(|p| p.half_width).expect("predicted"));
    let widest = widest[0].max(widest[1]);
    // The other perturbation of this length has other spectra: n_e of 15 or so makes them scatter by a quarter.
    assert!((widest / wanted - 1.0).abs() < 0.25, "{widest}");

    let records: Vec<Vec<(String, f64, f64)>> = (0..SEEDS as u64).map(|seed| fitted(&experiment, 100 + seed)).collect();
    let (mut scatter, mut reported) = (Vec::new(), Vec::new());
    for (k, predicted) in plan.predicted.iter().enumerate() {
        let (truth, half) = (predicted.value.expect("a value"), predicted.half_width.expect("a width"));
        let sigma = half * truth.abs() / 1.96;
        let count = SEEDS as f64;
        let squares = records.iter().map(|r| (r[k].1 - truth).powi(2)).sum::<f64>() / count;
        scatter.push(squares.sqrt() / sigma);
        reported.push(records.iter().map(|r| r[k].2).sum::<f64>() / count / sigma);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    println!("{duration_s} s: scatter/predicted {scatter:.2?}, reported/predicted {reported:.2?}");
    // A root mean square of N numbers has a relative standard deviation of 1/√(2N); the nine parameters count as three, M, B and K
    // each being correlated within.
    let four_sigma = 4.0 / (2.0 * SEEDS as f64).sqrt();
    for ratio in &scatter {
        assert!((ratio - 1.0).abs() < four_sigma, "{scatter:?}");
    }
    assert!((mean(&scatter) - 1.0).abs() < four_sigma / 3.0_f64.sqrt(), "{scatter:?}");
    // What fits report scatters less: their own noise estimate pools the band. The theory is of first order in 1/n_e.
    assert!((mean(&reported) - 1.0).abs() < 2.0 / 15.0, "{reported:?}");
}
