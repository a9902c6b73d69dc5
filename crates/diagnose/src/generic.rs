//! A model without physics: is there more to explain than the named causes do?
//!
//! Powers, products, lags, loops and slow changes of the measured motion, all at once, on top of what was named. What they
//! gain on blocks that they were not fitted to is structure that nobody has named.

use crate::search::{Found, Stand};
use crate::state::{Cause, Column, State};
use crate::subject::Subject;
use crate::whittle::{Likelihood, Power, whitened_power};
use num_complex::Complex64;
use std::sync::Arc;

/// What a regressor is a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// The velocity some time ago: linear dynamics.
    Lag,
    /// The axis' own displacement.
    Spring,
    /// The axis' own velocity.
    Damper,
    /// Products of the axis' own displacement and velocity.
    Mixed,
    /// Loops of the axis' own displacement.
    Loop,
    /// Other axes, alone and in products with this one.
    Cross,
    /// Place in the trial.
    Time,
}

/// A regressor on the balance of one axis.
pub(crate) struct Feature {
    pub axis: usize,
    pub family: Family,
    pub column: Column,
}

/// Regressors by what they stand for.
pub(crate) struct Features {
    pub linear: Vec<Feature>,
    pub nonlinear: Vec<Feature>,
    pub varying: Vec<Feature>,
}

impl Features {
    pub fn each(&self) -> impl Iterator<Item = &Feature> {
        self.linear.iter().chain(&self.nonlinear).chain(&self.varying)
    }

    fn each_mut(&mut self) -> impl Iterator<Item = &mut Feature> {
        self.linear.iter_mut().chain(&mut self.nonlinear).chain(&mut self.varying)
    }

    pub fn all(&self) -> Vec<&Column> {
        self.each().map(|f| &f.column).collect()
    }
}

/// Fewer blocks than this cannot be split into fitted and held-out ones.
const FEWEST_BLOCKS: usize = 3;

/// What the generic model gains.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gate {
    /// Held-out log-likelihood that it adds to the named causes, and its standard error over folds.
    pub beyond: f64,
    pub beyond_error: f64,
    /// Held-out log-likelihood that the named causes add to the baseline.
    pub named: f64,
    /// Share of the final residual's whitened power that it removes.
    pub removed: f64,
    /// The same as a share of the effort's rms.
    pub size: f64,
    /// Power that it leaves, or the named causes where it gains nothing beyond chance.
    pub power: Power,
}

impl Gate {
    /// Whether it gains anything beyond chance.
    pub fn sure(&self) -> bool {
        self.beyond > 2.0 * self.beyond_error
    }
}

/// Shares of the baseline's residual.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shares {
    pub linear: f64,
    pub nonlinear: f64,
    pub varying: f64,
    pub noise: f64,
}

fn loops(x: impl Iterator<Item = f64>, width: f64) -> Vec<f64> {
    // A play operator: rate-independent and exact for any step.
    let mut z: f64 = 0.0;
    let mut last = None;
    x.map(|x| {
        let dx = x - last.unwrap_or(x);
        last = Some(x);
        z = (z + dx).clamp(-width, width);
        z
    })
    .collect()
}

/// A force from all displacements, all velocities and the place in the trial.
type Moving<'a> = &'a dyn Fn(&[f64], &[f64], f64) -> f64;

/// A force from displacement and velocity over their standard deviations.
type Shape = Box<dyn Fn(f64, f64) -> f64>;

/// What a static force of one axis may look like.
fn shapes() -> Vec<(Family, Shape)> {
    use Family::{Damper, Mixed, Spring};
    let mut shapes: Vec<(Family, Shape)> = vec![
        (Spring, Box::new(|x, _| x * x)),
        (Spring, Box::new(|x, _| x * x * x)),
        (Spring, Box::new(|x, _| x.abs())),
        (Spring, Box::new(|x, _| x * x.abs())),
        (Damper, Box::new(|_, v| v * v)),
        (Damper, Box::new(|_, v| v * v.abs())),
        (Damper, Box::new(|_, v| v * v * v)),
        (Mixed, Box::new(|x, v| x * v)),
        (Mixed, Box::new(|x, v| x * x * v)),
        (Mixed, Box::new(|x, v| x * v * v)),
        (Damper, Box::new(|_, v| (v / 0.05).tanh())),
        (Damper, Box::new(|_, v| (v / 0.4).tanh())),
    ];
    for width in [1.0, 0.75, 0.6, 0.5, 0.4] {
        let w = std::f64::consts::PI / width;
        shapes.push((Spring, Box::new(move |x, _| (w * x).sin())));
        shapes.push((Spring, Box::new(move |x, _| (w * x).cos())));
    }
    shapes
}

