//! All torques that may be lacking, side by side in one band, and what products of them say.

use crate::band::Band;
use crate::causes::Form;
use crate::column::Column;
use crate::deflection::Gear;
use crate::dynamics::each_sample;
use crate::logged::Logged;
use crate::motion::Motion;
use crate::noise::Whitener;
use crate::scene::Scene;
use ndarray::{Array1, Array2};
use ndof_devices::TERMS_OF_A_LINK;
use ndof_signal::smoothing_edge;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One stretch of a log in which something is compared: samples of the log, by trial.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    pub trial: usize,
    pub places: Vec<usize>,
}

/// Columns over pieces, joint by joint: `[piece][joint]`, absent where a joint does not feel it.
#[derive(Clone, Debug)]
pub(crate) struct Series(pub Vec<Vec<Option<Vec<f64>>>>);

impl Series {
    pub fn whitened(&self, noise: &[Whitener]) -> Series {
        let joint = |(x, w): (&Option<Vec<f64>>, &Whitener)| x.as_ref().map(|x| w.apply(x));
        Series(self.0.iter().map(|piece| piece.iter().zip(noise).map(joint).collect()).collect())
    }

    /// Whether a joint feels both.
    pub fn shares_a_joint_with(&self, other: &Series) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a.iter().zip(b).any(|(a, b)| a.is_some() && b.is_some()))
    }

    /// Σ over all joints and samples of the product with another.
    pub fn dot(&self, other: &Series) -> f64 {
        let joint = |(a, b): (&Option<Vec<f64>>, &Option<Vec<f64>>)| match (a, b) {
            (Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| a * b).sum(),
            _ => 0.0,
        };
        self.0.iter().zip(&other.0).map(|(a, b)| a.iter().zip(b).map(joint).sum::<f64>()).sum()
    }

    /// Adds a multiple of another to what each joint has.
    pub fn add(&mut self, factor: f64, other: &Series) {
        for (own, other) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            if let (Some(own), Some(other)) = (own, other) {
                own.iter_mut().zip(other).for_each(|(x, y)| *x += factor * y);
            }
        }
    }

    /// Samples of a joint, piece after piece.
    pub fn of_joint(&self, j: usize) -> Vec<f64> {
        self.0.iter().filter_map(|piece| piece[j].as_deref()).flatten().copied().collect()
    }

    /// Samples of all joints.
    pub fn count(&self) -> usize {
        self.0.iter().flatten().flatten().map(Vec::len).sum()
    }
}

/// What is compared where: a scene with the motion of its trials, in one band, and the noise that it is compared in.
pub(crate) struct View<'a> {
    pub scene: &'a Scene<'a>,
    pub motions: &'a [Motion],
    pub band: &'a Band,
    pub pieces: Vec<Piece>,
    pub noise: Vec<Whitener>,
    kept: Mutex<Kept>,
    whole: &'a Mutex<Whole>,
}

/// What was asked for before.
#[derive(Default)]
pub(crate) struct Kept {
    columns: Vec<(Column, Arc<Series>)>,
    white: Vec<(Column, Arc<Series>)>,
    file: Option<Arc<Series>>,
    /// Logs that were corrected last, and what is missing of them.
    missing: VecDeque<(Logged, Arc<Series>)>,
    /// Gears that a search began with, and where they settled last.
    pub settled: Vec<(Gear, Gear)>,
    /// Where the slopes of each joint's gear were made last.
    pub slopes: Vec<Slopes>,
}

/// Logs that are kept corrected: a model and its like without one of its forms are asked in turns.
const LOGS: usize = 8;

/// A gear, the columns that hang on it, and the changes of all torques with both.
pub(crate) type Slopes = (Gear, Vec<Column>, Arc<Vec<Series>>);

/// Joints, and what each feels at every sample.
pub(crate) type Felt = Vec<(usize, Vec<f64>)>;

/// What joints feel of columns, by column and trial.
type Whole = Vec<(Column, usize, Arc<Felt>)>;

