//! The linear baseline: inertia, damping, stiffness, offsets, and what instruments may do within their tolerance.

use crate::baseline::{Baseline, Status};
use crate::curved::Curved;
use crate::layout::Layout;
use crate::state::{Cause, Column, State, Through};
use ndof_linear::square;
use ndof_models::ForceLaw;
use ndof_models::effects::{CurvedArm, Matrix};
use num_complex::Complex64;
use std::sync::Arc;

/// Standard deviation of a delay or filter that instruments have, for a band to 12 Hz.
const INSTRUMENT_DELAY_S: f64 = 2e-4;
/// Standard deviation of a force sensor's angle.
const INSTRUMENT_ANGLE_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Standard deviation of what gives way between the sensors of effort and motion, as a share of the motion at the end of the band: a transducer is used up
/// to a tenth of its resonance, where it is 1 % off, and that is two of them.
const INSTRUMENT_COMPLIANCE: f64 = 0.005;

/// What a base column's coefficient is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Role {
    /// An entry of M, B or K.
    Entry(Matrix, usize, usize),
    /// The offset of an equation in a trial.
    Offset(usize, usize),
    /// A power of time in an equation of a trial, which an integrated sensor leaves unknown.
    Integrated(usize, usize),
    /// A delay (or filter) of all effort channels that instruments may have (s).
    Latency,
    /// An angle between two effort channels' axes and their sensor's that instruments may have (rad).
    Angle,
    /// What gives way between the sensors of effort and motion (m/N, rad/(N m)), the same on all axes.
    Compliance,
}

impl Role {
    /// Whether it is of one trial alone, so that another part of the recording has its own.
    pub fn of_a_trial(self) -> bool {
        matches!(self, Role::Offset(..) | Role::Integrated(..))
    }
}

/// Inertia, damping and stiffness.
#[derive(Clone, Debug)]
pub(crate) struct Dynamics([Vec<Vec<f64>>; 3]);

impl Dynamics {
    /// An entry of M s² + B s + K.
    pub fn entry(&self, i: usize, j: usize, s: Complex64) -> Complex64 {
        let [m, b, k] = &self.0;
        (s * m[i][j] + b[i][j]) * s + k[i][j]
    }
}

/// Which entries the baseline has, and which of them are given.
#[derive(Clone)]
pub(crate) struct Structure {
    pub spring: bool,
    /// Entries that are given: matrix, row, column, value.
    pub given: Vec<(Matrix, usize, usize, f64)>,
    /// Which of the given ones may be wrong.
    pub nominal: Vec<(Matrix, usize, usize, f64)>,
    /// Matrices whose free part is symmetric.
    pub symmetric: Vec<Matrix>,
    pub tolerances: bool,
    /// What a compliance of instruments is small beside; none where that is not known, or no instrument lies between effort and motion.
    pub about: Option<Dynamics>,
    /// How many times what was measured of the motion is integrated to the displacement.
    pub integrals: usize,
    /// Forces that every model has.
    pub known: Vec<Arc<dyn ForceLaw>>,
}

impl Structure {
    /// The structure of a fitted baseline, or of the given one.
    pub fn new(axes: usize, baseline: Option<&Baseline>, spring: bool) -> Self {
        let mut structure = Structure {
            spring,
            given: vec![],
            nominal: vec![],
            // As `fit` has them: what turns is a cause.
            symmetric: vec![Matrix::Mass, Matrix::Damping, Matrix::Stiffness],
            tolerances: true,
            about: None,
            integrals: 0,
            known: Vec::new(),
        };
        let Some(baseline) = baseline else { return structure };
        for (matrix, part) in [(Matrix::Mass, &baseline.mass), (Matrix::Damping, &baseline.damping), (Matrix::Stiffness, &baseline.stiffness)] {
            let Some(part) = part else { continue };
            if part.status == Status::Free {
                if !part.symmetric && matrix != Matrix::Mass {
                    structure.symmetric.retain(|m| *m != matrix);
                }
                continue;
            }
            for i in 0..axes {
                for j in 0..axes {
                    let entry = (matrix, i, j, part.value[i][j]);
                    structure.given.push(entry);
                    if part.status == Status::Nominal {
                        structure.nominal.push(entry);
                    }
                }
            }
        }
        structure
    }

