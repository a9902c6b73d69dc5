//! The recording as a search sees it: corrected channels, derivatives, and their spectra block by block.

use crate::along::{Clock, along, interleave};
use crate::layout::{Layout, Track};
use crate::linear::{Symmetric, inner};
use crate::operators::{between, filter, remembered};
use ndof_linear::square;
use ndof_models::ForceLaw;
use ndof_models::effects::{Action, Matrix};
use num_complex::Complex64;
use rayon::prelude::*;
use std::sync::Arc;

/// Time within which the motion is thought to have come from rest, for a band to 12 Hz: what is expected of a past that was not recorded dies away with
/// the correlation of the motion.
const PAST_S: f64 = 0.5;

/// One channel quantity: `[trial][axis]`.
pub(crate) type Tracks = Vec<Vec<Track>>;
/// Samples at the working rate: `[trial][axis][time]`.
pub(crate) type Series = Vec<Vec<Vec<f64>>>;

/// What is known about where the motion comes from.
#[derive(Clone, Debug)]
pub(crate) enum Cause {
    /// The motion is imposed, the effort answers.
    Motion,
    /// The effort is imposed, the motion answers.
    Effort,
    /// The effort is imposed, and the motion is mostly not what the baseline makes of it: the bias of a noisy motion cannot be told from the rest.
    Unclear,
    /// A robot of this impedance (`[bin]`, rows of an n × n matrix) closes the loop around the plant.
    Loop(Arc<Vec<Vec<Complex64>>>),
}

impl Cause {
    /// The robot's, where one closes the loop.
    pub fn impedance(&self) -> Option<&[Vec<Complex64>]> {
        if let Cause::Loop(z) = self { Some(z) } else { None }
    }
}

/// How a column's coefficient enters the dynamics that lie between noise and motion.
#[derive(Clone, Debug)]
pub(crate) enum Through {
    /// Part of the dynamics that act on the corrected motion.
    Motion,
    /// Multiplied with the robot's impedance: part of what is done to the effort.
    Effort,
}

/// An entry of a column's linear action: row, column, transfer function over the bins.
pub(crate) type Entry = (usize, usize, Arc<Vec<Complex64>>);

/// A regressor: spectra on some equations, and the linear action that it stands for.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub parts: Vec<(usize, Arc<Vec<Complex64>>)>,
    pub action: Vec<Entry>,
    pub through: Through,
    /// 1 / σ² of a Gaussian prior around zero.
    pub precision: f64,
}

/// What stands between measured and true channels, per bin.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    /// Effort correction, rows of n × n.
    pub effort: Vec<Vec<Complex64>>,
    /// Motion correction, a factor for each axis.
    pub motion: Vec<Vec<Complex64>>,
    /// Series compliance, likewise.
    pub series: Vec<Vec<Complex64>>,
}

/// A transform with the values of its knobs.
#[derive(Clone)]
pub(crate) struct Transform {
    pub action: Action,
    pub axis: Option<usize>,
    pub knobs: Vec<f64>,
}

/// The corrected recording.
#[derive(Clone)]
pub(crate) struct State {
    pub layout: Arc<Layout>,
    pub effort: Tracks,
    pub motion: Tracks,
    pub centre: Vec<f64>,
    /// Displacement, centred.
    pub x: Arc<Series>,
    /// Velocity and displacement for nonlinear laws, axis beside axis: `[trial][time · axes + axis]`.
    pub law_v: Arc<Vec<Vec<f64>>>,
    pub law_x: Arc<Vec<Vec<f64>>>,
    /// Spectra of displacement, velocity and acceleration: `[order][axis]`.
    pub kinematics: [Vec<Arc<Vec<Complex64>>>; 3],
    pub effort_spectra: Vec<Arc<Vec<Complex64>>>,
    pub chain: Chain,
    /// What has been corrected, the first first.
    pub transforms: Vec<Transform>,
}

