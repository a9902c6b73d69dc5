//! What the black-box tests share: running the program, making recordings, checking JSON against a schema.

use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs `ndof` in `folder`.
pub fn ndof(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ndof")).args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Runs `ndof`, which must succeed, and returns its standard output.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = ndof(folder, arguments);
    assert!(output.status.success(), "ndof {}\n{}", arguments.join(" "), String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Runs `ndof`, which must refuse with exit code 2 and one message, and returns that message.
pub fn refuse(folder: &Path, arguments: &[&str]) -> String {
    let output = ndof(folder, arguments);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(2), "ndof {}\n{message}", arguments.join(" "));
    assert_eq!(message.lines().filter(|line| line.starts_with("error: ")).count(), 1, "one message: {message}");
    assert!(!message.contains("panicked"), "{message}");
    assert!(output.stdout.is_empty(), "nothing on standard output");
    message
}

/// The result of a command that writes JSON to standard output.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let all: Vec<&str> = arguments.iter().copied().chain(["--quiet", "--json", "-"]).collect();
    serde_json::from_str(&succeed(folder, &all)).expect("JSON")
}

/// A file of measured data beside the repository, or `None` with a printed line where there is none.
pub fn shared(path: &str) -> Option<PathBuf> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if file.exists() {
        return Some(file);
    }
    println!("skipped: {} is not there", file.display());
    None
}

/// White noise between −1 and 1 by a linear congruential generator.
pub fn noise(seed: u64, samples: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    (0..samples)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        })
        .collect()
}

/// Motion of a 2 kg mass on 12 N s/m and 300 N/m under a force held over each of `samples` intervals of 2 ms, as the mean over
/// each interval.
pub fn oscillator(force: &[f64]) -> Vec<f64> {
    oscillator_of([2.0, 12.0, 300.0], force)
}

/// The same with another mass, damping and stiffness.
pub fn oscillator_of(constants: [f64; 3], force: &[f64]) -> Vec<f64> {
    oscillator_that_changes(|_| constants, force)
}

/// The same with mass, damping and stiffness of their own in each interval.
pub fn oscillator_that_changes(constants: impl Fn(usize) -> [f64; 3], force: &[f64]) -> Vec<f64> {
    const STEPS: usize = 50;
    let h = 0.002 / STEPS as f64;
    let (mut x, mut v) = (0.0, 0.0);
    force
        .iter()
        .enumerate()
        .map(|(at, f)| {
            let ([m, b, k], mut mean) = (constants(at), 0.0);
            for _ in 0..STEPS {
                v += h * (f - b * v - k * x) / m;
                x += h * v;
                mean += x / STEPS as f64;
            }
            mean
        })
        .collect()
}

/// A CSV file from named columns.
pub fn csv(path: &Path, head: &str, columns: &[(&str, &[f64])]) {
    let mut text = head.to_owned();
    text += &columns.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(",");
    text.push('\n');
    for k in 0..columns[0].1.len() {
        let row: Vec<String> = columns.iter().map(|(_, samples)| samples[k].to_string()).collect();
        writeln!(text, "{}", row.join(",")).expect("a string");
    }
    std::fs::write(path, text).expect("a writable folder");
}

/// `trial.csv`: force and motion of the oscillator, 20 s at 500 Hz.
pub fn trial(folder: &Path) -> PathBuf {
    let force = noise(1, 10_000);
    let path = folder.join("trial.csv");
    csv(&path, "# sample_rate_hz: 500\n", &[("force_x [N]", &force), ("pos_x [m]", &oscillator(&force))]);
    path
}

/// Checks `value` against `schema` for what our schemas use: type, properties, required, items, prefixItems, anyOf, $ref, const,
/// enum, lengths. Returns the first place that does not fit.
pub fn violation(value: &Value, schema: &Value, root: &Value, place: &str) -> Option<String> {
    if let Some(reference) = schema.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(reference.trim_start_matches('#')).unwrap_or_else(|| panic!("{reference} is nowhere in the schema"));
        return violation(value, target, root, place);
    }
    if let Some(choices) = schema.get("anyOf").and_then(Value::as_array)
        && choices.iter().all(|choice| violation(value, choice, root, place).is_some())
    {
        return Some(format!("{place} fits none of {}", schema["anyOf"]));
    }
    let is = |name: &str| match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("type {other}"),
    };
    let fits = match schema.get("type") {
        Some(Value::String(name)) => is(name),
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).any(is),
        _ => true,
    };
    if !fits {
        return Some(format!("{place} is {value}, not {}", schema["type"]));
    }
    if let Some(object) = value.as_object() {
        for name in schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str) {
            if !object.contains_key(name) {
                return Some(format!("{place} lacks {name}"));
            }
        }
        for (name, member) in object {
            let Some(properties) = schema.get("properties") else { break };
            let Some(known) = properties.get(name) else { return Some(format!("{place}/{name} is not in the schema")) };
            if let Some(found) = violation(member, known, root, &format!("{place}/{name}")) {
                return Some(found);
            }
        }
    }
    let items = schema.get("items").filter(|items| items.is_object());
    value.as_array()?.iter().enumerate().find_map(|(k, item)| violation(item, items?, root, &format!("{place}/{k}")))
}

/// Two links that swing in a vertical plane, as a URDF.
pub const ARM_URDF: &str = r#"<robot name="arm">
  <link name="base"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="4" effort="60"/></joint>
  <link name="upper"><inertial><origin xyz="0 0 -0.15"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 -0.3"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="4" effort="30"/></joint>
  <link name="fore"><inertial><origin xyz="0 0 -0.12"/><mass value="1.2"/><inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>
"#;

/// A planar arm held by MIT-MANUS, as an experiment's file: what stands before its tables, and what comes behind the limb's matrices.
pub fn held_arm(before: &str, behind: &str) -> String {
    format!(
        r#"
        {before}
        [device]
        name = "mit-manus"
        [limb]
        name = "endpoint-linear"
        M = [[2.1, -0.55], [-0.55, 1.9]]
        B = [[11.0, -2.0], [-2.0, 15.0]]
        K = [[300.0, -60.0], [-60.0, 520.0]]
        {behind}
        "#
    )
}
