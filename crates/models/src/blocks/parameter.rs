//! Parameters of a block or a law, and their names and units.

/// A parameter of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockParameter {
    /// Name with unit.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Least value that makes sense.
    pub lower: f64,
    /// Largest value that makes sense.
    pub upper: f64,
    /// Where searches begin; every combination with those of the other parameters is tried.
    pub starts: Vec<f64>,
}

impl BlockParameter {
    pub(crate) fn new(name: impl Into<String>, unit: impl Into<String>, bounds: (f64, f64), starts: &[f64]) -> Self {
        BlockParameter { name: name.into(), unit: unit.into(), lower: bounds.0, upper: bounds.1, starts: starts.to_vec() }
    }
}

/// Largest stiffness (N/m, N m/rad) and damping that a limb or fixture can have.
pub(crate) const STIFF: f64 = 1e7;

fn effort_and_motion(rotational: bool) -> [&'static str; 3] {
    if rotational { ["nm", "N m", "rad"] } else { ["n", "N", "m"] }
}

/// A force over a power of the motion: `stem_n`, `stem_n_per_m`, `stem_n_per_m2` …
pub(crate) fn force(rotational: bool, stem: &str, power: u8, bounds: (f64, f64), starts: &[f64]) -> BlockParameter {
    let [effort, unit, motion] = effort_and_motion(rotational);
    let (name, unit) = match power {
        0 => (format!("{stem}_{effort}"), unit.to_owned()),
        1 => (format!("{stem}_{effort}_per_{motion}"), format!("{unit}/{motion}")),
        _ => (format!("{stem}_{effort}_per_{motion}{power}"), format!("{unit}/{motion}^{power}")),
    };
    BlockParameter::new(name, unit, bounds, starts)
}

/// A force over a velocity: `stem_n_s_per_m`.
pub(crate) fn damping(rotational: bool, stem: &str, bounds: (f64, f64), starts: &[f64]) -> BlockParameter {
    let [effort, unit, motion] = effort_and_motion(rotational);
    BlockParameter::new(format!("{stem}_{effort}_s_per_{motion}"), format!("{unit} s/{motion}"), bounds, starts)
}

/// A displacement: `stem_m`.
pub(crate) fn length(rotational: bool, stem: &str, bounds: (f64, f64), starts: &[f64]) -> BlockParameter {
    let [_, _, motion] = effort_and_motion(rotational);
    BlockParameter::new(format!("{stem}_{motion}"), motion, bounds, starts)
}

/// The velocity below which friction rises: `stribeck_m_per_s`.
pub(crate) fn stribeck(rotational: bool) -> BlockParameter {
    let [_, _, motion] = effort_and_motion(rotational);
    BlockParameter::new(format!("stribeck_{motion}_per_s"), format!("{motion}/s"), (1e-6, 1e3), &[0.03])
}
