//! Tone that changes during a trial.

use super::drift::{Drift, single};
use super::vocabulary::*;

const FRACTION: ParameterCard = plain("fraction_per_s", "1/s", -1e3, 1e3, None);
const CARD: Card = Card {
    name: "stiffness-drift",
    what: "stiffness (tone) that changes steadily during the trial",
    sides: &[Side::Limb],
    parameters: &[FRACTION],
    signature: "stiffness of the second half differs from that of the first, coherence is lowered around the resonance",
    look_alikes: &["cubic-stiffness", "posture-drift"],
    next_experiment: "a longer record of the same perturbation, repeated: drift goes on with time, a nonlinearity repeats",
    equation: "f = fraction (t - T/2) K x",
    source: "Lacquaniti, Carrozzo & Borghese 1993, Time-varying mechanical behavior of multijointed arm in man",
    trace: Trace::Forms,
};

/// Drifting stiffness.
pub struct StiffnessDrift;

impl Effect for StiffnessDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        let fraction = parameters.number(CARD.name, &FRACTION)?;
        let stiffness = match setting.axis {
            Some(axis) => single(setting.axes, axis, fraction * Setting::diagonal(&setting.stiffness, axis)),
            None => setting.stiffness.iter().map(|row| row.iter().map(|k| fraction * k).collect()).collect(),
        };
        Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, settling_per_s: 0.0, stiffness, force: vec![] })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.spring {
            return Vec::new();
        }
        let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
        // The fitted stiffness is that of the middle of what is analysed, the fraction is told of the trial's.
        let later_s = middle_s - scale.middle_s;
        let of = |label, axis, of_one: f64, stiffness: Box<dyn Fn(f64) -> Vec<Vec<f64>> + Send + Sync>| {
            Form::new(label, axis, Action::force(move |_, c| Drift { middle_s, settling_per_s: 0.0, stiffness: stiffness(c[0]), force: vec![] }))
                .coefficients(vec![Sign::Free])
                .numbers(move |_, c| [("fraction_per_s", c[0] / (of_one + c[0] * later_s))])
        };
        let one = |axis: usize| of("one axis", Some(axis), Setting::diagonal(&scale.stiffness, axis), Box::new(move |rate| single(n, axis, rate)));
        let whole = scale.stiffness.clone();
        let all = of("all axes", None, 1.0, Box::new(move |rate| whole.iter().map(|row| row.iter().map(|k| rate * k).collect()).collect()));
        (0..n).map(one).chain((n > 1).then_some(all)).collect()
    }
}
