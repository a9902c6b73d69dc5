//! The figures of a planar arm: segments, joint impedance, tone.

use crate::error::DeviceError;
use crate::noise::LimbNoise;
use ndof_models::Arm;
use serde::{Deserialize, Serialize};

/// Muscle tone after stroke: factors on K and B, and the force with which the arm pulls the hand towards its shoulder. Elbow
/// stiffness and damping rise together with the clinical score, hands of patients resonate at 2 to 3 Hz and pull with 3 to
/// 12 N; the figures of the two variants are ours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// K and B as given, no pull.
    #[default]
    Normal,
    /// Twice the stiffness, 1.5 times the damping, 4 N.
    MildHypertonia,
    /// Four times the stiffness, twice the damping, 10 N.
    SevereHypertonia,
}

impl Tone {
    /// Factor on K, factor on B, pull (N).
    pub(super) fn figures(self) -> (f64, f64, f64) {
        match self {
            Tone::Normal => (1.0, 1.0, 0.0),
            Tone::MildHypertonia => (2.0, 1.5, 4.0),
            Tone::SevereHypertonia => (4.0, 2.0, 10.0),
        }
    }
}

/// A planar arm of two segments. Segment figures left out follow from height and mass (Winter's tables), the
/// defaults being Shadmehr and Mussa-Ivaldi's (1994) arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(non_snake_case, reason = "the field's own letters, as the files write them")]
pub struct PlanarTwoLinkConfig {
    /// Which arm.
    pub arm: Arm,
    /// Body height (m); with `body_mass_kg` it sets the segments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Body mass (kg).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_mass_kg: Option<f64>,
    /// Lengths of upper arm and forearm to the hand (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link_lengths_m: Option<[f64; 2]>,
    /// Segment masses (kg).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link_masses_kg: Option<[f64; 2]>,
    /// Distances from joint to centre of mass (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link_centres_m: Option<[f64; 2]>,
    /// Moments of inertia about the centres of mass (kg m²).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link_inertias_kg_m2: Option<[f64; 2]>,
    /// Joint stiffness (N m/rad), two-joint terms off the diagonal.
    pub K: Vec<Vec<f64>>,
    /// Joint damping (N m s/rad).
    pub B: Vec<Vec<f64>>,
    /// Joint stiffness over the cycle of `controller.movement`: four matrices or more, evenly over it, the coefficients of closed cubic B-splines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub K_over_cycle: Option<Vec<Vec<Vec<f64>>>>,
    /// Joint damping over the cycle, likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub B_over_cycle: Option<Vec<Vec<Vec<f64>>>>,
    /// Force on the hand that holds the arm at the posture, in place of that of `tone`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_force_n: Option<Vec<f64>>,
    /// Muscle tone: what stroke adds to stiffness, damping and the pull towards the body.
    pub tone: Tone,
    /// Mass of handle and trough, moving with the hand (kg).
    pub handle_mass_kg: f64,
    /// Where the shoulder is; with the hand's place it sets the posture. Otherwise `posture.joint_rad` does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shoulder_m: Option<[f64; 2]>,
    /// Force that the limb makes by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<LimbNoise>,
}

impl Default for PlanarTwoLinkConfig {
    fn default() -> Self {
        PlanarTwoLinkConfig {
            arm: Arm::Right,
            height_m: None,
            body_mass_kg: None,
            link_lengths_m: None,
            link_masses_kg: None,
            link_centres_m: None,
            link_inertias_kg_m2: None,
            K: vec![vec![15.0, 6.0], vec![6.0, 16.0]],
            B: vec![vec![2.3, 0.9], vec![0.9, 2.4]],
            K_over_cycle: None,
            B_over_cycle: None,
            mean_force_n: None,
            tone: Tone::Normal,
            handle_mass_kg: 0.0,
            shoulder_m: None,
            noise: None,
        }
    }
}

/// Lengths, masses, centres and inertias of upper arm and forearm.
pub(super) struct Segments {
    pub(super) lengths: [f64; 2],
    pub(super) masses: [f64; 2],
    pub(super) centres: [f64; 2],
    pub(super) inertias: [f64; 2],
}

/// Segment figures from body height and mass: D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. (2009), table 4.1.
fn segments_of_body(height_m: f64, mass_kg: f64) -> Segments {
    let masses = [0.028 * mass_kg, 0.022 * mass_kg];
    let (upper, to_styloid) = (0.186 * height_m, 0.146 * height_m);
    // To the middle of the hand: half of the hand's 0.108 h beyond the wrist.
    let lengths = [upper, to_styloid + 0.054 * height_m];
    let centres = [0.436 * upper, 0.682 * to_styloid];
    let inertias = [masses[0] * (0.322 * upper).powi(2), masses[1] * (0.468 * to_styloid).powi(2)];
    Segments { lengths, masses, centres, inertias }
}

impl PlanarTwoLinkConfig {
    /// The segments: as given, else from height and mass, else the defaults.
    pub(super) fn segments(&self) -> Result<Segments, DeviceError> {
        let mut segments = match (self.height_m, self.body_mass_kg) {
            (Some(height), Some(mass)) if height > 0.0 && mass > 0.0 => segments_of_body(height, mass),
            (None, None) => Segments { lengths: [0.33, 0.34], masses: [1.93, 1.52], centres: [0.165, 0.19], inertias: [0.0141, 0.0188] },
            (Some(height), Some(mass)) => {
                return Err(DeviceError::value("limb.height_m × limb.body_mass_kg", height * mass, "the product of two positive numbers"));
            }
            _ => return Err(DeviceError::Missing("limb.height_m and limb.body_mass_kg set the segments together; give both or none".to_owned())),
        };
        let Segments { lengths, masses, centres, inertias } = &mut segments;
        for (name, values, given) in [
            ("link_lengths_m", lengths, self.link_lengths_m),
            ("link_masses_kg", masses, self.link_masses_kg),
            ("link_centres_m", centres, self.link_centres_m),
            ("link_inertias_kg_m2", inertias, self.link_inertias_kg_m2),
        ] {
            *values = given.unwrap_or(*values);
            values.iter().try_for_each(|v| DeviceError::positive(format!("limb.{name}"), *v))?;
        }
        Ok(segments)
    }
}
