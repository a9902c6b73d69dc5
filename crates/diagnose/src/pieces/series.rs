//! Series in time against their closed forms.

use super::{RATE_HZ, held, outline, outline_of};
use crate::detectors::levels;
use crate::diagnose::divide;
use crate::layout::{Layout, filter, finer};
use crate::optimise::minimise;
use crate::samples::{Meaning, Samples};
use crate::{HeldOut, Options, OwnEffects};
use ndof_models::effects::{EFFECTS, Knob};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use num_complex::Complex64;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::f64::consts::TAU;

/// A slow sine on a ramp.
fn curve(t: f64) -> f64 {
    0.4 + 0.3 * t + (TAU * 0.7 * t + 0.2).sin()
}

fn rate(t: f64) -> f64 {
    0.3 + TAU * 0.7 * (TAU * 0.7 * t + 0.2).cos()
}

fn sampled(f: fn(f64) -> f64, n: usize, rate_hz: f64) -> Vec<f64> {
    (0..n).map(|k| f(k as f64 / rate_hz)).collect()
}

fn close(found: &[f64], want: impl Fn(usize) -> f64, within: f64) {
    let third = found.len() / 3;
    for (k, x) in found.iter().enumerate().skip(third).take(third) {
        assert!((x - want(k)).abs() < within, "{k}: {x}, not {}", want(k));
    }
}

#[test]
fn an_operator_does_to_a_track_what_it_does_to_the_curve() {
    let x = sampled(curve, 4801, RATE_HZ);
    let layout = Layout::new(1, 1, x.len(), RATE_HZ, (0.0, 6.0));
    let (track, at) = (layout.track(&x), |k: usize| k as f64 / layout.rate_hz);
    let late = |s: Complex64| (-s * 0.13).exp();
    close(&layout.filtered(&track, |_| Complex64::ONE, None), |k| curve(at(k)), 1e-4);
    close(&layout.filtered(&track, late, None), |k| curve(at(k) - 0.13), 1e-3);
    close(&layout.filtered(&layout.transformed(&track, late), |_| 2.0.into(), None), |k| 2.0 * curve(at(k) - 0.13), 2e-3);
    close(&layout.filtered(&layout.transformed(&track, |s| s), |_| Complex64::ONE, None), |k| rate(at(k)), 2e-3);
    // The mirrored samples are the samples, and beside them the samples turned about both ends.
    let whole = layout.whole(&track);
    let pad = layout.pad;
    assert_eq!(whole.len(), layout.padded);
    for k in [1, 20, 60] {
        assert!((whole[pad + k] - curve(at(k))).abs() < 2e-2 && (whole[pad - k] - 2.0 * curve(0.0) + curve(at(k))).abs() < 2e-2);
    }
    close(&whole[pad..pad + layout.samples], |k| curve(at(k)), 1e-3);
    let again = layout.track_of_padded(whole);
    assert!((again.slope_per_s - track.slope_per_s).abs() < 1e-2 && (again.start - track.start).abs() < 1e-1);
    close(&layout.filtered(&again, |_| Complex64::ONE, None), |k| curve(at(k)), 1e-3);
}

#[test]
fn a_filter_of_plain_samples_delays_differentiates_and_scales_ramps() {
    let x = sampled(curve, 1501, 50.0);
    close(&filter(&x, 50.0, |s| (-s * 0.3).exp()), |k| curve(k as f64 / 50.0 - 0.3), 2e-2);
    close(&filter(&x, 50.0, |s| s), |k| rate(k as f64 / 50.0), 2e-2);
    close(&filter(&x, 50.0, |_| 3.0.into()), |k| 3.0 * curve(k as f64 / 50.0), 1e-9);
    let fine = finer(&x, 3);
    assert_eq!(fine.len(), 4503);
    close(&fine, |k| curve(k as f64 / 150.0), 2e-3);
    held(
        "ends",
        &json!([outline(&fine[..40]), outline(&fine[4460..]), outline(&filter(&x, 50.0, |s| s)), outline(&filter(&x[..7], 50.0, |s| 1.0 / (1.0 + s)))]),
    );
}

