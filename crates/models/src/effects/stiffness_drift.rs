//! Tone that changes during a trial.

use super::drift::{Drift, SETTLING_RATE, mean_course, settles, single};
use super::vocabulary::*;

const FRACTION: ParameterCard = plain("fraction_per_s", "1/s", -1e3, 1e3, None);
const CARD: Card = Card {
    name: "stiffness-drift",
    what: "stiffness (tone) that changes during the trial, steadily or to a new level",
    sides: &[Side::Limb],
    parameters: &[FRACTION, SETTLING_RATE],
    signature: "stiffness of the second half differs from that of the first, coherence is lowered around the resonance",
    look_alikes: &["cubic-stiffness", "posture-drift"],
    next_experiment: "a longer record of the same perturbation, repeated: drift goes on with time, a nonlinearity repeats",
    equation: "f = fraction g(t) K x, g = t - T/2, or (exp(-λ T/2) - exp(-λ t)) / λ where it settles at the rate λ",
    source: "Lacquaniti, Carrozzo & Borghese 1993, Time-varying mechanical behavior of multijointed arm in man",
    trace: Trace::Forms,
};

/// Drifting stiffness.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let fraction = parameters.number(CARD.name, &FRACTION)?;
    let stiffness = match setting.axis {
        Some(axis) => single(setting.axes, axis, fraction * Setting::diagonal(&setting.stiffness, axis)),
        None => scaled(&setting.stiffness, fraction),
    };
    let settling_per_s = parameters.number(CARD.name, &SETTLING_RATE)?;
    Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, settling_per_s, stiffness, force: vec![] })))
}

fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.spring {
        return Vec::new();
    }
    let (n, middle_s, analysed_s, duration_s) = (scale.axes(), scale.duration_s / 2.0, scale.middle_s, scale.duration_s);
    // The fitted stiffness is the mean of what is analysed, the fraction is told of that at the middle of the trial.
    let of = |[line, rest]: [&'static str; 2], axis, of_one: f64, unit: Vec<Vec<f64>>| {
        let law = move |settling_per_s: f64, slope: f64| Drift { middle_s, settling_per_s, stiffness: scaled(&unit, slope), force: vec![] };
        let fraction = move |settling_per_s: f64, slope: f64| ("fraction_per_s", slope / (of_one - slope * mean_course(settling_per_s, middle_s, analysed_s)));
        let of_line = law.clone();
        let straight = Form::new(line, axis, Action::force(move |_, c| of_line(0.0, c[0]))).numbers(move |_, c| [fraction(0.0, c[0])]);
        let settling = settles(Form::new(rest, axis, Action::force(move |k, c| law(k[0], c[0]))), duration_s);
        let settling = settling.numbers(move |k, c| [fraction(k[0], c[0]), ("settling_per_s", k[0])]);
        [straight, settling].map(|form| form.coefficients(vec![Sign::Free]))
    };
    let one = |axis: usize| of(["one axis", "settling, one axis"], Some(axis), Setting::diagonal(&scale.stiffness, axis), single(n, axis, 1.0));
    let all = (n > 1).then(|| of(["all axes", "settling, all axes"], None, 1.0, scale.stiffness.clone()));
    (0..n).flat_map(one).chain(all.into_iter().flatten()).collect()
}

fn scaled(matrix: &[Vec<f64>], by: f64) -> Vec<Vec<f64>> {
    matrix.iter().map(|row| row.iter().map(|k| by * k).collect()).collect()
}
