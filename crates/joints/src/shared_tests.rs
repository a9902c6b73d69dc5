//! What unit tests share.
#![cfg(test)]

use crate::band::Band;
use crate::scene::{Scene, scene};
use crate::table::View;
use ndof_devices::RobotConfig;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use std::sync::Mutex;

/// A body of 2 kg, 0.3 m behind a joint.
const PENDULUM: &str =
    "schema = \"ndof/robot/1\"\nname = \"one\"\njoints = [{ name = \"elbow\", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0] }]";

/// Asks something of its log at 100 Hz, in which it never rests.
pub(crate) fn of_a_pendulum(angle: Vec<f64>, torque: Vec<f64>, ask: impl FnOnce(&Scene<'_>, View<'_>)) {
    let chain = RobotConfig::parse("one.toml", PENDULUM, None).and_then(|c| c.chain()).expect("a robot");
    let samples = angle.len();
    let channel = |name: &str, quantity, x| Channel::new(name, Unit::si(quantity, true), x);
    let channels = vec![channel("torque_elbow", Quantity::Effort, torque), channel("angle_elbow", Quantity::Displacement, angle)];
    let log = [Recording::new(100.0, channels).expect("a log")];
    let (scene, mut motions) = scene(&chain, &log, &[], &Ports { references: vec![], inputs: vec![0], outputs: vec![1] }).expect("it moves");
    motions[0].moves = vec![vec![true; samples]];
    let (band, whole) = (Band::new([scene.fastest_hz, scene.lowest_hz()], scene.rate_hz), Mutex::default());
    ask(&scene, View::new(&scene, &motions, &band, &whole, &[(0, 0..samples)]));
}