/// The generic regressors of a stand, whose priors expect that together they make as much as it leaves: many that are alike would else cancel each
/// other within the motion that they are fitted to, and explode beyond it.
pub(crate) fn features(subject: &Subject, stand: &Stand) -> Features {
    features_along(subject, stand, &stand.state)
}

/// The same along another motion than the measured one.
fn features_along(subject: &Subject, stand: &Stand, state: &State) -> Features {
    let mut features = shapes_of(subject, state);
    let count = features.each().count() as f64 / subject.layout.axes as f64;
    for feature in features.each_mut() {
        let of_part = |(i, part): &(usize, Arc<Vec<Complex64>>)| {
            let power = &stand.fit.power[*i];
            part.iter().enumerate().map(|(q, p)| p.norm_sqr() / power[q % power.len()]).sum::<f64>() / part.len() as f64
        };
        feature.column.precision = count * feature.column.parts.iter().map(of_part).sum::<f64>();
    }
    features
}

fn shapes_of(subject: &Subject, state: &State) -> Features {
    let layout = &state.layout;
    let n = layout.axes;
    let scale = &subject.scale;
    let mut out = Features { linear: vec![], nonlinear: vec![], varying: vec![] };
    let series = |i: usize, f: Moving| -> Column {
        let forces = (0..layout.trials)
            .map(|trial| {
                (0..n)
                    .map(|q| {
                        if q != i {
                            return vec![0.0; layout.samples];
                        }
                        let (x, v) = (&state.law_x[trial], &state.law_v[trial]);
                        (0..layout.samples).map(|k| f(&x[k * n..(k + 1) * n], &v[k * n..(k + 1) * n], k as f64 / layout.samples as f64 - 0.5)).collect()
                    })
                    .collect()
            })
            .collect();
        state.force_column(&forces, None, Some(i))
    };
    for i in 0..n {
        let (sx, sv) = (scale.position[i].max(f64::MIN_POSITIVE), scale.velocity[i].max(f64::MIN_POSITIVE));
        let unit = layout.time_s;
        for lag in [-0.02, 0.02, 0.05, 0.1, 0.2] {
            out.linear.push(Feature { axis: i, family: Family::Lag, column: state.operator_between([i, i], |s| s * (-s * lag * unit).exp()) });
        }
        // What one axis does to another and is not done back, which no symmetric matrix has.
        for (j, lag) in (0..n).filter(|j| *j != i && subject.structure.is_symmetric()).flat_map(|j| [-0.02, 0.05].map(|lag| (j, lag))) {
            out.linear.push(Feature { axis: i, family: Family::Lag, column: state.operator_between([i, j], |s| s * (-s * lag * unit).exp()) });
        }
        for (family, shape) in &shapes() {
            out.nonlinear.push(Feature { axis: i, family: *family, column: series(i, &|x, v, _| shape(x[i] / sx, v[i] / sv)) });
        }
        for width in [0.1, 0.3, 0.8] {
            let forces = (0..layout.trials)
                .map(|trial| (0..n).map(|q| if q == i { loops(state.x[trial][i].iter().copied(), width * sx) } else { vec![0.0; layout.samples] }).collect())
                .collect();
            out.nonlinear.push(Feature { axis: i, family: Family::Loop, column: state.force_column(&forces, None, Some(i)) });
        }
        if n <= 3 {
            for j in (0..n).filter(|j| *j != i) {
                let (sy, su) = (scale.position[j].max(f64::MIN_POSITIVE), scale.velocity[j].max(f64::MIN_POSITIVE));
                type Cross<'a> = &'a dyn Fn(f64, f64, f64, f64) -> f64;
                let cross: [Cross; 8] = [
                    &|x, _, y, _| x * y,
                    &|_, _, y, _| y * y,
                    &|_, _, y, _| y * y * y,
                    &|x, _, y, _| x * x * y,
                    &|x, _, y, _| x * y * y,
                    &|x, _, _, u| u * x,
                    &|_, v, y, _| v * y,
                    &|_, _, _, u| (u / 0.05).tanh(),
                ];
                for f in cross {
                    let column = series(i, &|x, v, _| f(x[i] / sx, v[i] / sv, x[j] / sy, v[j] / su));
                    out.nonlinear.push(Feature { axis: i, family: Family::Cross, column });
                }
            }
        }
        let changes: [Moving; 3] = [&|x, _, t| t * x[i] / sx, &|_, v, t| t * v[i] / sv, &|x, _, t| t * t * x[i] / sx];
        out.varying.extend(changes.map(|f| Feature { axis: i, family: Family::Time, column: series(i, f) }));
        // A force that follows time answers no motion: it would else buy likelihood from the determinant, against an offset.
        if subject.structure.integrals == 0 {
            let time = Column { action: vec![], ..series(i, &|_, _, t| t) };
            out.varying.push(Feature { axis: i, family: Family::Time, column: time });
        }
    }
    out
}

