//! Force laws along a motion, models that run by themselves, and errors, against their closed forms.

use super::{PLAIN, held, outline};
use crate::along::along;
use crate::free_run::Runner;
use crate::judge::{Court, Errors, explained};
use crate::linear::{Symmetric, dot, inverse};
use crate::optimise::tells;
use ndof_models::effects::Knob;
use ndof_models::{ForceLaw, Motion};
use num_complex::Complex64;
use serde_json::json;
use std::f64::consts::TAU;

/// f = c z + t, ż = r (q - z) on axis 0, where q is the velocity, or the delayed displacement of the other axis.
struct Lag {
    rate: f64,
    delay_s: f64,
    time: f64,
}

impl ForceLaw for Lag {
    fn states(&self) -> usize {
        1
    }

    fn delay_s(&self) -> f64 {
        self.delay_s
    }

    fn fastest_rate(&self, _: &Motion<'_>) -> f64 {
        self.rate
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let into = if self.delay_s > 0.0 { motion.delayed_position[1] + 0.01 * motion.delayed_velocity[0] } else { motion.velocity[0] + motion.time_s };
        force[0] += 5.0 * states[0] + self.time * motion.time_s;
        rates[0] = self.rate * (into - states[0]);
    }
}

/// The answer of ż = r (sin(w t) - z) from rest.
fn lagged(r: f64, w: f64, t: f64) -> f64 {
    let steady = |t: f64| r * (r * (w * t).sin() - w * (w * t).cos()) / (r * r + w * w);
    steady(t) - steady(0.0) * (-r * t).exp()
}

#[test]
fn hidden_states_follow_their_equation_however_fast_they_are() {
    let (rate_hz, samples, w) = (100.0, 400, TAU * 0.8);
    let at = |k: usize| k as f64 / rate_hz;
    let beside = |a: &dyn Fn(f64) -> f64, b: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..samples).flat_map(|k| [a(at(k)), b(at(k))]).collect() };
    let sine = |t: f64| (w * t).sin();
    let mut rows = Vec::new();
    let x = beside(&|t| 0.3 * t, &|_| 0.0);
    let v = beside(&sine, &|_| 7.0);
    for (rate, within) in [(3.0, 2e-3), (30.0, 2e-3), (90.0, 5e-3), (400.0, 5e-3), (1500.0, 5e-3)] {
        // Undelayed, t enters through the clock, which starts at 2 s; subtracted here: ż = r (t - z).
        let (forces, z) = along(&Lag { rate, delay_s: 0.0, time: 1.0 }, (rate_hz, 2.0), 2, (&x, &v), (&x, &v));
        assert_eq!((forces.len(), forces[0].len(), z.len()), (2, samples, 1));
        assert!(forces[1].iter().all(|f| *f == 0.0));
        let truth = |t: f64| lagged(rate, w, t) + (t + 2.0 - 1.0 / rate) - (2.0 - 1.0 / rate) * (-rate * t).exp();
        for (k, f) in forces[0].iter().enumerate() {
            let want = 5.0 * truth(at(k)) + 2.0 + at(k);
            assert!((f - want).abs() < 5.0 * within * (1.0 + 25.0 * (-0.5 * rate * at(k)).exp()), "{rate} {k}: {f} {want}");
        }
        assert!((z[0] - truth(at(samples - 1))).abs() < within);
        rows.push([outline(&forces[0]), outline(&forces[0][..12]), z].concat());
    }
    // Delayed channels are those that are handed over.
    let (forces, _) =
        along(&Lag { rate: 30.0, delay_s: 0.1, time: 0.0 }, (rate_hz, 0.0), 2, (&x, &v), (&beside(&|_| 9.0, &sine), &beside(&|_| 100.0, &|_| 9.0)));
    for (k, f) in forces[0].iter().enumerate() {
        let want = 5.0 * (lagged(30.0, w, at(k)) + 1.0 - (-30.0 * at(k)).exp());
        assert!((f - want).abs() < if k < 12 { 0.1 } else { 0.02 }, "{k}: {f} {want}");
    }
    rows.push(outline(&forces[0]));
    held("along", &json!(rows));
}