    /// Whether damping and stiffness are, as the inertia is.
    pub fn is_symmetric(&self) -> bool {
        [Matrix::Damping, Matrix::Stiffness].iter().all(|matrix| self.symmetric.contains(matrix))
    }

    fn is_given(&self, matrix: Matrix, i: usize, j: usize) -> bool {
        self.given.iter().any(|e| (e.0, e.1, e.2) == (matrix, i, j))
    }
}

/// The columns that every model has.
#[derive(Clone)]
pub(crate) struct Base {
    pub columns: Vec<Column>,
    pub roles: Vec<Role>,
    pub held: Vec<(Column, f64)>,
    pub structure: Structure,
    /// The arm along whose curve the matrices act; straight without one.
    pub arm: Option<CurvedArm>,
}

impl Base {
    pub fn new(state: &State, cause: &Cause, structure: &Structure, arm: Option<&CurvedArm>) -> Self {
        let mut base = Base::of_motion(state, structure, arm);
        base.offsets(&state.layout);
        base.tolerances(state, cause);
        base
    }

    /// That of a state which is this one's under one more transform: what the transform leaves alone is taken over.
    pub fn under(&self, before: &State, state: &State, cause: &Cause) -> Self {
        // A state whose motion is another has series of its own.
        let still = Arc::ptr_eq(&before.x, &state.x);
        let mut base = if still { Base { columns: vec![], roles: vec![], ..self.clone() } } else { Base::of_motion(state, &self.structure, self.arm.as_ref()) };
        for (column, role) in self.columns.iter().zip(&self.roles) {
            if role.of_a_trial() || still && matches!(role, Role::Entry(..)) {
                base.columns.push(column.clone());
                base.roles.push(*role);
            }
        }
        base.tolerances(state, cause);
        base
    }

    /// What depends on the motion alone: matrices and known laws.
    fn of_motion(state: &State, structure: &Structure, arm: Option<&CurvedArm>) -> Self {
        let n = state.layout.axes;
        let curved = arm.map(|arm| Curved::new(state, arm));
        let entries_column = |matrix: Matrix, entries: &[(usize, usize, f64)]| match &curved {
            Some(curved) => curved.entries_column(matrix, entries),
            None => state.entries_column(matrix, entries),
        };
        let mut base = Base { columns: vec![], roles: vec![], held: vec![], structure: structure.clone(), arm: arm.cloned() };
        for matrix in [Matrix::Mass, Matrix::Damping, Matrix::Stiffness] {
            if matrix == Matrix::Stiffness && !structure.spring && structure.given.iter().all(|e| e.0 != matrix) {
                continue;
            }
            let symmetric = structure.symmetric.contains(&matrix);
            for i in 0..n {
                for j in 0..n {
                    if structure.is_given(matrix, i, j) || (symmetric && j < i) {
                        continue;
                    }
                    let entries: &[(usize, usize, f64)] = if symmetric && i != j { &[(i, j, 1.0), (j, i, 1.0)] } else { &[(i, j, 1.0)] };
                    base.columns.push(entries_column(matrix, entries));
                    base.roles.push(Role::Entry(matrix, i, j));
                }
            }
        }
        base.held = structure.given.iter().map(|&(matrix, i, j, value)| (entries_column(matrix, &[(i, j, 1.0)]), value)).collect();
        base.held.extend(curved.as_ref().map(|curved| (curved.held_column(), 1.0)));
        base.held.extend(structure.known.iter().map(|law| (state.force_column(&state.forces(law.as_ref()), None, None), 1.0)));
        base
    }

    /// What a balance of forces does not know of each trial: its offset and, where the displacement is an integral, the lines and parabolas of time
    /// that went with the constants of integration.
    fn offsets(&mut self, layout: &Layout) {
        let middle = 0.5 * layout.samples as f64;
        let powers = if self.structure.spring { self.structure.integrals } else { self.structure.integrals.saturating_sub(1) };
        for power in 0..=powers as i32 {
            let series: Vec<f64> = (0..layout.samples).map(|k| ((k as f64 - middle) / middle).powi(power)).collect();
            for (axis, trial) in (0..layout.axes).flat_map(|axis| (0..layout.trials).map(move |trial| (axis, trial))) {
                self.columns.push(Column {
                    parts: vec![(axis, Arc::new(layout.in_trial(trial, &series)))],
                    action: vec![],
                    through: Through::Motion,
                    precision: 0.0,
                });
                self.roles.push(if power == 0 { Role::Offset(axis, trial) } else { Role::Integrated(axis, trial) });
            }
        }
    }

