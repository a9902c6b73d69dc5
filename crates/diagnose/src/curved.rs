//! The matrices of a model along the curve of an arm: columns for the search, forces for a free run.

use crate::state::{Column, State, order_of};
use ndof_models::effects::{Carried, CurvedArm, Displaced, Matrix};

/// One sample of a motion along the curve, and the same straight: x, ẋ, ẍ.
struct Place {
    arm: Displaced,
    carried: Carried,
    straight: [[f64; 2]; 3],
}

/// The measured motion of one trial along the curve of an arm, series by series; NaN where the hand cannot be.
#[derive(Default)]
struct Course {
    /// P, `[row][column][time]`.
    turned: [[Vec<f64>; 2]; 2],
    /// x, ẋ, ẍ along the curve and straight, `[order][axis][time]`.
    curved: [[Vec<f64>; 2]; 3],
    straight: [[Vec<f64>; 2]; 3],
    coupling: [Vec<f64>; 2],
    held: [Vec<f64>; 2],
}

impl Course {
    fn of(places: &[Option<Place>]) -> Self {
        let series = |value: &dyn Fn(&Place) -> f64| places.iter().map(|place| place.as_ref().map_or(f64::NAN, value)).collect();
        let each = |value: &dyn Fn(&Place, usize) -> f64| [0, 1].map(|k| series(&|place| value(place, k)));
        Course {
            turned: [0, 1].map(|i| each(&|place, k| place.arm.turned[i][k])),
            curved: [0, 1, 2].map(|order| each(&|place, j| place.carried.order[order][j])),
            straight: [0, 1, 2].map(|order| each(&|place, j| place.straight[order][j])),
            coupling: each(&|place, k| place.carried.coupling[k]),
            held: each(&|place, k| place.arm.held[k]),
        }
    }
}

/// The measured motion along the curve of an arm.
pub(crate) struct Curved<'a> {
    state: &'a State,
    trials: Vec<Course>,
}

/// The places of one trial; none where the hand cannot be.
fn places(state: &State, arm: &CurvedArm, trial: usize) -> Vec<Option<Place>> {
    let layout = &state.layout;
    // Noise beyond the band would come back into it by products.
    let a: Vec<Vec<f64>> = state.motion[trial].iter().map(|track| layout.filtered(track, |s| s * s, Some(&layout.smooth))).collect();
    let pair = |of: &[f64], k: usize| [of[2 * k], of[2 * k + 1]];
    let place = |k: usize| {
        let straight = [pair(&state.law_x[trial], k), pair(&state.law_v[trial], k), [a[0][k], a[1][k]]];
        let arm = arm.displaced(straight[0])?;
        Some(Place { carried: arm.moving(straight[1], straight[2]), arm, straight })
    };
    (0..layout.samples).map(place).collect()
}

impl<'a> Curved<'a> {
    pub fn new(state: &'a State, arm: &CurvedArm) -> Self {
        Curved { state, trials: (0..state.layout.trials).map(|trial| Course::of(&places(state, arm, trial))).collect() }
    }

    fn column(&self, forces: impl Fn(&Course) -> [Vec<f64>; 2]) -> Column {
        self.state.force_column(&self.trials.iter().map(|course| forces(course).to_vec()).collect(), None, None)
    }

    /// The column of entries of M, B or K. What acts between noise and motion stays that of the straight one: it is a share of (amplitude / arm's
    /// length)² away.
    pub fn entries_column(&self, matrix: Matrix, entries: &[(usize, usize, f64)]) -> Column {
        let mut column = self.state.entries_column(matrix, entries);
        let order = order_of(matrix);
        let bent = self.column(|course| {
            let mut force = [0, 1].map(|_| vec![0.0; self.state.layout.samples]);
            for &(i, j, weight) in entries {
                for (k, force) in force.iter_mut().enumerate() {
                    for ((force, turned), moved) in force.iter_mut().zip(&course.turned[i][k]).zip(&course.curved[order][j]) {
                        *force += weight * turned * moved;
                    }
                }
                force[i].iter_mut().zip(&course.straight[order][j]).for_each(|(force, straight)| *force -= weight * straight);
            }
            force
        });
        column.parts.extend(bent.parts);
        column
    }

    /// The column of the inertia that follows the elbow.
    pub fn coupling_column(&self) -> Column {
        self.column(|course| course.coupling.clone())
    }

    /// The column of what turns with the force that holds the arm.
    pub fn held_column(&self) -> Column {
        Column { action: vec![], ..self.column(|course| course.held.clone()) }
    }
}

/// Matrices that act along the curve of an arm.
#[derive(Clone)]
pub(crate) struct CurvedPlant {
    pub arm: CurvedArm,
    pub coupling: f64,
    /// K, B, M at the posture.
    pub matrices: [[[f64; 2]; 2]; 3],
}

impl CurvedPlant {
    fn force_of(&self, arm: &Displaced, carried: &Carried) -> [f64; 2] {
        let mut force = [0.0; 2];
        for (matrix, of) in self.matrices.iter().zip(&carried.order) {
            for (force, row) in force.iter_mut().zip(matrix) {
                *force += row[0] * of[0] + row[1] * of[1];
            }
        }
        let force = arm.carried(force);
        [0, 1].map(|i| force[i] + self.coupling * carried.coupling[i] + arm.held[i])
    }

    /// The acceleration under a force less what else resists; NaN where the hand cannot be.
    pub fn acceleration(&self, x: [f64; 2], v: [f64; 2], force: [f64; 2]) -> [f64; 2] {
        let Some(arm) = self.arm.displaced(x) else { return [f64::NAN; 2] };
        let needed = |a: [f64; 2]| self.force_of(&arm, &arm.moving(v, a));
        let (still, first, second) = (needed([0.0; 2]), needed([1.0, 0.0]), needed([0.0, 1.0]));
        let [[a, c], [b, d]] = [first, second].map(|unit| [unit[0] - still[0], unit[1] - still[1]]);
        let [f, g] = [force[0] - still[0], force[1] - still[1]];
        let determinant = a * d - b * c;
        [(d * f - b * g) / determinant, (a * g - c * f) / determinant]
    }

    /// What the curve adds to the straight matrices: `[axis][time]`.
    pub fn beyond(&self, state: &State, trial: usize) -> Vec<Vec<f64>> {
        let force = |place: &Option<Place>| {
            let Some(place) = place else { return [f64::NAN; 2] };
            let whole = self.force_of(&place.arm, &place.carried);
            let straight = |i: usize| -> f64 { self.matrices.iter().zip(&place.straight).map(|(m, of)| m[i][0] * of[0] + m[i][1] * of[1]).sum() };
            [0, 1].map(|i| whole[i] - straight(i))
        };
        let forces: Vec<[f64; 2]> = places(state, &self.arm, trial).iter().map(force).collect();
        (0..2).map(|i| forces.iter().map(|f| f[i]).collect()).collect()
    }
}
