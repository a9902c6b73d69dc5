//! What data correct in a robot's file.

use super::body::Body;
use super::config::JointConfig;

/// A number of a robot's file that data correct.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// The joint; without meaning for [`Corrected::Gravity`].
    pub joint: String,
    /// What is corrected.
    pub what: Corrected,
    /// Its value, in the units of [`JointConfig`].
    pub value: f64,
    /// Why, for who reads the file.
    pub why: String,
}

/// What of a joint, or of the body that it moves, is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corrected {
    /// Viscous friction (N m s/rad, N s/m).
    Viscous,
    /// Dry friction (N m, N).
    Coulomb,
    /// Time by which dry friction turns before the joint (s).
    FrictionAhead,
    /// Inertia of the rotor as the joint feels it, gear included (kg m², kg).
    Rotor,
    /// Time by which the torque follows its command (s).
    TorqueDelay,
    /// Stiffness of a spring at the joint (N m/rad, N/m).
    Stiffness,
    /// Angle at which that spring rests (rad, m).
    SpringRest,
    /// Mass of the body (kg), its centre and the inertia about it remaining.
    Mass,
    /// Centre of mass: 0, 1, 2 are x, y, z in the joint's frame (m).
    Centre(usize),
    /// Inertia about the centre of mass: 0 to 5 are xx, yy, zz, xy, xz, yz in the joint's axes (kg m²).
    Inertia(usize),
    /// Gravity: 0, 1, 2 are x, y, z of the base (m/s²).
    Gravity(usize),
    /// Lower (0) and upper (1) end of the range (rad, m).
    Range(usize),
}

impl Correction {
    /// The number in words.
    pub(super) fn called(&self) -> String {
        let of = |names: &[&str], k: usize| names.get(k).copied().unwrap_or("?").to_owned();
        let what = match self.what {
            Corrected::Viscous => "viscous friction".to_owned(),
            Corrected::Coulomb => "dry friction".to_owned(),
            Corrected::FrictionAhead => "time ahead of the dry friction".to_owned(),
            Corrected::Rotor => "rotor inertia".to_owned(),
            Corrected::TorqueDelay => "delay of the torque".to_owned(),
            Corrected::Stiffness => "stiffness".to_owned(),
            Corrected::SpringRest => "rest of the spring".to_owned(),
            Corrected::Mass => "mass".to_owned(),
            Corrected::Centre(k) => format!("centre of mass {}", of(&["x", "y", "z"], k)),
            Corrected::Inertia(k) => format!("inertia {}", of(&["xx", "yy", "zz", "xy", "xz", "yz"], k)),
            Corrected::Gravity(k) => return format!("gravity {}", of(&["x", "y", "z"], k)),
            Corrected::Range(k) => format!("{} end of the range", of(&["lower", "upper"], k)),
        };
        format!("{what} of joint \"{}\"", self.joint)
    }

    pub(super) fn is_inertial(&self) -> bool {
        matches!(self.what, Corrected::Mass | Corrected::Centre(_) | Corrected::Inertia(_))
    }
}

/// Refuses what no robot has.
pub(super) fn check(correction: &Correction) -> Result<(), String> {
    let (count, positive) = match correction.what {
        Corrected::Centre(k) | Corrected::Gravity(k) => (k < 3, false),
        Corrected::Inertia(k) => (k < 6, false),
        Corrected::Range(k) => (k < 2, false),
        Corrected::SpringRest => (true, false),
        _ => (true, true),
    };
    if !count {
        return Err(format!("{}: no such component", correction.called()));
    }
    if !correction.value.is_finite() || (positive && correction.value < 0.0) {
        return Err(format!("{} would be {}; no robot has that", correction.called(), correction.value));
    }
    Ok(())
}

/// A joint with its corrections, the range beyond any where it has none.
pub(super) fn corrected(joint: &JointConfig, corrections: &[&Correction]) -> Result<JointConfig, String> {
    let mut target = joint.clone();
    for correction in corrections {
        let value = correction.value;
        match correction.what {
            Corrected::Viscous => target.viscous_nm_s_per_rad = value,
            Corrected::Coulomb => target.coulomb_nm = value,
            Corrected::FrictionAhead => target.friction_ahead_s = value,
            Corrected::Rotor => target.rotor_inertia_kg_m2 = value / target.gear_ratio.powi(2),
            Corrected::Stiffness => target.stiffness_nm_per_rad = value,
            Corrected::SpringRest => target.spring_rest_rad = value,
            Corrected::Mass => target.mass_kg = value,
            Corrected::Centre(k) => target.centre_m[k] = value,
            Corrected::Inertia(k) => target.inertia_kg_m2[k] = value,
            Corrected::Range(k) => target.range_rad.get_or_insert([f64::NEG_INFINITY, f64::INFINITY])[k] = value,
            Corrected::TorqueDelay | Corrected::Gravity(_) => {}
        }
    }
    let called = |want: fn(&Correction) -> bool| corrections.iter().find(|c| want(c)).map(|c| c.called());
    if let Some(called) = called(Correction::is_inertial).filter(|_| !Body::of(&target).exists()) {
        return Err(format!(
            "with the {called}, its body would be one that no masses make: a mass of {} kg, inertia {:?} kg m²",
            target.mass_kg, target.inertia_kg_m2
        ));
    }
    if let (Some([low, high]), Some(called)) = (target.range_rad, called(|c| matches!(c.what, Corrected::Range(_))))
        && !(low < high && low.is_finite() && high.is_finite())
    {
        return Err(format!("with the {called}, its range would be {low} to {high}; it needs two ends, the lower before the upper"));
    }
    Ok(target)
}

/// The corrections of one joint after another.
pub(super) fn by_joint(corrections: &[Correction]) -> Vec<(&str, Vec<&Correction>)> {
    let mut list: Vec<(&str, Vec<&Correction>)> = Vec::new();
    for correction in corrections.iter().filter(|c| !matches!(c.what, Corrected::Gravity(_))) {
        match list.iter_mut().find(|(name, _)| *name == correction.joint) {
            Some((_, own)) => own.push(correction),
            None => list.push((&correction.joint, vec![correction])),
        }
    }
    list
}

/// What a format cannot say.
pub(super) fn missing(correction: &Correction, format: &str) -> String {
    format!("{format} has no word for the {}: {} is not written", correction.called(), correction.value)
}