    /// A delay (or filter) of all effort channels, a compliance and a rotation of each pair, with priors as wide as instruments are good; where tolerances
    /// count.
    fn tolerances(&mut self, state: &State, cause: &Cause) {
        if !self.structure.tolerances {
            return;
        }
        let layout = &state.layout;
        let (n, lines) = (layout.axes, layout.lines());
        let impedance = |entry: &dyn Fn(usize, &[Complex64]) -> Complex64| match cause {
            Cause::Loop(z) => z.iter().enumerate().map(|(k, z)| entry(k, z)).collect(),
            _ => vec![Complex64::ZERO; lines],
        };
        let looped = matches!(cause, Cause::Loop(_));
        let times_s = |spectrum: &[Complex64]| -> Arc<Vec<Complex64>> {
            Arc::new(spectrum.chunks(lines).flat_map(|block| block.iter().zip(&layout.sj).map(|(f, s)| -f * s)).collect())
        };
        let sigma = INSTRUMENT_DELAY_S * layout.time_s;
        self.columns.push(Column {
            parts: (0..n).map(|i| (i, times_s(&state.effort_spectra[i]))).collect(),
            action: if looped { (0..n * n).map(|q| (q / n, q % n, Arc::new(impedance(&|k, z| layout.sj[k] * z[q])))).collect() } else { vec![] },
            through: Through::Effort,
            precision: 1.0 / (sigma * sigma),
        });
        self.roles.push(Role::Latency);
        self.compliance(state, cause);
        if !(2..=3).contains(&n) {
            return;
        }
        for i in 0..n {
            for j in i + 1..n {
                let negative = Arc::new(state.effort_spectra[j].iter().map(|f| -f).collect());
                let mut action = vec![];
                if looped {
                    for c in 0..n {
                        action.push((i, c, Arc::new(impedance(&|_, z| z[j * n + c]))));
                        action.push((j, c, Arc::new(impedance(&|_, z| -z[i * n + c]))));
                    }
                }
                self.columns.push(Column {
                    parts: vec![(i, negative), (j, state.effort_spectra[i].clone())],
                    action,
                    through: Through::Effort,
                    precision: 1.0 / (INSTRUMENT_ANGLE_RAD * INSTRUMENT_ANGLE_RAD),
                });
                self.roles.push(Role::Angle);
            }
        }
    }

    /// F + c P F in place of F: of the motion x that is measured, c F is none of the plant's P.
    fn compliance(&mut self, state: &State, cause: &Cause) {
        let Some(about) = &self.structure.about else { return };
        let layout = &state.layout;
        let (n, lines) = (layout.axes, layout.lines());
        let dynamics: Vec<Vec<Complex64>> = layout.sj.iter().map(|s| (0..n * n).map(|q| about.entry(q / n, q % n, *s)).collect()).collect();
        let top = (0..n).map(|i| dynamics[lines - 1][i * n + i].norm()).sum::<f64>() / n as f64;
        let precision = (top / INSTRUMENT_COMPLIANCE).powi(2);
        if !precision.is_normal() {
            return;
        }
        let part = |i: usize| -> Vec<Complex64> {
            (0..layout.size()).map(|at| -(0..n).map(|j| dynamics[at % lines][i * n + j] * state.effort_spectra[j][at]).sum::<Complex64>()).collect()
        };
        let entries = |of: Vec<Vec<Complex64>>| (0..n * n).map(|q| (q / n, q % n, Arc::new(of.iter().map(|matrix| matrix[q]).collect()))).collect();
        let action = match cause {
            Cause::Loop(z) => entries(dynamics.iter().zip(z.iter()).map(|(p, z)| square::product(p, z, n)).collect()),
            // The effort's density.
            Cause::Motion => entries(dynamics.clone()),
            Cause::Effort | Cause::Unclear => vec![],
        };
        self.columns.push(Column { parts: (0..n).map(|i| (i, Arc::new(part(i)))).collect(), action, through: Through::Effort, precision });
        self.roles.push(Role::Compliance);
    }

