use super::*;
use crate::Axis;
use crate::time::laws::{self, Coulomb};
use num_complex::Complex64;
use std::f64::consts::TAU;

fn force(samples: usize, axes: usize) -> Vec<Vec<f64>> {
    (0..axes).map(|a| (0..samples).map(|k| 4.0 * (0.1 * k as f64 * (1.0 + a as f64)).sin() + 2.0 * (0.023 * k as f64).cos()).collect()).collect()
}

/// Last outputs of a run.
fn last(mechanism: &Mechanism, theta: &[f64], initial: &[f64], drive: &Drive<'_>, derivatives: bool) -> Vec<f64> {
    let mut out = Vec::new();
    Runner::new(mechanism, theta).run(initial, drive, 0.004, 2, derivatives, |block| out = block.to_vec());
    out
}

fn assert_derivatives(mechanism: &Mechanism, theta: &[f64], initial: &[f64], drive: &Drive<'_>, what: &str) {
    let n = mechanism.axes.len();
    let exact = last(mechanism, theta, initial, drive, true);
    let width = exact.len() / n;
    for c in 0..width - 1 {
        let moved = |sign: f64| {
            let (mut t, mut x) = (theta.to_vec(), initial.to_vec());
            let value = if c < theta.len() { &mut t[c] } else { &mut x[c - theta.len()] };
            let step = 3e-6 * value.abs();
            *value += sign * step;
            (last(mechanism, &t, &x, drive, false), step)
        };
        let ((up, step), (down, _)) = (moved(1.0), moved(-1.0));
        for i in 0..n {
            let (difference, found) = ((up[i] - down[i]) / (2.0 * step), exact[i * width + 1 + c]);
            // 1e-6, and what rounding leaves of a difference.
            let rounding = 1e-12 * exact[i * width].abs().max(1e-3) / step;
            assert!((difference - found).abs() < 1e-6 * found.abs() + rounding, "{what} {c} {i}: {difference} {found}");
        }
    }
}

const BASE: [f64; 3] = [2.0, 12.0, 350.0];

#[test]
fn derivatives_of_exact_steps_are_differences_with_and_without_spring_offset_and_trend() {
    let force = force(180, 2);
    let drive = Drive::Force(force.iter().map(Vec::as_slice).collect());
    let axes = vec![Axis::linear("x"), Axis::linear("y")];
    let theta = [2.1, -0.5, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0, 0.2, -0.1, 0.3, 0.15];
    for (spring, offset, trend) in [(true, true, true), (true, false, true), (false, true, false), (false, false, false)] {
        let mechanism = Mechanism { spring, offset, trend, ..Mechanism::new(axes.clone()) };
        let count = mechanism.parameters().len();
        let theta: Vec<f64> = theta[..if spring { 9 } else { 6 }].iter().chain(&theta[9..]).take(count).copied().collect();
        assert_derivatives(&mechanism, &theta, &[0.001, -0.002, 0.05, 0.02], &drive, &format!("{spring} {offset} {trend}"));
    }
}

#[test]
fn derivatives_with_every_law_are_differences_of_the_discrete_run() -> Result<(), &'static str> {
    let force = force(150, 1);
    let drive = Drive::Force(vec![&force[0]]);
    let x: Vec<f64> = (0..150).map(|k| 0.01 * (0.043 * f64::from(k)).sin() + 0.004 * (0.11 * f64::from(k)).cos()).collect();
    let v: Vec<f64> = (0..150).map(|k| (0.01 * 0.043 * (0.043 * f64::from(k)).cos() - 0.004 * 0.11 * (0.11 * f64::from(k)).sin()) / 0.004).collect();
    let a: Vec<f64> =
        (0..150).map(|k| (-0.01 * 0.043f64.powi(2) * (0.043 * f64::from(k)).sin() - 0.004 * 0.11f64.powi(2) * (0.11 * f64::from(k)).cos()) / 1.6e-5).collect();
    let imposed = Drive::Motion([vec![&x], vec![&v], vec![&a]]);
    for law in laws::all() {
        let law = if law.name() == "coulomb-friction" { std::sync::Arc::new(Coulomb { turn_velocity: 0.02 }) } else { law };
        let (name, delay) = (law.name(), law.delay());
        let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_offset().with_law(law, 0);
        let mut base = BASE.to_vec();
        base.push(0.3);
        let mut theta = mechanism.starts(&base).pop().ok_or("no start")?;
        if let Some(delay) = delay {
            // No whole number of steps: where the past begins there is a kink.
            theta[4 + delay] *= 1.003;
        }
        if name == "stribeck-friction" {
            // Turned around over 1 mm/s, differences are no measure of anything.
            theta[4] = 0.05;
        }
        assert_derivatives(&mechanism, &theta, &[0.001, 0.03], &drive, name);
        if name != "saturation" && name != "latency" {
            assert_derivatives(&mechanism, &theta, &[], &imposed, &format!("{name}, motion imposed"));
        }
    }
    Ok(())
}

