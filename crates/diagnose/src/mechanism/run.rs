//! Free run of a simulated robot over held-out data: command less measured force in, motion out.

use super::balance::hold_on_means;
use super::simulated::{Endpoint, Mechanism};
use crate::judge::Errors;
use crate::layout::Layout;
use crate::linear::Symmetric;
use crate::operators::filter;
use crate::samples::Samples;

/// Held-out trials at the working rate.
pub(super) struct Held<'a> {
    mechanism: &'a dyn Mechanism,
    rate_hz: f64,
    /// `[trial][axis][time]`: command less measured force, and displacement.
    force: Vec<Vec<Vec<f64>>>,
    place: Vec<Vec<Vec<f64>>>,
    velocity: Vec<Vec<f64>>,
    sample_s: f64,
    pub duration_s: f64,
}

impl<'a> Held<'a> {
    pub fn new(samples: &Samples, band_hz: (f64, f64), mechanism: &'a dyn Mechanism) -> Self {
        let (trials, axes) = (samples.effort.len(), samples.effort[0].len());
        let layout = Layout::new(trials, axes, samples.len(), samples.rate_hz, (0.0, band_hz.1));
        let plain = |x: &[f64]| layout.filtered(&layout.track(x), |_| 1.0.into(), None);
        let force = (0..trials)
            .map(|t| (0..axes).map(|i| plain(&samples.reference[t][i]).iter().zip(plain(&samples.effort[t][i])).map(|(c, f)| c - f).collect()).collect())
            .collect();
        let place: Vec<Vec<Vec<f64>>> = samples.motion.iter().map(|t| t.iter().map(|x| plain(x)).collect()).collect();
        let velocity = samples.motion.iter().map(|t| t.iter().map(|x| layout.filtered(&layout.track(x), |s| s, None)[0]).collect()).collect();
        let duration_s = trials as f64 * layout.samples as f64 / layout.rate_hz;
        Held { mechanism, rate_hz: layout.rate_hz, force, place, velocity, sample_s: 1.0 / samples.rate_hz, duration_s }
    }

    /// Errors of the free run with these values; none of them counts where the run of a trial does not exist.
    pub fn errors(&self, values: &[f64]) -> Errors {
        let runs: Option<Vec<Vec<Vec<f64>>>> = (0..self.place.len()).map(|t| self.run(values, t)).collect();
        let runs = runs.unwrap_or_default();
        let of_output = |i: usize| -> Vec<(f64, f64)> {
            let skip = |x: &[f64]| ((2.0 * self.rate_hz) as usize).min(x.len() / 20);
            let of_trial = |(run, place): (&Vec<Vec<f64>>, &Vec<Vec<f64>>)| -> Vec<(f64, f64)> {
                place[i].iter().copied().zip(run[i].iter().copied()).skip(skip(&place[i])).collect()
            };
            let mut pairs: Vec<(f64, f64)> = runs.iter().zip(&self.place).flat_map(of_trial).collect();
            // The constant that the controller's target adds is not the robot's.
            let bias = pairs.iter().map(|(measured, predicted)| measured - predicted).sum::<f64>() / pairs.len() as f64;
            pairs.iter_mut().for_each(|(_, predicted)| *predicted += bias);
            pairs
        };
        let pairs: Vec<Vec<(f64, f64)>> = (0..self.place[0].len()).map(of_output).collect();
        Errors::new(&pairs, runs.len())
    }

