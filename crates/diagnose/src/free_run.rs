//! Free run of a model over held-out data: from the input alone, with fitted initial states.

use crate::along::{Clock, along};
use crate::curved::CurvedPlant;
use crate::movement;
use crate::operators::filter;
use crate::state::State;
use ndarray::Array2;
use ndof_linear::square;
use ndof_models::schedule::Splines;
use ndof_models::{ForceLaw, Motion};
use num_complex::Complex64;

/// Length of a window for plants without a restoring force, for a band to 12 Hz.
pub(crate) const WINDOW_S: f64 = 2.0;

/// A model that can run by itself.
pub(crate) struct Runner {
    pub mass: Vec<Vec<f64>>,
    pub damping: Vec<Vec<f64>>,
    pub stiffness: Vec<Vec<f64>>,
    /// Mean of the fitted offsets of each equation.
    pub offset: Vec<f64>,
    pub laws: Vec<Box<dyn ForceLaw>>,
    /// The matrices along the curve of an arm, where they act there.
    pub curved: Option<CurvedPlant>,
    /// The mean force of each equation over the cycle, which comes back with the phase.
    pub movement: Option<(Splines, Vec<Vec<f64>>)>,
}

/// A held-out prediction: measured and predicted outputs `[output][time]` and which samples count.
pub(crate) struct Prediction {
    pub measured: Vec<Vec<f64>>,
    pub predicted: Vec<Vec<f64>>,
    pub scored: Vec<bool>,
}

pub(crate) fn inverse(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    Some(square::inverse(&matrix.concat(), n)?.chunks(n).map(<[f64]>::to_vec).collect())
}

/// One run: displacement, velocity and acceleration, axis beside axis.
pub(crate) struct Run {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
}

/// What rates of change are put together in.
struct Scratch {
    resist: Vec<f64>,
    late_x: Vec<f64>,
    late_v: Vec<f64>,
}

impl Scratch {
    fn new(axes: usize) -> Self {
        let [resist, late_x, late_v] = std::array::from_fn(|_| vec![0.0; axes]);
        Scratch { resist, late_x, late_v }
    }
}

impl Runner {
    /// Force imposed: integrates over `effort[axis][time]` from the given initial displacement and velocity by Runge and Kutta's rule.
    pub fn run(
        &self,
        inverse_mass: &[Vec<f64>],
        effort: &[Vec<f64>],
        range: std::ops::Range<usize>,
        clock: Clock<'_>,
        initial: (&[f64], &[f64], &[f64]),
    ) -> Run {
        let n = self.mass.len();
        let Clock { rate_hz, start_s, .. } = clock;
        let dt = 1.0 / rate_hz;
        let mut y: Vec<f64> = initial.0.iter().chain(initial.1).chain(initial.2).copied().collect();
        let mut out = Run { x: Vec::new(), v: Vec::new(), a: Vec::new() };
        let stiffest = (0..n).map(|i| self.slope(i) * inverse_mass[i][i].abs() + self.damping[i][i].abs() * inverse_mass[i][i].abs()).fold(0.0, f64::max);
        let natural = (0..n).map(|i| (self.stiffness[i][i].abs() * inverse_mass[i][i].abs()).sqrt()).fold(0.0, f64::max);
        let fastest = |motion: Motion<'_>, least: f64| self.laws.iter().map(|law| law.fastest_rate(&motion)).fold(least, f64::max);
        let still = vec![0.0; n];
        let steady = fastest(Motion::now(0.0, &still, &still), stiffest.max(natural));
        let samples = range.len();
        let mut scratch = Scratch::new(n);
        let [mut here, mut there, mut force] = std::array::from_fn(|_| vec![0.0; n]);
        let [mut k1, mut k2, mut k3, mut k4, mut ahead] = std::array::from_fn(|_| vec![0.0; y.len()]);
        for k in 0..samples {
            let at = range.start + k;
            let next = (at + 1).min(range.end - 1);
            for (i, f) in effort.iter().enumerate() {
                (here[i], there[i]) = (f[at], f[next]);
            }
            let time = start_s + at as f64 * dt;
            self.rates(inverse_mass, &y, &here, (time, k as f64), &out, clock, &mut scratch, &mut k1);
            out.x.extend_from_slice(&y[..n]);
            out.v.extend_from_slice(&y[n..2 * n]);
            out.a.extend_from_slice(&k1[n..2 * n]);
            if k + 1 == samples {
                break;
            }
            let moving = fastest(Motion { schedule: clock.schedule_at(time), ..Motion::now(time, &y[..n], &y[n..2 * n]) }, steady);
            let steps = ((moving * dt / 1.2).ceil() as usize).clamp(1, 24);
            let h = dt / steps as f64;
            for step in 0..steps {
                let mut rates = |y: &[f64], u: f64, out_rates: &mut [f64]| {
                    let w = (step as f64 + u) / steps as f64;
                    force.iter_mut().zip(here.iter().zip(&there)).for_each(|(f, (a, b))| *f = a + w * (b - a));
                    let place = (time + (step as f64 + u) * h, k as f64 + w);
                    self.rates(inverse_mass, y, &force, place, &out, clock, &mut scratch, out_rates);
                };
                let along = |y: &[f64], k: &[f64], h: f64, ahead: &mut [f64]| ahead.iter_mut().zip(y.iter().zip(k)).for_each(|(to, (y, k))| *to = y + h * k);
                rates(&y, 0.0, &mut k1);
                along(&y, &k1, 0.5 * h, &mut ahead);
                rates(&ahead, 0.5, &mut k2);
                along(&y, &k2, 0.5 * h, &mut ahead);
                rates(&ahead, 0.5, &mut k3);
                along(&y, &k3, h, &mut ahead);
                rates(&ahead, 1.0, &mut k4);
                for (q, y) in y.iter_mut().enumerate() {
                    *y += h / 6.0 * (k1[q] + 2.0 * k2[q] + 2.0 * k3[q] + k4[q]);
                }
            }
            if y.iter().any(|v| !v.is_finite() || v.abs() > 1e12) {
                y.fill(f64::NAN);
            }
        }
        out
    }

