//! A measured human ankle: angle imposed, torque measured.

use ndof_models::{Axis, InertiaDampingStiffnessModel, Smoothing, Symmetry, WeightedFit, agreement, linear_start};
use ndof_signal::Welch;
use ndof_sysid::{Direct, Labels, Ports, ResponseKind};

#[test]
fn inertia_damping_and_stiffness_of_a_real_ankle_are_sensible() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/ankle/z_pf.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: no {}", path.display());
        return;
    };
    let rows: Vec<[f64; 2]> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .skip(1)
        .filter_map(|l| l.split_once(',').and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?])))
        .collect();
    let channels = [0, 1].map(|c| rows.iter().map(|r| r[c]).collect::<Vec<f64>>());
    let spectra = Welch::new(4096).spectra(1000.0, &[&channels[0], &channels[1]]).expect("long enough");
    let labels = Labels { references: vec![], inputs: vec!["angle_ankle".into()], outputs: vec!["torque_ankle".into()], kind: ResponseKind::DynamicStiffness };
    let estimate = ndof_sysid::direct(&spectra, &Ports { references: vec![], inputs: vec![0], outputs: vec![1] }, &labels, Direct::H1).expect("estimate");
    let model = InertiaDampingStiffnessModel::new(vec![Axis::from_channel("angle_ankle")], Symmetry::Symmetric);
    let band_hz = [0.5, 30.0];
    let start = linear_start(&model, &estimate.response.band(band_hz[0], band_hz[1])).expect("start");
    let fit = WeightedFit { band_hz, smoothing: Smoothing::Open, ..WeightedFit::default() }.fit(&model, &estimate.response, &start).expect("fit");
    let matrices = model.matrices(&fit.theta);
    let found = agreement(
        &estimate.response,
        &matrices.response(&estimate.response.frequency_hz, ResponseKind::DynamicStiffness),
        &estimate.coherence.partial,
        band_hz,
    )
    .expect("mechanical");
    // The transducer of this record reads the reaction: every matrix comes out negative.
    // Foot with apparatus 0.01 to 0.05 kg m², stiffness tens to hundreds of N m/rad (Kearney, Stein & Parameswaran 1997).
    assert!((0.005..0.05).contains(&-fit.theta[0]) && (0.1..5.0).contains(&-fit.theta[1]) && (20.0..300.0).contains(&-fit.theta[2]));
    assert_eq!(fit.parameters[2].unit, "N m/rad");
    assert!(found.vaf_percent[0][0].expect("model is not zero") > 90.0);
    // The reflex is not in the model, and the fit has to say so.
    assert!(fit.chi2_reduced > 2.0);
}
