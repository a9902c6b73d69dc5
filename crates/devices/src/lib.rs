//! Rehabilitation robots, limbs, controllers and sensors, simulated.
