//! Effects of channels, of the robot, and of what the limb does by itself.

use super::hiding::{Hiding, Tremor, Truth};
use crate::stages::Stage;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

impl Hiding {
    pub(super) fn add_to_channels(&mut self, name: &'static str, form: &'static str, s: f64, own: &mut Truth, rng: &mut ChaCha8Rng) {
        match name {
            "measurement-delay"
            | "channel-filter"
            | "sensor-scale"
            | "sensor-offset-drift"
            | "x-held-samples"
            | "x-clock-wander"
            | "x-slew"
            | "x-amplitude-delay" => self.stage(name, form, s, own),
            "series-compliance" => self.series = Some(self.sizes.k * 20.0 / s),
            "sensor-misalignment" => {
                self.angle = (15.0 * s).to_radians() * if rng.random_range(0.0..1.0) < 0.5 { 1.0 } else { -1.0 };
                self.one_way = form == "one-way";
                own.push(("angle", self.angle));
            }
            "periodic-disturbance" => {
                self.tremor = Tremor { amplitude: s * 0.6 * self.sizes.f, frequency: rng.random_range(4.0..10.0), form };
                own.extend([("frequency", self.tremor.frequency), ("amplitude", self.tremor.amplitude)]);
            }
            "quantisation" => {
                self.x_step = Some(0.25 * s * self.sizes.x);
                self.uneven_steps = form == "uneven";
                own.push(("step", 0.25 * s * self.sizes.x));
            }
            "limb-noise" => {
                self.own = s * 0.3 * self.sizes.f;
                own.push(("rms", self.own));
            }
            "robot-friction" => self.robot_friction[self.axis] = s * 0.5 * self.sizes.f,
            "added-mass" => {
                self.added_mass = s * 0.3 * self.sizes.m;
                own.push(("mass", self.added_mass));
            }
            // The plant is as drawn; a simulation that is judged against it is not.
            "parameter-error" | "cross-coupling" => {}
            other => panic!("the generator does not know {other}"),
        }
    }

    /// Stages of channels: latencies and filters of all efforts, the rest of the axis alone.
    fn stage(&mut self, name: &'static str, form: &'static str, s: f64, own: &mut Truth) {
        let (x, f, duration) = (self.sizes.x, self.sizes.f, self.sizes.duration);
        let late = 0.012 * s;
        let drift = |size: f64| s * 4.0 * size / duration;
        let (place, stage, told) = match (name, form) {
            ("measurement-delay", "motion") => (&mut self.motion, Stage::Delay(late), Some(("delay", late))),
            ("measurement-delay", "swaying") => (&mut self.efforts, Stage::SwayingDelay(late), Some(("delay", late))),
            ("measurement-delay", _) => (&mut self.efforts, Stage::Delay(late), Some(("delay", late))),
            ("channel-filter", _) => {
                let cutoff = 12.0 / s;
                let filter = match form {
                    "twice" => Stage::LowPass(1.55 * cutoff, 2),
                    "second" => Stage::Second(cutoff, 0.5f64.sqrt()),
                    "ringing" => Stage::Second(cutoff, 0.35),
                    "moving-average" => Stage::MovingAverage(0.4 / cutoff),
                    _ => Stage::LowPass(cutoff, 1),
                };
                (&mut self.efforts, filter, Some(("cutoff", cutoff)))
            }
            ("sensor-scale", _) => (&mut self.effort, Stage::Scale(1.0 + 0.4 * s), Some(("factor", 1.0 + 0.4 * s))),
            ("sensor-offset-drift", "motion") => (&mut self.motion, Stage::Drift(drift(x), ""), Some(("rate", drift(x)))),
            ("sensor-offset-drift", _) => (&mut self.effort, Stage::Drift(drift(f), form), Some(("rate", drift(f)))),
            ("x-held-samples", _) => (&mut self.motion, Stage::Held(0.6 * s), None),
            ("x-clock-wander", _) => (&mut self.efforts, Stage::ClockWander(0.03 * s), None),
            ("x-slew", _) => (&mut self.effort, Stage::Slew(f * 6.0 / s), None),
            _ => (&mut self.efforts, Stage::AmplitudeDelay(0.015 * s, f), None),
        };
        place.push(stage);
        own.extend(told);
    }
}
