//! What is wrong with one channel.

use super::assumptions::INTERVALS;
use super::result::Finding;
use crate::trials::roles::Roles;
use crate::trials::unit_of;
use ndof_signal::{Amplitudes, Channel, Quantity, Unit, frozen, lone_samples, reverse_arrangements};
use std::f64::consts::TAU;

/// Resolution as a share of the standard deviation above which it is coarse: its noise is a tenth of a hundredth of the power.
const COARSE: f64 = 0.1;
/// Distance from the median, in robust standard deviations, at which a single sample is an outlier.
const OUTLIER: f64 = 15.0;
/// A jump of an angle within this share of a turn is one.
const NEARLY_A_TURN: f64 = 0.05;
/// Metres that no person spans with both arms: 2.9 m is the longest known span.
const BEYOND_ARMS_M: f64 = 3.0;
/// Probability below which a trend is no chance.
const CHANCE: f64 = 1e-3;

/// What a channel is used as.
pub(super) fn role(roles: Option<&Roles>, index: usize) -> &'static str {
    let Some(ports) = roles.map(|roles| &roles.ports) else { return "none" };
    match index {
        _ if ports.references.contains(&index) => "reference",
        _ if ports.inputs.contains(&index) => "input",
        _ if ports.outputs.contains(&index) => "output",
        _ => "none",
    }
}

/// A channel's unit; of one that says nothing of it the one that an analysis takes it in.
pub(super) fn meant(roles: Option<&Roles>, index: usize, channel: &Channel) -> Unit {
    let found = roles.and_then(|roles| Some(unit_of(channel, roles.used().iter().position(|used| *used == index)?, roles)));
    found.unwrap_or_else(|| channel.unit.clone())
}

/// What is wrong with a channel in that role and unit, and what is worth knowing of one that is used.
pub(super) fn channel_findings(channel: &Channel, amplitudes: &Amplitudes, (role, unit): (&str, &Unit), trial: usize) -> Vec<Finding> {
    let mut found = Vec::new();
    let used = role != "none";
    let severity = if used { "fault" } else { "remark" };
    let mut say = |code: &str, severity: &str, message: String, action: &str| {
        found.push(Finding::new(code, severity, trial, Some(&channel.name), message, action));
    };
    let samples = &*amplitudes.samples;
    let missing = channel.samples.len() - samples.len();
    if missing > 0 {
        let first = channel.samples.iter().position(|sample| !sample.is_finite()).unwrap_or(0);
        let message = format!("{missing} of {} samples are missing, the first at sample {first}", channel.samples.len());
        say("missing-samples", severity, message, "cut the stretch out with `start`, `stop` or `exclude`, or repair the file");
    }
    if samples.len() < 3 {
        say("too-short", severity, format!("{} samples", samples.len()), "record longer");
        return found;
    }
    let [low, high] = amplitudes.range;
    if low == high {
        say("constant", severity, format!("it is {low} throughout"), "check the sensor and its cable");
        return found;
    }
    let angle = unit.quantity() == Quantity::Displacement && unit.is_rotational();
    let turns = channel.samples.windows(2).filter(|pair| angle && ((pair[1] - pair[0]).abs() / TAU - 1.0).abs() < NEARLY_A_TURN).count();
    if turns > 0 {
        let message = format!("it jumps by a whole turn {turns} times: the encoder begins anew at its end");
        say("angle-wrapped", severity, message, "unwrap the angle before, or set the encoder's zero elsewhere");
        return found;
    }
    // Commands may hold a level on purpose, or have few; a sensor that does has reached its limit, or is coarse.
    let sensed = role != "reference";
    if sensed && let share @ f64::MIN_POSITIVE.. = amplitudes.clipped() {
        let message = format!("{:.1} % of its samples stand still at the ends of its range, {low} and {high}", 100.0 * share);
        say("clipped", severity, message, "lower the amplifier's gain or the perturbation");
    }
    if !used {
        return found;
    }
    let std = amplitudes.std;
    if sensed && let Some(step) = amplitudes.step_above(COARSE * std) {
        let message = format!("its values are {step:.3e} apart, {:.0} % of its standard deviation", 100.0 * step / std);
        say("coarse-quantisation", "remark", message, "use a finer range of the sensor, or perturb more strongly");
    }
    if let Some(outliers @ 1..) = amplitudes.outliers(OUTLIER) {
        let message = format!("{outliers} sample(s) lie more than {OUTLIER} robust standard deviations from the median");
        say("outliers", "remark", message, "look at the trace; cut a knock or a glitch out with `exclude`");
    }
    let alone = if sensed { lone_samples(&channel.samples, OUTLIER) } else { Vec::new() };
    if let Some(first) = alone.first() {
        let message = format!("{} sample(s) stand alone, far off the line between their neighbours, the first is sample {first}", alone.len());
        say("lone-samples", "remark", message, "a bit may have been lost on the way: repair the file, or cut the place out with `exclude`");
    }
    let stopped = if role == "output" { frozen(&channel.samples) } else { Vec::new() };
    if let Some(first) = stopped.first() {
        let longest = stopped.iter().map(ExactSizeIterator::len).max().unwrap_or_default();
        let message =
            format!("it stands still {} time(s), for up to {longest} samples, while the motion goes on; first at sample {}", stopped.len(), first.start);
        say("frozen", "remark", message, "the sensor or its bus stopped: cut these stretches out with `exclude`");
    }
    if unit.quantity() == Quantity::Displacement && !unit.is_rotational() && high - low > BEYOND_ARMS_M {
        let message = format!("it moves over {:.3} m, more than any arm does", high - low);
        say("unlikely-unit", "remark", message, "if it is in millimetres or centimetres, write so in its header, as in `pos_x [mm]`");
    }
    let trend = |course: Result<Vec<f64>, _>| course.and_then(|course| reverse_arrangements(&course)).ok().filter(|trend| trend.p_value < CHANCE);
    if let Some(trend) = trend(amplitudes.means(INTERVALS)) {
        let message = format!("its mean has a trend over the record (reverse arrangements, p = {:.0e})", trend.p_value);
        say("drift", "remark", message, "let the sensor warm up and set its zero before a trial; a limb that gives way drifts as well");
    }
    if let Some(trend) = trend(amplitudes.mean_squares(INTERVALS)) {
        let message = format!("its mean square has a trend over the record (reverse arrangements, p = {:.0e})", trend.p_value);
        say("not-stationary", "remark", message, "leave the beginning out with `start`, or expect a limb that changes");
    }
    found
}
