//! A set of trials made ready for a search.

use crate::band;
use crate::baseline::Baseline;
use crate::hypotheses::Hypothesis;
use crate::layout::Layout;
use crate::linear_fit::LinearFit;
use crate::movement::mean_over;
use crate::plant::{Base, Role, Structure};
use crate::robot;
use crate::samples::{Meaning, Samples};
use crate::search::{Chosen, ENOUGH, Stand};
use crate::state::{Cause, Column, State, Tracks};
use crate::whittle::{Fit, Likelihood, Power, whitened_power};
use crate::{DiagnoseError, KnownArm, Options};
use ndof_models::effects::{CurvedArm, Matrix, Scale};
use ndof_signal::Amplitudes;
use std::sync::Arc;

/// Share of the effort's power that a linear robot may leave unexplained and still be believed.
const ROBOT_REST: f64 = 0.5;

/// Below this share of the effort's power between reference and effort there is no robot, only a late or filtered channel.
const ROBOT_PART: f64 = 0.05;

/// Trials, the grid that they are seen on, and what may be tried on them.
pub(crate) struct Subject {
    pub layout: Arc<Layout>,
    pub effort: Tracks,
    pub motion: Tracks,
    /// What was commanded; no channel where nothing was.
    pub reference: Tracks,
    pub centre: Vec<f64>,
    pub cause: Cause,
    /// Where the linear model runs away, what is recorded of where the motion comes from all the same.
    pub recorded: Option<Cause>,
    pub structure: Structure,
    pub scale: Scale,
    pub hypotheses: Vec<Hypothesis>,
    /// Power of the residual of the baseline.
    pub start: Power,
    /// Share of the effort's rms that inertia, damping and stiffness make with the sign that they should have, less the rest.
    pub polarity: f64,
}

fn std(series: &[Vec<Vec<f64>>], axis: usize) -> (f64, f64) {
    let n: usize = series.iter().map(|t| t[axis].len()).sum();
    let mean = series.iter().flat_map(|t| &t[axis]).sum::<f64>() / n as f64;
    let spread = series.iter().map(|t| {
        let own = t[axis].iter().sum::<f64>() / t[axis].len() as f64;
        t[axis].iter().map(|x| (x - own).powi(2)).sum::<f64>()
    });
    (mean, (spread.sum::<f64>() / n as f64).sqrt())
}

/// How far from the mean of its trial a series goes, but for seven of a hundred samples.
fn far(series: &[Vec<Vec<f64>>], axis: usize) -> f64 {
    let ways = |t: &Vec<Vec<f64>>| {
        let own = t[axis].iter().sum::<f64>() / t[axis].len() as f64;
        t[axis].iter().map(move |x| (x - own).abs()).collect::<Vec<_>>()
    };
    let all: Vec<f64> = series.iter().flat_map(ways).collect();
    let amplitudes = Amplitudes::of(&all);
    amplitudes.mean + amplitudes.std * amplitudes.quantiles(&[0.93])[0]
}

impl KnownArm {
    fn at_mean(&self, samples: &Samples) -> CurvedArm {
        let mean_force_n = self.mean_force_n.unwrap_or_else(|| [0, 1].map(|axis| std(&samples.effort, axis).0));
        CurvedArm { link_lengths_m: self.link_lengths_m, posture_rad: self.posture_rad, mean_force_n }
    }
}

