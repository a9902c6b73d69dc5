//! Axes of a mechanical system and the units that follow from them.

use serde::{Deserialize, Serialize};

/// One degree of freedom: a translation or a rotation.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Axis {
    /// Name without a role: `x`, `elbow`.
    pub name: String,
    /// Radians and newton metres in place of metres and newtons.
    pub rotational: bool,
}

impl Axis {
    /// A translation.
    pub fn linear(name: &str) -> Self {
        Axis { name: name.to_owned(), rotational: false }
    }

    /// A rotation.
    pub fn rotational(name: &str) -> Self {
        Axis { name: name.to_owned(), rotational: true }
    }

    /// The axis that a channel's name says: `pos_x` is the translation `x`, `torque_elbow` the rotation `elbow`; a name
    /// without a known prefix is a translation of that name.
    pub fn from_channel(channel: &str) -> Self {
        for (prefix, rotational) in [("pos_", false), ("force_", false), ("vel_", false), ("acc_", false), ("cmd_", false), ("angle_", true), ("torque_", true)]
        {
            if let Some(name) = channel.strip_prefix(prefix) {
                return Axis { name: name.to_owned(), rotational };
            }
        }
        Axis::linear(channel)
    }

    /// Unit of an effort along `self` per motion along `motion`, with `rate` as the power of time: 2 for inertia, 1 for
    /// damping, 0 for stiffness.
    pub fn unit_per(&self, motion: &Axis, rate: u8) -> String {
        let effort = if self.rotational { "N m" } else { "N" };
        let time = ["", " s", " s^2"][usize::from(rate.min(2))];
        format!("{effort}{time}/{}", if motion.rotational { "rad" } else { "m" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_name_their_axis_and_entries_their_unit() {
        let (x, elbow) = (Axis::from_channel("pos_x"), Axis::from_channel("torque_elbow"));
        assert_eq!((x.name.as_str(), x.rotational, elbow.name.as_str(), elbow.rotational), ("x", false, "elbow", true));
        assert_eq!(x.unit_per(&x, 2), "N s^2/m");
        assert_eq!(elbow.unit_per(&elbow, 1), "N m s/rad");
        assert_eq!(elbow.unit_per(&x, 0), "N m/m");
    }
}
