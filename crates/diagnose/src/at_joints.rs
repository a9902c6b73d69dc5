//! What a fit along the curve of an arm says: the plant of a free run, and the matrices at the joints.

use crate::curve::CALIBRATION;
use crate::curved::CurvedPlant;
use crate::result::CauseParameter;
use crate::search::{Chosen, Stand};
use crate::subject::Subject;
use crate::whittle::variance_of;
use ndof_models::effects::{CurvedArm, Matrix, Value};

const ORDERS: [Matrix; 3] = [Matrix::Stiffness, Matrix::Damping, Matrix::Mass];

impl Subject {
    /// The arm along whose curve the matrices of these hypotheses act.
    pub fn arm(&self, chosen: &[Chosen]) -> Option<&CurvedArm> {
        chosen.iter().find_map(|c| self.hypotheses[c.hypothesis].arm())
    }

    /// The plant of a stand, where it is curved.
    pub fn curved(&self, chosen: &[Chosen], stand: &Stand) -> Option<CurvedPlant> {
        let (place, arm) = chosen.iter().enumerate().find_map(|(q, c)| Some((q, self.hypotheses[c.hypothesis].arm()?)))?;
        let matrices = ORDERS.map(|matrix| {
            let rows = self.matrix(chosen, stand, matrix);
            [[rows[0][0], rows[0][1]], [rows[1][0], rows[1][1]]]
        });
        Some(CurvedPlant { arm: arm.clone(), coupling: self.coefficients(stand, place)[0], matrices })
    }

    /// M, B and K at the joints, where a chosen hypothesis is the arm's geometry: J₀ᵀ A J₀, and Γ(F₀) beside the stiffness.
    pub fn joints(&self, chosen: &[Chosen], stand: &Stand) -> Vec<CauseParameter> {
        let Some(arm) = self.arm(chosen) else { return Vec::new() };
        let kinematics = arm.kinematics();
        let (j, geometric) = (kinematics.jacobian(), kinematics.geometric_stiffness(&arm.mean_force_n));
        let covariance = stand.fit.covariance();
        let mut out = Vec::new();
        for (matrix, letter, unit) in [(Matrix::Mass, "M", "kg m^2"), (Matrix::Damping, "B", "N m s/rad"), (Matrix::Stiffness, "K", "N m/rad")] {
            if matrix == Matrix::Stiffness && !self.structure.spring {
                continue;
            }
            let hand = self.matrix(chosen, stand, matrix);
            for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let places = [(0, 0), (0, 1), (1, 0), (1, 1)];
                let share = |&(r, s): &(usize, usize)| j[[r, p]] * j[[s, q]];
                let value: f64 = places.iter().map(|at| share(at) * hand[at.0][at.1]).sum::<f64>() + if letter == "K" { geometric[[p, q]] } else { 0.0 };
                let of = |at: &(usize, usize)| {
                    self.parts_of(chosen, stand, (matrix, at.0, at.1)).into_iter().map(|(k, weight)| (k, weight * share(at))).collect::<Vec<_>>()
                };
                let slopes = places.iter().flat_map(of).collect::<Vec<_>>();
                let half = 1.96 * variance_of(&covariance, &slopes).sqrt().hypot(CALIBRATION * value);
                let names = ["shoulder", "elbow"];
                out.push(CauseParameter {
                    name: format!("{letter}_{}_{}", names[p], names[q]),
                    unit: unit.to_owned(),
                    value: Value::Number(value),
                    ci95: (!slopes.is_empty()).then_some([value - half, value + half]),
                });
            }
        }
        out
    }
}
