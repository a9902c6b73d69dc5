//! What is true of a limb that moves, beside the curves that were found.

use crate::error::StudyError;
use crate::file::ExperimentFile;
use ndarray::{Array2, arr2};
use ndof_analysis::PHASE;
use ndof_analysis::fit::schedule::rates;
use ndof_analysis::fit::schedule::result::ScheduleResult;
use ndof_devices::{Impedance, MovingArm};
use ndof_linear::inverse;

/// Writes what was simulated beside each curve: the limb's matrices at each phase, in the posture and under the force of the mean movement.
/// Nothing where the limb does not move, or the schedule is another one.
pub(crate) fn beside_the_truth(found: &mut ScheduleResult, file: &ExperimentFile) -> Result<(), StudyError> {
    let bench = file.experiment().build()?;
    let same_cycle = file.controller.movement.as_ref().is_some_and(|movement| found.cycle_s == Some(movement.cycle_s));
    let Some(arm) = bench.limb.moving().filter(|_| same_cycle && found.schedule == PHASE) else { return Ok(()) };
    let Some(truth) = truth(arm, found, &bench.rest_endpoint()) else { return Ok(()) };
    for (which, entries) in [&mut found.entries, &mut found.joint].into_iter().enumerate() {
        for (k, entry) in entries.iter_mut().enumerate() {
            let of = |limb: &Impedance| [&limb.stiffness, &limb.damping, &limb.inertia][k / 4][[k % 4 / 2, k % 2]];
            entry.truth = Some(truth.iter().map(|limbs| of(&limbs[which])).collect());
        }
    }
    Ok(())
}

/// At the hand, then at the joints, phase by phase, as a perturbation feels them: the muscles' matrices with what inertial and Coriolis forces add
/// because the arm moves.
fn truth(arm: &MovingArm, found: &ScheduleResult, rest: &[f64]) -> Option<Vec<[Impedance; 2]>> {
    // The hand's two displacements stand first, the two forces behind them.
    let [x, y, fx, fy] = [0, 1, 2, 3].map(|k| found.mean_movement.get(k).map(|mean| &mean.value));
    let (x, y, fx, fy) = (x?, y?, fx?, fy?);
    let angles: Vec<[f64; 2]> = (0..found.at.len()).map(|k| arm.joint_angles([x[k] - rest[0], y[k] - rest[1]])).collect::<Option<_>>()?;
    let [rate, acceleration] = rates(&angles.iter().map(|a| arr2(&[*a])).collect::<Vec<_>>(), found.cycle_s);
    let jacobians: Vec<Array2<f64>> = angles.iter().map(|a| arm.kinematics(*a).jacobian()).collect();
    let [turning, bending] = rates(&jacobians, found.cycle_s);
    let pair = |values: &Array2<f64>| [values[[0, 0]], values[[0, 1]]];
    let at = |k: usize| {
        let joints = arm.joints(found.at[k], angles[k]);
        let [more_damping, more_stiffness] = arm.inertial(angles[k], pair(&rate[k]), pair(&acceleration[k]));
        let back = inverse(&jacobians[k])?;
        let (damped, sprung) = (&joints.damping + &more_damping, &joints.stiffness + &more_stiffness);
        let outward = |a: Array2<f64>| back.t().dot(&a).dot(&back);
        let inertia = outward(joints.inertia.clone());
        let damping = outward(damped.clone()) - inertia.dot(&turning[k]).dot(&back) * 2.0;
        let bent = arm.kinematics(angles[k]).geometric_stiffness(&[fx[k], fy[k]]);
        let stiffness = outward(&sprung - bent) - (damping.dot(&turning[k]) + inertia.dot(&bending[k])).dot(&back);
        Some([Impedance { inertia, damping, stiffness }, Impedance { damping: damped, stiffness: sprung, ..joints }])
    };
    (0..found.at.len()).map(at).collect()
}
