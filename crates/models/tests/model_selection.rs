//! A phase that rolls off above 5 Hz: which extension of the arm explains it, and does the likelihood ratio know.

mod estimates;
mod support;

use ndof_models::blocks::{Block, Composite, Delay, FirstOrderFilter, Place, Placed, Reflex, SeriesCompliance};
use ndof_models::{Fit, InertiaDampingStiffnessModel, LoopModel, Smoothing, Symmetry, Transducer, WeightedFit, likelihood_ratio, linear_start};
use ndof_signal::{CrossSpectra, Passband, SosFilter, Welch};
use rayon::prelude::*;

const NAMES: [&str; 5] = ["none", "delay", "filter", "series", "reflex"];

/// Fits of the arm alone and with each extension to six trials with 0.3 N of limb noise whose channels went through
/// `alter`.
fn fits(seed: u64, alter: &dyn Fn(&mut [Vec<f64>])) -> Vec<Fit> {
    let limb = support::patient();
    let each = estimates::trial_spectra(&limb, 0.3, seed, &Welch::new(4096), alter);
    let derived = estimates::compliance(&CrossSpectra::pool(&each).expect("trials"));
    let band_hz = [0.4, 12.0];
    let robot = LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz).expect("loop");
    let transducer = Transducer { stiffness: support::TRANSDUCER.0, damping: support::TRANSDUCER.1 };
    let settings = WeightedFit { band_hz, smoothing: Smoothing::Derived(robot), transducer: Some(transducer), ..WeightedFit::default() };
    let arm = || InertiaDampingStiffnessModel::new(limb.axes.clone(), Symmetry::Symmetric);
    let start = linear_start(&arm(), &derived.response.band(0.5, 8.0)).expect("start");
    let both = || vec![0, 1];
    let extensions: Vec<Vec<(Box<dyn Block>, Place)>> = vec![
        vec![],
        vec![(Box::new(Delay), Place::EffortChannel(both()))],
        vec![(Box::new(FirstOrderFilter), Place::EffortChannel(both()))],
        vec![(Box::new(SeriesCompliance), Place::Series(both()))],
        vec![(Box::new(Reflex), Place::Parallel(both()))],
    ];
    extensions
        .into_iter()
        .map(|extension| {
            let model = Composite::new(Box::new(arm()), extension.into_iter().map(|(block, place)| Placed { block, place }).collect());
            settings.fit_from(&model, &derived.response, &model.starts(&start)).expect("fit")
        })
        .collect()
}

fn best(fits: &[Fit]) -> &'static str {
    let bic: Vec<f64> = fits.iter().map(Fit::bic).collect();
    NAMES[(0..bic.len()).min_by(|&a, &b| bic[a].total_cmp(&bic[b])).expect("five")]
}

#[test]
fn a_late_or_filtered_force_channel_is_named_and_measured_and_a_clean_one_left_alone() {
    let late = |channels: &mut [Vec<f64>]| channels[2..4].iter_mut().for_each(|c| c.rotate_right(2));
    let filter = SosFilter::butterworth(1, Passband::Low(30.0), support::RATE_HZ).expect("valid");
    let filtered = |channels: &mut [Vec<f64>]| channels[2..4].iter_mut().for_each(|c| *c = filter.filter(c));
    type Alter<'a> = &'a (dyn Fn(&mut [Vec<f64>]) + Sync);
    let cases: [(&str, Alter); 3] = [("none", &|_| ()), ("delay", &late), ("filter", &filtered)];
    let found: Vec<Vec<Fit>> = cases.par_iter().map(|(_, alter)| fits(3, alter)).collect();
    for ((truth, _), fits) in cases.iter().zip(&found) {
        println!("{truth}: {:?}", fits.iter().zip(NAMES).map(|(f, n)| format!("{n} χ²r {:.2} BIC {:.0}", f.chi2_reduced, f.bic())).collect::<Vec<_>>());
        assert_eq!(best(fits), *truth);
    }
    // SCIENCE C.17 and D.3: 4.0 ± 0.1 ms; 30 Hz is 5.3 ms, ± 0.1 ms of it.
    let delay = found[1][1].parameter("delay_s").expect("delay");
    assert!((delay.value - 0.004).abs() < 1e-4 && delay.std_error < 1e-4, "{delay:?}");
    let cutoff = found[2][2].parameter("cutoff_hz").expect("filter");
    assert!((cutoff.value - 30.0).abs() < 0.6, "{cutoff:?}");
    for (case, extension) in [(1, 1), (2, 2)] {
        let ratio = likelihood_ratio(&found[case][0], &found[case][extension]);
        assert!(ratio.p_value < 1e-12 && ratio.parameters == 1);
        // A reflex does not mend it.
        assert!(found[case][4].chi2_reduced > 3.0 * found[case][extension].chi2_reduced);
    }
    assert!(likelihood_ratio(&found[0][0], &found[0][1]).p_value > 0.001);
}
