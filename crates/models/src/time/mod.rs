//! Fits in the time domain: the model runs free from the measured force and has to stay with the measured motion.

mod fit;
mod mechanism;
mod simulate;

pub use fit::{FreeRun, FreeRunError, FreeRunFit, TimeTrial};
pub use mechanism::Mechanism;
