//! The paper's validation rig: a handle held by up to eight springs between an inner and an outer square.

use super::{Impedance, Limb};
use crate::device::LimbEntry;
use crate::error::DeviceError;
use crate::noise::LimbNoise;
use crate::parameters::parameter;
use ndarray::{Array2, arr1};
use serde::{Deserialize, Serialize};

/// The registry's entry.
pub(crate) static ENTRY: LimbEntry = LimbEntry {
    name: "spring-array",
    description: "handle on up to eight springs between two squares, configurations sa1 to sa9, for planar devices",
    parameters: &[
        parameter("configuration", "", f64::NAN, "sa1 to sa9"),
        parameter("springs_n_per_m", "N/m", f64::NAN, "stiffness at E, NE, N, NW, W, SW, S, SE in place of a configuration"),
        parameter("outer_half_m", "m", 0.23, "half of the outer square's side"),
        parameter("inner_half_m", "m", 0.05, "half of the inner square's side"),
        parameter("rest_length_m", "m", 0.1, "length of a spring at its initial tension"),
        parameter("initial_tension_n", "N", 0.0, "tension at the rest length"),
        parameter("mass_kg", "kg", 0.429, "mass of handle and inner square"),
        parameter("damping_ratio", "1", 0.01, "damping ratio of each axis"),
        parameter("noise", "", f64::NAN, "force made by the array itself: rms_n, cutoff_hz"),
    ],
    source: "Palazzolo et al., IEEE Trans. Neural Syst. Rehabil. Eng. 15 (2007) 92, fig. 5; stiffnesses are ours",
};

/// The mounts' directions, counter-clockwise: E, NE, N, NW, W, SW, S, SE; corners of a square, not of a circle.
const MOUNTS: [[f64; 2]; 8] = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]];

/// A named arrangement of springs, stiffness by mount (N/m), 0 where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringConfiguration {
    /// Its name, after the paper's figure 5.
    pub name: &'static str,
    /// Stiffness at E, NE, N, NW, W, SW, S, SE (N/m).
    pub springs_n_per_m: [f64; 8],
}

/// The nine arrangements sa1 to sa9. The paper shows their ellipses and prints no stiffness: the numbers are ours.
pub static SPRING_CONFIGURATIONS: [SpringConfiguration; 9] = [
    SpringConfiguration { name: "sa1", springs_n_per_m: [100.0, 250.0, 100.0, 0.0, 100.0, 250.0, 100.0, 0.0] },
    SpringConfiguration { name: "sa2", springs_n_per_m: [100.0, 0.0, 100.0, 250.0, 100.0, 0.0, 100.0, 250.0] },
    SpringConfiguration { name: "sa3", springs_n_per_m: [100.0, 150.0, 0.0, 0.0, 100.0, 150.0, 0.0, 0.0] },
    SpringConfiguration { name: "sa4", springs_n_per_m: [0.0, 100.0, 0.0, 100.0, 0.0, 100.0, 0.0, 100.0] },
    SpringConfiguration { name: "sa5", springs_n_per_m: [100.0; 8] },
    SpringConfiguration { name: "sa6", springs_n_per_m: [0.0, 150.0, 100.0, 0.0, 0.0, 150.0, 100.0, 0.0] },
    SpringConfiguration { name: "sa7", springs_n_per_m: [0.0, 0.0, 100.0, 150.0, 0.0, 0.0, 100.0, 150.0] },
    SpringConfiguration { name: "sa8", springs_n_per_m: [100.0, 0.0, 0.0, 150.0, 100.0, 0.0, 0.0, 150.0] },
    SpringConfiguration { name: "sa9", springs_n_per_m: [0.0, 300.0, 0.0, 100.0, 0.0, 300.0, 0.0, 100.0] },
];

/// Figures of a spring array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpringArrayConfig {
    /// One of sa1 to sa9; `springs_n_per_m` in its place gives any other.
    pub configuration: Option<String>,
    /// Stiffness at E, NE, N, NW, W, SW, S, SE (N/m), 0 for no spring.
    pub springs_n_per_m: Option<[f64; 8]>,
    /// Half of the outer square's side (m).
    pub outer_half_m: f64,
    /// Half of the inner square's side (m).
    pub inner_half_m: f64,
    /// Length of a spring at its initial tension (m).
    pub rest_length_m: f64,
    /// Tension at the rest length (N).
    pub initial_tension_n: f64,
    /// Mass of handle and inner square (kg).
    pub mass_kg: f64,
    /// Damping ratio ζ; B = diag(2 ζ √(K_ii m)).
    pub damping_ratio: f64,
    /// Force that the array makes by itself; for comparison with limbs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<LimbNoise>,
}