    /// Those of the baseline.
    pub fn dynamics(&self, theta: &[f64], axes: usize) -> Dynamics {
        Dynamics([Matrix::Mass, Matrix::Damping, Matrix::Stiffness].map(|matrix| self.matrix(theta, matrix, axes)))
    }

    /// The column of an entry, that of its mirror image where the matrix is symmetric.
    pub fn entry(&self, matrix: Matrix, i: usize, j: usize) -> Option<usize> {
        let mirrored = |role: &Role| self.structure.symmetric.contains(&matrix) && *role == Role::Entry(matrix, j, i);
        self.roles.iter().position(|role| *role == Role::Entry(matrix, i, j) || mirrored(role))
    }

    /// Full matrices of the baseline: given entries and fitted ones.
    pub fn matrix(&self, theta: &[f64], matrix: Matrix, axes: usize) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; axes]; axes];
        for &(m, i, j, value) in &self.structure.given {
            if m == matrix {
                out[i][j] = value;
            }
        }
        for (role, &value) in self.roles.iter().zip(theta) {
            if let Role::Entry(m, i, j) = *role
                && m == matrix
            {
                out[i][j] = value;
                if self.structure.symmetric.contains(&matrix) {
                    out[j][i] = value;
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::Transform;
    use ndof_models::effects::Action;

    fn same(a: &Column, b: &Column) -> bool {
        let [pa, pb] = [a, b].map(|c| c.parts.iter().map(|(i, s)| (*i, s.as_slice())).collect::<Vec<_>>());
        let [aa, ab] = [a, b].map(|c| c.action.iter().map(|(i, j, s)| (*i, *j, s.as_slice())).collect::<Vec<_>>());
        pa == pb && aa == ab && a.precision == b.precision
    }

    /// What is taken over from a state is what that of the transform would compute, straight or along an arm, whichever channels the transform touches.
    #[test]
    fn what_a_transform_leaves_alone_is_what_it_would_compute() {
        let layout = Arc::new(Layout::new(2, 2, 4000, 100.0, (0.5, 12.0)));
        let track = |k: usize| {
            layout.track(&(0..4000).map(|t| 0.02 * (0.1 * (t * (k + 3)) as f64).sin() + 0.01 * (0.037 * (t * (k + 2)) as f64).cos()).collect::<Vec<_>>())
        };
        let tracks = |first: usize| -> Vec<Vec<_>> { (0..2).map(|trial| (0..2).map(|axis| track(first + 2 * trial + axis)).collect()).collect() };
        let state = State::new(&layout, &tracks(0), &tracks(4), &[0.0, 0.0], &[]);
        let arm = CurvedArm { link_lengths_m: [0.33, 0.34], posture_rad: [0.785, 1.571], mean_force_n: [5.0, -6.0] };
        let mut structure = Structure::new(2, None, true);
        structure.given.push((Matrix::Damping, 0, 0, 7.0));
        let late = |s: Complex64, k: &[f64]| (-s * k[0]).exp();
        for (action, moves) in [(Action::Effort(Arc::new(late)), false), (Action::Motion(Arc::new(late)), true)] {
            let with = state.with(&Transform { action, axis: Some(1), knobs: vec![0.02] });
            for arm in [None, Some(&arm)] {
                let before = Base::new(&state, &Cause::Effort, &structure, arm);
                let (taken, computed) = (before.under(&state, &with, &Cause::Effort), Base::new(&with, &Cause::Effort, &structure, arm));
                assert_eq!(taken.roles, computed.roles);
                assert!(taken.columns.iter().zip(&computed.columns).all(|(a, b)| same(a, b)));
                assert!(taken.held.iter().zip(&computed.held).all(|(a, b)| same(&a.0, &b.0) && a.1 == b.1));
                assert_eq!((taken.columns.len(), taken.held.len()), (computed.columns.len(), computed.held.len()));
                // And the transform does change what it touches.
                assert!(!before.columns.iter().zip(&computed.columns).all(|(a, b)| same(a, b)));
                assert_eq!(!same(&before.columns[0], &computed.columns[0]) || !same(&before.columns[2], &computed.columns[2]), moves);
            }
        }
    }
}