/// The generic regressors along the motion that follows from the efforts alone, where these move what brings itself back. Between strong efforts a limb
/// moves by its own noise, which a function of the measured motion foretells: less of a damper where it is slow is what made it move.
fn driven(subject: &Subject, found: &Found) -> Option<Features> {
    let state = &found.stand.state;
    if matches!(subject.cause, Cause::Motion) || !subject.restores(&found.chosen, &found.stand, subject.scale.integrals) {
        return None;
    }
    let runner = subject.runner(&found.chosen, &found.stand);
    let trial = |trial: usize| {
        let run = runner.over_trial(state, trial)?;
        let of_axis = |(i, centre): (usize, &f64)| run.x.iter().skip(i).step_by(subject.layout.axes).map(|x| x + centre).collect::<Vec<f64>>();
        let places: Vec<Vec<f64>> = state.centre.iter().enumerate().map(of_axis).collect();
        places.iter().flatten().all(|x| x.is_finite()).then_some(places)
    };
    let places: Vec<Vec<Vec<f64>>> = (0..subject.layout.trials).map(trial).collect::<Option<_>>()?;
    let tracks = places.iter().map(|trial| trial.iter().map(|x| subject.layout.track_of(x)).collect()).collect();
    let mut features = features_along(subject, &found.stand, &State::new(&state.layout, &state.effort, &tracks, &state.centre, &[]));
    // What is known without the measured motion changes nothing of how that follows from a force.
    for feature in features.each_mut() {
        feature.column.action.clear();
    }
    Some(features)
}

/// Groups of blocks that are left out in turn: trials, or stretches of the only one.
fn folds(subject: &Subject) -> Vec<Vec<usize>> {
    let blocks = subject.layout.blocks();
    if subject.layout.trials > 1 {
        return (0..subject.layout.trials).map(|t| (0..blocks).filter(|b| subject.layout.trial_of(*b) == t).collect()).collect();
    }
    let parts = blocks.min(5);
    (0..parts).map(|p| (p * blocks / parts..(p + 1) * blocks / parts).collect()).collect()
}

/// Minus log-likelihood of each fold under a model fitted to the others.
pub(crate) fn held_out(subject: &Subject, stand: &Stand, extra: &[&Column]) -> Option<Vec<f64>> {
    let columns: Vec<&Column> = stand.columns().chain(extra.iter().copied()).collect();
    let free: Vec<usize> = stand.base.roles.iter().enumerate().filter(|(_, role)| role.of_a_trial()).map(|(k, _)| k).collect();
    let blocks = subject.layout.blocks();
    if blocks < FEWEST_BLOCKS {
        return None;
    }
    folds(subject)
        .iter()
        .map(|fold| {
            let rest: Vec<usize> = (0..blocks).filter(|b| !fold.contains(b)).collect();
            let likelihood = Likelihood { state: &stand.state, cause: &subject.cause, held: &stand.base.held, blocks: Some(&rest) };
            let fit = likelihood.fit(&columns, &stand.fit.power, 2, true)?;
            likelihood.score(&columns, &fit, &free, fold)
        })
        .collect()
}

/// What one model gains of held-out log-likelihood over another, and the standard error of that over folds.
fn gained(before: &[f64], after: &[f64]) -> (f64, f64) {
    let gains: Vec<f64> = before.iter().zip(after).map(|(b, a)| b - a).collect();
    let (sum, count) = (gains.iter().sum::<f64>(), gains.len() as f64);
    let squares: f64 = gains.iter().map(|g| (g - sum / count).powi(2)).sum();
    (sum, (squares / (count - 1.0).max(1.0) * count).sqrt())
}

