//! A force law along a motion that is given.

use crate::layout::Layout;
use crate::movement::Schedule;
use ndof_models::{ForceLaw, Motion};
use std::f64::consts::PI;
use std::ops::Range;

/// Rate and beginning of a motion, and the schedule along it.
#[derive(Clone, Copy)]
pub(crate) struct Clock<'a> {
    pub rate_hz: f64,
    pub start_s: f64,
    pub schedule: &'a [f64],
}

impl<'a> Clock<'a> {
    pub fn of(layout: &'a Layout, trial: usize) -> Self {
        Clock { rate_hz: layout.rate_hz, start_s: layout.start_s, schedule: layout.schedule_of(trial) }
    }

    pub fn schedule_at(&self, time_s: f64) -> f64 {
        Schedule::between(self.schedule, (time_s - self.start_s) * self.rate_hz)
    }
}

/// The force of a law along a motion at a rate, displacements and velocities `[axis][time]`; what a law looks back at is taken from the present.
///
/// A law that jumps is evaluated between the samples and low-passed, hidden states are integrated by Heun's rule.
///
/// ```
/// use ndof_models::effects::{Injection, Parameters, Setting, find};
///
/// let setting = Setting { axes: 1, axis: Some(0), mass: vec![vec![2.0]], stiffness: vec![vec![300.0]], duration_s: 1.0, sample_rate_hz: 500.0, seed: 0 };
/// let spring = find("cubic-stiffness").ok_or("no such effect")?.inject(&Parameters::new([("k3_n_per_m3", 1e5)]), &setting)?;
/// let Injection::Force(law) = spring else { return Err("no force".into()) };
/// let (x, v) = (vec![vec![0.0, 0.01, 0.02]], vec![vec![0.0; 3]]); // m, m/s
/// let force = ndof_diagnose::force_along(law.as_ref(), 500.0, &x, &v); // N
/// assert!((force[0][2] - 1e5 * 0.02_f64.powi(3)).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn force_along(law: &dyn ForceLaw, sample_rate_hz: f64, displacement: &[Vec<f64>], velocity: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let (x, v) = (interleave(displacement), interleave(velocity));
    along(law, Clock { rate_hz: sample_rate_hz, start_s: 0.0, schedule: &[] }, displacement.len(), (&x, &v), (&x, &v)).0
}

/// Series axis beside axis: `[time · axes + axis]`.
pub(crate) fn interleave(series: &[Vec<f64>]) -> Vec<f64> {
    let n = series.first().map_or(0, Vec::len);
    (0..n).flat_map(|k| series.iter().map(move |axis| axis[k])).collect()
}

/// The forces of a law along one motion and its last hidden states, which are integrated by Heun's rule with as many steps a sample as they need.
pub(crate) fn along(law: &dyn ForceLaw, time: Clock<'_>, axes: usize, (x, v): (&[f64], &[f64]), (dx, dv): (&[f64], &[f64])) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (samples, Clock { rate_hz, start_s, schedule }) = (x.len() / axes, time);
    let states = law.states();
    if law.jumps() && states == 0 {
        return (jumping(law, time, axes, [x, v, dx, dv]), vec![]);
    }
    let mut out = vec![vec![0.0; samples]; axes];
    let mut z = vec![0.0; states];
    let (mut k1, mut k2, mut force, mut middle) = (vec![0.0; states], vec![0.0; states], vec![0.0; axes], vec![0.0; states]);
    let dt = 1.0 / rate_hz;
    let mut place = vec![0.0; 4 * axes];
    for k in 0..samples {
        let here = k * axes..(k + 1) * axes;
        let motion = Motion {
            time_s: start_s + k as f64 * dt,
            position: &x[here.clone()],
            velocity: &v[here.clone()],
            delayed_position: &dx[here.clone()],
            delayed_velocity: &dv[here.clone()],
            schedule: schedule.get(k).copied().unwrap_or(f64::NAN),
        };
        force.fill(0.0);
        law.evaluate(&motion, &z, &mut force, &mut k1);
        for (series, f) in out.iter_mut().zip(&force) {
            series[k] = *f;
        }
        if states == 0 || k + 1 == samples {
            continue;
        }
        let steps = ((law.fastest_rate(&motion) * dt / 0.4).ceil() as usize).clamp(1, 48);
        let h = dt / steps as f64;
        let next = (k + 1) * axes..(k + 2) * axes;
        let clock = |part: f64| (start_s + (k as f64 + part) * dt, Schedule::between(schedule, k as f64 + part));
        for step in 0..steps {
            if step > 0 {
                // The place at which the step before ended.
                law.evaluate(&view(&place, axes, clock(step as f64 / steps as f64)), &z, &mut force, &mut k1);
            }
            middle.iter_mut().zip(&z).zip(&k1).for_each(|((m, z), k)| *m = z + h * k);
            interpolate(&mut place, (step + 1) as f64 / steps as f64, axes, [x, v, dx, dv], &here, &next);
            law.evaluate(&view(&place, axes, clock((step + 1) as f64 / steps as f64)), &middle, &mut force, &mut k2);
            z.iter_mut().zip(&k1).zip(&k2).for_each(|((z, a), b)| *z += 0.5 * h * (a + b));
        }
    }
    (out, z)
}