fn runner(mass: f64, damping: f64, stiffness: f64, laws: Vec<Box<dyn ForceLaw>>) -> Runner {
    let square = |a: f64, b: f64| vec![vec![a, b], vec![b, a]];
    Runner { mass: square(mass, 0.0), damping: square(damping, 0.0), stiffness: square(stiffness, 0.0), offset: vec![0.0, 0.5], laws }
}

#[test]
fn a_model_that_runs_follows_the_closed_form() {
    let (rate_hz, samples) = (50.0, 300);
    let (m, b, k) = (2.0, 4.0, 300.0);
    let step: Vec<Vec<f64>> = vec![vec![3.0; samples], vec![-1.5; samples]];
    let run = runner(m, b, k, vec![]).drive(&step, rate_hz).unwrap();
    let (a, w) = (b / (2.0 * m), (k / m - (b / (2.0 * m)).powi(2)).sqrt());
    for (i, force) in [3.0, -2.0].into_iter().enumerate() {
        for (q, x) in run[i].iter().enumerate() {
            let t = q as f64 / rate_hz;
            let want = force / k * (1.0 - (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin()));
            assert!((x - want).abs() < 1e-5 * force.abs(), "{i} {q}: {x} {want}");
        }
    }
    // A force on a straight line moves a mass by t³ / 6.
    let ramp = vec![(0..samples).map(|q| q as f64 / rate_hz).collect::<Vec<f64>>(), vec![0.5; samples]];
    let run = runner(m, 0.0, 0.0, vec![]).drive(&ramp, rate_hz).unwrap();
    for (q, x) in run[0].iter().enumerate() {
        assert!((x - (q as f64 / rate_hz).powi(3) / 6.0 / m).abs() < 1e-9, "{q}");
    }
    assert!(run[1].iter().all(|x| x.abs() < 1e-12));
    // Off the diagonal: M = [[2, 1], [1, 2]], so that equal forces meet a mass of 3.
    let mut coupled = runner(2.0, 0.0, 0.0, vec![]);
    (coupled.mass[0][1], coupled.mass[1][0], coupled.offset) = (1.0, 1.0, vec![0.0; 2]);
    let run = coupled.drive(&[ramp[0].clone(), ramp[0].clone()], rate_hz).unwrap();
    assert!((run[1][200] - 64.0 / 6.0 / 3.0).abs() < 1e-9);
    coupled.mass = vec![vec![1.0; 2]; 2];
    assert!(coupled.drive(&ramp, rate_hz).is_none());
}

/// f = c (x, ẋ) of so long ago on an axis.
struct Late(f64, [f64; 2], usize);

impl ForceLaw for Late {
    fn delay_s(&self) -> f64 {
        self.0
    }

    fn evaluate(&self, motion: &Motion<'_>, _: &[f64], force: &mut [f64], _: &mut [f64]) {
        let axis = self.2;
        force[axis] += self.1[0] * motion.delayed_position[axis] + self.1[1] * motion.delayed_velocity[axis];
    }
}

/// A stiff damper beyond a slip: 2000 N s/m at rest.
struct Stiff;

impl ForceLaw for Stiff {
    fn evaluate(&self, motion: &Motion<'_>, _: &[f64], force: &mut [f64], _: &mut [f64]) {
        force[1] += 2.0 * (motion.velocity[1] / 1e-3).tanh();
    }
}

#[test]
fn delays_stiff_laws_and_hidden_states_run_as_they_did() {
    let (rate_hz, samples) = (50.0, 200);
    let force: Vec<Vec<f64>> = (0..2).map(|i| (0..samples).map(|k| 4.0 * (0.11 * (k + 3 * i) as f64).sin()).collect()).collect();
    // A law that looks back a whole second acts from then on only, by a velocity of nothing and a displacement of now.
    let late = runner(1.0, 3.0, 40.0, vec![Box::new(Late(1.0, [0.0, 30.0], 0))]).drive(&force, rate_hz).unwrap();
    let plain = runner(1.0, 3.0, 40.0, vec![]).drive(&force, rate_hz).unwrap();
    assert!((0..50).all(|k| (late[0][k] - plain[0][k]).abs() < 1e-12) && (late[0][70] - plain[0][70]).abs() > 1e-3);
    let stick = runner(
        1.0,
        3.0,
        40.0,
        vec![
            Box::new(Late(0.07, [20.0, 2.0], 0)),
            Box::new(Late(0.043, [9.0, 1.5], 1)),
            Box::new(Stiff),
            Box::new(Lag { rate: 200.0, delay_s: 0.0, time: 0.1 }),
        ],
    );
    let run = stick.drive(&force, rate_hz).unwrap();
    let ring = runner(0.25, 8.0, 3e4, vec![]).drive(&force, rate_hz).unwrap();
    let thick = runner(0.5, 70.0, 100.0, vec![]).drive(&force, rate_hz).unwrap();
    held("run", &json!(late.iter().chain(&run).chain(&ring).chain(&thick).map(|x| x.iter().copied().step_by(6).collect::<Vec<f64>>()).collect::<Vec<_>>()));
    // What has no end is no number, and no panic.
    let mut away = runner(1.0, -300.0, 0.0, vec![]);
    away.offset = vec![0.0; 2];
    assert!(away.drive(&force, rate_hz).unwrap()[0][199].is_nan());
}