/// Gains of the named causes over the baseline, and of the generic model over them.
pub(crate) fn gate(subject: &Subject, baseline: &Stand, found: &Found, features: &Features) -> Gate {
    let all = features.all();
    let stand = &found.stand;
    let columns: Vec<&Column> = stand.columns().chain(all.iter().copied()).collect();
    let Some(full) = Likelihood::new(&stand.state, &subject.cause, &stand.base.held).fit(&columns, &stand.fit.power, 2, true) else {
        return Gate { power: stand.fit.power.clone(), ..Gate::default() };
    };
    let (before, after) = (whitened_power(&stand.fit.residual, &stand.fit.power), whitened_power(&full.residual, &stand.fit.power));
    let mut gate =
        Gate { removed: (1.0 - after / before).max(0.0), size: size(stand, &stand.fit.residual, &full.residual), power: full.power.clone(), ..Gate::default() };
    if let (Some(base), Some(named), Some(generic)) = (held_out(subject, baseline, &[]), held_out(subject, stand, &[]), held_out(subject, stand, &all)) {
        gate.named = base.iter().zip(&named).map(|(b, n)| b - n).sum();
        (gate.beyond, gate.beyond_error) = gained(&named, &generic);
        if gate.sure() {
            let along = driven(subject, found).and_then(|features| held_out(subject, stand, &features.all()));
            let (beyond, beyond_error) = along.map_or((gate.beyond, gate.beyond_error), |along| gained(&named, &along));
            if beyond <= 0.0 {
                gate = Gate { named: gate.named, beyond, beyond_error, power: stand.fit.power.clone(), ..Gate::default() };
            }
        } else {
            // What it takes off the part that it was fitted to may be noise.
            gate.power = stand.fit.power.clone();
        }
    } else {
        // Too few blocks to hold any back: the gain less its price.
        gate.beyond = full.log_likelihood - stand.fit.log_likelihood - subject.price(all.len());
        gate.named = stand.fit.log_likelihood - baseline.fit.log_likelihood;
    }
    gate
}

/// Root of the power that one residual has and another lacks, as a share of the effort's, on the equation where it is largest.
pub(crate) fn size(stand: &Stand, before: &[Vec<Complex64>], after: &[Vec<Complex64>]) -> f64 {
    let power = |v: &[Complex64]| v.iter().map(Complex64::norm_sqr).sum::<f64>();
    before
        .iter()
        .zip(after)
        .zip(&stand.state.effort_spectra)
        .map(|((b, a), f)| ((power(b) - power(a)).max(0.0) / power(f).max(f64::MIN_POSITIVE)).sqrt())
        .fold(0.0, f64::max)
}

/// How the baseline's residual splits, whitened by its own power.
pub(crate) fn shares(subject: &Subject, baseline: &Stand, features: &Features) -> Shares {
    let level = whitened_power(&baseline.fit.residual, &baseline.fit.power);
    let left = |extra: &[&Column]| -> Option<f64> {
        let columns: Vec<&Column> = baseline.base.columns.iter().chain(extra.iter().copied()).collect();
        let fit = Likelihood::new(&baseline.state, &subject.cause, &baseline.base.held).fit(&columns, &baseline.fit.power, 1, true)?;
        Some((whitened_power(&fit.residual, &baseline.fit.power) / level).min(1.0))
    };
    let linear: Vec<&Column> = features.linear.iter().map(|f| &f.column).collect();
    let nonlinear: Vec<&Column> = features.linear.iter().chain(&features.nonlinear).map(|f| &f.column).collect();
    let a = left(&linear).unwrap_or(1.0);
    let b = left(&nonlinear).unwrap_or(a).min(a);
    let c = left(&features.all()).unwrap_or(b).min(b);
    Shares { linear: 1.0 - a, nonlinear: a - b, varying: b - c, noise: c }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{baseline, known, linear};
    use ndof_challenge::Plant;

    /// Where nothing is hidden, a number costs about one of log-likelihood in a trial that it was not fitted to; in one that moves three times as far a cube
    /// is 27 times as large, and costs 27² times as much. Regressors that cancel each other in one trial explode in the other.
    #[test]
    fn what_is_alike_does_not_explode_where_a_trial_moves_farther() {
        for seed in [81, 82, 83] {
            let mut made = linear(Plant::Force, (2, 40.0), seed);
            for name in made.recordings[1].names() {
                made.recordings[1].map_channel(&name, |v| 3.0 * v).expect("a channel");
            }
            let (samples, meaning) = known(&made, &made.recordings);
            let (subject, stand) = baseline(&samples, &meaning);
            let features = features(&subject, &stand);
            let held = |extra: &[&Column]| held_out(&subject, &stand, extra).expect("two trials").iter().sum::<f64>();
            let cost = |columns: &[&Column]| held(columns) - held(&[]);
            let bound = 27.0 * 27.0 * features.each().count() as f64;
            let mut free: Vec<Column> = features.all().into_iter().cloned().collect();
            free.iter_mut().for_each(|column| column.precision = 0.0);
            let [lost, without] = [cost(&features.all()), cost(&free.iter().collect::<Vec<_>>())];
            assert!(lost < bound && without > 100.0 * bound, "{seed}: {lost}, {without} without a prior");
        }
    }
}
