//! Recordings as samples of effort, displacement and reference.

use crate::DiagnoseError;
use crate::operators::filter;
use crate::split::FEWEST;
use ndof_models::schedule::MeanOver;
use ndof_models::{Hold, Sampling, Ticks};
use ndof_signal::{Quantity, Recording};
use ndof_sysid::Ports;
use num_complex::Complex64;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Channels of some stretches of recordings: `[trial][axis][time]`.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    pub rate_hz: f64,
    pub effort: Vec<Vec<Vec<f64>>>,
    /// Displacement; integrated where velocity or acceleration was measured.
    pub motion: Vec<Vec<Vec<f64>>>,
    /// The motion channels as they are.
    pub measured: Vec<Vec<Vec<f64>>>,
    pub reference: Vec<Vec<Vec<f64>>>,
    /// What stiffness and damping may follow, `[trial][time]`; no trial where there is nothing.
    pub schedule: Vec<Vec<f64>>,
    /// Time of each trial's first sample since the recording began.
    pub start_s: Vec<f64>,
    /// Length of the whole recordings.
    pub duration_s: f64,
}

/// What the channels are.
#[derive(Clone, Debug)]
pub(crate) struct Meaning {
    /// Whether the motion is the input and the effort the output.
    pub motion_imposed: bool,
    /// How many times the displacement was differentiated before it was measured.
    pub order: usize,
    pub rotational: bool,
    pub effort_names: Vec<String>,
    pub motion_names: Vec<String>,
    /// Names of the axes, from the outputs.
    pub axes: Vec<String>,
    /// Whether references are efforts that the robot was told to apply.
    pub reference_is_effort: bool,
    pub effort_is_command: bool,
}

/// The axis in a channel's name: what follows the first underscore.
pub(crate) fn axis_of(name: &str) -> &str {
    name.split_once('_').map_or(name, |(_, axis)| axis)
}

fn is_effort(name: &str, quantity: Quantity, otherwise: bool) -> bool {
    match quantity {
        Quantity::Effort => true,
        Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration => false,
        _ if name.starts_with("force_") || name.starts_with("torque_") => true,
        _ if ["pos_", "angle_", "vel_", "acc_"].iter().any(|p| name.starts_with(p)) => false,
        _ => otherwise,
    }
}

impl Meaning {
    /// Reads the roles of the channels, and refuses what cannot be balanced.
    pub fn new(recording: &Recording, ports: &Ports) -> Result<Self, DiagnoseError> {
        let channel = |i: &usize| &recording.channels()[*i];
        let kinds =
            |indices: &[usize], otherwise| -> Vec<bool> { indices.iter().map(channel).map(|c| is_effort(&c.name, c.unit.quantity(), otherwise)).collect() };
        let (inputs, outputs) = (kinds(&ports.inputs, true), kinds(&ports.outputs, false));
        if ports.inputs.len() != ports.outputs.len() {
            return Err(DiagnoseError::Unequal { inputs: ports.inputs.len(), outputs: ports.outputs.len() });
        }
        let motion_imposed = match (inputs.iter().all(|e| *e), outputs.iter().all(|e| *e)) {
            (true, false) if outputs.iter().all(|e| !*e) => false,
            (false, true) if inputs.iter().all(|e| !*e) => true,
            _ => return Err(DiagnoseError::NotEffortAndMotion),
        };
        let (effort, motion) = if motion_imposed { (&ports.outputs, &ports.inputs) } else { (&ports.inputs, &ports.outputs) };
        let order = |i: &usize| {
            let c = channel(i);
            match c.unit.quantity() {
                Quantity::Velocity => 1,
                Quantity::Acceleration => 2,
                Quantity::Displacement => 0,
                _ if c.name.starts_with("vel_") => 1,
                _ if c.name.starts_with("acc_") => 2,
                _ => 0,
            }
        };
        let orders: Vec<usize> = motion.iter().map(order).collect();
        if orders.iter().any(|o| *o != orders[0]) {
            return Err(DiagnoseError::MixedMotion);
        }
        let names = |indices: &[usize]| -> Vec<String> { indices.iter().map(|i| channel(i).name.clone()).collect() };
        Ok(Meaning {
            motion_imposed,
            order: orders[0],
            rotational: motion.iter().map(channel).any(|c| c.unit.is_rotational()) || effort.iter().map(channel).any(|c| c.unit.is_rotational()),
            effort_names: names(effort),
            motion_names: names(motion),
            axes: ports.outputs.iter().map(|i| axis_of(&channel(i).name).to_owned()).collect(),
            reference_is_effort: ports.references.len() == effort.len() && ports.references.iter().map(channel).all(|c| c.unit.quantity() == Quantity::Effort),
            effort_is_command: !motion_imposed
                && effort.iter().map(channel).all(|c| c.name.starts_with("cmd_") || c.name.contains("motor") || c.name.contains("command")),
        })
    }
}