#[test]
fn small_systems_are_solved() {
    let a: Vec<f64> = (0..19).map(|k| f64::from(k) - 4.0).collect();
    assert_eq!(dot(&a, &a), a.iter().map(|x| x * x).sum::<f64>());
    for n in 1..=4 {
        let m: Vec<Complex64> = (0..n * n).map(|k| Complex64::new(((k * k * 7 + 3) % 11) as f64 - 4.5, ((k * 5) % 7) as f64 - 2.5)).collect();
        let (log_det, inv) = inverse(&m, n).unwrap();
        for (k, one) in crate::linear::product(&m, &inv, n).iter().enumerate() {
            assert!((one - if k / n == k % n { 1.0 } else { 0.0 }).norm() < 1e-12, "{n} {k}: {one}");
        }
        // The determinant by expanding the first row.
        fn det(m: &[Complex64], n: usize) -> Complex64 {
            if n == 1 {
                return m[0];
            }
            (0..n)
                .map(|c| {
                    let minor: Vec<Complex64> = (n..n * n).filter(|k| k % n != c).map(|k| m[k]).collect();
                    m[c] * det(&minor, n - 1) * if c % 2 == 0 { 1.0 } else { -1.0 }
                })
                .sum()
        }
        assert!((log_det - det(&m, n).norm().ln()).abs() < 1e-12, "{n}");
        assert!(inverse(&vec![Complex64::ONE; n * n], n).is_none() == (n > 1) && inverse(&vec![Complex64::ZERO; n * n], n).is_none());
        assert!(inverse(&vec![Complex64::from(f64::NAN); n * n], n).is_none() && inverse(&vec![Complex64::from(f64::INFINITY); n * n], n).is_none());
    }
    // A matrix that only changes places has no pivot where it stands.
    for places in [[1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0]] {
        let m: Vec<Complex64> = (0..9).map(|k| if places[k / 3] == k % 3 { Complex64::new(0.0, 2.0) } else { Complex64::ZERO }).collect();
        let (log_det, inv) = inverse(&m, 3).unwrap();
        assert!((log_det - 8f64.ln()).abs() < 1e-12 && (0..9).all(|k| (inv[k] - m[k % 3 * 3 + k / 3].conj() / 4.0).norm() < 1e-12));
    }
    let mut s = Symmetric::zeros(2);
    for (i, j, v) in [(0, 0, 2.0), (0, 1, 1.0), (0, 0, 2.0), (1, 1, 3.0)] {
        s.add(i, j, v);
    }
    let inverse = s.factor().unwrap().inverse();
    for (k, want) in [3.0, -1.0, -1.0, 4.0].into_iter().enumerate() {
        assert!((inverse.a[k] - want / 11.0).abs() < 1e-10);
    }
    let knob = |log, telling| Knob { lo: 1.0, hi: 100.0, log, telling };
    assert!(tells(&[knob(true, true)], &[1.02]) && !tells(&[knob(true, true)], &[1.06]) && !tells(&[knob(true, false)], &[1.0]));
    assert!(tells(&[knob(false, true)], &[1.9]) && !tells(&[knob(false, true)], &[2.1]));
}

