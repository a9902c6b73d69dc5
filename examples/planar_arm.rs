//! From a simulated robot and arm to joint stiffness, through the library: what `ndof study arm` does.
//!
//! cargo run --release --example planar_arm

use ndof::devices::{DeviceConfig, EndpointLinearConfig, Experiment, Extras, LimbConfig, PlanarTwoLinkConfig, Posture, linearise, simulate_trial};
use ndof::diagnose::{Options, diagnose};
use ndof::models::{Arm, Axis, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, LoopModel, Projection, Smoothing, Symmetry, Transducer};
use ndof::models::{WeightedFit, linear_start};
use ndof::signal::{FilteredNoise, Recording, SeedCriterion, Welch};
use ndof::sysid::{Direct, Labels, Ports, SpectralMethod, estimate};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let experiment = experiment();
    let trials = simulate(&experiment)?;
    println!("{} trials of {}", trials.len(), trials[0]);

    // Commanded force, measured force, displacement: the channels stand in this order, two axes each.
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let labels = Labels::of(&trials[0], &ports);
    let estimates = estimate(&trials.iter().collect::<Vec<_>>(), &ports, &labels, &SpectralMethod::Welch(Welch::smooth()), Direct::H1)?;
    let derived = estimates.derived.ok_or("as many references as inputs are needed")?;

    // M, B, K at the hand by least squares, weighted with the estimate's covariance and seen through its window.
    let band_hz = [0.5, 8.0];
    let truth = linearise(&experiment)?;
    let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
    let settings = WeightedFit {
        band_hz,
        smoothing: Smoothing::Derived(LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz)?),
        transducer: Some(Transducer { stiffness: truth.transducer.stiffness, damping: truth.transducer.damping }),
        ..WeightedFit::default()
    };
    let start = linear_start(&model, &derived.response.band(band_hz[0], band_hz[1]))?;
    let fit = settings.fit(&model, &derived.response, &start)?;

    // At the joints: the mean force adds stiffness by the curvature of the arm's kinematics.
    let posture = experiment.posture.joint_rad.as_deref().and_then(|q| <[f64; 2]>::try_from(q).ok()).ok_or("two joint angles")?;
    let projection = Projection {
        kinematics: Kinematics::planar_two_link(Arm::Right, [0.33, 0.34], posture)?,
        mean_force_n: ports.inputs.iter().map(|&input| mean(&trials, input)).collect(),
        sd: KinematicsSd::default(),
    };
    let joints = projection.fit_to_joints(&model, &fit)?;

    println!("{:20} {:>12} {:>10} {:>9}   95 % interval", "", "unit", "simulated", "estimate");
    let (limb, _) = truth.limb_joints.as_ref().ok_or("a limb with joints")?;
    let simulated = [&truth.limb, limb].map(|l| [&l.inertia, &l.damping, &l.stiffness].map(|m| [m[[0, 0]], m[[0, 1]], m[[1, 1]]]));
    for (parameter, simulated) in fit.parameters.iter().chain(&joints.parameters).zip(simulated.iter().flatten().flatten()) {
        let [low, high] = parameter.ci95;
        println!("{:20} {:>12} {simulated:10.4} {:9.4}   {low:.4} … {high:.4}", parameter.name, parameter.unit, parameter.value);
    }

    // What the linear simulation misses in what was recorded.
    let diagnosis = diagnose(&trials, &ports, &Options::default(), None, &mut |_| ())?;
    println!("\nthe linear simulation is {:?}, held-out NRMSE {:.3?}", diagnosis.verdict, diagnosis.baseline.held_out.nrmse);
    diagnosis.causes.iter().map(|cause| &cause.effect).chain(&diagnosis.discrepancy.notes).for_each(|line| println!("  {line}"));

    // The same limb without its links, its matrices at the hand kept: what is gone then was the arm's geometry.
    let [mass, damping, stiffness] =
        [&truth.limb.inertia, &truth.limb.damping, &truth.limb.stiffness].map(|m| m.rows().into_iter().map(|row| row.to_vec()).collect());
    let linear = EndpointLinearConfig { M: mass, B: damping, K: stiffness, mean_force_n: Some(vec![5.0, -6.0]), ..EndpointLinearConfig::default() };
    let straight = Experiment { limb: LimbConfig::EndpointLinear(linear), ..experiment };
    let diagnosis = diagnose(&simulate(&straight)?, &ports, &Options::default(), None, &mut |_| ())?;
    println!("without the geometry of its links it is {:?}, held-out NRMSE {:.3?}", diagnosis.verdict, diagnosis.baseline.held_out.nrmse);
    Ok(())
}

/// A patient-like arm that pushes against MIT-MANUS with 8 N.
fn experiment() -> Experiment {
    let limb = LimbConfig::PlanarTwoLink(PlanarTwoLinkConfig {
        K: vec![vec![67.0, 28.0], vec![28.0, 40.5]],
        B: vec![vec![2.46, 1.05], vec![1.05, 1.27]],
        handle_mass_kg: 0.6,
        mean_force_n: Some(vec![5.0, -6.0]),
        ..PlanarTwoLinkConfig::default()
    });
    let posture = Posture { hand_m: None, joint_rad: Some(vec![std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_2]) };
    Experiment { trials: 6, posture, ..Experiment::new(DeviceConfig::named("mit-manus"), limb) }
}

/// Each trial under filtered noise of 4 N whose two axes happen to be least coherent among 20 seeds.
fn simulate(experiment: &Experiment) -> Result<Vec<Recording>, Box<dyn Error>> {
    let (discarded, recorded) = experiment.samples();
    let noise = FilteredNoise { axes: 2, samples: discarded + recorded, rms: 4.0, ..FilteredNoise::default() };
    let criterion = SeedCriterion { candidates: 20, ..SeedCriterion::default() };
    (0..experiment.trials)
        .map(|trial| {
            let seed = noise.search(1 + 20 * trial as u64, &criterion, &|_, _| ())?.seed;
            Ok(simulate_trial(experiment, &noise.generate(seed)?, &Extras::default(), trial)?)
        })
        .collect()
}

fn mean(trials: &[Recording], channel: usize) -> f64 {
    let samples = || trials.iter().flat_map(|trial| &trial.channels()[channel].samples);
    samples().sum::<f64>() / samples().count() as f64
}