    /// Displacement `[axis][time]` from rest under a force; `None` where the mass is singular.
    pub fn drive(&self, effort: &[Vec<f64>], rate_hz: f64) -> Option<Vec<Vec<f64>>> {
        let n = self.mass.len();
        let still = vec![0.0; n];
        let hidden = vec![0.0; self.laws.iter().map(|law| law.states()).sum()];
        let run = self.run(&inverse(&self.mass)?, effort, 0..effort[0].len(), Clock { rate_hz, start_s: 0.0, schedule: &[] }, (&still, &still, &hidden));
        Some((0..n).map(|i| run.x.iter().skip(i).step_by(n).copied().collect()).collect())
    }

    /// Slopes of the rates of change of displacements, velocities and hidden states, at rest.
    pub fn slopes_at_rest(&self, inverse_mass: &[Vec<f64>], clock: Clock<'_>) -> Array2<f64> {
        let n = self.mass.len();
        let size = 2 * n + self.laws.iter().map(|law| law.states()).sum::<usize>();
        let (still, none, mut scratch) = (vec![0.0; n], Run { x: vec![], v: vec![], a: vec![] }, Scratch::new(n));
        let mut rates = |y: &[f64]| {
            let mut out = vec![0.0; size];
            self.rates(inverse_mass, y, &still, (clock.start_s, 0.0), &none, clock, &mut scratch, &mut out);
            out
        };
        let (at_rest, small) = (rates(&vec![0.0; size]), 1e-7);
        let beside: Vec<Vec<f64>> = (0..size).map(|j| rates(&(0..size).map(|k| if k == j { small } else { 0.0 }).collect::<Vec<_>>())).collect();
        Array2::from_shape_fn((size, size), |(i, j)| (beside[j][i] - at_rest[i]) / small)
    }

    /// The steepest rise of an axis' resisting force with velocity, at rest.
    fn slope(&self, axis: usize) -> f64 {
        let n = self.mass.len();
        self.laws
            .iter()
            .map(|law| {
                let z = vec![0.0; law.states()];
                let mut rates = z.clone();
                let mut force = |v: f64| {
                    let mut velocity = vec![0.0; n];
                    velocity[axis] = v;
                    let (rest, mut f) = (vec![0.0; n], vec![0.0; n]);
                    let motion = Motion { delayed_velocity: &rest, ..Motion::now(0.0, &rest, &velocity) };
                    law.evaluate(&motion, &z, &mut f, &mut rates);
                    f[axis]
                };
                let small = 1e-7;
                (force(small) - force(-small)).abs() / (2.0 * small)
            })
            .sum()
    }

