//! What each effect of the registry does to a recording: one picture an effect, for the book.
//!
//! cargo run --release --example effect_pictures [FOLDER]
//!
//! The same three trials are simulated twice, with the same seeds, without and with the effect. Drawn are the compliance along x,
//! and the force that the true linear limb does not explain, against displacement, velocity and time.

use ndof::models::effects::EFFECTS;
use ndof::report::Figure;
use ndof::report::plot::{Axis, Color, Panel, Series};
use ndof::signal::{Passband, Recording, SosFilter, Welch};
use ndof::study::file::{ExperimentFile, HiddenEffect};
use ndof::sysid::{Direct, Estimates, Labels, Ports, SpectralMethod, estimate};
use std::error::Error;
use std::path::PathBuf;

/// Where an effect sits and how strong it is, strong enough to be seen.
const CASES: [(&str, &str, &str, &str); 32] = [
    ("parameter-error", "limb", "", "name = \"K_x_x\"\nvalue = 360.0"),
    ("added-mass", "limb", "", "mass_kg = 0.6"),
    ("coulomb-friction", "limb", "x", "level_n = 0.8"),
    ("hysteresis", "limb", "x", "stiffness_n_per_m = 300.0\nyield_m = 0.003"),
    ("cubic-stiffness", "limb", "x", "k3_n_per_m3 = 4e5"),
    ("asymmetric-stiffness", "limb", "x", "k2_n_per_m2 = 6e3"),
    ("dead-zone", "limb", "x", "half_gap_m = 0.003"),
    ("end-stop", "limb", "x", "position_m = 0.007\nstiffness_n_per_m = 800.0"),
    ("viscoelastic", "limb", "x", "modulus_n_per_m = 250.0\ntime_s = 0.08"),
    ("extra-resonance", "limb", "x", "frequency_hz = 8.0\ndamping_ratio = 0.1\nmass_share = 0.2"),
    ("reflex-delay", "limb", "x", "delay_s = 0.04\nstiffness_n_per_m = 60.0\ndamping_n_s_per_m = 20.0"),
    ("measurement-delay", "sensor", "x", "delay_s = 0.008"),
    ("channel-filter", "sensor", "x", "cutoff_hz = 12.0"),
    ("actuation-delay", "actuator", "x", "delay_s = 0.02"),
    ("actuator-saturation", "actuator", "x", "level_n = 5.0"),
    ("sensor-misalignment", "sensor", "", "angle_rad = 0.15"),
    ("sensor-scale", "sensor", "", "factor = 1.2\nchannel = \"force_x\""),
    ("sensor-offset-drift", "sensor", "", "rate_per_s = 0.06\nchannel = \"force_x\""),
    ("quantisation", "sensor", "", "step = 1.0\nchannel = \"force_x\""),
    ("periodic-disturbance", "environment", "x", "frequency_hz = 5.0\namplitude_n = 1.5"),
    ("limb-noise", "limb", "x", "rms_n = 1.2"),
    ("transient-disturbance", "environment", "x", "time_s = 6.0\nimpulse_n_s = 1.5"),
    ("stiffness-drift", "limb", "x", "fraction_per_s = 0.012"),
    ("posture-drift", "limb", "x", "rate_m_per_s = 2e-4"),
    ("varying-stiffness", "limb", "x", "swing_n_per_m = 200.0\ncycle_s = 4.0"),
    ("varying-damping", "limb", "x", "swing_n_s_per_m = 8.0\ncycle_s = 4.0"),
    ("varying-reflex", "limb", "x", "delay_s = 0.04\ndamping_n_s_per_m = 20.0\ncycle_s = 4.0"),
    ("arm-geometry", "limb", "", ""),
    ("posture-stiffness", "limb", "", "elbow_with_elbow_nm_per_rad2 = 120.0"),
    ("gravity", "limb", "x", "torque_nm = 40.0"),
    ("geometry-error", "robot", "", "name = \"link_1_m\"\nvalue = 0.44"),
    ("cross-coupling", "limb", "", "matrix = [[0.0, -120.0], [-120.0, 0.0]]"),
];

const M: [[f64; 2]; 2] = [[2.1, -0.2], [-0.2, 1.9]];
const B: [[f64; 2]; 2] = [[11.0, -2.0], [-2.0, 15.0]];
const K: [[f64; 2]; 2] = [[300.0, -60.0], [-60.0, 520.0]];
/// Above this the second derivative of a position in steps is noise.
const LOW_PASS_HZ: f64 = 15.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "book/src/pictures/effects".to_owned()));
    std::fs::create_dir_all(&folder)?;
    if let Some(effect) = EFFECTS.iter().find(|effect| CASES.iter().all(|case| case.0 != effect.name())) {
        return Err(format!("{} has no picture: give it a line in CASES", effect.name()).into());
    }
    let without = Seen::of(None)?;
    for (name, side, axis, parameters) in CASES {
        let hidden = HiddenEffect {
            name: name.to_owned(),
            side: side.to_owned(),
            axis: (!axis.is_empty()).then(|| axis.to_owned()),
            parameters: toml::from_str(parameters)?,
        };
        let figure = picture(name, &without, &Seen::of(Some(hidden))?);
        std::fs::write(folder.join(format!("{name}.svg")), figure.to_svg())?;
        println!("{name}");
    }
    Ok(())
}