impl Subject {
    /// `spring`: where the linear model runs away, which says nothing of one, whether there is one all the same.
    pub fn new(samples: &Samples, meaning: &Meaning, options: &Options, baseline: Option<&Baseline>, spring: bool) -> Result<Self, DiagnoseError> {
        let axes = meaning.effort_names.len();
        let trials = samples.effort.len();
        let splines = |high_hz: f64| options.schedule.as_ref().filter(|_| !samples.schedule.is_empty()).and_then(|schedule| schedule.splines(high_hz));
        let length = samples.len();
        let movement = splines(0.0).and_then(|splines| mean_over(&samples.schedule, splines, &(0..length)));
        let band_hz = options.band_hz.unwrap_or_else(|| match &movement {
            Some(movement) => find_band(&samples.deviations(movement), meaning),
            None => find_band(samples, meaning),
        });
        let layout = Layout::new(trials, axes, length, samples.rate_hz, band_hz);
        let layout = Arc::new(layout.following(&samples.schedule).about_movement(splines(band_hz.1)));
        if layout.lines() < 12 {
            return Err(DiagnoseError::NoBand { lo: band_hz.0, hi: band_hz.1 });
        }
        let (effort, motion, reference) = (layout.tracks(&samples.effort), layout.tracks(&samples.motion), layout.tracks(&samples.reference));
        let centre: Vec<f64> = (0..axes).map(|i| std(&samples.motion, i).0).collect();
        let state = State::new(&layout, &effort, &motion, &centre, &[]);
        let mut cause = if meaning.motion_imposed {
            Cause::Motion
        } else if samples.reference[0].is_empty() {
            Cause::Effort
        } else {
            robot::fit(&state, &samples.reference, meaning.reference_is_effort)
                .filter(|r| r.rest < ROBOT_REST && r.part > ROBOT_PART)
                .map_or(Cause::Effort, |r| Cause::Loop(Arc::new(r.impedance)))
        };
        let mut structure = Structure { integrals: meaning.order, known: options.known.clone(), ..Structure::new(axes, baseline, true) };
        // A balance of forces that stands for itself is as free as it was: its plant need not be a mechanism.
        let symmetric = |fit: &LinearFit| fit.is_symmetric() && (meaning.motion_imposed || fit.moves() || (-fit.clone()).moves());
        if baseline.is_none() && !options.linear.as_ref().is_some_and(symmetric) {
            structure.symmetric = vec![Matrix::Mass];
        }
        let (mut base, mut fit) = settle(&state, &cause, &structure)?;
        let mut recorded = None;
        if runs_away(&state, &fit) {
            recorded = Some(std::mem::replace(&mut cause, Cause::Unclear));
            (base, fit) = settle(&state, &cause, &structure)?;
        }
        let judged = baseline.is_none() && options.schedule.is_none() && (recorded.is_none() || !spring);
        if judged && !needs_spring(&state, &cause, &structure, &base, &fit) {
            structure.spring = false;
        }
        let base = if structure.spring {
            base
        } else {
            let (free, without) = settle(&state, &cause, &structure)?;
            fit = without;
            free
        };
        let matrix = |m| base.matrix(&fit.theta, m, axes);
        structure.about = (!matches!(cause, Cause::Unclear) && !meaning.effort_is_command).then(|| base.dynamics(&fit.theta, axes));
        let size = |v: &[num_complex::Complex64], i: usize| whitened_power(&[v.to_vec()], &vec![fit.power[i].clone()]).sqrt();
        let polarity = [Matrix::Stiffness, Matrix::Damping, Matrix::Mass]
            .into_iter()
            .enumerate()
            .map(|(order, m)| {
                let values = matrix(m);
                (0..axes).map(|i| values[i][i] * size(&state.kinematics[order][i], i) / size(&state.effort_spectra[i], i).max(f64::MIN_POSITIVE)).sum::<f64>()
            })
            .sum();
        let scale = Scale {
            position: (0..axes).map(|i| std(&samples.motion, i).1).collect(),
            far: (0..axes).map(|i| far(&samples.motion, i)).collect(),
            centre: centre.clone(),
            velocity: (0..axes).map(|i| spread(&state.law_v, axes, i)).collect(),
            effort: (0..axes).map(|i| std(&samples.effort, i).1).collect(),
            time_s: layout.time_s,
            duration_s: samples.duration_s,
            middle_s: samples.start_s[0] + 0.5 * length as f64 / samples.rate_hz,
            mass: matrix(Matrix::Mass),
            stiffness: matrix(Matrix::Stiffness),
            spring: structure.spring,
            integrals: meaning.order,
            rotational: meaning.rotational,
            motion_imposed: meaning.motion_imposed,
            effort_is_command: meaning.effort_is_command,
            effort_names: meaning.effort_names.clone(),
            motion_names: meaning.motion_names.clone(),
            nominal: structure.nominal.clone(),
            held: structure.given.clone(),
            symmetric: structure.is_symmetric(),
            arm: options.arm.filter(|_| axes == 2 && !meaning.rotational).map(|arm| arm.at_mean(samples)),
            closed_schedule: options.schedule.as_ref().filter(|_| !samples.schedule.is_empty()).map(|schedule| schedule.cycle_s.is_some()),
        };
        let hypotheses = Hypothesis::all(&scale, &options.own, &options.without);
        Ok(Subject { layout, effort, motion, reference, centre, cause, recorded, structure, scale, hypotheses, start: fit.power, polarity })
    }