    /// Rates of change of displacements, velocities and hidden states, at a time and a place among the samples of the run so far.
    #[allow(clippy::too_many_arguments)]
    fn rates(
        &self,
        inverse_mass: &[Vec<f64>],
        y: &[f64],
        effort: &[f64],
        (time_s, place): (f64, f64),
        past: &Run,
        clock: Clock<'_>,
        scratch: &mut Scratch,
        out: &mut [f64],
    ) {
        let n = self.mass.len();
        let (x, v) = (&y[..n], &y[n..2 * n]);
        let schedule = clock.schedule_at(time_s);
        let Scratch { resist, late_x, late_v } = scratch;
        resist.iter_mut().enumerate().for_each(|(i, force)| *force = self.steady(i, schedule));
        out[..n].copy_from_slice(v);
        let mut from = 2 * n;
        for law in &self.laws {
            let to = from + law.states();
            let delay = law.delay_s();
            let (mut delayed_position, mut delayed_velocity) = (x, v);
            if delay > 0.0 {
                let back = place - delay * clock.rate_hz;
                for i in 0..n {
                    late_x[i] = sample(&past.x, n, i, back).unwrap_or(x[i]);
                    late_v[i] = sample(&past.v, n, i, back).unwrap_or(0.0);
                }
                (delayed_position, delayed_velocity) = (late_x.as_slice(), late_v.as_slice());
            }
            let motion = Motion { time_s, position: x, velocity: v, delayed_position, delayed_velocity, schedule };
            law.evaluate(&motion, &y[from..to], resist, &mut out[from..to]);
            from = to;
        }
        if let Some(plant) = &self.curved {
            let a = plant.acceleration([x[0], x[1]], [v[0], v[1]], [effort[0] - resist[0], effort[1] - resist[1]]);
            out[n..2 * n].copy_from_slice(&a);
            return;
        }
        for (i, force) in resist.iter_mut().enumerate() {
            *force += (0..n).map(|j| self.damping[i][j] * v[j] + self.stiffness[i][j] * x[j]).sum::<f64>();
        }
        for i in 0..n {
            out[n + i] = (0..n).map(|j| inverse_mass[i][j] * (effort[j] - resist[j])).sum();
        }
    }

    /// The offset of an axis and its mean force at a place of the schedule.
    fn steady(&self, axis: usize, schedule: f64) -> f64 {
        self.offset[axis] + self.movement.as_ref().map_or(0.0, |(splines, means)| movement::at(*splines, &means[axis], schedule))
    }

