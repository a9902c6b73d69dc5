//! A knock or a voluntary reaction.

use super::vocabulary::*;

const TIME: ParameterCard = plain("time_s", "s", 0.0, 1e6, None);
const IMPULSE: ParameterCard = mechanical("impulse_n_s", ("N s", "N m s"), -1e6, 1e6, None);
const DURATION: ParameterCard = plain("duration_s", "s", 1e-4, 1e3, Some(0.2));
const CARD: Card = Card {
    name: "transient-disturbance",
    what: "a voluntary reaction or a knock",
    sides: &[Side::Environment, Side::Limb],
    parameters: &[TIME, IMPULSE, DURATION],
    signature: "a short burst in the residual force, nothing before and after",
    look_alikes: &["limb-noise"],
    next_experiment: "another record: a knock does not come back at its time",
    equation: "f = -(2 impulse / duration) sin²(π (t - time) / duration) while it lasts",
    source: "the raised cosine pulse",
    trace: Trace::Burst,
};

/// A short pulse of force.
pub struct TransientDisturbance;

/// A raised cosine pulse on some axes.
struct Pulse {
    axes: Vec<usize>,
    start_s: f64,
    duration_s: f64,
    impulse: f64,
}

impl ForceLaw for Pulse {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let phase = (motion.time_s - self.start_s) / self.duration_s;
        if (0.0..1.0).contains(&phase) {
            let pulse = 2.0 * self.impulse / self.duration_s * (std::f64::consts::PI * phase).sin().powi(2);
            for &axis in &self.axes {
                force[axis] -= pulse;
            }
        }
    }
}

impl Effect for TransientDisturbance {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        Ok(Injection::Force(Box::new(Pulse {
            axes: setting.sites(),
            start_s: parameters.number(CARD.name, &TIME)?,
            duration_s: parameters.number(CARD.name, &DURATION)?,
            impulse: parameters.number(CARD.name, &IMPULSE)?,
        })))
    }
}
