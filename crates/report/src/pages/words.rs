//! A diagnosis in one sentence, for people who do not read likelihoods.

use crate::figures::capitalised;
use crate::number::significant;
use ndof_diagnose::{BandShare, Cause, CauseParameter, Diagnosis, Verdict};
use ndof_models::effects::Value;

/// What the plant does and what the effect is called, in plain words.
fn plain(effect: &str) -> (&'static str, &'static str) {
    match effect {
        "parameter-error" => ("a number in the simulation is wrong", "a corrected parameter"),
        "added-mass" => ("it is heavier than the simulation thinks", "an added mass"),
        "coulomb-friction" => ("it sticks before it moves", "dry friction"),
        "hysteresis" => ("it holds back", "a hysteresis"),
        "cubic-stiffness" => ("its stiffness changes with the size of the movement", "a cubic stiffness"),
        "asymmetric-stiffness" => ("it is stiffer one way than the other", "an asymmetric stiffness"),
        "dead-zone" => ("there is slack around rest", "a dead zone"),
        "end-stop" => ("it runs into a stop", "an end stop"),
        "viscoelastic" => ("it relaxes", "a viscoelastic element"),
        "extra-resonance" => ("something in it swings or gives by itself", "an extra resonance"),
        "reflex-delay" => ("it answers late, as a reflex does", "a reflex"),
        "measurement-delay" => ("one channel comes late", "a delay"),
        "channel-filter" => ("one channel is smoothed", "a filter"),
        "actuation-delay" => ("the force comes later than commanded", "an actuation delay"),
        "actuator-saturation" => ("the force does not reach what is commanded", "a saturation"),
        "sensor-misalignment" => ("the force sensor is turned", "a misalignment"),
        "sensor-scale" => ("a channel's unit or gain is wrong", "a wrong scale"),
        "sensor-offset-drift" => ("a sensor's zero wanders", "a drift"),
        "quantisation" => ("a channel moves in coarse steps", "a quantisation"),
        "periodic-disturbance" => ("it trembles", "a tremor or hum"),
        "limb-noise" => ("it moves by itself", "a force of its own"),
        "transient-disturbance" => ("something pushed it once", "a knock or voluntary reaction"),
        "stiffness-drift" => ("its stiffness changes during the trial", "a stiffness drift"),
        "varying-stiffness" => ("its stiffness varies", "a stiffness that varies"),
        "varying-damping" => ("its damping varies", "a damping that varies"),
        "varying-reflex" => ("it answers late, and not always alike", "a reflex whose gain varies"),
        "arm-geometry" => ("it turns with its joints", "the arm's own geometry with a coupling"),
        "posture-stiffness" => ("the stiffness of its joints varies with the posture", "a joint stiffness that varies with the posture by a slope"),
        "posture-drift" => ("it creeps from its place", "a posture drift"),
        "gravity" => ("its weight pulls", "gravity"),
        "geometry-error" => ("the geometry in the simulation is wrong", "a corrected length or angle"),
        "cross-coupling" => ("its axes act on each other", "a coupling"),
        "viscous-friction" => ("it drags more the faster it moves", "viscous friction"),
        "load-friction" => ("it drags more the more it carries", "friction that grows with the load"),
        "gear-hysteresis" => ("its gear holds back before it slips", "a gear's hysteresis"),
        "motor-inertia" => ("its motor is harder to turn than simulated", "a motor's inertia"),
        "joint-flexibility" => ("a joint gives under load", "a flexible joint"),
        "backlash" => ("there is play between motor and link", "backlash"),
        "cable-force" => ("something pulls as the joint turns", "a cable or spring"),
        "spring-rest" => ("a spring rests elsewhere than simulated", "a spring's rest"),
        "torque-offset" => ("a torque channel does not begin at zero", "a torque offset"),
        "torque-scale" => ("a torque channel has a wrong gain", "a wrong torque gain"),
        "torque-delay" => ("torque and motion are logged at different times", "a torque delay"),
        "angle-offset" => ("an angle's zero is not where the file has it", "a shifted zero of an angle"),
        "link-parameters" => ("a link's mass or shape is not what the file says", "a link's correction"),
        "payload" => ("it carries what the file does not have", "a payload"),
        "base-tilt" => ("its base does not stand as the file says", "a tilt"),
        _ => ("the simulation misses something", "an effect"),
    }
}

/// What is said where the robot has less of it than the file.
fn less(d: &Diagnosis, cause: &Cause) -> Option<&'static str> {
    let (parameter, words) = match cause.effect.as_str() {
        "coulomb-friction" => ("coulomb", "it sticks less than simulated"),
        "viscous-friction" => ("viscous", "it drags less than simulated"),
        "motor-inertia" => ("rotor", "its motor is easier to turn than simulated"),
        "cable-force" => ("spring", "a spring pulls less than simulated"),
        _ => return None,
    };
    let name = format!("{parameter}_{}_", cause.site.axis);
    d.extended.parameter_shift.iter().any(|shift| shift.name.starts_with(&name) && shift.after < shift.before).then_some(words)
}