impl<'a> View<'a> {
    /// The stretch from one time to another of each of these trials, in samples of the log.
    pub fn new(scene: &'a Scene<'a>, motions: &'a [Motion], band: &'a Band, whole: &'a Mutex<Whole>, stretches: &[(usize, std::ops::Range<usize>)]) -> Self {
        let margin = smoothing_edge(scene.lowest_hz(), scene.rate_hz);
        let pieces = stretches
            .iter()
            .map(|(trial, range)| {
                let places = band.places(motions[*trial].q[0].len(), margin).into_iter().filter(|p| range.contains(p)).collect();
                Piece { trial: *trial, places }
            })
            .collect();
        let noise = scene.joints.iter().map(|j| Whitener::plain(j.torque)).collect();
        View { scene, motions, band, pieces, noise, kept: Mutex::default(), whole }
    }

    pub fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same view in other noise.
    pub fn in_noise(self, noise: Vec<Whitener>) -> Self {
        self.kept().white.clear();
        View { noise, ..self }
    }

    /// Torques that these columns need for each unit of them.
    pub fn series(&self, columns: &[Column]) -> Vec<Arc<Series>> {
        let new: Vec<Column> = {
            let kept = self.kept();
            columns.iter().filter(|c| !kept.columns.iter().any(|(k, _)| k == *c)).cloned().collect()
        };
        let found = self.compute(&new);
        let mut kept = self.kept();
        kept.columns.extend(new.into_iter().zip(found.into_iter().map(Arc::new)));
        columns.iter().filter_map(|c| Some(kept.columns.iter().find(|(k, _)| k == c)?.1.clone())).collect()
    }

    /// What joints feel of a column at every sample of a trial; kept, but for gravities, which are sums of three. Zeros move on, and the last are kept.
    pub fn along(&self, column: &Column, trial: usize) -> Arc<Felt> {
        let uprights = [0, 1, 2].map(Column::upright);
        if let Some(gravity) = column.gravity(self.scene.chain.gravity()).filter(|_| !uprights.contains(column)) {
            let mut sum: Felt = (0..self.scene.joints.len()).map(|joint| (joint, vec![0.0; self.motions[trial].q[joint].len()])).collect();
            for (axis, times) in uprights.iter().zip(gravity).filter(|(_, times)| *times != 0.0) {
                for ((_, sum), (_, felt)) in sum.iter_mut().zip(self.along(axis, trial).iter()) {
                    sum.iter_mut().zip(felt).for_each(|(sum, felt)| *sum += times * felt);
                }
            }
            return Arc::new(sum);
        }
        let whole = || self.whole.lock().unwrap_or_else(PoisonError::into_inner);
        let known = whole().iter().find(|(own, t, _)| *t == trial && own == column).map(|(.., felt)| felt.clone());
        known.unwrap_or_else(|| {
            let felt = Arc::new(column.along(&self.motions[trial], self.scene));
            let (mut whole, moves_on) = (whole(), |(own, ..): &(Column, usize, Arc<Felt>)| matches!(own, Column::Zeros(_)));
            if matches!(column, Column::Zeros(_)) && whole.iter().filter(|kept| moves_on(kept)).count() >= LOGS * self.motions.len() {
                let oldest = whole.iter().position(moves_on);
                oldest.map(|oldest| whole.remove(oldest));
            }
            whole.push((column.clone(), trial, felt.clone()));
            felt
        })
    }

    /// The same, whitened.
    pub fn white(&self, columns: &[Column]) -> Vec<Arc<Series>> {
        let series = self.series(columns);
        let mut kept = self.kept();
        columns
            .iter()
            .zip(series)
            .map(|(column, series)| {
                if let Some((_, white)) = kept.white.iter().find(|(k, _)| k == column) {
                    return white.clone();
                }
                let white = Arc::new(series.whitened(&self.noise));
                kept.white.push((column.clone(), white.clone()));
                white
            })
            .collect()
    }

