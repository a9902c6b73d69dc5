//! What a simulation gets wrong, and why.

mod band;
mod baseline;
mod error;
mod hypotheses;
mod layout;
mod linear;
mod optimise;
mod options;
mod plant;
mod robot;
mod samples;
mod search;
mod state;
mod subject;
mod whittle;

pub use baseline::{Baseline, Part, Status};
pub use error::DiagnoseError;
pub use options::{HeldOut, Options};

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
