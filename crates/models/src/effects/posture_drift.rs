//! A limb that creeps from its place.

use super::drift::{Drift, ramp};
use super::vocabulary::*;

const RATE: ParameterCard = mechanical("rate_m_per_s", ("m/s", "rad/s"), -1e3, 1e3, None);
const CARD: Card = Card {
    name: "posture-drift",
    what: "the posture that the limb holds creeps",
    sides: &[Side::Limb],
    parameters: &[RATE],
    signature: "a slow trend of the displacement that the mean force does not explain",
    look_alikes: &["sensor-offset-drift", "stiffness-drift"],
    next_experiment: "the force sensor unloaded before and after the trial: if its zero stayed, the posture crept",
    equation: "f = -K rate (t - T/2)",
    source: "Palazzolo et al. 2007, Stochastic estimation of arm mechanical impedance during robotic stroke rehabilitation",
    trace: Trace::Forms,
};

/// Creeping posture.
pub struct PostureDrift;

impl Effect for PostureDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let rate = parameters.number(CARD.name, &RATE)?;
        let moving = setting.sites();
        let force = setting.stiffness.iter().map(|row| -rate * moving.iter().filter_map(|&j| row.get(j)).sum::<f64>()).collect();
        Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, stiffness: vec![], force })))
    }

    /// Not offered where the displacement is an integral: the sensor's unknown zero moves it alike.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.spring || scale.integrals > 0 {
            return Vec::new();
        }
        (0..scale.axes())
            .map(|axis| {
                let stiffness = Setting::diagonal(&scale.stiffness, axis);
                Form::new("creep", Some(axis), ramp(axis, scale)).coefficients(vec![Sign::Free]).numbers(move |_, c| [("rate_m_per_s", -c[0] / stiffness)])
            })
            .collect()
    }
}
