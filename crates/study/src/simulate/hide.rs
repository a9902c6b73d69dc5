//! Hidden effects of an experiment's file as what a simulation has to do.

use crate::error::{StudyError, meaning};
use crate::file::{ExperimentFile, HiddenEffect};
use ndof_analysis::{AnalysisError, did_you_mean, nearest};
use ndof_devices::{Experiment, Extras, Impedance, LimbConfig};
use ndof_models::Axis;
use ndof_models::effects::{EFFECTS, Effect, Injection, Parameters, Setting, Side, Value, find};
use ndof_signal::{Channel, Recording};
use std::collections::BTreeMap;

/// What a trial's simulation does on top of its experiment.
pub(super) struct Hidden {
    /// The experiment with the parameters that effects change.
    pub experiment: Experiment,
    /// Force laws and stages.
    pub extras: Extras,
    /// Matrices that mix the effort channels, one after the other.
    pub mixing: Vec<Vec<Vec<f64>>>,
}

/// What hides in trial `trial` of `file`, whose limb is `limb` about the posture.
pub(super) fn hide(file: &ExperimentFile, axes: &[Axis], limb: &Impedance, trial: usize) -> Result<Hidden, StudyError> {
    let (mut experiment, mut extras, mut mixing) = (file.experiment(), Extras::default(), Vec::new());
    for (k, hidden) in file.effects.iter().enumerate() {
        let wrong = |what: String| meaning(&format!("effect {} ({})", k + 1, hidden.name), what);
        let effect = find(&hidden.name).ok_or_else(|| {
            let known: Vec<&str> = EFFECTS.iter().map(|effect| effect.name()).collect();
            wrong(format!("no such effect{}; `ndof list effects` prints them", did_you_mean(nearest(&hidden.name, known).as_deref())))
        })?;
        let side = side(effect, &hidden.side).map_err(&wrong)?;
        let axis = match &hidden.axis {
            Some(name) => {
                Some(axes.iter().position(|axis| axis.name == *name).ok_or_else(|| wrong(format!("no axis \"{name}\"; the device has {}", names(axes))))?)
            }
            None => None,
        };
        let rows = |matrix: &ndarray::Array2<f64>| matrix.rows().into_iter().map(|row| row.to_vec()).collect();
        let setting = Setting {
            axes: axes.len(),
            axis,
            mass: rows(&limb.inertia),
            stiffness: rows(&limb.stiffness),
            duration_s: file.duration_s,
            sample_rate_hz: file.sample_rate_hz,
            seed: file.seed.wrapping_add(((trial as u64) << 20) + ((k as u64) << 40)),
        };
        let parameters = Parameters(values(hidden).map_err(&wrong)?);
        let channel = match parameters.0.get("channel") {
            Some(Value::Text(name)) => Some(name.clone()),
            _ => None,
        };
        let sites = || setting.sites().into_iter().map(|axis| &axes[axis]);
        match effect.inject(&parameters, &setting)? {
            Injection::Force(law) if side == Side::Robot => extras.robot.push(law),
            Injection::Force(law) => extras.limb.push(law),
            Injection::Stage(_) => {
                let make = || {
                    let (parameters, setting) = (parameters.clone(), setting.clone());
                    // What has succeeded above succeeds again with the same arguments.
                    let stage: ndof_devices::StageMaker = Box::new(move || match effect.inject(&parameters, &setting) {
                        Ok(Injection::Stage(stage)) => stage,
                        _ => Box::new(|sample: f64| sample),
                    });
                    stage
                };
                if side == Side::Actuator {
                    extras.actuators.extend(sites().map(|axis| (axis.name.clone(), make())));
                } else {
                    let effort = |axis: &Axis| format!("{}_{}", if axis.rotational { "torque" } else { "force" }, axis.name);
                    let channels = channel.map_or_else(|| sites().map(effort).collect(), |name| vec![name]);
                    extras.sensors.extend(channels.into_iter().map(|channel| (channel, make())));
                }
            }
            Injection::Mass(mass) => add_mass(&mut experiment.limb, mass, &setting.sites()).map_err(wrong)?,
            Injection::Mixing(matrix) => mixing.push(matrix),
            Injection::Parameter { name, value } => change(&mut experiment, axes, &name, value),
        }
    }
    Ok(Hidden { experiment, extras, mixing })
}