/// The running integral of samples less their mean, itself less its straight line.
fn integral(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    // From one sample to the next along the polynomial of fifth degree through six of them: the rule of trapezoids is 1.6 % short at a fourteenth of the
    // rate. At the ends trapezoids.
    let between = |k: usize| match samples.get(k.wrapping_sub(3)..k + 3) {
        Some([a, b, c, d, e, f]) => (11.0 * (a + f) - 93.0 * (b + e) + 802.0 * (c + d)) / 1440.0,
        _ => 0.5 * (samples[k - 1] + samples[k]),
    };
    let mut sum = 0.0;
    let mut out: Vec<f64> = (0..samples.len())
        .map(|k| {
            sum += if k == 0 { 0.0 } else { (between(k) - mean) / rate_hz };
            sum
        })
        .collect();
    let middle = (n - 1.0) / 2.0;
    let level = out.iter().sum::<f64>() / n;
    let (sxy, sxx) = out.iter().enumerate().fold((0.0, 0.0), |(xy, xx), (k, y)| {
        let u = k as f64 - middle;
        (xy + u * (y - level), xx + u * u)
    });
    let slope = sxy / sxx.max(1.0);
    out.iter_mut().enumerate().for_each(|(k, y)| *y -= level + slope * (k as f64 - middle));
    out
}

impl Samples {
    /// The samples of whole recordings.
    pub fn new(trials: &[Recording], ports: &Ports, meaning: &Meaning) -> Result<Self, DiagnoseError> {
        let first = trials.first().ok_or(DiagnoseError::NoTrial)?;
        let rate_hz = first.sample_rate_hz();
        let (effort, motion) = if meaning.motion_imposed { (&ports.outputs, &ports.inputs) } else { (&ports.inputs, &ports.outputs) };
        let mut out =
            Samples { rate_hz, effort: vec![], motion: vec![], measured: vec![], reference: vec![], schedule: vec![], start_s: vec![], duration_s: 0.0 };
        for (number, trial) in trials.iter().enumerate() {
            ports.validate(trial.channels().len())?;
            if (trial.sample_rate_hz() - rate_hz).abs() > 1e-9 * rate_hz {
                return Err(DiagnoseError::Rates { trial: number + 1, expected: rate_hz, found: trial.sample_rate_hz() });
            }
            if trial.len() < FEWEST {
                return Err(DiagnoseError::TooShort { trial: number + 1, samples: trial.len() });
            }
            let used: Vec<usize> = effort.iter().chain(motion).chain(&ports.references).copied().collect();
            trial.require_finite(used.iter().map(|i| trial.channels()[*i].name.as_str()))?;
            let own = |indices: &[usize]| -> Vec<Vec<f64>> { trial.columns(indices).into_iter().map(<[f64]>::to_vec).collect() };
            let measured = own(motion);
            let displacement = measured.iter().map(|m| (0..meaning.order).fold(m.clone(), |x, _| integral(&x, rate_hz))).collect();
            for (channels, indices) in [(&measured, motion), (&own(effort), effort)] {
                for (samples, index) in channels.iter().zip(indices) {
                    if samples.iter().all(|s| *s == samples[0]) {
                        return Err(DiagnoseError::Constant { trial: number + 1, channel: trial.channels()[*index].name.clone() });
                    }
                }
            }
            out.effort.push(own(effort));
            out.motion.push(displacement);
            out.measured.push(measured);
            out.reference.push(own(&ports.references));
            out.start_s.push(0.0);
            out.duration_s = out.duration_s.max(trial.duration_s());
        }
        Ok(out)
    }

    /// Some of the trials.
    pub fn pick(&self, trials: &[usize]) -> Self {
        let schedule = trials.iter().filter_map(|t| self.schedule.get(*t).cloned()).collect();
        self.of(|all| trials.iter().map(|t| all[*t].clone()).collect(), schedule, trials.iter().map(|t| self.start_s[*t]).collect())
    }

