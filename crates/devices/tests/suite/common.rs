//! Experiments that several tests share.

use ndof_devices::{DeviceConfig, EndpointLinearConfig, Experiment, LimbConfig, PlanarTwoLinkConfig, Sensors};
use ndof_signal::Recording;

/// The patient-like test arm P1 on MIT-MANUS, sensors ideal.
pub fn patient_arm() -> Experiment {
    let limb = LimbConfig::EndpointLinear(EndpointLinearConfig {
        M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
        B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
        K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
        ..EndpointLinearConfig::default()
    });
    let sensors = Sensors { force_noise_rms: Some(0.0), force_quantum: Some(0.0), encoder_bits: Some(0), ..Sensors::default() };
    Experiment { duration_s: 4.0, discard_s: 0.0, sensors, ..Experiment::new(DeviceConfig::named("mit-manus"), limb) }
}

/// A two-link arm with a mean force of tone, a trough and a two-joint stiffness, sensors ideal.
pub fn two_link_arm() -> Experiment {
    let limb = PlanarTwoLinkConfig {
        K: vec![vec![29.5, 14.3], vec![14.3, 39.3]],
        mean_force_n: Some(vec![-3.0, -5.0]),
        handle_mass_kg: 0.6,
        ..PlanarTwoLinkConfig::default()
    };
    Experiment { limb: LimbConfig::PlanarTwoLink(limb), ..patient_arm() }
}

/// Commands of two axes: sums of sines from 0.3 to 12 Hz with the root mean square `rms`.
pub fn sines(experiment: &Experiment, rms: f64) -> Vec<Vec<f64>> {
    let (discarded, recorded) = experiment.samples();
    let lines: Vec<f64> = (0..20).map(|k| 0.3 + 0.61 * k as f64).collect();
    let amplitude = rms * (2.0 / lines.len() as f64).sqrt();
    (0..2)
        .map(|axis| {
            (0..discarded + recorded)
                .map(|k| {
                    let t = k as f64 / experiment.sample_rate_hz;
                    let phase = |l: usize| (l * l) as f64 * (0.7 + 0.45 * axis as f64);
                    lines.iter().enumerate().map(|(l, f)| amplitude * (std::f64::consts::TAU * f * t + phase(l)).sin()).sum()
                })
                .collect()
        })
        .collect()
}

/// Largest over force and position channels of the rms of the difference over the rms of the reference, both about their means.
pub fn relative_error(found: &Recording, reference: &Recording) -> f64 {
    let mut worst: f64 = 0.0;
    for (f, r) in found.channels().iter().zip(reference.channels()).filter(|(f, _)| !f.name.starts_with("cmd")) {
        let mean = r.samples.iter().sum::<f64>() / r.samples.len() as f64;
        let size: f64 = r.samples.iter().map(|v| (v - mean).powi(2)).sum();
        let error: f64 = f.samples.iter().zip(&r.samples).map(|(a, b)| (a - b).powi(2)).sum();
        worst = worst.max((error / size).sqrt());
    }
    worst
}