impl State {
    /// The state of measured channels under transforms, the first applied first.
    pub fn new(layout: &Arc<Layout>, effort: &Tracks, motion: &Tracks, centre: &[f64], transforms: &[Transform]) -> Self {
        let n = layout.axes;
        let each = |value: Complex64| vec![vec![value; n]; layout.lines()];
        let identity: Vec<Complex64> = (0..n * n).map(|k| if k / n == k % n { Complex64::ONE } else { Complex64::ZERO }).collect();
        let mut chain = Chain { effort: vec![identity; layout.lines()], motion: each(Complex64::ONE), series: each(Complex64::ZERO) };
        let (mut effort, mut motion) = (effort.clone(), motion.clone());
        for transform in transforms {
            apply(layout, transform, &mut effort, &mut motion, &mut chain);
        }
        Self::build(layout, effort, motion, centre, chain, transforms.to_vec())
    }

    fn build(layout: &Arc<Layout>, effort: Tracks, motion: Tracks, centre: &[f64], chain: Chain, transforms: Vec<Transform>) -> Self {
        let smooth = Some(layout.smooth.as_slice());
        let series = |tracks: &Tracks, power: i32, extra: Option<&[f64]>| -> Series {
            tracks.iter().map(|trial| trial.iter().map(|t| layout.filtered(t, |s| s.powi(power), extra)).collect()).collect()
        };
        let mut x = series(&motion, 0, None);
        for trial in &mut x {
            for (axis, samples) in trial.iter_mut().enumerate() {
                samples.iter_mut().for_each(|v| *v -= centre[axis]);
            }
        }
        let (v, a, f) = (series(&motion, 1, None), series(&motion, 2, None), series(&effort, 0, None));
        let law_v = series(&motion, 1, smooth).iter().map(|trial| interleave(trial)).collect();
        let law_x = x.iter().map(|trial| interleave(trial)).collect();
        let spectra = |s: &Series| -> Vec<Arc<Vec<Complex64>>> {
            (0..layout.axes).map(|axis| Arc::new(layout.spectra(s.iter().map(|trial| trial[axis].as_slice())))).collect()
        };
        let kinematics = [spectra(&x), spectra(&v), spectra(&a)];
        let effort_spectra = spectra(&f);
        State {
            layout: layout.clone(),
            effort,
            motion,
            centre: centre.to_vec(),
            x: Arc::new(x),
            law_v: Arc::new(law_v),
            law_x: Arc::new(law_x),
            kinematics,
            effort_spectra,
            chain,
            transforms,
        }
    }

    /// The same recording under one more transform.
    pub fn with(&self, transform: &Transform) -> Self {
        let (mut effort, mut motion, mut chain) = (self.effort.clone(), self.motion.clone(), self.chain.clone());
        apply(&self.layout, transform, &mut effort, &mut motion, &mut chain);
        let transforms: Vec<Transform> = self.transforms.iter().chain([transform]).cloned().collect();
        if matches!(transform.action, Action::Effort(_) | Action::Mode { .. } | Action::Lag | Action::Mix(_) | Action::Clip) {
            // The motion stays as it is: only the effort's spectra are new.
            let layout = &self.layout;
            let effort_spectra = (0..layout.axes)
                .map(|axis| {
                    let trials: Vec<Vec<f64>> = effort.iter().map(|trial| layout.filtered(&trial[axis], |_| Complex64::ONE, None)).collect();
                    Arc::new(layout.spectra(trials.iter().map(Vec::as_slice)))
                })
                .collect();
            return State { effort, chain, effort_spectra, transforms, ..self.clone() };
        }
        Self::build(&self.layout, effort, motion, &self.centre, chain, transforms)
    }

    /// The forces of a law along the measured motion: `[trial][axis][time]`.
    pub fn forces(&self, law: &dyn ForceLaw) -> Series {
        (0..self.layout.trials).into_par_iter().map(|trial| self.forces_of(law, trial)).collect()
    }

    /// The forces of a law along one trial: `[axis][time]`.
    pub fn forces_of(&self, law: &dyn ForceLaw, trial: usize) -> Vec<Vec<f64>> {
        self.along(law, trial, self.law_x[trial].len()).0
    }

    /// The hidden states of a law at a sample of one trial, from the measured motion before it.
    pub fn hidden(&self, law: &dyn ForceLaw, trial: usize, sample: usize) -> Vec<f64> {
        if law.states() == 0 || sample == 0 {
            return vec![0.0; law.states()];
        }
        self.along(law, trial, (sample + 1) * self.layout.axes).1
    }

