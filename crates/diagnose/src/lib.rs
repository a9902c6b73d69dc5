//! What a simulation gets wrong, and why.
//!
//! [`diagnose`] takes the recordings of one experiment and says what a linear simulation of it misses, names the cause from the
//! registry of [effects](ndof_models::effects), extends the model with it, and measures the gain on data that no fit saw.
//!
//! How: the balance of forces M ẍ + B ẋ + K x + f = F is written in the frequency domain over blocks of time, every effect is a
//! further regressor computed from the measured motion (nothing is integrated that could diverge), and a Whittle likelihood with a
//! noise spectrum of its own for each hypothesis decides. A free run of the extended model over held-out data confirms.

mod answer;
mod band;
mod baseline;
mod detectors;
mod diagnose;
mod error;
mod extended;
mod floor;
mod free_run;
mod generic;
mod hypotheses;
mod judge;
mod layout;
mod linear;
mod optimise;
mod options;
mod plant;
mod probability;
mod result;
mod robot;
mod samples;
mod search;
mod state;
mod subject;
mod whittle;

pub use baseline::{Baseline, Part, Status};
pub use diagnose::diagnose;
pub use error::DiagnoseError;
pub use options::{HeldOut, Options};
pub use probability::Features;
pub use result::{
    BandShare, Cause, CauseParameter, Confusable, Considered, Diagnosis, Discrepancy, Extended, Gain, Minor, Model, ModelParameter, NoiseFloor, Score, Shift, Site,
    Split, TimeShare, Verdict,
};

#[doc(hidden)]
pub fn trace(trials: &[ndof_signal::Recording], ports: &ndof_sysid::Ports, options: &Options) -> Result<String, DiagnoseError> {
    use std::fmt::Write;
    let meaning = samples::Meaning::new(&trials[0], ports)?;
    let s = samples::Samples::new(trials, ports, &meaning)?;
    let t = std::time::Instant::now();
    let subject = subject::Subject::new(&s, &meaning, options, None)?;
    let mut out = String::new();
    let l = &subject.layout;
    let _ = writeln!(out, "band to {:.2} Hz rate {:.1} blocks {} lines {} spring {} hyps {} prep {:.2}s mass {:?} K {:?} loop {}", l.frequency_hz[l.lines() - 1], l.rate_hz, l.blocks(), l.lines(), subject.scale.spring, subject.hypotheses.len(), t.elapsed().as_secs_f64(), subject.scale.mass, subject.scale.stiffness, matches!(subject.cause, state::Cause::Loop(_)));
    let found = subject.search(4, &mut |_| {}).ok_or(DiagnoseError::BaselineFailed)?;
    for (k, step) in found.steps.iter().enumerate() {
        for j in step.judged.iter().take(5) {
            let h = &subject.hypotheses[j.hypothesis];
            let _ = writeln!(out, "  {k}: {} [{}] {:?} gain {:.1} net {:.1} share {:.4} {:?}", h.effect.name(), h.form.label, h.form.axis, j.gain, j.net, j.share, (h.form.naming)(&j.tried.knobs, &j.tried.coefficients));
        }
    }
    for (c, w) in found.chosen.iter().zip(&found.worth) {
        let h = &subject.hypotheses[c.hypothesis];
        let _ = writeln!(out, "  => {} [{}] {:?} worth {w:.1} {:?}", h.effect.name(), h.form.label, h.form.axis, c.knobs);
    }
    let _ = writeln!(out, "  time {:.2}", t.elapsed().as_secs_f64());
    Ok(out)
}
