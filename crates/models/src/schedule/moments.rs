//! Sums of products of the rows: all that a linear fit asks of the data.

use super::ScheduleError;
use super::design::{Layout, Rows};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};

/// A share of the largest diagonal that keeps splines of the mean finite where no sample lies.
const RIDGE: f64 = 1e-10;

/// Which of inertia, damping and stiffness follow the schedule, in the order of the equation's derivatives: K, B, M.
pub(super) type Varying = [bool; 3];

/// Columns of a model, each the sum of these columns of the rows: one spline, or all of an entry that stays constant, as splines add up to one.
pub(super) struct Columns {
    pub summed: Vec<Vec<usize>>,
    /// Where the splines of each entry that varies begin.
    pub groups: Vec<usize>,
    /// First column and whether it varies of each entry, matrix by matrix.
    pub entries: Vec<(usize, bool)>,
}

impl Columns {
    pub(super) fn new(layout: &Layout, varying: Varying) -> Self {
        let count = layout.splines.count();
        let mut columns = Columns { summed: Vec::new(), groups: Vec::new(), entries: Vec::new() };
        for (matrix, varies) in varying.into_iter().enumerate() {
            for input in 0..layout.axes {
                let own = (0..count).map(|k| layout.column(matrix, input, k));
                columns.entries.push((columns.summed.len(), varies));
                if varies {
                    columns.groups.push(columns.summed.len());
                    columns.summed.extend(own.map(|c| vec![c]));
                } else {
                    columns.summed.push(own.collect());
                }
            }
        }
        columns
    }
}

/// Products of all columns of the rows with each other, and how many rows there are.
#[derive(Clone)]
pub(super) struct Products {
    pub gram: Mat<f64>,
    pub rows: usize,
}

impl Products {
    pub(super) fn of(rows: &Rows) -> Self {
        let all = MatRef::from_row_major_slice(&rows.values, rows.block.len(), rows.width);
        Products { gram: all.transpose() * all, rows: rows.block.len() }
    }

    /// Those of each fold, which `fold` gives for a block.
    pub(super) fn folds(rows: &Rows, folds: usize, fold: impl Fn(usize) -> usize) -> Vec<Self> {
        let mut parts = vec![(Vec::new(), 0); folds];
        for (row, block) in rows.values.chunks_exact(rows.width).zip(&rows.block) {
            let (values, count) = &mut parts[fold(*block)];
            values.extend_from_slice(row);
            *count += 1;
        }
        let product = |(values, count): (Vec<f64>, usize)| {
            let all = MatRef::from_row_major_slice(&values, count, rows.width);
            Products { gram: all.transpose() * all, rows: count }
        };
        parts.into_iter().map(product).collect()
    }

    /// All but a part.
    pub(super) fn without(&self, part: &Products) -> Self {
        Products { gram: &self.gram - &part.gram, rows: self.rows - part.rows }
    }

    fn summed(&self, left: &[Vec<usize>], right: &[Vec<usize>]) -> Mat<f64> {
        Mat::from_fn(left.len(), right.len(), |i, j| left[i].iter().map(|a| right[j].iter().map(|b| self.gram[(*a, *b)]).sum::<f64>()).sum())
    }
}

/// The normal equations of one row of the matrices for these columns and the mean's behind them.
///
/// `d` are the regressors, or what the instruments tell of them: D = Z (ZᵀZ)⁻¹ ZᵀX (two-stage least squares), X those that were measured.
pub(super) struct Normal {
    pub rows: usize,
    pub dd: Mat<f64>,
    pub dy: Mat<f64>,
    pub xx: Mat<f64>,
    pub xy: Mat<f64>,
    pub yy: f64,
}

impl Normal {
    /// Those of an effort with instruments, where the rows have them.
    pub(super) fn new(products: &Products, layout: &Layout, columns: &[Vec<usize>], output: usize) -> Result<Self, ScheduleError> {
        let normal = Self::measured(products, layout, columns, output);
        let width = products.gram.ncols();
        if width == layout.regressors() + layout.mean.count() + layout.axes {
            return Ok(normal);
        }
        let (mean, y) = (mean_columns(width, layout), [vec![width - layout.axes + output]]);
        let x: Vec<Vec<usize>> = columns.iter().chain(&mean).cloned().collect();
        // The sum of columns that stand there by themselves says nothing new.
        let single = |c: &usize| columns.iter().any(|other| other.as_slice() == [*c]);
        let own = columns.iter().filter(|c| c.len() == 1 || !c.iter().all(single));
        let shifted = own.map(|c| c.iter().map(|c| c + layout.regressors()).collect());
        let z: Vec<Vec<usize>> = shifted.chain(mean.iter().cloned()).collect();
        let (zx, zy) = (products.summed(&z, &x), products.summed(&z, &y));
        let zz = lifted(products.summed(&z, &z), z.len() - mean.len()).llt(Side::Lower).map_err(|_| ScheduleError::Undetermined)?;
        let dd = lifted(zx.transpose() * zz.solve(&zx), columns.len());
        Ok(Normal { dd, dy: zx.transpose() * zz.solve(&zy), ..normal })
    }

    /// Those of an effort, the measured motion as it is.
    pub(super) fn measured(products: &Products, layout: &Layout, columns: &[Vec<usize>], output: usize) -> Self {
        let width = products.gram.ncols();
        let x: Vec<Vec<usize>> = columns.iter().cloned().chain(mean_columns(width, layout)).collect();
        let y = [vec![width - layout.axes + output]];
        let (xx, xy) = (products.summed(&x, &x), products.summed(&x, &y));
        Normal { rows: products.rows, dd: lifted(xx.clone(), columns.len()), dy: xy.clone(), xx, xy, yy: products.summed(&y, &y)[(0, 0)] }
    }

    /// ‖y − Xβ‖².
    pub(super) fn left(&self, beta: &Mat<f64>) -> f64 {
        let explained = (beta.transpose() * (&self.xy * faer::Scale(2.0) - &self.xx * beta))[(0, 0)];
        self.yy - explained
    }
}

fn mean_columns(width: usize, layout: &Layout) -> Vec<Vec<usize>> {
    let end = width - layout.axes;
    (end - layout.mean.count()..end).map(|c| vec![c]).collect()
}

/// With a ridge on the columns of the mean, which begin at `first`.
fn lifted(mut gram: Mat<f64>, first: usize) -> Mat<f64> {
    let largest = (first..gram.nrows()).map(|k| gram[(k, k)]).fold(0.0, f64::max);
    (first..gram.nrows()).for_each(|k| gram[(k, k)] += RIDGE * largest);
    gram
}
