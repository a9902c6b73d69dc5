//! How far a job is.

/// Called with what is done, how much of it and of how much; from any thread.
pub type Progress<'a> = dyn Fn(&'static str, usize, usize) + Sync + 'a;