    /// Forces and last hidden states of a law along the beginning of a trial, so many places of all axes.
    fn along(&self, law: &dyn ForceLaw, trial: usize, places: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let delay = law.delay_s();
        let delayed = (delay > 0.0).then(|| self.delayed(trial, delay));
        let (x, v) = (&self.law_x[trial][..places], &self.law_v[trial][..places]);
        let then = delayed.as_ref().map_or((x, v), |(x, v)| (&x[..places], &v[..places]));
        along(law, Clock::of(&self.layout, trial), self.layout.axes, (x, v), then)
    }

    /// The poles of the modes that efforts pass, each with its axis.
    pub fn modes(&self) -> impl Iterator<Item = (usize, Complex64)> {
        self.transforms.iter().filter_map(|t| if let Action::Mode { pole, .. } = t.action { Some((t.axis?, pole(&t.knobs))) } else { None })
    }

    /// What the effort channels would show of these true efforts.
    pub fn uncorrect_effort(&self, mut effort: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        for transform in self.transforms.iter().rev() {
            match &transform.action {
                Action::Effort(operator) | Action::Mode { passes: operator, .. } => {
                    for (axis, series) in effort.iter_mut().enumerate() {
                        if transform.axis.is_none_or(|a| a == axis) {
                            *series = filter(series, self.layout.rate_hz, |s| 1.0 / operator(s, &transform.knobs));
                        }
                    }
                }
                Action::Lag => {
                    for series in &mut effort {
                        *series = lagging(series, &self.layout, 0, [-transform.knobs[0], -transform.knobs[1]]);
                    }
                }
                Action::Mix(matrix) => {
                    let n = effort.len();
                    if let Some(back) = square::inverse(&matrix(&transform.knobs).concat(), n) {
                        let old = effort.clone();
                        for (i, series) in effort.iter_mut().enumerate() {
                            for (k, value) in series.iter_mut().enumerate() {
                                *value = (0..n).map(|j| back[i * n + j] * old[j][k]).sum();
                            }
                        }
                    }
                }
                _ => {}
            }
        }
        effort
    }

    /// What the motion channels would show of this true motion under the (corrected) effort.
    pub fn uncorrect_motion(&self, mut motion: Vec<Vec<f64>>, order: usize, effort: &[Vec<f64>]) -> Vec<Vec<f64>> {
        for transform in self.transforms.iter().rev() {
            for (axis, (series, force)) in motion.iter_mut().zip(effort).enumerate() {
                match &transform.action {
                    Action::Motion(_) if transform.axis.is_some_and(|a| a != axis) => {}
                    Action::Motion(operator) => *series = filter(series, self.layout.rate_hz, |s| 1.0 / operator(s, &transform.knobs)),
                    Action::Series(operator) => {
                        let stretch = filter(&force[..series.len()], self.layout.rate_hz, |s| s.powi(order as i32) * operator(s, &transform.knobs));
                        series.iter_mut().zip(&stretch).for_each(|(x, y)| *x += y);
                    }
                    _ => {}
                }
            }
        }
        motion
    }

    fn delayed(&self, trial: usize, delay: f64) -> (Vec<f64>, Vec<f64>) {
        let layout = &self.layout;
        let late = |s: Complex64| (-s * delay).exp();
        let x: Vec<Vec<f64>> =
            self.motion[trial].iter().zip(&self.centre).map(|(t, centre)| layout.filtered(t, late, None).into_iter().map(|v| v - centre).collect()).collect();
        let v: Vec<Vec<f64>> = self.motion[trial].iter().map(|t| layout.filtered(t, |s| s * late(s), Some(&layout.smooth))).collect();
        (interleave(&x), interleave(&v))
    }

