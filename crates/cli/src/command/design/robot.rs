//! `ndof design --robot`: what is said of a motion of joints.

use crate::error::CliError;
use crate::options::Shared;
use crate::output::{self, headed, short};
use ndof_study::design::excitation::{ExcitationResult, ExcitedParameter};
use ndof_study::{RobotMotion, excitation_report};
use std::path::Path;

/// Parameters that are printed: those that will be known worst.
const WORST: usize = 8;

pub fn run(motion: &RobotMotion, out: &Path, shared: &Shared) -> Result<(), CliError> {
    motion.robot.as_deref().into_iter().for_each(ndof_io::keep);
    let excited = motion.run()?;
    output::create_folder(out.parent().unwrap_or_else(|| Path::new("")))?;
    ndof_io::write(out, &excited.recording)?;
    output::json(shared, &excited.result)?;
    output::report(shared, &excitation_report(&excited, &output::command_line())?)?;
    output::warnings(shared, &excited.result.head.warnings);
    output::table(shared, &format!("{}\n{}\n", summary(&excited.result), out.display()))
}

fn summary(result: &ExcitationResult) -> String {
    let of = |value: f64, limit: Option<f64>| limit.map_or_else(|| short(value), |limit| format!("{} of {}", short(value), short(limit)));
    let head = ["largest of a joint, and its limit", "from", "to", "range", "speed", "acceleration", "torque"];
    let limits = result.joints.iter().map(|j| {
        vec![
            format!("{} ({})", j.name, j.unit),
            short(j.range_used[0]),
            short(j.range_used[1]),
            format!("{} … {}", short(j.range[0]), short(j.range[1])),
            of(j.speed, Some(j.speed_limit)),
            of(j.acceleration, j.acceleration_limit),
            of(j.torque, j.torque_limit),
        ]
    });
    let mut worst: Vec<_> = result.parameters.iter().filter(|p| p.of_interest && p.relative_standard_error.is_some()).collect();
    worst.sort_by(|a, b| b.relative_standard_error.unwrap_or(0.0).total_cmp(&a.relative_standard_error.unwrap_or(0.0)));
    let error = |p: &ExcitedParameter| vec![p.name.clone(), short(p.value), format!("± {} %", short(p.relative_standard_error.map(|share| 100.0 * share)))];
    format!(
        "{}\ncondition of the regressor: {}; of random motions {} in the mean, {} at best\n\n{}",
        headed(&head, limits),
        short(result.condition),
        short(result.condition_random_mean),
        short(result.condition_random_best),
        headed(&["known worst", "value", "standard error"], worst.into_iter().take(WORST).map(error))
    )
}