#[test]
fn exact_steps_and_runge_kutta_steps_are_one_mechanism() {
    let force = force(400, 1);
    let drive = Drive::Force(vec![&force[0]]);
    let plain = Mechanism::new(vec![Axis::linear("x")]).with_offset();
    let carried = plain.clone().with(laws::CubicStiffness, 0);
    let (mut exact, mut stepped) = (Vec::new(), Vec::new());
    Runner::new(&plain, &[2.0, 12.0, 350.0, 0.2]).run(&[0.001, 0.02], &drive, 0.002, 1, false, |y| exact.push(y[0]));
    Runner::new(&carried, &[2.0, 12.0, 350.0, 0.2, 0.0]).run(&[0.001, 0.02], &drive, 0.002, 4, false, |y| stepped.push(y[0]));
    let size = exact.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    // (ω h)⁴/120 of 0.5 ms steps at 13 rad/s: 1e-11 a step's worth.
    assert!(exact.iter().zip(&stepped).all(|(a, b)| (a - b).abs() < 1e-9 * size));
}

/// Twelve seconds of 2 Hz, at this rate.
const RATE: f64 = 4000.0;
const TURN: f64 = TAU * 2.0 / RATE;

fn sine() -> Vec<f64> {
    (0..(12.0 * RATE) as usize).map(|k| (TURN * k as f64).sin()).collect()
}

/// The last period of an answer to that as a phasor, over the sinc² that a force which is linear between samples has of the sine.
fn phasor(y: &[f64]) -> Complex64 {
    let period = (TAU / TURN).round() as usize;
    let sum = |of: fn(f64) -> f64| y.iter().enumerate().skip(y.len() - period).map(|(k, y)| y * of(TURN * k as f64)).sum::<f64>();
    Complex64::new(sum(f64::sin), sum(f64::cos)) * 2.0 / period as f64 / (0.5 * TURN).sin().powi(2) * (0.5 * TURN).powi(2)
}

#[test]
fn time_and_frequency_faces_of_every_linear_law_agree() {
    // The steady answer of mass, damper, spring and law to a sine, by the run and by 1/(M s² + B s + K + f/x).
    let sine = sine();
    for law in laws::all() {
        let theta = Mechanism::new(vec![Axis::linear("x")]).with_law(law.clone(), 0).starts(&[2.0, 30.0, 350.0]).remove(0);
        let s = Complex64::new(0.0, TURN * RATE);
        let Some(own) = law.response(&theta[3..], s) else { continue };
        let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(law.clone(), 0);
        let answer = &super::simulate(&mechanism, &theta, &[0.0, 0.0], &[&sine], RATE, 1)[0];
        let want = (s * s * theta[0] + s * theta[1] + theta[2] + own).inv();
        let error = (phasor(answer) / want - 1.0).norm();
        let bound = if law.name() == "fractional" { laws::FractionalDamping::ERROR } else { 1e-8 };
        println!("{}: {error:.1e}", law.name());
        assert!(error < bound, "{}: {error:e}", law.name());
    }
}

#[test]
fn six_axes_with_laws_answer_a_sine_as_their_dynamic_stiffness_says() -> Result<(), &'static str> {
    let n = 6;
    let axes = ["x", "y", "z"].iter().map(|a| Axis::linear(a)).chain(["rx", "ry", "rz"].iter().map(|a| Axis::rotational(a))).collect();
    let mechanism = Mechanism::new(axes).with(laws::Relaxation, 0).with(laws::LinearReflex, 2).with(laws::FlexibleMode, 5);
    let pairs = mechanism.entries();
    // Diagonally dominant, all entries different.
    let matrix = |size: f64| pairs.iter().map(move |&(i, j)| if i == j { size * (1.0 + 0.1 * i as f64) } else { size * 0.02 * (i + 2 * j) as f64 / 6.0 });
    let base: Vec<f64> = matrix(2.0).chain(matrix(30.0)).chain(matrix(350.0)).collect();
    let theta = mechanism.starts(&base).remove(0);
    let sine = sine();
    let still = vec![0.0; sine.len()];
    let force: Vec<&[f64]> = (0..n).map(|i| if i == 2 { &sine[..] } else { &still[..] }).collect();
    let answer = super::simulate(&mechanism, &theta, &[0.0; 12], &force, RATE, 1);
    let d = mechanism.dynamic_stiffness(&theta, Complex64::new(0.0, TURN * RATE)).ok_or("not all linear")?;
    let x: Vec<_> = answer.iter().map(|y| phasor(y)).collect();
    for i in 0..n {
        let back: Complex64 = (0..n).map(|j| d[[i, j]] * x[j]).sum();
        let want = f64::from(u8::from(i == 2));
        assert!((back - want).norm() < 1e-8, "{i}: {back}");
    }
    assert!(mechanism.with(laws::CubicStiffness, 1).dynamic_stiffness(&[theta, vec![1.0]].concat(), Default::default()).is_none());
    Ok(())
}

