//! The length that a design recommends gives the intervals that were wanted: by Monte Carlo.

use ndof_analysis::{Estimate, Fit, Trial};
use ndof_study::file::{ExperimentFile, parse};
use ndof_study::{Design, simulate};

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

fn settings(experiment: &ExperimentFile, duration_s: f64) -> Design {
    let target = "K=15%".parse().expect("a target");
    Design { experiment: Some(experiment.clone()), duration_s: Some(duration_s), target_ci: vec![target], fit_band_hz: Some(BAND_HZ), ..Design::default() }
}

/// Value and standard error of every parameter, as `ndof fit` reports them for the trials of one seed.
fn fitted(experiment: &ExperimentFile, seed: u64) -> Vec<(String, f64, f64)> {
    let simulated = simulate(&ExperimentFile { seed, ..experiment.clone() }, &|_, _, _| ()).expect("simulated");
    let settings = Estimate { nperseg: Some(2048), noverlap: Some(1536), nfft: Some(8192), ..Estimate::default() };
    let estimated = settings.run(&Trial::numbered("trial", simulated.recordings)).expect("estimated");
    let transducer = simulated.linear.transducer;
    let mount = (Some(transducer.stiffness), Some(transducer.damping));
    let fit = Fit { band_hz: Some(BAND_HZ), transducer_stiffness: mount.0, transducer_damping: mount.1, ..Fit::default() };
    let fit = fit.run(&estimated).expect("fitted").fit;
    fit.parameters.into_iter().map(|p| (p.name, p.value, p.std_error)).collect()
}

#[test]
fn the_recommended_length_gives_the_wanted_interval() {
    let mut experiment: ExperimentFile = parse(EXPERIMENT, "test").expect("an experiment");
    let wanted = 0.15;
    let plan = settings(&experiment, 50.0).run().expect("designed").result.length.expect("a plan");
    let duration_s = plan.duration_s.expect("within reach");
    assert!((5.0..50.0).contains(&duration_s), "{duration_s}");
    experiment.duration_s = duration_s;
    let plan = settings(&experiment, duration_s).run().expect("designed").result.length.expect("a plan");
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