    /// The column of a series of forces, with its best linear approximation where `linear` is not given.
    pub fn force_column(&self, forces: &Series, linear: Option<Vec<Entry>>, axis: Option<usize>) -> Column {
        let layout = &self.layout;
        let acts = |i: &usize| forces.iter().any(|trial| trial[*i].iter().any(|f| *f != 0.0));
        let part = |i: usize| (i, Arc::new(layout.spectra(forces.iter().map(|trial| trial[i].as_slice()))));
        let parts: Vec<_> = (0..layout.axes).filter(acts).map(part).collect();
        let action = linear.unwrap_or_else(|| parts.iter().flat_map(|(i, spectrum)| self.approximation(*i, spectrum, axis)).collect());
        Column { parts, action, through: Through::Motion, precision: 0.0 }
    }

    /// The combination of displacement, velocity and acceleration nearest to a force (Bussgang).
    fn approximation(&self, equation: usize, spectrum: &[Complex64], axis: Option<usize>) -> Vec<Entry> {
        let from: Vec<usize> = if axis.is_some() { vec![equation] } else { (0..self.layout.axes).collect() };
        let regressors: Vec<(usize, usize)> = from.iter().flat_map(|&j| (0..3).map(move |order| (order, j))).collect();
        let columns: Vec<&[Complex64]> = regressors.iter().map(|&(order, j)| self.kinematics[order][j].as_slice()).collect();
        let gram = Symmetric::of(columns.len(), |i, j| inner(columns[i], columns[j]));
        let rhs: Vec<f64> = columns.iter().map(|c| inner(c, spectrum)).collect();
        let Some(factor) = gram.factor() else { return Vec::new() };
        let theta = factor.solve(&rhs);
        from.iter()
            .map(|&j| {
                let h = self
                    .layout
                    .sj
                    .iter()
                    .map(|&s| regressors.iter().zip(&theta).filter(|(r, _)| r.1 == j).map(|(r, t)| s.powi(r.0 as i32) * t).sum())
                    .collect();
                (equation, j, Arc::new(h))
            })
            .collect()
    }

    /// The column of an exact linear operator on one axis' displacement about the centre.
    pub fn operator_column(&self, axis: usize, operator: impl Fn(Complex64) -> Complex64) -> Column {
        self.operator_between([axis; 2], operator)
    }

    /// That of a force on `to` that is linear in the displacement along `of`.
    pub fn operator_between(&self, [to, of]: [usize; 2], operator: impl Fn(Complex64) -> Complex64) -> Column {
        let layout = &self.layout;
        let ends = (PAST_S * layout.time_s * layout.rate_hz).ceil() as usize;
        let trials: Vec<Vec<f64>> = self.x.iter().map(|trial| remembered(&trial[of], ends.min(layout.samples - 1), layout.rate_hz, &operator)).collect();
        let spectrum = layout.spectra(trials.iter().map(Vec::as_slice));
        let h = layout.sj.iter().map(|&s| operator(s)).collect();
        Column { parts: vec![(to, Arc::new(spectrum))], action: vec![(to, of, Arc::new(h))], through: Through::Motion, precision: 0.0 }
    }

    /// The column of entries of M, B or K.
    pub fn entries_column(&self, matrix: Matrix, entries: &[(usize, usize, f64)]) -> Column {
        let order = order_of(matrix);
        let h: Arc<Vec<Complex64>> = Arc::new(self.layout.sj.iter().map(|s| s.powi(order as i32)).collect());
        let scaled = |v: &Arc<Vec<Complex64>>, w: f64| if w == 1.0 { v.clone() } else { Arc::new(v.iter().map(|x| x * w).collect()) };
        Column {
            parts: entries.iter().map(|&(i, j, w)| (i, scaled(&self.kinematics[order][j], w))).collect(),
            action: entries.iter().map(|&(i, j, w)| (i, j, scaled(&h, w))).collect(),
            through: Through::Motion,
            precision: 0.0,
        }
    }
}

/// The derivative that a matrix multiplies.
pub(crate) fn order_of(matrix: Matrix) -> usize {
    match matrix {
        Matrix::Stiffness => 0,
        Matrix::Damping => 1,
        Matrix::Mass => 2,
    }
}

/// Samples at t + a + b t of those at t, `before` of which lie before the record.
fn lagging(samples: &[f64], layout: &Layout, before: usize, [a, b]: [f64; 2]) -> Vec<f64> {
    let at = |k: usize| {
        let time_s = layout.start_s + (k as f64 - before as f64) / layout.rate_hz;
        between(samples, k as f64 + layout.rate_hz * (a + b * time_s))
    };
    (0..samples.len()).map(at).collect()
}

