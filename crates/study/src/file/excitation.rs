//! The commanded perturbation, as experiments and `ndof design` describe it.

use ndof_analysis::{did_you_mean, nearest};
use ndof_signal::{AxisPlan, Lines, Sweep};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The commanded perturbation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Excitation {
    /// `filtered-noise`, `multisine`, `prbs` or `chirp`; `file` follows from the key of that name.
    pub kind: String,
    /// A designed perturbation that is replayed in place of all that follows: channels `cmd_…` of a recording; NAME.EXT for every
    /// trial, or NAME-1.EXT, NAME-2.EXT … as `ndof design` writes them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Where that file is looked for.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Root mean square of each axis (N, N m); of all axes together where it is pre-compensated.
    pub rms: f64,
    /// Corner of the low-pass.
    pub cutoff_hz: f64,
    /// Order of the low-pass.
    pub order: usize,
    /// Seeds tried for each trial; the one whose axes are least coherent is taken.
    pub candidates: usize,
    /// How many of the best seeds `ndof design` simulates, to take the one whose delivered forces are the least coherent.
    pub shortlist: usize,
    /// Band in which the search and the removal of coherence judge.
    pub search_band_hz: [f64; 2],
    /// Whether what is left of coherence between the axes is taken out of each trial.
    pub decorrelate: bool,
    /// Whether the inverse of the linear model of robot, hold and limb goes before it, so that the delivered forces have the
    /// properties that were designed.
    pub precompensate: bool,
    /// Times that a pre-compensated command is corrected by what the simulated device, its friction included, fails to deliver.
    pub corrections: usize,
    /// Length of a period, of multisine and binary sequence.
    pub period_s: f64,
    /// Lines of a multisine, ends of a sweep.
    pub band_hz: [f64; 2],
    /// Which harmonics of a multisine carry power.
    pub harmonics: Lines,
    /// How the axes of a multisine are told apart.
    pub axis_plan: AxisPlan,
    /// Amplitudes of a multisine are proportional to frequency to this power.
    pub slope: f64,
    /// Steps that lower the peak of a multisine.
    pub crest_steps: usize,
    /// How the frequency of a chirp goes with time.
    pub sweep: Sweep,
    /// Time over which it fades in and out.
    pub fade_s: f64,
    /// Largest magnitude; a perturbation that exceeds it is scaled down as a whole.
    pub peak: Option<f64>,
    /// Largest change per second; a perturbation that exceeds it is scaled down as a whole.
    pub slew_per_s: Option<f64>,
}

impl Excitation {
    /// The kinds that are made.
    pub const KINDS: [&str; 4] = ["filtered-noise", "multisine", "prbs", "chirp"];
    /// Steepest low-pass: beyond it nothing falls faster that a robot could show.
    const MOST_ORDER: usize = 32;
    /// Most seeds that a search tries for each trial.
    const MOST_CANDIDATES: usize = 100_000;
    /// Most corrections by what a device fails to deliver; some steps settle it.
    const MOST_CORRECTIONS: usize = 100;
    /// Most steps that lower the peak of a multisine.
    const MOST_CREST_STEPS: usize = 100_000;
    /// The kind of one that is replayed.
    pub const FILE: &str = "file";

    /// Whether it comes from a file.
    pub fn replays(&self) -> bool {
        self.file.is_some()
    }

    /// Checks what the types do not; the message says what is wrong.
    pub(crate) fn check(&self) -> Result<(), String> {
        let kind = self.kind.as_str();
        if self.file.is_some() {
            let own = self.precompensate || self.decorrelate;
            return if own { Err("excitation.file is replayed as it is; precompensate and decorrelate belong to `ndof design`".to_owned()) } else { Ok(()) };
        }
        if kind == Self::FILE {
            return Err("excitation.kind = \"file\" without excitation.file; write for example file = \"cmd.csv\"".to_owned());
        }
        if !Self::KINDS.contains(&kind) {
            let suggestion = did_you_mean(nearest(kind, Self::KINDS).as_deref());
            return Err(format!("excitation.kind = \"{kind}\"{suggestion}; there are {}, and file = \"cmd.csv\"", Self::KINDS.join(", ")));
        }
        for (key, value, most) in [
            ("order", self.order, Self::MOST_ORDER),
            ("candidates", self.candidates, Self::MOST_CANDIDATES),
            ("shortlist", self.shortlist, Self::MOST_CANDIDATES),
            ("corrections", self.corrections, Self::MOST_CORRECTIONS),
            ("crest_steps", self.crest_steps, Self::MOST_CREST_STEPS),
        ] {
            if value > most {
                return Err(format!("{key} = {value}; at most {most} make sense"));
            }
        }
        if self.corrections > 0 && !self.precompensate {
            return Err("corrections improve a pre-compensated command; set precompensate, too".to_owned());
        }
        if self.decorrelate && kind != "filtered-noise" {
            return Err(format!("decorrelate changes the signals; it is for filtered-noise, a {kind} would lose what makes it one"));
        }
        Ok(())
    }
}

impl Default for Excitation {
    fn default() -> Self {
        Excitation {
            kind: "filtered-noise".to_owned(),
            file: None,
            folder: PathBuf::new(),
            rms: 4.0,
            cutoff_hz: 15.0,
            order: 8,
            candidates: 1,
            shortlist: 1,
            search_band_hz: [0.25, 12.0],
            decorrelate: false,
            precompensate: false,
            corrections: 0,
            period_s: 10.0,
            band_hz: [0.3, 12.0],
            harmonics: Lines::OddWithDetection,
            axis_plan: AxisPlan::Orthogonal,
            slope: 0.0,
            crest_steps: 200,
            sweep: Sweep::Logarithmic,
            fade_s: 0.0,
            peak: None,
            slew_per_s: None,
        }
    }
}