    /// Effort that an imposed motion needs, `[axis][time]`.
    pub fn needed(&self, state: &State, trial: usize) -> Vec<Vec<f64>> {
        let layout = &state.layout;
        let n = layout.axes;
        let kinematics = |power: i32| -> Vec<Vec<f64>> { state.motion[trial].iter().map(|t| layout.filtered(t, |s| s.powi(power), None)).collect() };
        let (v, a, x) = (kinematics(1), kinematics(2), &state.x[trial]);
        let steady = |i: usize, k: usize| self.steady(i, layout.schedule_of(trial).get(k).copied().unwrap_or(f64::NAN));
        let mut out: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                (0..layout.samples)
                    .map(|k| {
                        steady(i, k) + (0..n).map(|j| self.mass[i][j] * a[j][k] + self.damping[i][j] * v[j][k] + self.stiffness[i][j] * x[j][k]).sum::<f64>()
                    })
                    .collect()
            })
            .collect();
        let of_laws = self.laws.iter().map(|law| state.forces_of(law.as_ref(), trial));
        for force in self.curved.iter().map(|plant| plant.beyond(state, trial)).chain(of_laws) {
            out.iter_mut().flatten().zip(force.iter().flatten()).for_each(|(sum, f)| *sum += f);
        }
        out
    }

    /// Predicts one held-out trial whose measured channels are `raw` and corrected ones `state`.
    pub fn predict(&self, raw: &State, state: &State, trial: usize, order: usize, motion_imposed: bool, windowed: bool) -> Option<Prediction> {
        let layout = &state.layout;
        let n = layout.axes;
        let skip = layout.settled();
        if motion_imposed {
            let needed = self.needed(state, trial);
            // Beyond the band an imposed motion is the differentiated noise of its sensor.
            let top = layout.frequency_hz[layout.lines() - 1];
            let inside = |s: Complex64| Complex64::from((-(s.im / std::f64::consts::TAU / (1.1 * top)).powi(16)).exp());
            let cut = |series: Vec<Vec<f64>>| -> Vec<Vec<f64>> { series.iter().map(|x| filter(x, layout.rate_hz, inside)).collect() };
            let predicted: Vec<Vec<f64>> = cut(state.uncorrect_effort(needed));
            let measured: Vec<Vec<f64>> = raw.effort[trial].iter().map(|t| layout.filtered(t, inside, None)).collect();
            let predicted = predicted.into_iter().zip(&measured).map(|(p, m)| shifted(p, m, skip..m.len())).collect();
            return Some(Prediction { measured, predicted, scored: (0..layout.samples).map(|k| k >= skip).collect() });
        }
        let inverse_mass = inverse(&self.mass)?;
        let (effort, v) = (straightened(state, trial), velocity(state, trial));
        let measured: Vec<Vec<f64>> = raw.motion[trial].iter().map(|t| layout.filtered(t, |s| s.powi(order as i32), None)).collect();
        let length = if windowed { ((WINDOW_S * layout.time_s.max(1.0) * layout.rate_hz) as usize).clamp(8, layout.samples) } else { layout.samples };
        let mut predicted = vec![Vec::with_capacity(layout.samples); n];
        let mut start = 0;
        while start + length <= layout.samples {
            let range = start..start + length;
            let fitted = if windowed { length } else { self.felt(&inverse_mass, state) };
            let run = self.fitted_run(&inverse_mass, (&effort, &v), state, trial, range, fitted);
            let series = [&run.x, &run.v, &run.a][order];
            for (i, p) in predicted.iter_mut().enumerate() {
                p.extend(series.iter().skip(i).step_by(n));
            }
            start += length;
        }
        let covered = predicted[0].len();
        let measured: Vec<Vec<f64>> = measured.into_iter().map(|m| m[..covered].to_vec()).collect();
        if order == 0 {
            for (p, centre) in predicted.iter_mut().zip(&state.centre) {
                p.iter_mut().for_each(|v| *v += centre);
            }
        }
        let predicted = state.uncorrect_motion(predicted, order, &effort);
        let predicted = if windowed { predicted } else { predicted.into_iter().zip(&measured).map(|(p, m)| shifted(p, m, skip..covered)).collect() };
        Some(Prediction { measured, predicted, scored: (0..covered).map(|k| windowed || k >= skip).collect() })
    }

    /// The run over a whole trial; `None` where the mass is singular.
    pub fn over_trial(&self, state: &State, trial: usize) -> Option<Run> {
        let inverse_mass = inverse(&self.mass)?;
        let (effort, v) = (straightened(state, trial), velocity(state, trial));
        Some(self.fitted_run(&inverse_mass, (&effort, &v), state, trial, 0..state.layout.samples, self.felt(&inverse_mass, state)))
    }

    /// Effort beside the measured one with which a plant would run as this model does, over the whole trial, `[axis][time]`:
    /// M ẍ + B ẋ + K x + g − F with the plant's matrices and laws along the model's run. A constant is left out, which offsets have.
    pub fn added_to(&self, plant: &Runner, state: &State, trial: usize) -> Option<Vec<Vec<f64>>> {
        let layout = &state.layout;
        let n = layout.axes;
        let (effort, run) = (straightened(state, trial), self.over_trial(state, trial)?);
        let clock = Clock::of(layout, trial);
        let mut laws = vec![vec![0.0; layout.samples]; n];
        for force in plant.laws.iter().map(|law| along(law.as_ref(), clock, n, (&run.x, &run.v), (&run.x, &run.v)).0) {
            laws.iter_mut().flatten().zip(force.iter().flatten()).for_each(|(sum, f)| *sum += f);
        }
        let at = |i: usize, k: usize| -> f64 {
            let of = |matrix: &[Vec<f64>], series: &[f64]| (0..n).map(|j| matrix[i][j] * series[k * n + j]).sum::<f64>();
            of(&plant.mass, &run.a) + of(&plant.damping, &run.v) + of(&plant.stiffness, &run.x) + laws[i][k] - effort[i][k]
        };
        let series: Vec<Vec<f64>> = (0..n).map(|i| (0..layout.samples).map(|k| at(i, k)).collect()).collect();
        let about_mean = |s: Vec<f64>| {
            let mean = s.iter().sum::<f64>() / s.len() as f64;
            s.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        series.iter().flatten().all(|x| x.is_finite()).then(|| series.into_iter().map(about_mean).collect())
    }
}

/// The effort of a trial for a run that goes from sample to sample in straight lines, which pass sinc² of a frequency.
fn straightened(state: &State, trial: usize) -> Vec<Vec<f64>> {
    let layout = &state.layout;
    let inverse = |s: Complex64| {
        let half = 0.5 * s.im / layout.rate_hz;
        Complex64::from(if half == 0.0 { 1.0 } else { (half / half.sin()).powi(2) })
    };
    state.effort[trial].iter().map(|t| layout.filtered(t, inverse, None)).collect()
}

/// The measured velocity of a trial.
fn velocity(state: &State, trial: usize) -> Vec<Vec<f64>> {
    state.motion[trial].iter().map(|t| state.layout.filtered(t, |s| s, None)).collect()
}

fn sample(series: &[f64], n: usize, axis: usize, place: f64) -> Option<f64> {
    if place < 0.0 {
        return None;
    }
    let k = place.floor() as usize;
    let a = *series.get(k * n + axis)?;
    let b = series.get((k + 1) * n + axis).copied().unwrap_or(a);
    Some(a + place.fract() * (b - a))
}

/// Adds the constant that fits best over a range: where a sensor begins to count and a limb comes to rest is no part of a model, and what a limb does by
/// itself in the first moments would offset all that follows.
fn shifted(predicted: Vec<f64>, measured: &[f64], range: std::ops::Range<usize>) -> Vec<f64> {
    let count = range.len().max(1) as f64;
    let offset = range.map(|k| measured[k] - predicted[k]).sum::<f64>() / count;
    predicted.into_iter().map(|p| p + offset).collect()
}
