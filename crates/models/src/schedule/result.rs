//! What a scheduled fit finds.

use serde::{Deserialize, Serialize};

/// A matrix of the equation of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Term {
    /// K, of displacement.
    Stiffness,
    /// B, of velocity.
    Damping,
    /// M, of acceleration.
    Inertia,
}

impl Term {
    /// All, in the order of derivatives.
    pub const ALL: [Term; 3] = [Term::Stiffness, Term::Damping, Term::Inertia];

    /// The field's letter.
    pub fn symbol(self) -> char {
        match self {
            Term::Stiffness => 'K',
            Term::Damping => 'B',
            Term::Inertia => 'M',
        }
    }
}

/// One entry of a matrix at the places [`Scheduled::at`].
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledEntry {
    /// Which matrix.
    pub term: Term,
    /// Row: the effort's axis.
    pub row: usize,
    /// Column: the motion's axis.
    pub column: usize,
    /// Whether it was let vary.
    pub varies: bool,
    /// Its values (SI).
    pub value: Vec<f64>,
    /// Their standard errors, under the penalty as a prior.
    pub std_error: Vec<f64>,
    /// Half widths of 95 % intervals in standard errors, at each place by itself.
    pub pointwise: f64,
    /// The same of a band that holds the whole curve.
    pub simultaneous: f64,
    /// Effective number of coefficients, from one for a constant.
    pub degrees_of_freedom: f64,
}

/// Mean over the schedule of an effort or a motion, within the band.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanMovement {
    /// Of each effort at the places, an axis.
    pub effort: Vec<Vec<f64>>,
    /// Of each displacement.
    pub motion: Vec<Vec<f64>>,
}

/// Inertia, damping and stiffness over a schedule.
#[derive(Clone, Debug, PartialEq)]
pub struct Scheduled {
    /// Places of the curves, from 0 to 1.
    pub at: Vec<f64>,
    /// Entries matrix by matrix in the order of [`Term::ALL`], row by row.
    pub entries: Vec<ScheduledEntry>,
    /// Of each matrix: probability of so much variation if it were constant, the least of its rows times their number.
    pub probability_if_constant: [f64; 3],
    /// The mean movement.
    pub mean: MeanMovement,
    /// Variance accounted for of the deviation from the mean movement, of blocks that the fit has not seen, by the constant matrices, an
    /// effort (1 is all). Empty where there are too few blocks.
    pub vaf_constant: Vec<f64>,
    /// The same by the matrices that vary.
    pub vaf_varying: Vec<f64>,
    /// Order of the autoregression, an effort.
    pub noise_order: Vec<usize>,
    /// Rows of the regression: samples within the band.
    pub rows: usize,
    /// How many times blocks were held out.
    pub folds: usize,
    /// Share of each motion's variance that the command foretells, where it is the instrument.
    pub foretold: Option<Vec<f64>>,
}

impl Scheduled {
    /// An entry of a matrix.
    pub fn entry(&self, term: Term, row: usize, column: usize) -> Option<&ScheduledEntry> {
        self.entries.iter().find(|e| (e.term, e.row, e.column) == (term, row, column))
    }
}
