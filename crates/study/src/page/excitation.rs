//! The report of a robot's motion: what it keeps, what it tells, how it looks.

use crate::design::ExcitedRobot;
use ndof_report::figures::{self, FigureError, Trace, Traces};
use ndof_report::number::{nan, significant};
use ndof_report::{Report, Section, Table};
use ndof_signal::{Channel, Quantity};

/// The page of `ndof design --robot`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn excitation_report(excited: &ExcitedRobot, command: &str) -> Result<Report, FigureError> {
    let result = &excited.result;
    let numbers = [Some(result.condition), result.condition_random_mean, result.condition_random_best].map(|v| significant(nan(v), 3));
    let [condition, mean, best] = &numbers;
    let mut joints = Table::new("Largest of each joint, and its limit", ["Joint"], ["Range", "Speed", "Acceleration", "Torque"]);
    let of =
        |value: f64, limit: Option<f64>| limit.map_or_else(|| significant(value, 3), |limit| format!("{} of {}", significant(value, 3), significant(limit, 3)));
    for j in &result.joints {
        let [range, used] = [j.range, j.range_used].map(|[low, high]| format!("{} … {}", significant(low, 3), significant(high, 3)));
        joints = joints.row([
            j.name.clone(),
            format!("{used} of {range} {}", j.unit),
            of(j.speed, Some(j.speed_limit)),
            of(j.acceleration, j.acceleration_limit),
            of(j.torque, j.torque_limit),
        ]);
    }
    let mut parameters = Table::new("Predicted errors", ["Parameter"], ["Value", "Standard error", "in %"]);
    for p in &result.parameters {
        let numbers = [p.value, p.standard_error, 100.0 * nan(p.relative_standard_error)].map(|v| significant(v, 3));
        parameters = parameters.row(std::iter::once(p.name.clone()).chain(numbers));
    }
    let traces = Traces {
        sample_rate_hz: excited.recording.sample_rate_hz(),
        start_s: 0.0,
        traces: excited.recording.channels().iter().filter(|c| c.unit.quantity() == Quantity::Displacement).map(|c| trace(c, result)).collect(),
        detail_s: None,
    };
    Ok(Report {
        lead: format!("The condition of the regressor is {condition}; that of random motions within the same limits is {mean} in the mean and {best} at best."),
        facts: vec![
            ("Robot".to_owned(), result.robot.clone()),
            ("Motion".to_owned(), format!("{} s in periods of {} s at {} Hz", result.duration_s, result.period_s, result.sample_rate_hz)),
        ],
        sections: vec![
            Section::new("Limits", "In rad, rad/s, rad/s² and N m; of sliding joints in m, m/s, m/s² and N.").table(joints),
            Section::new("What it determines", "With torque noise that is white from sample to sample, of the nominal model's size.").table(parameters),
            Section::new("Angles", "The first period.").figure(figures::traces("angles", "Angles", &traces)?),
        ],
        ..Report::of(&result.head, "Motion of a robot", command)
    })
}

/// The first period of a channel.
fn trace(channel: &Channel, result: &crate::design::excitation::ExcitationResult) -> Trace {
    let samples = ((result.period_s * result.sample_rate_hz).round() as usize).min(channel.samples.len());
    Trace { label: channel.name.clone(), unit: channel.unit.symbol().to_owned(), measured: channel.samples[..samples].to_vec(), simulated: Vec::new() }
}
