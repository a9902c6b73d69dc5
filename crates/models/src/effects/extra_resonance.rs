//! A flexible mode, or compliance in series.

use super::vocabulary::*;
use num_complex::Complex64;
use std::f64::consts::TAU;

const FREQUENCY: ParameterCard = plain("frequency_hz", "Hz", 1e-9, 1e6, None);
const DAMPING_RATIO: ParameterCard = plain("damping_ratio", "", 0.0, 2.0, Some(0.05));
const MASS_SHARE: ParameterCard = plain("mass_share", "", 0.0, 1e3, None);
/// Of two modes either may be taken for the one between: the gain of the one is that of the other times the square of their frequencies' ratio, so that
/// one of them is small.
const GAIN_BEYOND: ParameterCard = plain("gain_beyond", "", -3.0, 3.0, None);
const CARD: Card = Card {
    name: "extra-resonance",
    what: "an unmodelled flexible mode, or compliance of a transducer, a handle or tissue in series",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[FREQUENCY, DAMPING_RATIO, MASS_SHARE, GAIN_BEYOND],
    signature: "a peak and a notch in the response, inertia that changes across it; in series: phase that rolls off with the inertia's gain",
    look_alikes: &["measurement-delay", "channel-filter", "periodic-disturbance"],
    next_experiment: "the same perturbation with a known mass added to the handle: a mode moves, a delay does not",
    equation: "f = m2 s² (2 ζ ω s + ω²) / (s² + 2 ζ ω s + ω²) x; held softly: f = (k + c s) Z / (Z + k + c s) x; in series: x measured = x + F / k; between: F felt = (g s² + 2 ζ ω s + ω²) / (s² + 2 ζ ω s + ω²) F",
    source: "Den Hartog 1934, Mechanical vibrations, ch. 3",
    trace: Trace::Forms,
};

/// A mode damped more than this does not swing: a reflex or a relaxation answers alike.
const DEAD: f64 = 0.25;

/// Where modes are looked for, in units of [`Scale::time_s`], and how much they are damped.
fn modes(unit: f64) -> Vec<Knob> {
    vec![Knob::log(0.8 / unit, 12.5 / unit), Knob::log(0.003, 0.4)]
}

/// Frequencies from which the search begins, likewise.
fn starts(unit: f64) -> [f64; 8] {
    [1.5, 2.2, 3.0, 4.2, 5.5, 7.0, 9.0, 11.0].map(|f| f / unit)
}