    /// Fits the baseline anew after the layout has been masked.
    pub fn restart(&mut self) -> Result<(), DiagnoseError> {
        let state = State::new(&self.layout, &self.effort, &self.motion, &self.centre, &[]);
        self.start = settle(&state, &self.cause, &self.structure)?.1.power;
        Ok(())
    }

    /// Whether inertia and stiffness of every axis of a model are below zero.
    pub fn is_negative(&self, chosen: &[Chosen], stand: &Stand) -> bool {
        let [mass, stiffness] = [Matrix::Mass, Matrix::Stiffness].map(|matrix| self.matrix(chosen, stand, matrix));
        (0..self.layout.axes).all(|axis| mass[axis][axis] < 0.0 && (!self.structure.spring || stiffness[axis][axis] < 0.0))
    }

    /// What a number of parameters has to gain.
    pub fn price(&self, parameters: usize) -> f64 {
        self.layout.price(parameters)
    }
}

fn spread(interleaved: &[Vec<f64>], axes: usize, axis: usize) -> f64 {
    let values = || interleaved.iter().flat_map(|t| t.iter().skip(axis).step_by(axes));
    let n = values().count() as f64;
    let mean = values().sum::<f64>() / n;
    (values().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// The baseline fitted: first by ordinary least squares with the effort's own power as noise, which has no unit, then without bias.
fn settle(state: &State, cause: &Cause, structure: &Structure) -> Result<(Base, Fit), DiagnoseError> {
    let base = Base::new(state, cause, structure, None);
    let columns: Vec<&Column> = base.columns.iter().collect();
    let likelihood = Likelihood::new(state, cause, &base.held);
    let target = likelihood.target();
    let power = likelihood.power(&target);
    let fit =
        likelihood.fit(&columns, &power, 3, false).and_then(|start| likelihood.fit(&columns, &start.power, 4, true)).ok_or(DiagnoseError::BaselineFailed)?;
    drop(columns);
    Ok((base, fit))
}

/// Whether a fit leaves more than there was.
pub(crate) fn runs_away(state: &State, fit: &Fit) -> bool {
    let power = |v: &[num_complex::Complex64]| v.iter().map(|v| v.norm_sqr()).sum::<f64>();
    fit.residual.iter().zip(&state.effort_spectra).any(|(e, f)| power(e) > power(f))
}

/// Whether the diagonal of the stiffness is more than chance and matters within the band.
fn needs_spring(state: &State, cause: &Cause, structure: &Structure, base: &Base, fit: &Fit) -> bool {
    let without = Structure { spring: false, ..structure.clone() };
    let Ok((_, free)) = settle(state, cause, &without) else { return true };
    let entries = base.roles.iter().filter(|r| matches!(r, Role::Entry(Matrix::Stiffness, _, _))).count();
    fit.log_likelihood - free.log_likelihood > state.layout.price(entries) + ENOUGH
}

/// The excited band of samples.
pub(crate) fn find_band(samples: &Samples, meaning: &Meaning) -> (f64, f64) {
    fn view(all: &[Vec<Vec<f64>>]) -> Vec<Vec<&[f64]>> {
        all.iter().map(|t| t.iter().map(Vec::as_slice).collect()).collect()
    }
    let (effort, motion) = (view(&samples.effort), view(&samples.measured));
    let reference = view(&samples.reference);
    let by = if meaning.motion_imposed {
        &motion
    } else if reference[0].is_empty() {
        &effort
    } else {
        &reference
    };
    band::excited(&effort, by, &motion, (meaning.order, meaning.motion_imposed), samples.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_is_a_way_and_no_number_of_deviations() {
        // From 5 mm a millimetre to either side, evenly: 93 of a hundred go no farther than 0.93 mm.
        let even: Vec<f64> = (-1000..=1000).map(|k| 5e-3 + 1e-6 * f64::from(k)).collect();
        assert!((far(&[vec![even]], 0) - 0.93e-3).abs() < 1e-6);
    }
}
