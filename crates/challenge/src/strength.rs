//! How strong an effect is in a recording: by the same recording without it, and least squares that know nothing of the diagnosis.

use super::balance::{Left, left};
use super::{Case, Made, Plant, Setting, make_with};
use std::f64::consts::TAU;

/// Size of what is hidden.
#[derive(Clone, Copy, Debug, Default)]
pub struct Strength {
    /// Share of what a linear model leaves that is there only with the effect.
    pub share: f64,
    /// Root of that power over the effort's.
    pub size: f64,
    /// Root of the same power, carried to the predicted output, over the output's.
    pub output: f64,
    /// Whether it lies within what instruments are allowed.
    pub tolerated: bool,
}

/// Strength of what a case hides: zero in size if it is tolerated.
pub fn strength(case: &Case, made: &Made) -> Strength {
    let setting = Setting::default();
    let found = against(case, &setting, &floor(case, &setting));
    Strength { size: if tolerated(case, made) { 0.0 } else { found.size }, ..found }
}

/// What a linear model leaves of the twin without effects and imperfections.
#[derive(Clone, Copy, Debug)]
pub struct Floor {
    /// With noise, steps and the limb's own force,
    loud: Left,
    /// and without.
    quiet: Left,
}

/// The floor under what a case hides.
pub fn floor(case: &Case, setting: &Setting) -> Floor {
    let bare = Case { hidden: vec![], background: false, ..case.clone() };
    let of = |setting: &Setting| left(case, &make_with(&bare, setting), everywhere(case));
    Floor { loud: of(setting), quiet: of(&Setting { quiet: true, ..setting.clone() }) }
}

/// Strength of what a case hides over such a floor. What it leaves of itself is seen without noise and the limb's own force, since least
/// squares let these bias the linear model, and by another amount with the effect than without it.
pub fn against(case: &Case, setting: &Setting, floor: &Floor) -> Strength {
    let quiet = make_with(case, &Setting { quiet: true, ..setting.clone() });
    let alone = left(case, &quiet, everywhere(case));
    let (effort, output) = ((alone.effort - floor.quiet.effort).max(0.0), (alone.output - floor.quiet.output).max(0.0));
    Strength {
        share: effort / (effort + floor.loud.effort).max(f64::MIN_POSITIVE),
        size: (effort / alone.all_effort.max(f64::MIN_POSITIVE)).sqrt(),
        output: steps(case, &quiet).unwrap_or((output / alone.all_output.max(f64::MIN_POSITIVE)).sqrt()),
        tolerated: tolerated(case, &quiet),
    }
}

/// Whether what is hidden has no axis of its own.
fn everywhere(case: &Case) -> bool {
    case.hidden.iter().any(|h| h.name.starts_with("sensor-misalignment"))
}

/// rms of the rounding of a motion with coarse steps, over the motion's rms.
fn steps(case: &Case, made: &Made) -> Option<f64> {
    let at = case.hidden.iter().position(|h| h.name.starts_with("quantisation"))?;
    let step = made.truth[at].first()?.1;
    let x = &made.recordings[0].channels()[made.motion(case.plant)[made.axis]].samples;
    Some(step / 12f64.sqrt() / ndof_signal::deviation(x))
}

/// Whether all that is hidden lies within what instruments are allowed: a delay or filter below 0.8 ms and an angle below 2° (four
/// standard deviations of the priors; times are longer for slower experiments), steps whose rounding is below 1 % of the rms.
fn tolerated(case: &Case, made: &Made) -> bool {
    let late = 0.8e-3 * 12.0 / case.plant.band_hz();
    let effect = |name: &'static str| super::hide::parts(name).0;
    !case.hidden.is_empty()
        && case.hidden.iter().zip(&made.truth).all(|(hidden, truth)| match (effect(hidden.name), truth.first()) {
            ("measurement-delay", Some((_, delay))) => *delay < late,
            ("channel-filter", Some((_, cutoff))) => 1.0 / (TAU * cutoff) < late,
            ("sensor-misalignment", Some((_, angle))) => angle.abs() < 2f64.to_radians(),
            ("quantisation", _) => steps(case, made).is_some_and(|rms| rms < 0.01),
            _ => false,
        })
}

impl Made {
    /// Channels of motion, whichever way round.
    pub(crate) fn motion(&self, plant: Plant) -> &[usize] {
        if plant == Plant::Motion { &self.ports.inputs } else { &self.ports.outputs }
    }

    /// Channels of effort.
    pub(crate) fn effort(&self, plant: Plant) -> &[usize] {
        if plant == Plant::Motion { &self.ports.outputs } else { &self.ports.inputs }
    }
}