/// Where most of what is missed lies.
fn place(bands: &[BandShare]) -> String {
    let outputs: Vec<&str> = bands.iter().map(|b| b.output.as_str()).collect();
    let count = outputs.iter().filter(|o| Some(*o) == outputs.first()).count().max(1);
    let mut shares: Vec<([f64; 2], f64)> = bands.iter().take(count).map(|b| (b.band_hz, 0.0)).collect();
    for (k, band) in bands.iter().enumerate() {
        shares[k % count].1 += band.share.max(0.0) * count as f64 / bands.len() as f64;
    }
    match shares.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)) {
        Some((0, (band, share))) if *share > 0.5 => format!("Mostly below {} Hz", significant(band[1], 2)),
        Some((k, (band, share))) if *share > 0.5 && k + 1 == count => format!("Mostly above {} Hz", significant(band[0], 2)),
        Some((_, (band, share))) if *share > 0.5 => format!("Mostly between {} and {} Hz", significant(band[0], 2), significant(band[1], 2)),
        _ => "Over the whole band".to_owned(),
    }
}

/// "0.60 ± 0.10 N m", to the digits that the interval allows.
fn amount(parameters: &[CauseParameter]) -> Option<String> {
    // What may be nothing is not what was found.
    let sure = parameters.iter().find(|p| matches!(p.value, Value::Number(_)) && p.ci95.is_some_and(|[low, high]| low > 0.0 || high < 0.0));
    sure.into_iter().chain(parameters).find_map(|p| {
        let Value::Number(value) = p.value else { return None };
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        let half = p.ci95.map(|[low, high]| 0.5 * (high - low)).filter(|half| *half > 0.0);
        // Beyond what people read as a plain number, powers of ten stand behind.
        let power = if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) { value.abs().log10().floor() as i32 } else { 0 };
        let scaled = |x: f64| x / 10f64.powi(power);
        let digits = |size: f64| (1.0 - scaled(size).abs().max(1e-12).log10().floor()).clamp(0.0, 12.0) as usize;
        let times = if power == 0 { String::new() } else { format!("e{power}") };
        // An interval that is not about the value is told by its ends.
        let ends = p.ci95.filter(|[low, high]| power == 0 && half.is_some_and(|half| (value - 0.5 * (low + high)).abs() > 0.25 * half));
        (value != 0.0).then(|| match half.map(|half| (half, ends)) {
            Some((half, Some([low, high]))) => format!("{value:.0$}{unit} ({low:.0$} to {high:.0$})", digits(half)),
            Some((half, None)) if power == 0 => format!("{value:.0$} ± {half:.0$}{unit}", digits(half)),
            Some((half, None)) => format!("({1:.0$} ± {2:.0$}){times}{unit}", digits(half), scaled(value), scaled(half)),
            None => format!("{0:.1$}{times}{unit}", scaled(value), digits(value)),
        })
    })
}

/// " between 23.66 and 25.26 s": when it was, of what has a time.
fn stretch(parameters: &[CauseParameter]) -> Option<String> {
    let [from, to] = parameters.first().filter(|p| p.name == "time_s")?.ci95?;
    Some(format!(" between {from:.2} and {to:.2} s"))
}

/// " from 3.1 ± 0.2 N m/rad to 90.2 ± 1.1 N m/rad".
fn range(parameters: &[CauseParameter]) -> String {
    let end = |word: &str| parameters.iter().position(|p| p.name.ends_with(word)).and_then(|k| amount(&parameters[k..=k]));
    end("_least").zip(end("_greatest")).map_or_else(String::new, |(least, greatest)| format!(" from {least} to {greatest}"))
}

/// "dry friction at elbow, wrist; a payload": each name once, with all its places.
fn listed<'a>(causes: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut names: Vec<(&str, Vec<&str>)> = Vec::new();
    for (effect, axis) in causes {
        let name = plain(effect).1;
        let at = names.iter().position(|(known, _)| *known == name).unwrap_or(names.len());
        if at == names.len() {
            names.push((name, Vec::new()));
        }
        names[at].1.extend(Some(axis).filter(|axis| !axis.is_empty()));
    }
    let one = |(name, places): (&str, Vec<&str>)| if places.is_empty() { name.to_owned() } else { format!("{name} at {}", places.join(", ")) };
    names.into_iter().map(one).collect::<Vec<_>>().join("; ")
}