fn names(axes: &[Axis]) -> String {
    axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The side that the file names, if the effect can sit there.
fn side(effect: &Effect, name: &str) -> Result<Side, String> {
    let sides = effect.card.sides;
    sides
        .iter()
        .copied()
        .find(|side| side.word() == name)
        .ok_or_else(|| format!("side = \"{name}\"; it can sit at {}", sides.iter().map(|side| format!("\"{}\"", side.word())).collect::<Vec<_>>().join(", ")))
}

/// TOML values as the effects take them.
fn values(hidden: &HiddenEffect) -> Result<BTreeMap<String, Value>, String> {
    let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|n| n as f64));
    hidden
        .parameters
        .iter()
        .map(|(name, value)| {
            let row = |row: &toml::Value| row.as_array()?.iter().map(number).collect::<Option<Vec<f64>>>();
            let found = match value {
                toml::Value::Boolean(flag) => Some(Value::Flag(*flag)),
                toml::Value::String(text) => Some(Value::Text(text.clone())),
                toml::Value::Array(rows) => rows.iter().map(row).collect::<Option<Vec<_>>>().map(Value::Matrix),
                other => number(other).map(Value::Number),
            };
            Ok((name.clone(), found.ok_or_else(|| format!("parameters.{name} = {value}; write a number, a word, true or false, or a matrix"))?))
        })
        .collect()
}

/// Adds inertia to the axes of a limb.
fn add_mass(limb: &mut LimbConfig, mass: f64, sites: &[usize]) -> Result<(), String> {
    match limb {
        LimbConfig::EndpointLinear(config) => {
            for &axis in sites {
                if let Some(entry) = config.M.get_mut(axis).and_then(|row| row.get_mut(axis)) {
                    *entry += mass;
                }
            }
            Ok(())
        }
        LimbConfig::PlanarTwoLink(config) => {
            config.handle_mass_kg += mass;
            Ok(())
        }
        _ => Err("a mass can be added to the limbs endpoint-linear and planar-two-link only".to_owned()),
    }
}

/// Changes a parameter: an entry of the limb's matrices (`K_x_y`), else one of the device's.
fn change(experiment: &mut Experiment, axes: &[Axis], name: &str, value: f64) {
    if let LimbConfig::EndpointLinear(config) = &mut experiment.limb {
        let n = axes.len();
        for (letter, matrix) in [("M", &mut config.M), ("B", &mut config.B), ("K", &mut config.K)] {
            let entry = |k: &usize| name == format!("{letter}_{}_{}", axes[k / n].name, axes[k % n].name) || (n == 1 && name == letter);
            if let Some(k) = (0..n * n).find(entry) {
                matrix[k / n][k % n] = value;
                matrix[k % n][k / n] = value;
                return;
            }
        }
    }
    experiment.device.parameters.insert(name.to_owned(), value);
}

/// Mixes the effort channels of a recording.
pub(super) fn mix(recording: &Recording, matrix: &[Vec<f64>]) -> Result<Recording, StudyError> {
    let is_effort = |channel: &Channel| channel.name.starts_with("force_") || channel.name.starts_with("torque_");
    let efforts: Vec<&Channel> = recording.channels().iter().filter(|channel| is_effort(channel)).collect();
    let mut row = 0;
    let channels = recording
        .channels()
        .iter()
        .map(|channel| {
            let mut channel = channel.clone();
            if is_effort(&channel) {
                for (k, sample) in channel.samples.iter_mut().enumerate() {
                    *sample = matrix.get(row).into_iter().flatten().zip(&efforts).map(|(m, effort)| m * effort.samples[k]).sum();
                }
                row += 1;
            }
            channel
        })
        .collect();
    Ok(recording.with_channels(channels).map_err(|source| AnalysisError::Recording { file: "the simulation".to_owned(), source })?)
}
