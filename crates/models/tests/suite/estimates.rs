//! Spectra and the derived compliance of six simulated trials.

use crate::support::{RATE_HZ, trial};
use ndof_models::InertiaDampingStiffness;
use ndof_signal::{CrossSpectra, Welch};
use ndof_sysid::{DerivedEstimate, Labels, Ports, ResponseKind};

/// Spectra of six trials through a transducer whose channels went through `alter`.
pub fn trial_spectra(
    limb: &InertiaDampingStiffness,
    transducer: (f64, f64),
    limb_noise_n: f64,
    seed: u64,
    welch: &Welch,
    alter: &dyn Fn(&mut [Vec<f64>]),
) -> Vec<CrossSpectra> {
    (0..6)
        .map(|t| {
            let mut trial = trial(limb, transducer, limb_noise_n, 100 * seed + t);
            alter(&mut trial);
            welch.spectra(RATE_HZ, &trial.iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("valid")
        })
        .collect()
}

/// Derived compliance.
pub fn compliance(spectra: &CrossSpectra) -> DerivedEstimate {
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let names = |role: &str| vec![format!("{role}_x"), format!("{role}_y")];
    let labels = Labels { references: names("cmd"), inputs: names("force"), outputs: names("pos"), kind: ResponseKind::Compliance };
    ndof_sysid::derived(spectra, &ports, &labels).expect("estimate")
}