#[test]
fn a_taper_has_unit_power_a_mask_takes_lines_and_samples_away() {
    let mut layout = Layout::new(2, 1, 4800, RATE_HZ, (0.0, 6.0));
    // A sine in the middle of a line's neighbours: by Parseval all lines together have half of its power, for real samples have two sides.
    let line = TAU * 30.0 / layout.block as f64;
    let x: Vec<f64> = (0..layout.samples).map(|k| 3.0 * (line * k as f64).cos()).collect();
    let mut out = Vec::new();
    layout.blocks_of(0, &x, &mut out);
    let lines = layout.lines();
    assert_eq!(out.len(), layout.starts.len() * lines);
    let power: f64 = out[..lines].iter().map(Complex64::norm_sqr).sum();
    assert!((power / (layout.block as f64 * 9.0 / 4.0) - 1.0).abs() < 2e-3, "{power}");
    layout.keep[30] = false;
    layout.weights = vec![vec![1.0; layout.samples], vec![0.0; layout.samples]];
    let both = layout.spectra([x.as_slice(), x.as_slice()].into_iter());
    assert_eq!(both.len(), layout.size());
    assert!(both[30] == Complex64::ZERO && both[31] != Complex64::ZERO && both[2 * lines..].iter().all(|v| *v == Complex64::ZERO));
    assert_eq!((0..4).map(|b| layout.trial_of(b)).collect::<Vec<_>>(), [0, 0, 1, 1]);
    // A constant: the line at zero hertz has half the power that a complex one of its size would.
    let mut one = Vec::new();
    layout.blocks_of(0, &vec![1.0; layout.samples], &mut one);
    let whole: f64 = one[..lines].iter().map(|v| 2.0 * v.norm_sqr()).sum();
    assert!((whole / layout.block as f64 - 1.0).abs() < 0.02, "{whole}");
}

#[test]
fn layouts_are_as_they_were() {
    let found: Vec<Value> = [
        (1, 1, 4800, 200.0, (0.0, 6.0)),
        (3, 2, 9000, 500.0, (0.5, 12.0)),
        (1, 1, 400, 100.0, (0.0, 30.0)),
        (2, 1, 60_000, 1000.0, (1.0, 40.0)),
        (1, 1, 20_000, 20.0, (0.01, 0.4)),
        (1, 2, 700, 50.0, (2.0, 3.0)),
    ]
    .into_iter()
    .map(|(trials, axes, samples, rate_hz, band_hz)| {
        let l = Layout::new(trials, axes, samples, rate_hz, band_hz);
        let x: Vec<f64> = (0..samples).map(|k| (0.01 * (k as f64).powf(1.5)).sin() + 1e-3 * k as f64).collect();
        let track = l.track(&x);
        let filtered = l.filtered(&track, |s| 1.0 / (1.0 + s * 0.01), Some(&l.smooth));
        let mut blocks = Vec::new();
        l.blocks_of(0, &filtered, &mut blocks);
        json!([
            [l.rate_hz, l.time_s, track.start, track.slope_per_s],
            [l.samples, l.factor, l.pad, l.padded, l.block, l.bins.start, l.bins.end, l.blocks(), l.lines()],
            l.starts,
            outline(&l.frequency_hz),
            outline_of(&l.s),
            outline_of(&l.sj),
            outline(&l.smooth),
            outline_of(&track.spectrum),
            outline(&filtered),
            outline(&filtered[filtered.len() - 30..]),
            outline_of(&blocks),
        ])
    })
    .collect();
    held("layouts", &json!(found));
}

fn channel(name: &str, quantity: Quantity, samples: Vec<f64>) -> Channel {
    Channel::new(name, Unit::si(quantity, false), samples)
}