fn apply(layout: &Layout, transform: &Transform, effort: &mut Tracks, motion: &mut Tracks, chain: &mut Chain) {
    let (n, knobs) = (layout.axes, transform.knobs.as_slice());
    match &transform.action {
        Action::Effort(operator) | Action::Mode { passes: operator, .. } => {
            for trial in effort.iter_mut() {
                for (axis, track) in trial.iter_mut().enumerate() {
                    if transform.axis.is_none_or(|a| a == axis) {
                        *track = layout.transformed(track, |s| operator(s, knobs));
                    }
                }
            }
            for (matrix, &s) in chain.effort.iter_mut().zip(&layout.sj) {
                for (k, entry) in matrix.iter_mut().enumerate() {
                    if transform.axis.is_none_or(|a| a == k / n) {
                        *entry *= operator(s, knobs);
                    }
                }
            }
        }
        Action::Motion(operator) => {
            let axes = transform.axis.map_or(0..n, |axis| axis..axis + 1);
            for track in motion.iter_mut().flat_map(|trial| &mut trial[axes.clone()]) {
                *track = layout.transformed(track, |s| operator(s, knobs));
            }
            for ((m, c), &s) in chain.motion.iter_mut().zip(&mut chain.series).zip(&layout.sj) {
                let factor = operator(s, knobs);
                m[axes.clone()].iter_mut().chain(&mut c[axes.clone()]).for_each(|value| *value *= factor);
            }
        }
        Action::Series(operator) => {
            for (trial, forces) in motion.iter_mut().zip(effort.iter()) {
                for (track, force) in trial.iter_mut().zip(forces) {
                    let stretch = layout.transformed(force, |s| operator(s, knobs));
                    track.spectrum.iter_mut().zip(&stretch.spectrum).for_each(|(x, y)| *x -= y);
                    track.start -= stretch.start;
                    track.slope_per_s -= stretch.slope_per_s;
                }
            }
            for (c, &s) in chain.series.iter_mut().zip(&layout.sj) {
                let stretch = operator(s, knobs);
                c.iter_mut().for_each(|value| *value += stretch);
            }
        }
        Action::Mix(matrix) => {
            let mix = matrix(knobs);
            for trial in effort.iter_mut() {
                let old = trial.clone();
                for (i, track) in trial.iter_mut().enumerate() {
                    let sum = |value: &dyn Fn(&Track) -> Complex64| old.iter().zip(&mix[i]).map(|(t, w)| value(t) * w).sum::<Complex64>();
                    track.spectrum = (0..track.spectrum.len()).map(|k| sum(&|t| t.spectrum[k])).collect();
                    track.start = sum(&|t| t.start.into()).re;
                    track.slope_per_s = sum(&|t| t.slope_per_s.into()).re;
                }
            }
            let dense: Vec<Complex64> = mix.iter().flatten().map(|&w| w.into()).collect();
            for matrix in &mut chain.effort {
                *matrix = square::product(&dense, matrix, n);
            }
        }
        Action::Lag => {
            for track in effort.iter_mut().flatten() {
                *track = layout.track_of_padded(lagging(&layout.whole(track), layout, layout.pad, [knobs[0], knobs[1]]));
            }
            let middle = knobs[0] + knobs[1] * (layout.start_s + 0.5 * layout.samples as f64 / layout.rate_hz);
            for (matrix, &s) in chain.effort.iter_mut().zip(&layout.sj) {
                matrix.iter_mut().for_each(|entry| *entry *= (s * middle).exp());
            }
        }
        Action::Clip => {
            for track in effort.iter_mut().flatten() {
                let level = knobs[0];
                let full = layout.whole(track);
                *track = layout.track_of_padded(full.into_iter().map(|f| f.clamp(-level, level)).collect());
            }
        }
        Action::Force { .. } | Action::Scheduled(_) | Action::Reflex(_) | Action::Curved(_) | Action::Entries { .. } => {}
    }
}