    /// The samples from `from` to before `to` of every trial.
    pub fn cut(&self, from: usize, to: usize) -> Self {
        let part = |x: &Vec<f64>| x[from..to.min(x.len())].to_vec();
        let start_s = self.start_s.iter().map(|s| s + from as f64 / self.rate_hz).collect();
        self.of(|all| all.iter().map(|trial| trial.iter().map(part).collect()).collect(), self.schedule.iter().map(part).collect(), start_s)
    }

    /// The same about the mean movement.
    pub fn deviations(&self, movement: &MeanOver) -> Self {
        let about_mean = |all: &[Vec<Vec<f64>>]| -> Vec<Vec<Vec<f64>>> {
            let channels = all.first().map_or(0, Vec::len);
            let each: Vec<Vec<Vec<f64>>> = (0..channels).map(|c| movement.deviation(&all.iter().map(|t| t[c].as_slice()).collect::<Vec<_>>())).collect();
            (0..all.len()).map(|trial| each.iter().map(|channel| channel[trial].clone()).collect()).collect()
        };
        self.of(about_mean, self.schedule.clone(), self.start_s.clone())
    }

    /// Of each kind of channel what is made of it, with another schedule and beginning.
    fn of(&self, made: impl Fn(&[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>>, schedule: Vec<Vec<f64>>, start_s: Vec<f64>) -> Self {
        let [effort, motion, measured, reference] = [&self.effort, &self.motion, &self.measured, &self.reference].map(|all| made(all));
        Samples { rate_hz: self.rate_hz, effort, motion, measured, reference, schedule, start_s, duration_s: self.duration_s }
    }

    /// Puts in the place of efforts that are held between their samples, or read at the ticks of a loop whose command is held, what acts on the plant at the
    /// frequencies that samples carry.
    pub fn hold(&mut self, hold: Hold, ticks: Option<&Ticks>, meaning: &Meaning) {
        if hold == Hold::BandLimited || meaning.motion_imposed {
            return;
        }
        let (rate_hz, step_s) = (self.rate_hz, 1.0 / self.rate_hz);
        let Some(ticks) = ticks else {
            return self.effort.iter_mut().flatten().for_each(|f| *f = filter(f, rate_hz, |s| hold.response(s, step_s)));
        };
        let sampling = Sampling { hold, sample_rate_hz: rate_hz, derivatives: meaning.order as i32 };
        // Every pair of channels asks for the same frequencies.
        let known = RefCell::new(BTreeMap::new());
        let acting = |s: Complex64, i, j| {
            let mut known = known.borrow_mut();
            let acting = known.entry(s.im.to_bits()).or_insert_with(|| ticks.acting(sampling, s));
            acting.as_ref().map_or(Complex64::from(f64::from(u8::from(i == j))), |acting| acting[[i, j]])
        };
        for effort in &mut self.effort {
            let read = std::mem::take(effort);
            let of = |i| {
                let parts = read.iter().enumerate().map(|(j, read)| filter(read, rate_hz, |s| acting(s, i, j)));
                parts.reduce(|sum, part| sum.iter().zip(&part).map(|(a, b)| a + b).collect()).unwrap_or_default()
            };
            *effort = (0..read.len()).map(of).collect();
        }
    }

    /// Counts effort the other way round.
    pub fn turn(&mut self, references_too: bool) {
        self.effort.iter_mut().flatten().flatten().for_each(|f| *f = -*f);
        if references_too {
            self.reference.iter_mut().flatten().flatten().for_each(|f| *f = -*f);
        }
    }

    /// The number of samples of the shortest trial.
    pub fn len(&self) -> usize {
        self.effort.iter().map(|t| t[0].len()).min().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_integral_of_a_fast_sine_is_the_cosine() {
        // The next term of the rule is 191/60480 of the step's sixth power; trapezoids are a twelfth of its square short.
        let (rate_hz, frequency_hz) = (200.0, 14.0);
        let step = TAU * frequency_hz / rate_hz;
        let speed: Vec<f64> = (0..4001).map(|k| (step * f64::from(k)).cos()).collect();
        let place = integral(&speed, rate_hz);
        // Over whole periods, of which a hundred samples hold seven.
        let size = (100..3900).map(|k| place[k] * (step * k as f64).sin()).sum::<f64>() / 1900.0;
        let error = (size * TAU * frequency_hz - 1.0).abs();
        assert!(error < 1.5 * 191.0 / 60480.0 * step.powi(6), "{error}");
    }
}