/// "The held-out part from 42.50 to 50.00 s is as of another plant than what was fitted."
fn another_plant(d: &Diagnosis) -> Option<String> {
    let stretch = &d.discrepancy.another_plant.as_ref()?.stretch;
    Some(format!("{} is as of another plant than what was fitted.", capitalised(stretch)))
}

/// The diagnosis in one sentence.
pub fn sentence(d: &Diagnosis) -> String {
    let Some(first) = d.causes.iter().find(|c| c.is_likely()).or(d.causes.first()) else {
        return match d.verdict {
            Verdict::Adequate => "The simulation is adequate: nothing beyond the tolerance is missing.".to_owned(),
            _ => another_plant(d)
                .unwrap_or_else(|| format!("{} the simulation misses something that none of the known causes explains.", place(&d.discrepancy.by_band))),
        };
    };
    let (more, name) = plain(&first.effect);
    let what = less(d, first).unwrap_or(more);
    let with = first.over_schedule.first().map(|curve| format!(" with {}", curve.over)).unwrap_or_default();
    let of = match first.over_schedule.first() {
        Some(_) => range(&first.parameters),
        None => stretch(&first.parameters).or_else(|| amount(&first.parameters).map(|amount| format!(" of {amount}"))).unwrap_or_default(),
    };
    let at = if first.site.axis.is_empty() { format!(" ({})", first.site.side) } else { format!(" at {} ({})", first.site.axis, first.site.side) };
    let share = match first.gain.explained_fraction {
        Some(share) if share >= 0.01 && !d.extended.held_out.is_worse_than(&d.baseline.held_out) => {
            format!("explains {:.0} % of what the simulation missed", 100.0 * share)
        }
        _ => "is part of what the simulation missed".to_owned(),
    };
    let unsure = if first.probability > Cause::LIKELY { "" } else { "perhaps " };
    let mut text = capitalised(&format!("{what}{with}: {unsure}{name}{of}{at} {share}."));
    for (words, likely) in [("With it", true), ("Also possible", false)] {
        let others = listed(d.causes.iter().filter(|c| !std::ptr::eq(*c, first) && c.is_likely() == likely).map(|c| (c.effect.as_str(), c.site.axis.as_str())));
        if !others.is_empty() {
            text += &format!(" {words}: {others}.");
        }
    }
    if !matches!(d.verdict, Verdict::Explained | Verdict::Adequate) {
        let another = another_plant(d);
        text.push(' ');
        text += if first.is_in_doubt() {
            "That this is its name is not sure."
        } else if d.extended.held_out.is_worse_than(&d.baseline.held_out) {
            "The free run is no better with it."
        } else {
            another.as_deref().unwrap_or("Something is left that none of the known causes explains.")
        };
    }
    text
}

/// A share in percent as people read it: what rounds to none is "< 1 %".
pub fn percent(share: f64) -> String {
    let whole = (100.0 * share).round();
    if whole < 1.0 { "< 1 %".to_owned() } else { format!("{whole:.0} %") }
}

