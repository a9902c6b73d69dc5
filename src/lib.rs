#![doc = include_str!("../README.md")]

pub mod studies;

pub use ndof_devices as devices;
pub use ndof_diagnose as diagnose;
pub use ndof_io as io;
pub use ndof_models as models;
pub use ndof_report as report;
pub use ndof_signal as signal;
pub use ndof_study as study;
pub use ndof_sysid as sysid;
