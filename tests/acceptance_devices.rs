//! The nonlinear simulation seen through the estimator: T, R and C with their intervals against the linear model of the same parts.

use ndarray::Array2;
use ndof::analysis::{Estimate, MethodName, Trial};
use ndof::devices::{EndpointLinearConfig, LimbConfig, Linearised, PlanarTwoLinkConfig, SpringArrayConfig};
use ndof::study::file::{ExperimentFile, parse};
use ndof::study::simulate;
use ndof::sysid::FrequencyResponse;
use num_complex::Complex64;

/// Six trials of orthogonal multisines, five periods each: no leakage, so what is left is noise and nonlinearity.
fn experiment(seed: u64, rms: f64, dry_friction: bool, limb: LimbConfig) -> ExperimentFile {
    let friction = if dry_friction { "" } else { "parameters = { coulomb_1_nm = 0.0, coulomb_2_nm = 0.0 }" };
    let text = format!(
        "seed = {seed}\ntrials = 6\nduration_s = 50.0\ndiscard_s = 10.0\n[device]\nname = \"mit-manus\"\n{friction}\n\
         [limb]\nname = \"endpoint-linear\"\nM = [[1.0]]\nB = [[1.0]]\nK = [[1.0]]\n[excitation]\nkind = \"multisine\"\nrms = {rms}\nperiod_s = 10.0\n"
    );
    let mut file: ExperimentFile = parse(&text, "experiment").expect("understood");
    file.limb = limb;
    file
}

fn arm() -> LimbConfig {
    LimbConfig::EndpointLinear(EndpointLinearConfig {
        M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
        B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
        K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
        ..EndpointLinearConfig::default()
    })
}

/// The share of elements inside their 95 % discs between 0.3 and 12 Hz, and the number of frequencies.
fn covered(found: &FrequencyResponse, model: impl Fn(f64) -> Array2<Complex64>) -> (f64, usize) {
    let freedom = found.uncertainty.as_ref().expect("a covariance").degrees_of_freedom;
    // 95 % of F with 2 and 2ν degrees of freedom.
    let quantile = freedom * (0.05_f64.powf(-1.0 / freedom) - 1.0);
    let (p, q) = found.shape();
    let (mut inside, mut elements, mut bins) = (0, 0, 0);
    for (f, &hz) in found.frequency_hz.iter().enumerate().filter(|(_, hz)| (0.3..=12.0).contains(*hz)) {
        let truth = model(hz);
        let here: Vec<bool> = (0..p * q)
            .map(|e| (e / q, e % q))
            .filter(|&(i, j)| found.variance(f, i, j).is_finite() && found.value[[f, i, j]].is_finite())
            .map(|(i, j)| (found.value[[f, i, j]] - truth[[i, j]]).norm_sqr() <= quantile * found.variance(f, i, j))
            .collect();
        bins += usize::from(!here.is_empty());
        elements += here.len();
        inside += here.iter().filter(|h| **h).count();
    }
    (inside as f64 / elements as f64, bins)
}

/// Share of T, R and C inside their discs, and the number of frequencies.
fn shares(file: &ExperimentFile) -> ([f64; 3], usize) {
    let simulated = simulate(file, &|_, _, _| ()).expect("simulated");
    let settings = Estimate { method: MethodName::Periodic, period_s: Some(10.0), ..Estimate::default() };
    let estimated = settings.run(&Trial::numbered("trial", simulated.recordings)).expect("estimated");
    let derived = estimated.estimates.derived.as_ref().expect("references");
    let linear: &Linearised = &simulated.linear;
    let sampled = |hz: f64| linear.sampled_responses(hz).expect("regular");
    let (t, bins) = covered(&derived.to_reference.t, |hz| sampled(hz).0);
    let (r, _) = covered(&derived.to_reference.r, |hz| sampled(hz).1);
    let (c, _) = covered(&derived.response, |hz| linear.compliance_with_transducer(hz).expect("regular"));
    ([t, r, c], bins)
}

/// Four binomial standard deviations of 95 %, counting each frequency once because its elements share their noise.
fn as_often_as_it_says(share: f64, bins: usize) -> bool {
    (share - 0.95).abs() < 4.0 * (0.95 * 0.05 / bins as f64).sqrt()
}

#[test]
fn small_forces_give_t_r_and_c_of_the_linear_model_within_their_intervals() {
    let springs = LimbConfig::SpringArray(SpringArrayConfig { configuration: Some("sa3".to_owned()), ..SpringArrayConfig::default() });
    for (name, limb) in [("arm", arm()), ("two-link arm", LimbConfig::PlanarTwoLink(PlanarTwoLinkConfig::default())), ("springs", springs)] {
        let (shares, bins) = shares(&experiment(3, 0.4, false, limb));
        println!("{name}: T, R, C inside their 95 % discs at {shares:.3?} of {bins} frequencies");
        for (what, share) in ["T", "R", "C"].iter().zip(shares) {
            assert!(as_often_as_it_says(share, bins), "{name}: {what} {share:.3} of {bins}");
        }
    }
}

#[test]
fn dry_friction_of_the_robot_bends_t_and_r_and_leaves_the_limb_s_c() {
    let ([t, r, c], bins) = shares(&experiment(3, 4.0, true, arm()));
    println!("with friction: T, R, C inside at {t:.3}, {r:.3}, {c:.3} of {bins} frequencies");
    assert!(as_often_as_it_says(c, bins), "C {c:.3}");
    // The linear model has no friction: its T and R are outside far more often than one time in twenty.
    assert!(!as_often_as_it_says(t, bins) && !as_often_as_it_says(r, bins) && t.max(r) < 0.95, "{t:.3} {r:.3}");
}
