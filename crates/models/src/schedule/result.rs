//! What a scheduled fit finds.

use super::band::standard_errors;
use super::spline::Splines;
use faer::Mat;
use ndarray::Array2;
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

/// Mean over the schedule of an effort or a motion, as finely as the splines of the mean follow it.
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
    pub(super) splines: Splines,
    pub(super) curves: Vec<RowCurves>,
}

/// What the curves of one row of the matrices depend on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RowCurves {
    pub coefficients: Vec<f64>,
    pub covariance: Mat<f64>,
    pub pointwise: f64,
    /// First coefficient and whether it varies of each entry, matrix by matrix.
    pub entries: Vec<(usize, bool)>,
}

impl Scheduled {
    /// Entry (`row`, `column`) of Lᵀ Σ X R over the `parts`, X one of the matrices with its R; L and R are axes × joints at each place. It counts as
    /// one of the first part's.
    ///
    /// Each row of the matrices is a fit of its own, and their errors count as independent.
    pub fn transformed(&self, (row, column): (usize, usize), left: &[Array2<f64>], parts: &[(Term, &[Array2<f64>])]) -> ScheduledEntry {
        let (axes, term) = (self.curves.len(), parts.first().map_or(Term::Stiffness, |part| part.0));
        let widths = self.curves.iter().map(|curves| curves.coefficients.len());
        let begins: Vec<usize> = widths.clone().scan(0, |sum, width| Some(std::mem::replace(sum, *sum + width))).collect();
        let mut rows = vec![vec![0.0; widths.sum()]; self.at.len()];
        for (place, (u, weights)) in self.at.iter().zip(&mut rows).enumerate() {
            for (r, curves) in self.curves.iter().enumerate() {
                for (c, (term, right)) in (0..axes).flat_map(|c| parts.iter().map(move |part| (c, part))) {
                    let matrix = Term::ALL.iter().position(|t| t == term).unwrap_or(0);
                    let (first, varies) = curves.entries[matrix * axes + c];
                    let (share, at) = (left[place][[r, row]] * right[place][[c, column]], begins[r] + first);
                    if varies {
                        self.splines.at(*u).into_iter().for_each(|(k, value)| weights[at + k] += share * value);
                    } else {
                        weights[at] += share;
                    }
                }
            }
        }
        let owner = |i: usize| begins.partition_point(|begin| *begin <= i) - 1;
        let covariance = |i: usize, j: usize| {
            let r = owner(i);
            if r == owner(j) { self.curves[r].covariance[(i - begins[r], j - begins[r])] } else { 0.0 }
        };
        let coefficients: Vec<f64> = self.curves.iter().flat_map(|curves| curves.coefficients.iter().copied()).collect();
        let (std_error, wide) = standard_errors(&rows, covariance);
        let pointwise = self.curves.iter().map(|curves| curves.pointwise).fold(0.0, f64::max);
        let parts = || self.entries.iter().filter(|entry| entry.term == term);
        ScheduledEntry {
            term,
            row,
            column,
            varies: true,
            value: rows.iter().map(|row| row.iter().zip(&coefficients).map(|(w, c)| w * c).sum()).collect(),
            std_error,
            pointwise,
            simultaneous: wide.max(pointwise),
            degrees_of_freedom: parts().map(|entry| entry.degrees_of_freedom).fold(1.0, f64::max),
        }
    }

    /// An entry of a matrix.
    pub fn entry(&self, term: Term, row: usize, column: usize) -> Option<&ScheduledEntry> {
        self.entries.iter().find(|e| (e.term, e.row, e.column) == (term, row, column))
    }
}