/// Places between two samples at which a force that jumps is evaluated,
const FINE: usize = 8;
/// and samples on either side over which a low-pass takes them together.
const REACH: usize = 4;

/// The samples of a force without states that jumps: evaluated more often than sampled and low-passed, lest what lies beyond the band fold into it.
fn jumping(law: &dyn ForceLaw, Clock { rate_hz, start_s, schedule }: Clock<'_>, axes: usize, series: [&[f64]; 4]) -> Vec<Vec<f64>> {
    let samples = series[0].len() / axes;
    let (mut place, mut force) = (vec![0.0; 4 * axes], vec![0.0; axes]);
    let mut fine = vec![Vec::with_capacity(samples * FINE); axes];
    for at in 0..samples * FINE {
        let (k, part) = (at / FINE, (at % FINE) as f64 / FINE as f64);
        let next = (k + 1).min(samples - 1);
        interpolate(&mut place, part, axes, series, &(k * axes..(k + 1) * axes), &(next * axes..(next + 1) * axes));
        let clock = (start_s + (k as f64 + part) / rate_hz, Schedule::between(schedule, k as f64 + part));
        force.fill(0.0);
        law.evaluate(&view(&place, axes, clock), &[], &mut force, &mut []);
        fine.iter_mut().zip(&force).for_each(|(series, f)| series.push(*f));
    }
    let half = (REACH * FINE) as isize;
    let kernel: Vec<f64> = (-half..=half)
        .map(|j| {
            let (u, w) = (j as f64 / FINE as f64 * PI, j as f64 / half as f64 * PI);
            (if j == 0 { 1.0 } else { u.sin() / u }) * (0.5 + 0.5 * w.cos())
        })
        .collect();
    let sum: f64 = kernel.iter().sum();
    // Before the first sample and behind the last the force stays as it is there.
    let low_passed = |fine: &Vec<f64>| -> Vec<f64> {
        let end = |k: usize| std::iter::repeat_n(fine[k], REACH * FINE);
        let longer: Vec<f64> = end(0).chain(fine.iter().copied()).chain(end(fine.len() - 1)).collect();
        longer.windows(kernel.len()).step_by(FINE).map(|around| around.iter().zip(&kernel).map(|(f, h)| f * h).sum::<f64>() / sum).collect()
    };
    fine.iter().map(low_passed).collect()
}

fn interpolate(place: &mut [f64], fraction: f64, axes: usize, series: [&[f64]; 4], here: &Range<usize>, next: &Range<usize>) {
    for (q, s) in series.iter().enumerate() {
        for i in 0..axes {
            let (a, b) = (s[here.start + i], s[next.start + i]);
            place[q * axes + i] = a + fraction * (b - a);
        }
    }
}

fn view(place: &[f64], axes: usize, (time_s, schedule): (f64, f64)) -> Motion<'_> {
    Motion {
        time_s,
        position: &place[..axes],
        velocity: &place[axes..2 * axes],
        delayed_position: &place[2 * axes..3 * axes],
        delayed_velocity: &place[3 * axes..],
        schedule,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_models::effects::{Injection, Parameters, Setting, find};

    /// Of a steady motion friction is the same force at the ends of a record as in its middle.
    #[test]
    fn a_force_that_jumps_keeps_its_size_at_the_ends() -> Result<(), Box<dyn std::error::Error>> {
        let setting = Setting { axes: 1, axis: Some(0), mass: vec![vec![2.0]], stiffness: vec![vec![300.0]], duration_s: 1.0, sample_rate_hz: 500.0, seed: 0 };
        let friction = find("coulomb-friction").ok_or("no such effect")?.inject(&Parameters::new([("level_n", 1.5)]), &setting)?;
        let Injection::Force(law) = friction else { return Err("no force".into()) };
        let x: Vec<f64> = (0..50).map(|k| 0.002 * f64::from(k)).collect();
        let force = force_along(law.as_ref(), 500.0, &[x], &[vec![1.0; 50]]);
        assert!(law.jumps() && force[0].iter().all(|f| (f - 1.5).abs() < 1e-9), "{force:?}");
        Ok(())
    }
}