    /// A joint's torque in the band, while it moves.
    fn seen(&self, piece: &Piece, joint: usize, kernel: &[f64], x: &[f64]) -> Vec<f64> {
        let moves = &self.motions[piece.trial].moves[joint];
        if moves.iter().all(|m| *m) {
            return self.band.apply(kernel, x, &piece.places);
        }
        let moving: Vec<f64> = x.iter().zip(moves).map(|(x, m)| if *m { *x } else { 0.0 }).collect();
        self.band.apply(kernel, &moving, &piece.places)
    }

    /// The logged torque so many samples later, as it is seen. Where the joint rests now and then, what counts is when it moves, not when the torque was
    /// logged: it is brought to its time first.
    fn taken_later(&self, piece: &Piece, joint: usize, samples: f64) -> Vec<f64> {
        let motion = &self.motions[piece.trial];
        if samples == 0.0 || motion.moves[joint].iter().all(|m| *m) {
            return self.seen(piece, joint, &self.band.kernel(samples), &motion.torque[joint]);
        }
        self.seen(piece, joint, &self.band.kernel(0.0), &later(&motion.torque[joint], samples))
    }

    /// Samples in which a joint moves: those that say something of it.
    pub fn moved(&self, joint: usize) -> usize {
        self.pieces.iter().map(|p| p.places.iter().filter(|k| self.motions[p.trial].moves[joint][**k]).count()).sum()
    }

    /// Their share of all.
    pub fn moving(&self, joint: usize) -> f64 {
        let count: usize = self.pieces.iter().map(|p| p.places.len()).sum();
        (self.moved(joint).max(1) as f64 / count.max(1) as f64).min(1.0)
    }

    /// Torques of columns that are asked for once.
    pub fn compute(&self, columns: &[Column]) -> Vec<Series> {
        let kernel = self.band.kernel(0.0);
        // One pass over the regressor serves all combinations of a body's parameters.
        let bodies = if columns.iter().filter(|c| matches!(c, Column::Body { .. })).count() > 2 { self.bodies(&kernel) } else { vec![] };
        columns
            .par_iter()
            .map(|column| {
                if let (Column::Body { link, parts }, false) = (column, bodies.is_empty()) {
                    return combined(&bodies[*link], parts);
                }
                // What a search asks of a gear both stretches ask, and it is dear; so are weight and zeros.
                let searched = matches!(column, Column::Gear(gear) if gear.is_searched());
                let both = searched || matches!(column, Column::Zeros(_)) || column.gravity(self.scene.chain.gravity()).is_some();
                let of = |motion: &Motion| if both { self.along(column, motion.trial) } else { Arc::new(column.along(motion, self.scene)) };
                let felt = self.by_trial(of);
                self.in_band(|trial| felt[trial].iter().flat_map(|felt| felt.iter()))
            })
            .collect()
    }

    /// Several torques that are computed together along a motion, each as what joints feel of it.
    pub fn together(&self, count: usize, felt: impl Fn(&Motion) -> Vec<Felt>) -> Vec<Series> {
        let felt = self.by_trial(felt);
        (0..count).into_par_iter().map(|k| self.in_band(|trial| felt[trial].iter().flat_map(move |felt| felt[k].iter()))).collect()
    }

    /// Of each trial of which there is a piece.
    fn by_trial<T>(&self, of: impl Fn(&Motion) -> T) -> Vec<Option<T>> {
        self.motions.iter().map(|motion| self.pieces.iter().any(|p| p.trial == motion.trial).then(|| of(motion))).collect()
    }

    /// What joints feel by trial, in the band.
    fn in_band<'b, I: Iterator<Item = &'b (usize, Vec<f64>)>>(&self, felt: impl Fn(usize) -> I) -> Series {
        let kernel = self.band.kernel(0.0);
        let piece = |piece: &Piece| {
            let mut joints = vec![None; self.scene.joints.len()];
            felt(piece.trial).for_each(|(joint, x)| joints[*joint] = Some(self.seen(piece, *joint, &kernel, x)));
            joints
        };
        Series(self.pieces.iter().map(piece).collect())
    }