#[test]
fn a_velocity_is_integrated_once_and_an_acceleration_twice() {
    let n = 2001;
    // Whole turns: neither mean nor slope.
    let w = TAU * 0.5;
    let curve = |f: fn(f64) -> f64, size: f64| -> Vec<f64> { (0..n).map(|k| size * f(w * k as f64 / 100.0)).collect() };
    for (order, word, quantity, samples) in [(1, "vel", Quantity::Velocity, curve(f64::cos, w)), (2, "acc", Quantity::Acceleration, curve(f64::sin, -w * w))] {
        let r =
            Recording::new(100.0, vec![channel("force_x", Quantity::Effort, curve(f64::sin, 1.0)), channel(&format!("{word}_x"), quantity, samples.clone())])
                .unwrap();
        let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
        let meaning = Meaning::new(&r, &ports).unwrap();
        assert_eq!(meaning.order, order);
        let found = Samples::new(&[r], &ports, &meaning).unwrap();
        assert_eq!(found.measured[0][0], samples);
        // A running integral has no constant and no slope.
        let want = curve(f64::sin, 1.0);
        let middle = (n as f64 - 1.0) / 2.0;
        let (mut level, mut sxy, mut sxx) = (0.0, 0.0, 0.0);
        for (k, y) in want.iter().enumerate() {
            level += y / n as f64;
            sxy += (k as f64 - middle) * y;
            sxx += (k as f64 - middle).powi(2);
        }
        let straight = |y: f64, k: usize| y - level - sxy / sxx * (k as f64 - middle);
        for (k, x) in found.motion[0][0].iter().enumerate() {
            assert!((x - straight(want[k], k)).abs() < 1e-3, "{order} {k}: {x} {}", straight(want[k], k));
        }
    }
}

#[test]
fn roles_come_from_the_quantity_and_where_there_is_none_from_the_name() {
    let wave: Vec<f64> = (0..300).map(|k| (0.1 * k as f64).sin()).collect();
    let meaning = |a: (&str, Quantity), b: (&str, Quantity)| {
        let r = Recording::new(100.0, vec![channel(a.0, a.1, wave.clone()), channel(b.0, b.1, wave.clone())]).unwrap();
        Meaning::new(&r, &Ports { references: vec![], inputs: vec![0], outputs: vec![1] }).ok().map(|m| (m.motion_imposed, m.order, m.axes[0].clone()))
    };
    use Quantity::{Displacement, Effort, Other, Velocity};
    let is = |imposed, order, axis: &str| Some((imposed, order, axis.to_owned()));
    assert_eq!(meaning(("a_1", Effort), ("b_2", Displacement)), is(false, 0, "2"));
    assert_eq!(meaning(("pos_x", Effort), ("force_x", Velocity)), is(false, 1, "x"));
    assert_eq!(meaning(("b", Displacement), ("a", Effort)), is(true, 0, "a"));
    for (word, order) in [("pos_x", 0), ("angle_x", 0), ("vel_x", 1), ("acc_x", 2)] {
        assert_eq!(meaning((word, Other), ("torque_x", Other)), is(true, order, "x"), "{word}");
        assert_eq!(meaning(("force_x", Other), (word, Other)), is(false, order, "x"), "{word}");
    }
    // Without a word an input is an effort, and an output is none.
    assert_eq!(meaning(("u", Other), ("y", Other)), is(false, 0, "y"));
    assert_eq!(meaning(("force_x", Effort), ("force_y", Effort)), None);
    assert_eq!(meaning(("pos_x", Other), ("vel_x", Other)), None);
}

#[test]
fn samples_are_cut_picked_and_turned() {
    let trial = |sign: f64| vec![(0..300).map(|k| sign * k as f64).collect::<Vec<f64>>()];
    let all = vec![trial(1.0), trial(-1.0)];
    let samples = Samples {
        rate_hz: 50.0,
        effort: all.clone(),
        motion: all.clone(),
        measured: all.clone(),
        reference: all.clone(),
        start_s: vec![0.0, 1.0],
        duration_s: 6.0,
    };
    let cut = samples.cut(100, 250);
    assert_eq!((cut.len(), cut.start_s.clone(), cut.effort[1][0][0], cut.motion[0][0][149]), (150, vec![2.0, 3.0], -100.0, 249.0));
    let mut one = samples.pick(&[1]);
    assert_eq!((one.effort.len(), one.start_s.clone(), one.duration_s), (1, vec![1.0], 6.0));
    one.turn(false);
    assert_eq!((one.effort[0][0][7], one.reference[0][0][7], one.motion[0][0][7]), (7.0, -7.0, -7.0));
    one.turn(true);
    assert_eq!((one.effort[0][0][7], one.reference[0][0][7]), (-7.0, 7.0));
}