/// What one experiment shows.
struct Seen {
    estimates: Estimates,
    position: Vec<f64>,
    velocity: Vec<f64>,
    /// The force along x that the true linear limb does not explain.
    left_over: Vec<f64>,
    rate_hz: f64,
}

impl Seen {
    fn of(hidden: Option<HiddenEffect>) -> Result<Self, Box<dyn Error>> {
        let rows = |matrix: [[f64; 2]; 2]| format!("{matrix:?}");
        let mut file: ExperimentFile = toml::from_str(&format!(
            "seed = 3\ntrials = 3\n[device]\nname = \"mit-manus\"\n[limb]\nname = \"endpoint-linear\"\nM = {}\nB = {}\nK = {}\n",
            rows(M),
            rows(B),
            rows(K)
        ))?;
        file.effects.extend(hidden);
        let trials = ndof::study::simulate(&file, &|_, _, _| ())?.recordings;
        let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
        let labels = Labels::of(&trials[0], &ports);
        let estimates = estimate(&trials.iter().collect::<Vec<_>>(), &ports, &labels, &SpectralMethod::Welch(Welch::smooth()), Direct::H1)?;
        Self::in_time(estimates, &trials[0])
    }

    fn in_time(estimates: Estimates, trial: &Recording) -> Result<Self, Box<dyn Error>> {
        let rate = trial.sample_rate_hz();
        let filter = SosFilter::butterworth(4, Passband::Low(LOW_PASS_HZ), rate)?;
        let smooth = |channel: usize| -> Result<Vec<f64>, Box<dyn Error>> {
            let samples = &trial.channels()[channel].samples;
            let mean = samples.iter().sum::<f64>() / samples.len() as f64;
            Ok(filter.filter_zero_phase(&samples.iter().map(|s| s - mean).collect::<Vec<_>>())?)
        };
        let slope =
            |x: &[f64]| -> Vec<f64> { (0..x.len()).map(|k| if k == 0 || k + 1 == x.len() { 0.0 } else { (x[k + 1] - x[k - 1]) * rate / 2.0 }).collect() };
        let (force, motion) = (smooth(2)?, [smooth(4)?, smooth(5)?]);
        let velocity = [slope(&motion[0]), slope(&motion[1])];
        let acceleration = [slope(&velocity[0]), slope(&velocity[1])];
        let explained = |k: usize| (0..2).map(|j| M[0][j] * acceleration[j][k] + B[0][j] * velocity[j][k] + K[0][j] * motion[j][k]).sum::<f64>();
        let left_over = (0..force.len()).map(|k| force[k] - explained(k)).collect();
        let [position, _] = motion;
        let [velocity, _] = velocity;
        Ok(Seen { estimates, position, velocity, left_over, rate_hz: rate })
    }
}

fn picture(name: &str, without: &Seen, with: &Seen) -> Figure {
    let both = [(without, "without", Color::Grey), (with, "with the effect", Color::Vermillion)];
    let mut gain = Panel::new(Axis::log("Frequency", "Hz").range(0.4, 15.0), Axis::log("Gain", "m/N"));
    let mut phase = Panel::new(Axis::log("Frequency", "Hz").range(0.4, 15.0), Axis::degrees("Phase"));
    let mut position = Panel::new(Axis::linear("Displacement", "m"), Axis::linear("Unexplained force", "N"));
    let mut velocity = Panel::new(Axis::linear("Velocity", "m/s"), Axis::linear("Unexplained force", "N"));
    let mut time = Panel::new(Axis::linear("Time", "s"), Axis::linear("Unexplained force", "N"));
    for (seen, label, color) in both {
        let response = &seen.estimates.direct.response;
        let inside: Vec<usize> = (0..response.frequency_hz.len()).filter(|&f| (0.4..=15.0).contains(&response.frequency_hz[f])).collect();
        let hz: Vec<f64> = inside.iter().map(|&f| response.frequency_hz[f]).collect();
        let at = |f: usize| response.value[[f, 0, 0]];
        gain = gain.with(Series::line(label, hz.clone(), inside.iter().map(|&f| at(f).norm()).collect(), color));
        phase = phase.with(Series::line(label, hz, inside.iter().map(|&f| at(f).arg().to_degrees()).collect(), color));
        // The filter's ends do not belong to the picture, and eyes need no more than a few hundred dots.
        let samples = seen.left_over.len();
        let thinned: Vec<usize> = (500..samples - 500).step_by(53).collect();
        let pick = |of: &[f64]| thinned.iter().map(|&k| of[k]).collect::<Vec<f64>>();
        position = position.with(Series::points(label, pick(&seen.position), pick(&seen.left_over), color));
        velocity = velocity.with(Series::points(label, pick(&seen.velocity), pick(&seen.left_over), color));
        let seconds: Vec<f64> = thinned.iter().map(|&k| k as f64 / seen.rate_hz).collect();
        time = time.with(Series::line(label, seconds, pick(&seen.left_over), color));
    }
    Figure::new(name, name)
        .columns(4)
        .cell("compliance along x", vec![gain.height(120.0), phase.height(90.0)])
        .panel("against displacement", position.height(210.0))
        .panel("against velocity", velocity.height(210.0))
        .panel("over time", time.height(210.0))
}
