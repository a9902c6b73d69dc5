//! What a scheduled fit is made from.

use super::ScheduleError;

/// One stretch of a recording, evenly sampled. All channels are of one length; efforts and motions are as many as there are axes.
#[derive(Clone, Debug, Default)]
pub struct Stretch<'a> {
    /// Measured efforts (N, N m).
    pub effort: Vec<&'a [f64]>,
    /// Displacements (m, rad).
    pub motion: Vec<&'a [f64]>,
    /// Commanded efforts, where a robot drives by force; none where the motion itself is imposed.
    pub command: Vec<&'a [f64]>,
    /// The scheduling variable, scaled to 0 to 1; NaN where there is none, as before a first cycle.
    pub schedule: Vec<f64>,
    /// What is left out together when a model is held against data that it has not seen: a cycle, a trial, a piece of one.
    pub block: Vec<usize>,
}

impl Stretch<'_> {
    /// Numbers of axes and of commands, if all stretches agree and hold numbers.
    pub(super) fn check(stretches: &[Stretch<'_>]) -> Result<(usize, usize), ScheduleError> {
        let first = stretches.first().ok_or(ScheduleError::TooShort { rows: 0, needed: 1 })?;
        let (axes, commands) = (first.effort.len(), first.command.len());
        for stretch in stretches {
            let samples = stretch.schedule.len();
            let channels = || stretch.effort.iter().chain(&stretch.motion).chain(&stretch.command);
            let alike = channels().all(|c| c.len() == samples) && stretch.block.len() == samples;
            if axes == 0 || stretch.effort.len() != axes || stretch.motion.len() != axes || stretch.command.len() != commands || !alike {
                return Err(ScheduleError::Shape { efforts: stretch.effort.len(), motions: stretch.motion.len(), samples });
            }
            if !channels().all(|c| c.iter().all(|v| v.is_finite())) {
                return Err(ScheduleError::NotFinite);
            }
        }
        Ok((axes, commands))
    }
}