#[test]
fn a_rounded_channel_shows_its_step_and_a_smooth_one_none() {
    let smooth: Vec<f64> = (0..2000).map(|k| 40.0 * (0.013 * k as f64).sin() + 3.0).collect();
    let rounded: Vec<f64> = smooth.iter().map(|x| 0.5 * (x / 0.5).round()).collect();
    let still = vec![1.0; 2000];
    let samples = |effort: &[f64], motion: &[f64]| Samples {
        rate_hz: 100.0,
        effort: vec![vec![effort.to_vec()]],
        motion: vec![vec![motion.to_vec()]],
        measured: vec![vec![motion.to_vec()]],
        reference: vec![vec![]],
        start_s: vec![0.0],
        duration_s: 20.0,
    };
    let found = levels(&samples(&smooth, &rounded), 1e-3);
    let [level] = &found[..] else { panic!("{found:?}") };
    let mean = rounded.iter().sum::<f64>() / 2000.0;
    let rms = (rounded.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
    assert!(!level.effort && (level.step - 0.5).abs() < 1e-12 && (level.share - 0.5 / 12f64.sqrt() / rms).abs() < 1e-12);
    assert!(levels(&samples(&rounded, &still), 1e-3)[0].effort && levels(&samples(&still, &smooth), 1e-3).is_empty());
    assert!(levels(&samples(&rounded, &smooth), 1.01 * level.share).is_empty() && !levels(&samples(&rounded, &smooth), 0.99 * level.share).is_empty());
    // Every third gap is half a step: no grid of such a step.
    let odd: Vec<f64> = rounded.iter().map(|x| if (x / 0.5).rem_euclid(3.0) == 1.0 { x + 0.15 } else { *x }).collect();
    assert!(levels(&samples(&odd, &smooth), 1e-3).is_empty());
    // Round-off beside a step is no step, and values that hardly ever come twice are no grid.
    let dirty: Vec<f64> = rounded.iter().enumerate().map(|(k, x)| x + 5e-6 * (k as f64).sin()).collect();
    assert_eq!(levels(&samples(&dirty, &smooth), 1e-3).len(), 1);
    let ramp: Vec<f64> = (0..2000).map(f64::from).collect();
    assert!(levels(&samples(&ramp, &smooth), 1e-6).is_empty());
}

#[test]
fn the_held_out_part_is_trials_or_a_stretch_of_time_and_leaves_enough_beside_it() {
    let trial = |n: usize| vec![(0..n).map(|k| k as f64).collect::<Vec<f64>>()];
    let samples = |trials: usize| {
        let all: Vec<_> = (0..trials).map(|t| trial(1000 + t)).collect();
        Samples {
            rate_hz: 50.0,
            effort: all.clone(),
            motion: all.clone(),
            measured: all,
            reference: vec![vec![]; trials],
            start_s: vec![0.0; trials],
            duration_s: 20.0,
        }
    };
    let ask = |trials: usize, held_out: HeldOut| {
        divide(&samples(trials), &held_out)
            .ok()
            .map(|(a, b, split)| ([a.effort.len(), a.len(), b.effort.len(), b.len()], [a.start_s[0], b.start_s[0]], split.estimation, split.held_out))
    };
    let is = |sizes, starts, a: &str, b: &str| Some((sizes, starts, a.to_owned(), b.to_owned()));
    assert_eq!(ask(1, HeldOut::Auto), is([1, 700, 1, 300], [0.0, 14.0], "0.00 to 14.00 s", "14.00 to 20.00 s"));
    assert_eq!(ask(5, HeldOut::Auto), is([3, 1000, 2, 1003], [0.0, 0.0], "trials 1, 2, 3", "trials 4, 5"));
    assert_eq!(ask(3, HeldOut::Trials(vec![1])), is([2, 1000, 1, 1001], [0.0, 0.0], "trials 1, 3", "trials 2"));
    assert_eq!(ask(2, HeldOut::Time(12.0, 18.0)), is([2, 600, 2, 300], [0.0, 12.0], "0.00 to 12.00 s", "12.00 to 18.00 s"));
    assert_eq!(ask(2, HeldOut::Time(4.0, 8.0)), is([2, 600, 2, 200], [8.0, 4.0], "8.00 to 20.00 s", "4.00 to 8.00 s"));
    assert_eq!(ask(1, HeldOut::Time(9.0, 13.0)), is([1, 450, 1, 200], [0.0, 9.0], "0.00 to 9.00 s", "9.00 to 13.00 s"));
    assert_eq!(ask(1, HeldOut::Time(16.0, 99.0)), is([1, 800, 1, 200], [0.0, 16.0], "0.00 to 16.00 s", "16.00 to 20.00 s"));
    for held_out in [
        HeldOut::Time(4.0, 7.9),
        HeldOut::Time(3.0, 17.0),
        HeldOut::Time(15.0, 5.0),
        HeldOut::Time(0.0, 20.0),
        HeldOut::Trials(vec![]),
        HeldOut::Trials(vec![0, 1]),
        HeldOut::Trials(vec![2]),
    ] {
        assert!(ask(2, held_out.clone()).is_none(), "{held_out:?}");
    }
    let own = Options { own: OwnEffects(vec![EFFECTS[2]]), ..Options::default() };
    assert!(own == own.clone() && own != Options::default() && Options::default() == Options::default());
    assert!(own != Options { own: OwnEffects(vec![EFFECTS[3]]), ..Options::default() } && format!("{own:?}").contains(EFFECTS[2].name()));
}

#[test]
fn a_search_for_the_best_knobs_goes_the_way_it_went() {
    let knob = |lo, hi, log| Knob { lo, hi, log, telling: false };
    let way = |knobs: &[Knob], grid: &[Vec<f64>], start: &[f64], evaluations: usize, cost: &dyn Fn(&[f64]) -> f64| -> Value {
        let seen = RefCell::new(Vec::new());
        let best = minimise(knobs, grid, start, cost(start), evaluations, |k| {
            seen.borrow_mut().push(k.to_vec());
            cost(k)
        });
        json!([best, seen.into_inner()])
    };
    let valley = |k: &[f64]| 100.0 * ((1.0 - k[0]).powi(2) + 100.0 * (k[1] - k[0] * k[0]).powi(2));
    let bowl = |k: &[f64]| 1e4 * k.iter().zip([0.3, 3.0, -2.0]).map(|(k, c)| (k - c).powi(2)).sum::<f64>();
    let steep = |k: &[f64]| if k[0] < 0.2 { 1e6 } else { (k[0] - 0.21).abs() };
    let grid = [vec![0.1], vec![0.3], vec![0.9]];
    held(
        "knobs",
        &json!([
            way(&[knob(-2.0, 2.0, false), knob(-1.0, 3.0, false)], &[], &[-1.2, 1.0], 60, &valley),
            way(&[knob(0.01, 1.0, true), knob(0.0, 3.5, false), knob(-4.0, 1.0, false)], &[], &[0.9, 3.2, 0.9], 30, &bowl),
            way(&[knob(0.01, 2.0, true)], &grid, &[0.3], 14, &steep),
            way(&[knob(0.0, 2.0, false)], &grid, &[0.9], 9, &|k| (k[0] - 1.3).powi(2)),
            way(&[knob(0.0, 2.0, false)], &grid, &[0.1], 30, &|k| -k[0]),
            way(&[knob(0.0, 1.0, false), knob(0.0, 1.0, false)], &[], &[0.5, 0.5], 60, &|k| 1e3 * (k[0] - 0.5).abs() + 1e3 * (k[1] - 0.5).abs()),
        ]),
    );
}
