//! Inputs whose power does not come evenly in time: sweeps, steps, bursts and stretches of rest.

use super::channel::role;
use super::result::Finding;
use crate::trials::roles::Roles;
use ndof_signal::Recording;
use ndof_sysid::{Steadiness, repeats, steadiness};
use rayon::prelude::*;

/// How evenly each driver of a recording drives, where that can be told. What repeats itself comes and goes on purpose: averages over its periods
/// hold.
pub(crate) fn evenness(recording: &Recording, roles: &Roles) -> Vec<Steadiness> {
    let of = |&index: &usize| even(&recording.channels()[index].samples, recording.sample_rate_hz());
    roles.ports.drivers().par_iter().filter_map(of).collect()
}

/// The same of one driver.
pub(super) fn even(samples: &[f64], sample_rate_hz: f64) -> Option<Steadiness> {
    let seen = steadiness(samples, sample_rate_hz)?;
    let uneven = seen.is_unsteady() || !seen.rest.is_empty();
    (!uneven || repeats(samples).is_none()).then_some(seen)
}

/// Findings of a recording, by how evenly its drivers drive.
pub(super) fn unsteady<'a>(recording: &Recording, roles: &Roles, trial: usize, evenness: impl IntoIterator<Item = (usize, &'a Steadiness)>) -> Vec<Finding> {
    let mut found = Vec::new();
    let second = |sample: usize| recording.start_s() + sample as f64 / recording.sample_rate_hz();
    for (index, seen) in evenness {
        let (name, role) = (recording.channels()[index].name.as_str(), role(Some(roles), index));
        let share = 100.0 * seen.share;
        let mut say = |code: &str, message: String, action: &str| found.push(Finding::new(code, "remark", trial, Some(name), message, action));
        let averages = "leave `method` out: averages over segments (welch) each see another input; local polynomials take it for what it is, and multitaper where what comes early could be taken for the record's beginning";
        match seen.sweep {
            Some(up) if seen.is_unsteady() => {
                let way = if up { "upwards" } else { "downwards" };
                say("sweep", format!("the {role} is a sweep, {way}: each band has its power in {share:.0} % of the time"), averages);
            }
            None if seen.is_unsteady() => {
                say(
                    "unsteady-input",
                    format!("the {role}'s power comes and goes, as with steps, pulses and bursts: it counts for {share:.0} % of the time"),
                    averages,
                );
            }
            _ => {}
        }
        for rest in seen.rest.iter().filter(|_| !seen.is_sweep()) {
            let message = format!("the {role} rests from {:.3} to {:.3} s", second(rest.start), second(rest.end));
            say("rest", message, "nothing at the ends of a recording, which `method=auto` leaves out; give what lies between with `exclude`");
        }
    }
    found
}