impl Default for SpringArrayConfig {
    fn default() -> Self {
        SpringArrayConfig {
            configuration: None,
            springs_n_per_m: None,
            outer_half_m: 0.23,
            inner_half_m: 0.05,
            rest_length_m: 0.1,
            initial_tension_n: 0.0,
            mass_kg: 0.429,
            damping_ratio: 0.01,
            noise: None,
        }
    }
}

/// The array built from [`SpringArrayConfig`]: m ẍ + B ẋ − Σ Tᵢ vᵢ/Lᵢ = F with vᵢ = (a − b) uᵢ − x, Lᵢ = |vᵢ| and
/// Tᵢ = T₀ + kᵢ (Lᵢ − L₀) where positive.
#[derive(Clone, Debug)]
pub struct SpringArray {
    springs: Vec<Spring>,
    rest_length: f64,
    initial_tension: f64,
    mass: f64,
    damping: [f64; 2],
    stiffness: Array2<f64>,
    mean_force: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Spring {
    span: [f64; 2],
    stiffness: f64,
}

impl SpringArray {
    /// The array from its figures.
    ///
    /// # Errors
    /// [`DeviceError`] if the configuration is unknown, no spring is given, or a figure is impossible.
    pub fn new(config: &SpringArrayConfig) -> Result<Self, DeviceError> {
        let stiffness = match (&config.configuration, config.springs_n_per_m) {
            (None, Some(springs)) => springs,
            (Some(name), None) => {
                SPRING_CONFIGURATIONS
                    .iter()
                    .find(|c| c.name == name)
                    .ok_or_else(|| DeviceError::Missing(format!("no spring configuration \"{name}\"; there are sa1 to sa9, or give springs_n_per_m")))?
                    .springs_n_per_m
            }
            _ => return Err(DeviceError::Missing("a spring array needs either limb.configuration (sa1 to sa9) or limb.springs_n_per_m".to_owned())),
        };
        for (name, value, least) in [
            ("outer_half_m − inner_half_m", config.outer_half_m - config.inner_half_m, f64::MIN_POSITIVE),
            ("mass_kg", config.mass_kg, f64::MIN_POSITIVE),
            ("rest_length_m", config.rest_length_m, f64::MIN_POSITIVE),
            ("initial_tension_n", config.initial_tension_n, 0.0),
            ("damping_ratio", config.damping_ratio, 0.0),
        ] {
            if !(value.is_finite() && value >= least) {
                return Err(DeviceError::value(format!("limb.{name}"), value, if least > 0.0 { "positive" } else { "zero or positive" }));
            }
        }
        if let Some(k) = stiffness.iter().find(|k| !(k.is_finite() && **k >= 0.0)) {
            return Err(DeviceError::value("limb.springs_n_per_m", *k, "zero or positive"));
        }
        let span = config.outer_half_m - config.inner_half_m;
        let springs: Vec<Spring> =
            MOUNTS.iter().zip(stiffness).filter(|(_, k)| *k > 0.0).map(|(u, stiffness)| Spring { span: [span * u[0], span * u[1]], stiffness }).collect();
        if springs.is_empty() {
            return Err(DeviceError::Missing("limb.springs_n_per_m holds no spring: at least one must be positive".to_owned()));
        }
        let mut array = SpringArray {
            springs,
            rest_length: config.rest_length_m,
            initial_tension: config.initial_tension_n,
            mass: config.mass_kg,
            damping: [0.0; 2],
            stiffness: Array2::zeros((2, 2)),
            mean_force: vec![0.0; 2],
        };
        array.stiffness = array.stiffness_at_rest();
        for i in 0..2 {
            array.damping[i] = 2.0 * config.damping_ratio * (array.stiffness[[i, i]] * config.mass_kg).sqrt();
        }
        array.mean_force = array.force([0.0; 2]).iter().map(|f| -f).collect();
        Ok(array)
    }

    /// Force of the springs on the inner square at displacement `x` (N).
    pub fn force(&self, x: [f64; 2]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for spring in &self.springs {
            let v = [spring.span[0] - x[0], spring.span[1] - x[1]];
            let length = v[0].hypot(v[1]);
            let tension = self.tension(spring, length);
            sum[0] += tension * v[0] / length;
            sum[1] += tension * v[1] / length;
        }
        sum
    }

    fn tension(&self, spring: &Spring, length: f64) -> f64 {
        (self.initial_tension + spring.stiffness * (length - self.rest_length)).max(0.0)
    }

