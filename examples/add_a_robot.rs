//! Another robot: a file that describes it, and the whole way from commanded force to the limb's impedance.
//!
//! cargo run --release --example add_a_robot

use ndof::devices::{DeviceConfig, Extras, LimbConfig, linearise, simulate_trial};
use ndof::models::{Axis, InertiaDampingStiffnessModel, LoopModel, Smoothing, Symmetry, Transducer, WeightedFit, linear_start};
use ndof::signal::{FilteredNoise, Recording, Welch};
use ndof::study::file::{ExperimentFile, parse};
use ndof::sysid::{Direct, Labels, Ports, SpectralMethod, estimate};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    // An experiment names the robot's file: a serial chain as TOML or URDF.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/experiments");
    let text = std::fs::read_to_string(folder.join("two-link.toml"))?;
    let experiment = parse::<ExperimentFile>(&text, "two-link.toml")?.beside(&folder).experiment();
    let robot: &DeviceConfig = &experiment.device;
    let device = robot.build()?;
    println!("{} joints, axes {:?}", device.robot.joints().coulomb.len(), device.robot.axes().iter().map(|axis| &axis.name).collect::<Vec<_>>());

    // What the file means at the hand: look at this before anything is measured.
    let linear = linearise(&experiment)?;
    println!("endpoint inertia of the robot in kg:\n{:.3}", linear.robot_inertia);

    let trials = simulate(&experiment)?;
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let labels = Labels::of(&trials[0], &ports);
    let estimates = estimate(&trials.iter().collect::<Vec<_>>(), &ports, &labels, &SpectralMethod::Welch(Welch::smooth()), Direct::H1)?;
    let derived = estimates.derived.ok_or("as many references as inputs are needed")?;

    let band_hz = [0.5, 8.0];
    let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
    let fit = WeightedFit {
        band_hz,
        smoothing: Smoothing::Derived(LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz)?),
        transducer: Some(Transducer { stiffness: linear.transducer.stiffness, damping: linear.transducer.damping }),
        ..WeightedFit::default()
    }
    .fit(&model, &derived.response, &linear_start(&model, &derived.response.band(band_hz[0], band_hz[1]))?)?;

    let LimbConfig::EndpointLinear(limb) = &experiment.limb else { return Err("a linear limb".into()) };
    let truth = [&limb.M, &limb.B, &limb.K].map(|m| [m[0][0], m[0][1], m[1][1]]);
    for (parameter, truth) in fit.parameters.iter().zip(truth.iter().flatten()) {
        let [low, high] = parameter.ci95;
        println!("{:6} {:>8} simulated {truth:8.3}, found {:8.3}, 95 % interval {low:.3} … {high:.3}", parameter.name, parameter.unit, parameter.value);
    }
    Ok(())
}

fn simulate(experiment: &ndof::devices::Experiment) -> Result<Vec<Recording>, Box<dyn Error>> {
    let (discarded, recorded) = experiment.samples();
    let noise = FilteredNoise { axes: 2, samples: discarded + recorded, rms: 4.0, ..FilteredNoise::default() };
    (0..experiment.trials).map(|trial| Ok(simulate_trial(experiment, &noise.generate(100 + trial as u64)?, &Extras::default(), trial)?)).collect()
}
