//! What reading a file did that its user should know.

pub use ndof_signal::Warning as Note;