/// A sine, and what a prediction with a part of its size, of its noise and of an offset makes of it.
fn pairs(size: f64, offset: f64) -> Vec<Vec<(f64, f64)>> {
    let wave = |k: usize, f: f64| 2f64.sqrt() * (TAU * f * k as f64 / 1000.0).sin();
    vec![(0..2000).map(|k| (wave(k, 5.0) + 1.0, wave(k, 5.0) + 1.0 - size * wave(k, 40.0) - offset)).collect(); 2]
}

#[test]
fn errors_are_shares_of_the_outputs_deviation() {
    let (e, half) = (Errors::new(&pairs(0.3, 0.4), 2, true), Errors::new(&pairs(0.15, 0.4), 2, true));
    assert!((e.score.nrmse[0].unwrap() - 0.5).abs() < 1e-9 && (e.score.vaf_percent[1].unwrap() - 91.0).abs() < 1e-7);
    assert!((e.variance().unwrap() - 0.09).abs() < 1e-9 && (e.mean().unwrap() - 0.25).abs() < 1e-9);
    assert!((e.distance(&half) - 0.15).abs() < 1e-9 && e.distance(&e) == 0.0);
    let nothing = Errors::new(&[vec![(1.0, 0.0); 9]], 1, false);
    assert!(nothing.score.nrmse[0].is_none() && nothing.mean().is_none() && nothing.variance().is_none());
    // From 0.25 to 0.1825 above a floor of 0.01.
    let ask = |floor: f64, block_s: f64, duration_s: f64| explained(&e, &half, floor, block_s, duration_s, 200, 1);
    let (share, Some([low, high])) = ask(0.01, 0.5, 20.0) else { panic!("an interval") };
    let share = share.unwrap();
    assert!((share - 0.0675 / 0.24).abs() < 1e-9 && low <= high && high <= 1.0, "{share} {low} {high}");
    assert_eq!(ask(0.3, 0.5, 20.0).0, Some(0.0));
    assert_eq!(explained(&e, &nothing, 0.0, 0.5, 20.0, 10, 1), (None, None));
    // Drift makes blocks unlike each other.
    let drift = |size: f64, shifted: bool, trials: usize| {
        let pairs =
            |phase: f64| (0..1200).map(|k| ((0.3 * k as f64).sin(), (0.3 * k as f64).sin() - size * (0.011 * k as f64 + phase).sin() - size * 0.2)).collect();
        Errors::new(&[pairs(0.0), pairs(1.0)], trials, shifted)
    };
    let draws: Vec<_> = [(true, 1, 2.0), (false, 1, 2.0), (true, 3, 1.3), (false, 4, 50.0), (true, 2, 0.001)]
        .into_iter()
        .map(|(shifted, trials, block_s)| explained(&drift(0.9, shifted, trials), &drift(0.5, shifted, trials), 0.1, block_s, 24.0, 40, 7))
        .collect();
    held("draws", &json!(draws));
}

#[test]
fn the_true_model_predicts_what_was_not_fitted_on_every_channel() {
    let friction = |imposed: bool, order: i32, axes: usize| super::Experiment { imposed, order, axes, noise: 0.01, ..PLAIN };
    for (experiment, restoring) in [
        (friction(false, 0, 1), true),
        (friction(false, 0, 2), false),
        (friction(true, 0, 2), true),
        (friction(false, 1, 1), false),
        (friction(false, 2, 1), true),
    ] {
        let (samples, meaning) = experiment.samples();
        let subject = experiment.subject(&[]);
        let stand = subject.stand(&[], &subject.start, 3).unwrap();
        let court = Court::new(&samples, &meaning, &subject, restoring);
        assert_eq!(court.windowed, !experiment.imposed && !restoring);
        assert!((court.duration_s() - 48.0).abs() < 0.1);
        let errors = court.errors(&subject, &[], &stand);
        for e in &errors.score.nrmse {
            assert!(e.is_some_and(|e| e < 0.05), "{} {} {}: {e:?}", experiment.imposed, experiment.order, experiment.axes);
        }
        let name = format!("run-{}-{}-{}", experiment.imposed, experiment.order, experiment.axes);
        held(
            &name,
            &json!([
                errors.score,
                errors.signed.iter().map(|e| outline(e)).collect::<Vec<_>>(),
                errors.predicted.iter().map(|e| outline(e)).collect::<Vec<_>>()
            ]),
        );
    }
}