#[test]
fn derivatives_of_three_axes_with_laws_are_differences_whatever_drives_them() -> Result<(), &'static str> {
    let (n, samples) = (3, 60);
    let force = force(samples, n);
    let driven = Drive::Force(force.iter().map(Vec::as_slice).collect());
    let wave = |a: usize, order: u32| -> Vec<f64> {
        let w = 0.11 + 0.03 * a as f64;
        let turn = f64::from(order) * std::f64::consts::FRAC_PI_2;
        (0..samples).map(|k| 0.01 * (w / 0.004).powi(order as i32) * (w * k as f64 + a as f64 + turn).sin()).collect()
    };
    let motion: [Vec<Vec<f64>>; 3] = [0, 1, 2].map(|order| (0..n).map(|a| wave(a, order)).collect());
    let imposed = Drive::Motion([0, 1, 2].map(|k| motion[k].iter().map(Vec::as_slice).collect()));
    let initial: Vec<f64> = (0..6).map(|k| 1e-3 * (1.0 + f64::from(k))).collect();
    for (spring, offset, trend) in [(true, true, true), (false, false, true)] {
        let limb = Mechanism { spring, offset, trend, ..Mechanism::new(["x", "y", "z"].map(Axis::linear).to_vec()) };
        let mechanism = limb.with(laws::MaxwellSlip, 2).with(laws::LinearReflex, 1).with(laws::CubicStiffness, 0);
        // Diagonally dominant, no two entries alike.
        let matrix = |size: f64| {
            let pairs = mechanism.entries();
            pairs.into_iter().map(move |(i, j)| if i == j { size * (1.0 + 0.1 * i as f64) } else { size * 0.03 * (1 + i + 2 * j) as f64 })
        };
        let mut base: Vec<f64> = matrix(2.0).chain(matrix(30.0)).collect();
        base.extend(matrix(350.0).filter(|_| spring));
        base.extend((base.len()..mechanism.baseline_parameters()).map(|k| 0.1 + 0.01 * k as f64));
        let mut theta = mechanism.starts(&base).pop().ok_or("no start")?;
        let (mut at, before) = (mechanism.baseline_parameters(), theta.clone());
        for placed in &mechanism.laws {
            // No whole number of steps.
            placed.law.delay().into_iter().for_each(|d| theta[at + d] = 1.003 * before[at + d].min(0.05));
            at += placed.law.parameters(false).len();
        }
        assert_derivatives(&mechanism, &theta, &initial, &driven, &format!("driven {spring}"));
        assert_derivatives(&mechanism, &theta, &[], &imposed, &format!("imposed {spring}"));
        // A force that a motion asks for moves the masses that way: what is imposed is M a, B v, K x and the laws.
        let mut asked = Vec::new();
        Runner::new(&mechanism, &theta).run(&[], &imposed, 0.004, 2, false, |y| asked = y.to_vec());
        let bare = Mechanism { laws: vec![], ..mechanism.clone() };
        let mut plain = Vec::new();
        Runner::new(&bare, &base).run(&[], &imposed, 0.004, 2, false, |y| plain = y.to_vec());
        let last = |k: usize, j: usize| motion[k][j][samples - 1];
        let runner = Runner::new(&bare, &base);
        for (i, found) in plain.iter().enumerate() {
            let sum: f64 =
                (0..n).map(|j| runner.mass[i * n + j] * last(2, j) + runner.damping[i * n + j] * last(1, j) + runner.stiffness[i * n + j] * last(0, j)).sum();
            let want = sum + runner.offset[i] + runner.trend[i] * 0.004 * (samples - 1) as f64;
            assert!((found - want).abs() < 1e-9 * want.abs().max(1.0), "{i}: {found} {want}");
        }
        let cubic = theta[theta.len() - 1] * last(0, 0).powi(3);
        assert!((asked[0] - plain[0] - cubic).abs() < 1e-9 * cubic.abs().max(1e-3), "{} {cubic}", asked[0] - plain[0]);
    }
    Ok(())
}
