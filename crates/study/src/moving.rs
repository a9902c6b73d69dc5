//! What is true of a limb that moves, beside the curves that were found.

use crate::error::StudyError;
use crate::file::ExperimentFile;
use ndof_analysis::fit::schedule::PHASE;
use ndof_analysis::fit::schedule::result::ScheduleResult;
use ndof_devices::Impedance;

/// Writes what was simulated beside each curve: the limb's matrices at each phase, in the posture and under the force of the mean movement.
/// Nothing where the limb does not move, or the schedule is another one.
pub(crate) fn beside_the_truth(found: &mut ScheduleResult, file: &ExperimentFile) -> Result<(), StudyError> {
    let bench = file.experiment().build()?;
    let rest = bench.rest_endpoint();
    let same_cycle = file.controller.movement.as_ref().is_some_and(|movement| found.cycle_s == Some(movement.cycle_s));
    let Some(arm) = bench.limb.moving().filter(|_| same_cycle && found.schedule == PHASE) else { return Ok(()) };
    // The limb's two displacements stand first, its two efforts behind them.
    let [Some(x), Some(y), Some(fx), Some(fy)] = [0, 1, 2, 3].map(|k| found.mean_movement.get(k).map(|mean| &mean.value)) else { return Ok(()) };
    let at = |k: usize| arm.matrices(found.at[k], [x[k] - rest[0], y[k] - rest[1]], &[fx[k], fy[k]]);
    let Some(truth) = (0..found.at.len()).map(at).collect::<Option<Vec<[Impedance; 2]>>>() else { return Ok(()) };
    for (which, entries) in [&mut found.entries, &mut found.joint].into_iter().enumerate() {
        for (k, entry) in entries.iter_mut().enumerate() {
            let of = |limb: &Impedance| {
                let matrix = [&limb.stiffness, &limb.damping, &limb.inertia][k / 4];
                matrix[[k % 4 / 2, k % 2]]
            };
            entry.truth = Some(truth.iter().map(|limbs| of(&limbs[which])).collect());
        }
    }
    Ok(())
}
