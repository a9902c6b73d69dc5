//! What unit tests share.
#![cfg(test)]

use crate::Options;
use crate::samples::{Meaning, Samples};
use crate::search::Stand;
use crate::subject::Subject;
use ndof_challenge::{Case, Made, Plant, make};
use ndof_signal::Recording;

/// Trials of a linear plant.
pub(crate) fn linear(plant: Plant, (trials, duration_s): (usize, f64), seed: u64) -> Made {
    make(&Case { plant, hidden: vec![], other: false, background: false, trials, duration_s, seed, command: (1.0, 1.0) })
}

/// What a search knows of a case, with recordings that may be others than its own.
pub(crate) fn known(made: &Made, recordings: &[Recording]) -> (Samples, Meaning) {
    let meaning = Meaning::new(&recordings[0], &made.ports).expect("efforts and motions");
    (Samples::new(recordings, &made.ports, &meaning).expect("samples"), meaning)
}

/// The search's subject, and its baseline along the balance of forces.
pub(crate) fn baseline(samples: &Samples, meaning: &Meaning) -> (Subject, Stand) {
    let subject = Subject::new(samples, meaning, &Options::default(), None, true).expect("a subject");
    let stand = subject.stand(&[], &subject.start, 4).expect("a fit");
    (subject, stand)
}
