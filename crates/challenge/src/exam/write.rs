//! A question as files: recordings as CSV, the truth beside them as JSON, and the simulation that it is judged against.

use super::families::Kind;
use super::pose::{Class, Posed};
use crate::hide::parts;
use crate::plants::Plant;
use ndof_signal::Recording;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Result;
use std::path::Path;

/// Writes `ID-1.csv` …, `ID.truth.json` and perhaps `ID.baseline.toml` into a folder.
///
/// # Errors
/// Those of the file system.
pub fn write(posed: &Posed, folder: &Path) -> Result<()> {
    let id = &posed.question.id;
    let mut files = Vec::new();
    for (k, recording) in posed.made.recordings.iter().enumerate() {
        let name = format!("{id}-{}.csv", k + 1);
        std::fs::write(folder.join(&name), csv(recording))?;
        files.push(name);
    }
    let against = posed.question.kind == "against";
    if against {
        std::fs::write(folder.join(format!("{id}.baseline.toml")), simulation(posed))?;
    }
    let truth = serde_json::to_string_pretty(&truth(posed, files, against)).map_err(std::io::Error::other)?;
    std::fs::write(folder.join(format!("{id}.truth.json")), truth + "\n")
}

/// Nine digits, without those that say nothing.
fn digits(value: f64) -> String {
    let plain = format!("{value:.8e}");
    plain.parse::<f64>().map_or(plain, |rounded| (rounded + 0.0).to_string())
}

fn csv(recording: &Recording) -> String {
    let channels = recording.channels();
    let mut out = format!("# sample_rate_hz: {}\n", recording.sample_rate_hz());
    let header: Vec<String> = channels.iter().map(|c| format!("{} [{}]", c.name, c.unit.symbol())).collect();
    out += &header.join(",");
    out.push('\n');
    for k in 0..recording.len() {
        for (q, channel) in channels.iter().enumerate() {
            let _ = write!(out, "{}{}", if q > 0 { "," } else { "" }, digits(channel.samples[k]));
        }
        out.push('\n');
    }
    out
}

fn truth(posed: &Posed, files: Vec<String>, against: bool) -> Value {
    let (question, made, case) = (&posed.question, &posed.made, &posed.case);
    let effects: Vec<Value> = case.hidden.iter().enumerate().map(|(k, _)| effect(posed, k)).collect();
    let family = question.hidden.join(" + ");
    // Against given parameters, or on the robot's side, least squares of the limb measure nothing.
    let graded = !question.families.is_empty() || question.kind == "noise";
    let own = posed.true_model.as_ref().map(|t| t.own.iter().copied().fold(0.0, f64::max));
    json!({
        "schema": "ndof/exam/1",
        "id": question.id,
        "generator": "challenge",
        "kind": question.kind,
        "family": family,
        "held_back": question.families.iter().any(|f| f.held_back),
        "class": if graded { word(posed.class()).into() } else { Value::Null },
        "plant": case.plant.word(),
        "axes": case.plant.names(),
        "files": files,
        "arguments": roles(posed),
        "baseline": against.then(|| format!("{}.baseline.toml", question.id)),
        "trials": case.trials,
        "duration_s": case.duration_s,
        "sample_rate_hz": posed.setting.rate_hz,
        "bursts": posed.setting.bursts,
        "seed": case.seed,
        "effects": effects,
        "strength": { "share": posed.strength.share, "size": posed.strength.size, "output": posed.strength.output },
        // The limb's own force, where the instruments see it: naming it is not wrong then.
        "present": if own.is_none_or(|own| own >= 0.01) { vec!["limb-noise"] } else { vec![] },
        "true_model": posed.true_model.as_ref().map(|t| json!({ "nrmse": t.nrmse, "own_force": t.own, "how": t.how })),
        "linear": { "M": made.mass, "B": made.damping, "K": made.stiffness },
    })
}

/// Options of the command line that say what is given and what is measured, where the channels' names do not.
fn roles(posed: &Posed) -> Vec<String> {
    let name = |channel: &usize| posed.made.recordings[0].channels()[*channel].name.clone();
    let list = |channels: &[usize]| channels.iter().map(name).collect::<Vec<_>>().join(",");
    let ports = &posed.made.ports;
    if posed.case.plant == Plant::Motion { vec!["--input".to_owned(), list(&ports.inputs), "--output".to_owned(), list(&ports.outputs)] } else { vec![] }
}

fn effect(posed: &Posed, k: usize) -> Value {
    let (question, made) = (&posed.question, &posed.made);
    let hidden = &posed.case.hidden[k];
    let (name, form) = parts(hidden.name);
    let family = question.families.get(k);
    let registry = family.is_none_or(|f| f.kind == Kind::Registry);
    // A half-sine is no raised cosine: it begins at another time.
    let parameters: serde_json::Map<String, Value> =
        made.truth[k].iter().filter(|_| registry && name != "transient-disturbance").map(|(name, value)| ((*name).to_owned(), json!(value))).collect();
    let sides: &[&str] = match (family, name) {
        (Some(family), _) => family.sides(),
        (None, "robot-friction") => &["robot"],
        (None, "sensor-scale") => &["sensor"],
        _ => &["limb"],
    };
    let whole = matches!(
        name,
        "sensor-misalignment" | "added-mass" | "measurement-delay" | "channel-filter" | "x-clock-wander" | "x-amplitude-delay" | "periodic-disturbance"
    );
    json!({
        "effect": family.map_or(name, |f| f.effect()),
        "form": form,
        "names": family.map_or_else(|| vec![name], |f| f.names()),
        "sides": sides,
        "axis": if whole { Value::Null } else { made.axis_name.into() },
        "severity": hidden.severity,
        "parameters": parameters,
        "one_directional": (name == "reflex-one").then_some(true),
    })
}

fn word(class: Class) -> &'static str {
    match class {
        Class::Clear => "clear",
        Class::Middle => "middle",
        Class::Weak => "weak",
        Class::Faint => "faint",
    }
}

/// The simulation that lacks what is hidden: added mass and scale against all parameters as they are, a stiffness that is a third too
/// low, and one without its coupling.
fn simulation(posed: &Posed) -> String {
    let made = &posed.made;
    let name = posed.question.hidden.first().copied().unwrap_or_default();
    let matrix = |m: &[Vec<f64>]| {
        let rows: Vec<String> = m.iter().map(|r| format!("[{}]", r.iter().map(f64::to_string).collect::<Vec<_>>().join(", "))).collect();
        if m.len() == 1 { m[0][0].to_string() } else { format!("[{}]", rows.join(", ")) }
    };
    let mut stiffness = made.stiffness.clone();
    for (i, row) in stiffness.iter_mut().enumerate() {
        for (j, k) in row.iter_mut().enumerate() {
            *k *= match name {
                "parameter-error" => 2.0 / 3.0,
                "cross-coupling" if i != j => 0.0,
                _ => 1.0,
            };
        }
    }
    let status = |part: &str| match (name, part) {
        ("added-mass", "M") | ("cross-coupling", "K") | ("sensor-scale", _) => "fixed",
        ("parameter-error", "K") => "nominal",
        _ => "free",
    };
    let mut out = "model = \"inertia-damping-stiffness\"\n".to_owned();
    for (part, value) in [("M", &made.mass), ("B", &made.damping), ("K", &stiffness)] {
        let _ = write!(out, "[parameters.{part}]\nvalue = {}\nstatus = \"{}\"\n", matrix(value), status(part));
    }
    debug_assert!(posed.case.plant != Plant::Mass, "a mass has no stiffness to be wrong about");
    out
}
