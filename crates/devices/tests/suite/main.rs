//! Devices as a whole: accuracy of the simulation, its linear model, its sensors.

mod accuracy;
mod common;
mod linear;
