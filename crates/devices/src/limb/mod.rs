//! Limbs: what the robot's end effector is fastened to.

mod arm_figures;
pub(crate) mod endpoint_linear;
mod moving_arm;
pub(crate) mod planar_two_link;
pub(crate) mod spring_array;
pub(crate) mod wrist;

pub use arm_figures::{PlanarTwoLinkConfig, Tone};
pub use endpoint_linear::{EndpointLinear, EndpointLinearConfig};
pub use moving_arm::MovingArm;
pub use planar_two_link::PlanarTwoLink;
pub use spring_array::{SPRING_CONFIGURATIONS, SpringArray, SpringArrayConfig, SpringConfiguration};
pub use wrist::{Wrist, WristConfig, anatomical_axes, hand_gravity_stiffness};

use ndarray::Array2;

/// Inertia, damping and stiffness matrices of a limb, axes × axes: D(s) = M s² + B s + K.
#[derive(Clone, Debug, PartialEq)]
pub struct Impedance {
    /// M (kg, kg m²).
    pub inertia: Array2<f64>,
    /// B (N s/m, N m s/rad).
    pub damping: Array2<f64>,
    /// K (N/m, N m/rad).
    pub stiffness: Array2<f64>,
}

/// A limb as the endpoint feels it.
///
/// Displacement x is counted from the posture, where the limb rests under its mean force.
pub trait Limb: Send + Sync {
    /// The number of endpoint axes.
    fn axes(&self) -> usize {
        self.mean_force().len()
    }

    /// The force on the limb that keeps it at the posture, F₀ (N, N m).
    fn mean_force(&self) -> &[f64];

    /// Writes ẍ at displacement `x` and velocity `v` under the whole applied `force` (F₀ included).
    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]);

    /// The matrices at the posture, the geometric stiffness of the mean force included.
    fn linearised(&self) -> Impedance;

    /// The same in the limb's own joints with the Jacobian between (endpoint rows, joint columns), where it has joints.
    fn joint_impedance(&self) -> Option<(Impedance, Array2<f64>)> {
        None
    }

    /// The limb as one that moves, where it does: a force law over and above [`Limb::acceleration`].
    fn moving(&self) -> Option<&MovingArm> {
        None
    }
}
