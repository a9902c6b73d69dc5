//! The numbers of a chain by their names.

use super::link::Link;
use crate::vector3::Vector;
use ndof_models::robot::{Joints, Meaning, RobotError, RobotParameter};

/// Numbers of a joint and its body.
const OF_A_JOINT: usize = 16;
/// Rows and columns of an inertia, in the order of its names.
const ENTRIES: [(&str, usize, usize); 6] = [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)];

/// Mass, centre of mass, inertia about it, rotor, friction and origin of each joint, then the place of the tip where it shows.
pub(super) fn told(links: &[Link], tip: Option<Vector>, joints: &Joints) -> Vec<RobotParameter> {
    let mut out = Vec::new();
    for (j, link) in links.iter().enumerate() {
        let name = &joints.names[j];
        let mut add =
            |what: &str, suffix: &str, unit: &str, value, meaning| out.push(RobotParameter::new(format!("{what}_{name}_{suffix}"), unit, value, meaning));
        add("mass", "kg", "kg", link.mass, Meaning::Inertia);
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            add(&format!("centre_{axis}"), "m", "m", link.centre[k], Meaning::Inertia);
        }
        for (entry, r, c) in ENTRIES {
            add(&format!("inertia_{entry}"), "kg_m2", "kg m^2", link.inertia[r][c], Meaning::Inertia);
        }
        let [of_rotor, coulomb, viscous] =
            if link.slides { [("kg", "kg"), ("n", "N"), ("n_s_per_m", "N s/m")] } else { [("kg_m2", "kg m^2"), ("nm", "N m"), ("nm_s_per_rad", "N m s/rad")] };
        add("rotor", of_rotor.0, of_rotor.1, link.rotor, Meaning::Inertia);
        add("coulomb", coulomb.0, coulomb.1, joints.coulomb[j], Meaning::Friction);
        add("viscous", viscous.0, viscous.1, joints.viscous[j], Meaning::Friction);
        for (k, axis) in ["x", "y", "z"].iter().enumerate() {
            add(&format!("origin_{axis}"), "m", "m", link.origin[k], Meaning::Geometry);
        }
    }
    for (axis, place) in ["x", "y", "z"].iter().zip(tip.iter().flatten()) {
        out.push(RobotParameter::new(format!("tip_{axis}_m"), "m", *place, Meaning::Geometry));
    }
    out
}

/// Sets them, in the order of [`told`].
pub(super) fn taken(values: &[f64], links: &mut [Link], tip: &mut Option<Vector>, joints: &mut Joints) -> Result<(), RobotError> {
    let expected = OF_A_JOINT * links.len() + if tip.is_some() { 3 } else { 0 };
    if values.len() != expected {
        return Err(RobotError::Length { what: "the list of parameters", found: values.len(), expected });
    }
    let (of_joints, of_tip) = values.split_at(OF_A_JOINT * links.len());
    for (j, (link, own)) in links.iter_mut().zip(of_joints.chunks_exact(OF_A_JOINT)).enumerate() {
        link.mass = own[0];
        link.centre.copy_from_slice(&own[1..4]);
        for ((_, r, c), value) in ENTRIES.iter().zip(&own[4..10]) {
            (link.inertia[*r][*c], link.inertia[*c][*r]) = (*value, *value);
        }
        (link.rotor, joints.coulomb[j], joints.viscous[j]) = (own[10], own[11], own[12]);
        link.origin.copy_from_slice(&own[13..]);
    }
    if let Some(tip) = tip {
        tip.copy_from_slice(of_tip);
    }
    Ok(())
}
