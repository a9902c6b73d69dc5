//! What every reader hands over: named columns, before units and time are understood.

use crate::error::Place;
use crate::recording::Note;
use std::collections::{BTreeMap, BTreeSet};

/// One column of a file in the file's own unit; a missing sample is NaN.
#[derive(Clone, Debug, Default)]
pub(crate) struct Column {
    pub name: String,
    pub unit: Option<String>,
    pub samples: Vec<f64>,
    pub rounding: Rounding,
}

impl Column {
    /// The column without its samples.
    #[cfg(feature = "parquet")]
    pub fn header(&self) -> Self {
        Column { name: self.name.clone(), unit: self.unit.clone(), samples: Vec::new(), rounding: self.rounding }
    }
}

/// How coarsely the numbers of a column are written.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Rounding {
    /// The smallest decimal place in use, e.g. 1e-3; 0 for binary numbers.
    pub place: f64,
    /// The most significant digits in use; 0 for binary numbers.
    pub significant: u32,
    /// The epsilon of a binary type coarser than `f64`, else 0.
    pub relative: f64,
}

impl Rounding {
    /// The spacing of the written numbers about `value`.
    pub fn about(&self, value: f64) -> f64 {
        let digits = if self.significant > 0 && value != 0.0 { 10f64.powi(value.abs().log10().floor() as i32 + 1 - self.significant as i32) } else { 0.0 };
        self.place.max(self.relative * value.abs()).max(digits)
    }
}

/// A file as columns and facts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    /// The trial's name, in a file that may hold several.
    pub trial: Option<String>,
    pub columns: Vec<Column>,
    pub metadata: BTreeMap<String, String>,
    pub notes: Vec<Note>,
    /// The line of each row in a text file; empty for binary files.
    pub lines: Vec<usize>,
}

impl Table {
    /// Where row `row` stands in the file.
    pub fn place(&self, row: usize) -> Place {
        self.lines.get(row).map_or(Place::Sample(row), |&line| Place::Line(line))
    }

    /// What is known besides the columns.
    #[cfg(feature = "parquet")]
    pub fn facts(&self) -> Self {
        Table { trial: self.trial.clone(), columns: Vec::new(), metadata: self.metadata.clone(), notes: self.notes.clone(), lines: Vec::new() }
    }

    /// Gives columns that have the name of another one a number behind it: `emg`, `emg_2`.
    pub fn rename_repeated(&mut self) {
        let mut seen = BTreeSet::new();
        for column in &mut self.columns {
            let mut name = column.name.clone();
            let mut count = 1;
            while !seen.insert(name.clone()) {
                count += 1;
                name = format!("{}_{count}", column.name);
            }
            column.name = name;
        }
    }
}
