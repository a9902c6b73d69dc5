//! Devices as a whole: accuracy of the simulation, its linear model, its sensors and files.

mod accuracy;
mod common;
mod conformance;
mod dynamics;
mod files;
mod linear;
mod mjcf;
mod recording;
mod safety;
mod write;
