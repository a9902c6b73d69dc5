//! The mechanism that a free-run fit simulates.

use crate::{Axis, ParameterInfo};
use serde::{Deserialize, Serialize};

/// M ẍ + B ẋ + K x + F_c tanh(ẋ/v_s) + F_0 = F for N axes, with or without spring, dry friction and offset.
///
/// Parameters in this order, matrices symmetric and by their upper triangle row by row: M, B, K where `spring`,
/// `coulomb_n` of each axis where `coulomb`, `offset_n` of each axis where `offset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mechanism {
    /// The axes.
    pub axes: Vec<Axis>,
    /// Whether a spring holds it; a free mass has none.
    pub spring: bool,
    /// Whether dry friction acts on each axis.
    pub coulomb: bool,
    /// Whether a constant force acts on each axis.
    pub offset: bool,
    /// v_s: dry friction turns around within this velocity (m/s, rad/s).
    pub stick_velocity: f64,
}

impl Mechanism {
    /// Entries of one matrix.
    pub(crate) fn entries(&self) -> Vec<(usize, usize)> {
        let n = self.axes.len();
        (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).collect()
    }

    /// Number of matrices: M, B and perhaps K.
    pub(crate) fn matrices(&self) -> usize {
        if self.spring { 3 } else { 2 }
    }

    /// What the parameters are.
    pub fn parameters(&self) -> Vec<ParameterInfo> {
        let single = self.axes.len() == 1;
        let free = |name: String, unit: String, site: String, lower: f64| ParameterInfo { name, unit, site, lower, upper: f64::INFINITY };
        let mut out = Vec::new();
        for (matrix, rate) in [("M", 2), ("B", 1), ("K", 0)].into_iter().take(self.matrices()) {
            for (i, j) in self.entries() {
                let (row, column) = (&self.axes[i], &self.axes[j]);
                let name = if single { matrix.to_owned() } else { format!("{matrix}_{}_{}", row.name, column.name) };
                let site = if i == j { row.name.clone() } else { format!("{},{}", row.name, column.name) };
                // A mass of nothing would fly off.
                let lower = if matrix == "M" && i == j { 1e-9 } else { f64::NEG_INFINITY };
                out.push(free(name, row.unit_per(column, rate), site, lower));
            }
        }
        for (stem, used) in [("coulomb", self.coulomb), ("offset", self.offset)] {
            for axis in self.axes.iter().filter(|_| used) {
                let (suffix, unit) = if axis.rotational { ("nm", "N m") } else { ("n", "N") };
                let name = if single { format!("{stem}_{suffix}") } else { format!("{stem}_{suffix}_{}", axis.name) };
                out.push(free(name, unit.to_owned(), axis.name.clone(), f64::NEG_INFINITY));
            }
        }
        out
    }
}