    /// Displacement `[axis][time]` of one trial: the hold acts on the measured motion's mean and on the simulated motion about it.
    fn run(&self, values: &[f64], trial: usize) -> Option<Vec<Vec<f64>>> {
        let mut robot = self.mechanism.with(values)?;
        let (force, place) = (&self.force[trial], &self.place[trial]);
        let (axes, samples) = (place.len(), place[0].len());
        let (kp, kd): (Vec<f64>, Vec<f64>) = (0..axes)
            .map(|i| {
                // The hold as stiffness and damping at 1 Hz, which is where it acts on the motion.
                let w = std::f64::consts::TAU;
                let z = self.mechanism.hold(i, num_complex::Complex64::new(0.0, w));
                (z.re, z.im / w)
            })
            .unzip();
        let mean: Vec<f64> = place.iter().map(|x| x.iter().sum::<f64>() / samples as f64).collect();
        let level: Vec<f64> = force.iter().map(|f| f.iter().sum::<f64>() / samples as f64).collect();
        // The difference between the hold's two pictures, from the measured motion.
        let rest: Vec<Vec<f64>> = (0..axes)
            .map(|i| {
                filter(&place[i], self.rate_hz, |s| hold_on_means(self.mechanism, i, s, self.sample_s) - kp[i] - s * kd[i])
                    .into_iter()
                    .zip(&force[i])
                    .map(|(h, f)| f - level[i] - h)
                    .collect()
            })
            .collect();
        let offset: Vec<f64> = rest.iter().map(|r| r.iter().sum::<f64>() / samples as f64).collect();
        let dt = 1.0 / self.rate_hz;
        let steps = ((dt / 1e-3).ceil() as usize).max(1);
        let h = dt / steps as f64;
        let mut y: Vec<f64> = place.iter().map(|x| x[0]).chain(self.velocity[trial].iter().copied()).collect();
        let mut out = vec![Vec::with_capacity(samples); axes];
        let mut work = Work::new(axes);
        for k in 0..samples {
            out.iter_mut().zip(&y).for_each(|(o, y)| o.push(*y));
            let next = (k + 1).min(samples - 1);
            for step in 0..steps {
                let mut rates = |y: &[f64], u: f64| -> Option<Vec<f64>> {
                    let w = (step as f64 + u) / steps as f64;
                    let acting: Vec<f64> =
                        (0..axes).map(|i| rest[i][k] + w * (rest[i][next] - rest[i][k]) - offset[i] - kp[i] * (y[i] - mean[i]) - kd[i] * y[axes + i]).collect();
                    work.accelerate(robot.as_mut(), &y[..axes], &y[axes..], &acting)
                };
                let ahead = |k: &[f64], h: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + h * k).collect() };
                let k1 = rates(&y, 0.0)?;
                let k2 = rates(&ahead(&k1, 0.5 * h), 0.5)?;
                let k3 = rates(&ahead(&k2, 0.5 * h), 0.5)?;
                let k4 = rates(&ahead(&k3, h), 1.0)?;
                for (q, y) in y.iter_mut().enumerate() {
                    *y += h / 6.0 * (k1[q] + 2.0 * k2[q] + 2.0 * k3[q] + k4[q]);
                }
            }
        }
        Some(out)
    }
}

/// Room for solving the balance for the acceleration, in which it is affine.
struct Work {
    zero: Vec<f64>,
    at: Vec<f64>,
    moved: Vec<f64>,
    unit: Vec<f64>,
}

impl Work {
    fn new(axes: usize) -> Self {
        Work { zero: vec![0.0; axes], at: vec![0.0; axes], moved: vec![0.0; axes], unit: vec![0.0; axes] }
    }

    /// Velocity and acceleration under an endpoint force.
    fn accelerate(&mut self, robot: &mut dyn Endpoint, x: &[f64], v: &[f64], force: &[f64]) -> Option<Vec<f64>> {
        let n = x.len();
        if !robot.needed(x, v, &self.zero, &mut self.at) {
            return None;
        }
        let mut mass = Symmetric::zeros(n);
        for j in 0..n {
            self.unit.fill(0.0);
            self.unit[j] = 1.0;
            if !robot.needed(x, v, &self.unit, &mut self.moved) {
                return None;
            }
            (0..=j).for_each(|i| mass.add(i, j, self.moved[i] - self.at[i]));
        }
        let left: Vec<f64> = force.iter().zip(&self.at).map(|(f, a)| f - a).collect();
        let a = mass.factor()?.solve(&left);
        Some(v.iter().copied().chain(a).collect())
    }
}