/// A p-value as people read it: what is too small for a number is "< 1e-300".
pub fn p_value(p: f64) -> String {
    if p < 1e-300 { "< 1e-300".to_owned() } else { format!("= {}", significant(p, 2)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_p_value_that_is_too_small_for_a_number_is_said_to_be_small() {
        assert_eq!([p_value(0.0), p_value(0.0123)], ["< 1e-300", "= 0.012"]);
    }

    #[test]
    fn a_share_that_is_small_is_not_said_to_be_none() {
        assert_eq!([0.9, 0.006, 0.004, 0.0].map(percent), ["90 %", "1 %", "< 1 %", "< 1 %"]);
    }

    #[test]
    fn the_amount_that_is_told_is_one_that_is_beyond_doubt() {
        let of = |value: f64, half: f64| CauseParameter {
            name: "tilt_rad".to_owned(),
            unit: "rad".to_owned(),
            value: Value::Number(value),
            ci95: Some([value - half, value + half]),
        };
        assert_eq!(amount(&[of(1e-6, 1e-4), of(0.2, 0.01)]).as_deref(), Some("0.200 ± 0.010 rad"));
        assert!(amount(&[of(1e-6, 1e-4)]).is_some(), "where none is, the first");
    }

    /// A likely friction that takes `share` of what was missed; the free run's error was 1 and is `error`, the file's friction was 1 and is `level`.
    fn friction(share: f64, error: f64, level: f64) -> Diagnosis {
        let none = serde_json::json!([]);
        let score = |error: f64| serde_json::json!({ "nrmse": [error], "vaf_percent": [100.0 * (1.0 - error * error)] });
        let gain = serde_json::json!({ "nrmse_before": [1.0], "nrmse_after": [error], "vaf_before": [0.0], "vaf_after": [0.0], "log_likelihood": null,
            "log_likelihood_ci95": null, "explained_fraction": share, "explained_fraction_ci95": null, "delta_bic": -9.0 });
        let cause = serde_json::json!({ "effect": "coulomb-friction", "site": { "side": "robot", "axis": "elbow" }, "parameters": none, "probability": 0.99,
            "p_value": 0.0, "gain": gain, "evidence": none });
        let shift = serde_json::json!({ "name": "coulomb_elbow_nm", "unit": "N m", "before": 1.0, "after": level });
        serde_json::from_value(serde_json::json!({
            "split": { "estimation": "", "held_out": "", "windows_s": null },
            "baseline": { "model": "", "parameters": none, "held_out": score(1.0) },
            "noise_floor": { "nrmse": [0.0], "how": "" },
            "discrepancy": { "by_band": none, "by_time": none, "linear_share": 0.0, "nonlinear_share": 1.0, "time_varying_share": 0.0, "noise_share": 0.0, "notes": none },
            "verdict": "explained",
            "causes": [cause],
            "extended": { "model": "", "parameters": none, "held_out": score(error), "residual_white": true, "parameter_shift": [shift] },
            "considered": none, "minor": none, "confusable": none,
        }))
        .expect("a diagnosis")
    }

    #[test]
    fn a_stretch_of_another_plant_is_what_the_sentence_is_of() {
        let mut d = friction(0.6, 0.5, 2.0);
        d.verdict = Verdict::PartlyExplained;
        d.causes[0].probability = 0.99;
        let another = ndof_diagnose::AnotherPlant { stretch: "the held-out part from 42.50 to 50.00 s".to_owned(), nrmse: vec![Some(0.01)] };
        assert!(sentence(&d).ends_with("Something is left that none of the known causes explains."), "{}", sentence(&d));
        d.discrepancy.another_plant = Some(another);
        let told = "The held-out part from 42.50 to 50.00 s is as of another plant than what was fitted.";
        assert!(sentence(&d).ends_with(told), "{}", sentence(&d));
        (d.verdict, d.causes) = (Verdict::Unexplained, Vec::new());
        assert_eq!(sentence(&d), told);
    }

    #[test]
    fn a_share_is_told_where_the_free_run_is_better_for_it() {
        assert!(sentence(&friction(0.6, 0.5, 2.0)).contains("explains 60 % of what"));
        assert!(sentence(&friction(0.6, 1.1, 2.0)).contains("is part of what"), "a free run that is worse");
        assert!(sentence(&friction(0.001, 0.99, 2.0)).contains("is part of what"), "next to nothing");
    }

    #[test]
    fn less_friction_than_the_file_has_is_called_less() {
        assert!(sentence(&friction(0.6, 0.5, 2.0)).starts_with("It sticks before it moves"));
        assert!(sentence(&friction(0.6, 0.5, 0.3)).starts_with("It sticks less than simulated"));
    }

    #[test]
    fn every_cause_has_words_of_its_own() {
        let effects = ndof_models::effects::EFFECTS.iter().map(|effect| effect.name()).chain(ndof_joints::CAUSES.iter().map(|cause| cause.card.name));
        for effect in effects {
            assert_ne!(plain(effect), plain("no such effect"), "{effect}");
        }
    }

    #[test]
    fn causes_of_one_name_are_listed_once_with_their_places() {
        let causes = [("coulomb-friction", "elbow"), ("payload", ""), ("coulomb-friction", "wrist")];
        assert_eq!(listed(causes.into_iter()), "dry friction at elbow, wrist; a payload");
    }

    #[test]
    fn a_knock_is_told_by_when_it_was() {
        let knock = CauseParameter { name: "time_s".into(), unit: "s".into(), value: Value::Number(23.66), ci95: Some([23.66, 25.26]) };
        assert_eq!(stretch(std::slice::from_ref(&knock)).as_deref(), Some(" between 23.66 and 25.26 s"));
        assert_eq!(stretch(&[CauseParameter { name: "level_n".into(), ..knock }]), None);
    }

    #[test]
    fn an_amount_has_the_digits_that_its_interval_allows() {
        let of = |value: f64, half: f64| {
            let parameter = CauseParameter { name: "k".into(), unit: "N/m".into(), value: Value::Number(value), ci95: Some([value - half, value + half]) };
            amount(&[parameter]).expect("a number")
        };
        assert_eq!(of(297.123, 8.31), "297.1 ± 8.3 N/m");
        assert_eq!(of(2_315_261.0, 57_584.0), "(2.315 ± 0.058)e6 N/m");
        let skew = CauseParameter { name: "cutoff_hz".into(), unit: "Hz".into(), value: Value::Number(74.61), ci95: Some([44.64, 87.21]) };
        assert_eq!(amount(&[skew]).as_deref(), Some("75 Hz (45 to 87)"));
    }
}