    /// K = Σ kᵢ nᵢnᵢᵀ + (Tᵢ/Lᵢ)(1 − nᵢnᵢᵀ): the pretension stiffens across the spring.
    fn stiffness_at_rest(&self) -> Array2<f64> {
        let mut sum = Array2::zeros((2, 2));
        for spring in &self.springs {
            let length = spring.span[0].hypot(spring.span[1]);
            let tension = self.tension(spring, length);
            let along = if tension > 0.0 { spring.stiffness } else { 0.0 };
            for i in 0..2 {
                for j in 0..2 {
                    let nn = spring.span[i] * spring.span[j] / (length * length);
                    let one = f64::from(u8::from(i == j));
                    sum[[i, j]] += along * nn + tension / length * (one - nn);
                }
            }
        }
        sum
    }
}

impl Limb for SpringArray {
    fn mean_force(&self) -> &[f64] {
        &self.mean_force
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        let spring = self.force([x[0], x[1]]);
        for i in 0..2 {
            out[i] = (force[i] + spring[i] - self.damping[i] * v[i]) / self.mass;
        }
    }

    fn linearised(&self) -> Impedance {
        Impedance { inertia: Array2::eye(2) * self.mass, damping: Array2::from_diag(&arr1(&self.damping)), stiffness: self.stiffness.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array_called(name: &str) -> SpringArray {
        SpringArray::new(&SpringArrayConfig { configuration: Some(name.to_owned()), ..Default::default() }).expect("valid")
    }

    /// K_xx, K_xy, K_yy of each configuration, to the tenth, from an independent script (tests/reference_devices/springs.py).
    const TABLE: [(&str, [f64; 3]); 9] = [
        ("sa1", [690.7, 98.2, 690.7]),
        ("sa2", [690.7, -98.2, 690.7]),
        ("sa3", [441.1, 58.9, 330.0]),
        ("sa4", [321.4, 0.0, 321.4]),
        ("sa5", [610.3, 0.0, 610.3]),
        ("sa6", [330.0, 58.9, 441.1]),
        ("sa7", [330.0, -58.9, 441.1]),
        ("sa8", [441.1, -58.9, 330.0]),
        ("sa9", [642.9, 78.6, 642.9]),
    ];

    #[test]
    fn the_nine_configurations_have_their_stiffness() {
        for (name, [xx, xy, yy]) in TABLE {
            let k = array_called(name).linearised().stiffness;
            for (found, expected) in [(k[[0, 0]], xx), (k[[0, 1]], xy), (k[[1, 0]], xy), (k[[1, 1]], yy)] {
                assert!((found - expected).abs() <= 0.1, "{name}: {k}");
            }
        }
    }

    #[test]
    fn stiffness_is_the_slope_of_the_force() {
        for pretension in [0.0, 3.0] {
            let config = SpringArrayConfig { configuration: Some("sa3".to_owned()), initial_tension_n: pretension, ..Default::default() };
            let array = SpringArray::new(&config).expect("valid");
            let (h, k) = (1e-5, array.linearised().stiffness);
            for j in 0..2 {
                let at = |s: f64| array.force(if j == 0 { [s, 0.0] } else { [0.0, s] });
                let (plus, minus) = (at(h), at(-h));
                for i in 0..2 {
                    // h² f‴/6 with f‴ of the order k/L² = 1e4, and round-off 1e-14·F/h.
                    assert!((-(plus[i] - minus[i]) / (2.0 * h) - k[[i, j]]).abs() < 1e-5, "{pretension} N");
                }
            }
        }
    }

    #[test]
    fn force_leaves_the_straight_line_slowly() {
        // 0.03 % at 1 cm and 0.5 % at 4 cm at most, over all directions and configurations.
        for (radius, bound) in [(0.01, 4e-4), (0.04, 6e-3)] {
            let mut worst: f64 = 0.0;
            for (name, _) in TABLE {
                let array = array_called(name);
                let k = array.linearised().stiffness;
                for step in 0..72 {
                    let angle = f64::from(step) * std::f64::consts::TAU / 72.0;
                    let x = [radius * angle.cos(), radius * angle.sin()];
                    let linear = [k[[0, 0]] * x[0] + k[[0, 1]] * x[1], k[[1, 0]] * x[0] + k[[1, 1]] * x[1]];
                    let force = array.force(x);
                    worst = worst.max((force[0] + linear[0]).hypot(force[1] + linear[1]) / linear[0].hypot(linear[1]));
                }
            }
            assert!(worst < bound && worst > bound / 10.0, "{worst} at {radius}");
        }
    }

    #[test]
    fn a_slack_spring_pulls_no_more() {
        let config = SpringArrayConfig { springs_n_per_m: Some([100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), ..Default::default() };
        let array = SpringArray::new(&config).expect("valid");
        assert!(array.force([0.07, 0.0])[0] > 0.9);
        assert_eq!(array.force([0.09, 0.0]), [0.0, 0.0]);
        // A lone spring needs a force to be held where it is.
        assert!((array.mean_force()[0] + 8.0).abs() < 1e-12);
        assert!(SpringArray::new(&SpringArrayConfig::default()).is_err());
    }
}