/// What is held and what holds it, from what is seen before the hold. With a mass m, a damper b and a spring k_l behind a spring k and a damper c, the
/// axis has B = c and K = k - c²/m beside the mode, ω² = (k + k_l)/m and 2 ζ ω = (c + b)/m, and the mode's force at rest is g ω² m = k² - c² ω². One m above
/// zero agrees: of g ω² m³ - (K² - c² ω²) m² - 2 K c² m - c⁴ = 0 signs change once.
fn behind_hold(knobs: &[f64], coefficients: &[f64], [_, c, stiffness]: [f64; 3], rotational: bool) -> String {
    let (w, ratio) = (TAU * knobs[0], knobs[1]);
    let cubic = [coefficients[0] * w * w, (c * w).powi(2) - stiffness * stiffness, -2.0 * stiffness * c * c, -c.powi(4)];
    let bound = 1.0 + cubic[1..].iter().fold(0.0, |most: f64, a| most.max((a / cubic[0]).abs()));
    // From above the largest root Newton's steps fall to it.
    let step = |m: f64| {
        let (value, slope) = cubic.iter().fold((0.0, 0.0), |(value, slope), a| (value * m + a, slope * m + value));
        m - value / slope
    };
    let m = (0..200).fold(bound, |m, _| step(m));
    let hold = stiffness + c * c / m;
    let numbers = [m, 2.0 * ratio * w * m - c, m * w * w - hold, hold, c];
    if !numbers.iter().all(|x| x.is_finite()) {
        return "M of the extended model is that of what lies before the hold".to_owned();
    }
    let three = |x: f64| format!("{x:.0$}", (2.0 - x.abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize);
    let [mass, damper, spring] = if rotational { ["kg m²", "N m s/rad", "N m/rad"] } else { ["kg", "N s/m", "N/m"] };
    let [m, b, k, hold, c] = numbers.map(three);
    format!(
        "about {m} {mass}, {b} {damper} and {k} {spring} behind a hold of about {hold} {spring} and {c} {damper} answer so; M of the extended model is that of what lies before the hold"
    )
}

/// A mass on a spring and damper, carried by one axis.
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    if parameters.find(GAIN_BEYOND.name).is_some() {
        return Err(EffectError::Kind {
            effect: CARD.name,
            parameter: GAIN_BEYOND.name,
            expected: "left out: answers alone have it, and a mass is what is hidden",
        });
    }
    let axis = setting.one_axis(&CARD)?;
    let inertia = Setting::diagonal(&setting.mass, axis);
    if inertia <= 0.0 {
        return Err(EffectError::Setting { effect: CARD.name, what: "a plant with inertia on its axis" });
    }
    let number = |card| parameters.number(CARD.name, card);
    let theta = [inertia * number(&MASS_SHARE)?, number(&FREQUENCY)?, number(&DAMPING_RATIO)?];
    Ok(Injection::Force(Box::new(on_axis(axis, laws::FlexibleMode, theta))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let unit = scale.time_s;
    let mut forms: Vec<Form> = (0..scale.axes())
        .map(|axis| {
            let inertia = Setting::diagonal(&scale.mass, axis).abs().max(f64::MIN_POSITIVE);
            Form::new("carried mass", Some(axis), Action::force(move |k, c| on_axis(axis, laws::FlexibleMode, [c[0], k[0], k[1]])))
                .knobs(modes(unit), &[&starts(unit), &[0.07]])
                .coefficients(vec![Sign::Positive])
                .numbers(move |k, c| [("frequency_hz", k[0]), ("damping_ratio", k[1]), ("mass_share", c[0] / inertia)])
        })
        .collect();
    forms.extend((0..scale.axes()).map(|axis| {
        Form::new("held softly", Some(axis), Action::force(move |k, c| on_axis(axis, laws::SoftHold, [c[0], c[1], k[0], k[1]])))
            .knobs(modes(unit), &[&starts(unit), &[0.1]])
            .coefficients(vec![Sign::Positive, Sign::Free])
            .numbers(|k, _| [("frequency_hz", k[0]), ("damping_ratio", k[1])])
            .remark(behind_hold)
    }));
    if scale.motion_imposed {
        // The measured effort would stand on both sides of the balance.
        return forms;
    }
    let axes = scale.axes();
    let gain = (0..axes).map(|i| scale.effort[i] / scale.position[i].max(f64::MIN_POSITIVE)).sum::<f64>() / axes as f64;
    let inertia = (0..axes).map(|i| Setting::diagonal(&scale.mass, i).abs()).sum::<f64>() / axes as f64;
    let series = Form::new("series compliance", None, Action::Series(Arc::new(|_, k| Complex64::new(k[0], 0.0))))
        .knobs(vec![Knob::log(1e-3 / gain, 0.5 / gain)], &[&[160.0, 40.0, 10.0].map(|q| 1.0 / (q * gain))])
        .numbers(move |k, _| {
            let frequency = (1.0 / (k[0] * inertia.max(f64::MIN_POSITIVE))).sqrt() / TAU;
            [("frequency_hz", frequency), ("damping_ratio", 0.0), ("mass_share", 1.0)]
        });
    forms.push(series.floor(0.02));
    // Where the motion is measured elsewhere than the effort acts, what lies between them may push either way beyond its mode.
    forms.extend((0..axes).map(|axis| {
        let passes: Operator = Arc::new(|s, k| {
            let w = TAU * k[0];
            let spring = w * (2.0 * k[1] * s + w);
            (k[2] * s * s + spring) / (s * s + spring)
        });
        let pole = |k: &[f64]| Complex64::new(-k[1], (1.0 - k[1] * k[1]).sqrt()) * TAU * k[0];
        let gain = Knob::linear(GAIN_BEYOND.bounds.0, GAIN_BEYOND.bounds.1);
        Form::new("between effort and motion", Some(axis), Action::Mode { passes, pole })
            .knobs(
                [modes(unit), vec![gain]].concat(),
                // A gain on either side of nought, between a mode that nothing passes and one that is hardly there.
                &[&starts(unit), &[0.02], &[-1.0, 0.3]],
            )
            .numbers(|k, _| [("frequency_hz", k[0]), ("damping_ratio", k[1]), ("gain_beyond", k[2])])
    }));
    forms
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    if evidence.number(&DAMPING_RATIO).is_some_and(|ratio| ratio > DEAD) { &["reflex-delay", "viscoelastic"] } else { &[] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 kg, 18 N s/m and 400 N/m behind 1700 N/m and 30 N s/m: (c s + k)²/(m s² + (b + c) s + k_l + k) is c²/m and the mode's force.
    #[test]
    fn what_is_held_and_what_holds_it_follow_from_what_is_seen() {
        let (m, b, k_l, k, c) = (2.0, 18.0, 400.0, 1700.0, 30.0);
        let w = f64::sqrt((k + k_l) / m);
        let at_rest = (k * k - c * c * w * w) / m / (w * w);
        let said = behind_hold(&[w / TAU, (b + c) / m / (2.0 * w)], &[at_rest, 0.0], [0.3, c, k - c * c / m], false);
        assert!(said.starts_with("about 2.00 kg, 18.0 N s/m and 400 N/m behind a hold of about 1700 N/m and 30.0 N s/m"), "{said}");
    }
}