    /// What each inertial parameter of each body needs, `[link][term]`.
    fn bodies(&self, kernel: &[f64]) -> Vec<Vec<Series>> {
        let (n, chain) = (self.scene.joints.len(), self.scene.chain);
        let empty = Series(self.pieces.iter().map(|_| vec![None; n]).collect());
        let mut out = vec![vec![empty; TERMS_OF_A_LINK]; n];
        let width = TERMS_OF_A_LINK * n;
        for (trial, motion) in self.motions.iter().enumerate().filter(|(t, _)| self.pieces.iter().any(|p| p.trial == *t)) {
            let all = each_sample(motion, n * width, |q, v, a, out| {
                let y = chain.regressor(q, v, a);
                out.iter_mut().enumerate().for_each(|(k, out)| *out = y[[k / width, k % width]]);
            });
            let felt: Vec<(usize, usize)> = (0..n * width).map(|k| (k / width, k % width)).filter(|(joint, c)| *joint <= c / TERMS_OF_A_LINK).collect();
            for (p, piece) in self.pieces.iter().enumerate().filter(|(_, piece)| piece.trial == trial) {
                let found: Vec<Vec<f64>> = felt.par_iter().map(|(joint, c)| self.seen(piece, *joint, kernel, &all[joint * width + c])).collect();
                for ((joint, c), x) in felt.iter().zip(found) {
                    out[c / TERMS_OF_A_LINK][c % TERMS_OF_A_LINK].0[p][*joint] = Some(x);
                }
            }
        }
        out
    }

    /// Logged torques, delays and gains taken off, less what the file says of the corrected motion.
    pub fn missing(&self, logged: &Logged) -> Arc<Series> {
        let known = self.kept().missing.iter().find(|(own, _)| own == logged).map(|(_, missing)| missing.clone());
        known.unwrap_or_else(|| {
            let missing = Arc::new(self.find_missing(logged));
            let mut kept = self.kept();
            kept.missing.truncate(LOGS - 1);
            kept.missing.push_front((logged.clone(), missing.clone()));
            missing
        })
    }

    fn find_missing(&self, logged: &Logged) -> Series {
        let (factors, columns): (Vec<f64>, Vec<Column>) = logged.columns(self.scene).into_iter().unzip();
        let mut file = self.file();
        if !columns.is_empty() {
            let mut sum = file.as_ref().clone();
            self.series(&columns).iter().zip(factors).for_each(|(felt, factor)| sum.add(factor, felt));
            file = Arc::new(sum);
        }
        let piece = |(piece, file): (&Piece, &Vec<Option<Vec<f64>>>)| {
            (0..self.scene.joints.len())
                .map(|j| {
                    let torque = self.taken_later(piece, j, logged.late_s[j] * self.scene.rate_hz);
                    Some(torque.iter().zip(file[j].as_ref()?).map(|(a, b)| a / logged.gain_of(j) - b).collect())
                })
                .collect()
        };
        Series(self.pieces.iter().zip(&file.0).map(piece).collect())
    }

    /// Torques of all that the file says.
    fn file(&self) -> Arc<Series> {
        let known = self.kept().file.clone();
        known.unwrap_or_else(|| {
            let kernel = self.band.kernel(0.0);
            let nominal: Vec<Vec<Vec<f64>>> = self.motions.iter().map(|m| self.scene.nominal(m)).collect();
            let piece = |p: &Piece| nominal[p.trial].iter().enumerate().map(|(j, x)| Some(self.seen(p, j, &kernel, x))).collect();
            let file = Arc::new(Series(self.pieces.iter().map(piece).collect()));
            self.kept().file = Some(file.clone());
            file
        })
    }
}

/// A series as it is so many samples later, by the cubic through four samples: what a low-pass keeps, it keeps.
pub(crate) fn later(x: &[f64], samples: f64) -> Vec<f64> {
    let last = x.len() as isize - 1;
    (0..x.len())
        .map(|k| {
            let at = k as f64 + samples;
            let (i, u) = (at.floor(), at - at.floor());
            let value = |by: isize| x[(i as isize + by).clamp(0, last) as usize];
            let weights =
                [-u * (u - 1.0) * (u - 2.0) / 6.0, (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0, -(u + 1.0) * u * (u - 2.0) / 2.0, (u + 1.0) * u * (u - 1.0) / 6.0];
            (-1..=2).zip(weights).map(|(by, w)| w * value(by)).sum()
        })
        .collect()
}

/// Of the largest term of a body, what is left of a combination that cancels: directions in files have ten digits at most.
const ROUND_OFF: f64 = 1e-10;

/// A combination of the torques of one body's parameters; nothing at all where they cancel.
fn combined(terms: &[Series], parts: &[f64]) -> Series {
    let mut sum = terms[0].clone();
    sum.add(parts[0] - 1.0, &terms[0]);
    terms.iter().zip(parts).skip(1).filter(|(_, part)| **part != 0.0).for_each(|(term, part)| sum.add(*part, term));
    let largest = |series: &Series| series.0.iter().flatten().flatten().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    if largest(&sum) <= ROUND_OFF * terms.iter().map(largest).fold(0.0, f64::max) {
        sum.0.iter_mut().flatten().flatten().flatten().for_each(|x| *x = 0.0);
    }
    sum
}

/// Whitened columns of all forms and their products.
pub(crate) struct Table {
    /// For each form, where its columns stand.
    pub columns: Vec<Vec<usize>>,
    /// Products of all columns.
    pub gram: Array2<f64>,
    /// Products with what is missing.
    pub right: Array1<f64>,
    /// Of what is missing with itself.
    pub total: f64,
    /// Whitened samples of all joints.
    pub samples: usize,
}

impl Table {
    /// Distinct columns of forms; each form's place in them.
    pub fn distinct(forms: &[Form]) -> (Vec<Column>, Vec<Vec<usize>>) {
        let mut distinct: Vec<Column> = Vec::new();
        let places = forms
            .iter()
            .map(|form| {
                form.columns
                    .iter()
                    .map(|c| {
                        distinct.iter().position(|d| d == c).unwrap_or_else(|| {
                            distinct.push(c.clone());
                            distinct.len() - 1
                        })
                    })
                    .collect()
            })
            .collect();
        (distinct, places)
    }

    pub fn new(columns: Vec<Vec<usize>>, series: &[Arc<Series>], missing: &Series) -> Self {
        let c = series.len();
        let (pieces, joints) = (missing.0.len(), missing.0.first().map_or(0, Vec::len));
        let mut gram = Array2::zeros((c, c));
        let mut right = Array1::zeros(c);
        for joint in 0..joints {
            let felt: Vec<usize> = (0..c).filter(|k| series[*k].0.iter().any(|p| p[joint].is_some())).collect();
            for piece in 0..pieces {
                let Some(y) = &missing.0[piece][joint] else { continue };
                let rows = Array2::from_shape_fn((felt.len(), y.len()), |(k, i)| series[felt[k]].0[piece][joint].as_ref().map_or(0.0, |x| x[i]));
                let own = rows.dot(&rows.t());
                let with = rows.dot(&Array1::from(y.clone()));
                for (a, &i) in felt.iter().enumerate() {
                    right[i] += with[a];
                    for (b, &j) in felt.iter().enumerate() {
                        gram[[i, j]] += own[[a, b]];
                    }
                }
            }
        }
        Table { columns, gram, right, total: missing.dot(missing), samples: missing.count() }
    }

    /// The table with columns more than those of `series`.
    pub fn beside(&self, series: &[Arc<Series>], more: &[Series], missing: &Series) -> Table {
        let (c, m) = (series.len(), more.len());
        let (mut gram, mut right) = (Array2::zeros((c + m, c + m)), Array1::zeros(c + m));
        for i in 0..c {
            right[i] = self.right[i];
            (0..c).for_each(|j| gram[[i, j]] = self.gram[[i, j]]);
        }
        for (i, own) in more.iter().enumerate() {
            right[c + i] = own.dot(missing);
            for (k, other) in series.iter().map(|s| s.as_ref()).chain(more).enumerate() {
                let product = own.dot(other);
                gram[[c + i, k]] = product;
                gram[[k, c + i]] = product;
            }
        }
        Table { columns: vec![], gram, right, total: self.total, samples: self.samples }
    }
}
