//! What a diagnosis promises is what the corrected file keeps: written back and judged again, nothing is missing.

use ndof_devices::{Corrected, RobotConfig, SerialChain, Written};
use ndof_diagnose::{Diagnosis, Verdict};
use ndof_joints::{Corrections, Options, corrections, diagnose};
use ndof_models::robot::Robot;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const URDF: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="trunk">
    <inertial><origin xyz="0 0.01 0.1"/><mass value="4"/><inertia ixx="0.03" iyy="0.03" izz="0.02"/></inertial>
  </link>
  <link name="upper">
    <inertial><origin xyz="0.15 0 0"/><mass value="3"/><inertia ixx="0.004" iyy="0.03" izz="0.03"/></inertial>
  </link>
  <link name="fore">
    <inertial><origin xyz="0.12 0.01 0"/><mass value="1.5"/><inertia ixx="0.002" iyy="0.012" izz="0.012"/></inertial>
  </link>
  <link name="flange"/>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="trunk"/><axis xyz="0 0 1"/><dynamics damping="0.3" friction="0.05"/>
  </joint>
  <joint name="lift" type="continuous">
    <parent link="trunk"/><child link="upper"/><origin xyz="0 0 0.25"/><axis xyz="0 1 0"/><dynamics damping="0.4" friction="0.1"/>
  </joint>
  <joint name="bend" type="continuous">
    <parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><dynamics damping="0.1" friction="0.05"/>
  </joint>
  <joint name="tool" type="fixed"><parent link="fore"/><child link="flange"/><origin xyz="0.25 0 0"/></joint>
</robot>
"#;

/// The same arm in a format that has a word for rotors and gravity.
const TOML: &str = r#"schema = "ndof/robot/1"
name = "arm"
[[joints]]
name = "turn"
axis = [0.0, 0.0, 1.0]
mass_kg = 4.0
centre_m = [0.0, 0.01, 0.1]
inertia_kg_m2 = [0.03, 0.03, 0.02, 0.0, 0.0, 0.0]
viscous_nm_s_per_rad = 0.3
coulomb_nm = 0.05
[[joints]]
name = "lift"
axis = [0.0, 1.0, 0.0]
origin_m = [0.0, 0.0, 0.25]
mass_kg = 3.0
centre_m = [0.15, 0.0, 0.0]
inertia_kg_m2 = [0.004, 0.03, 0.03, 0.0, 0.0, 0.0]
viscous_nm_s_per_rad = 0.4
coulomb_nm = 0.1
[[joints]]
name = "bend"
axis = [0.0, 1.0, 0.0]
origin_m = [0.3, 0.0, 0.0]
mass_kg = 1.5
centre_m = [0.12, 0.01, 0.0]
inertia_kg_m2 = [0.002, 0.012, 0.012, 0.0, 0.0, 0.0]
viscous_nm_s_per_rad = 0.1
coulomb_nm = 0.05
[end_effector]
translation_m = [0.25, 0.0, 0.0]
"#;

/// Fine enough that a turn of a joint, where dry friction jumps, is known to a sample of many.
const RATE_HZ: f64 = 500.0;
const DURATION_S: f64 = 40.0;
/// Of each joint's torque, as a share of its root mean square.
const NOISE: f64 = 0.01;
const COUNTS: f64 = 262_144.0;
/// Joints of the arm, the first three channels being torques.
const JOINTS: usize = 3;

fn ports() -> Ports {
    Ports { references: vec![], inputs: vec![0, 1, 2], outputs: vec![3, 4, 5] }
}

fn robot(file: &str, text: &str) -> RobotConfig {
    RobotConfig::parse(file, text, None).expect("reads")
}

/// Angle, rate and acceleration of a joint: three tones that no other joint has.
fn motion(joint: usize, t: f64) -> [f64; 3] {
    let tones = [[0.11, 0.8], [0.29, 0.35], [0.53, 0.2]];
    tones.iter().fold([[0.3, -0.4, 0.6][joint], 0.0, 0.0], |[q, v, a], [hz, size]| {
        let w = std::f64::consts::TAU * hz * (1.0 + 0.17 * joint as f64);
        let (s, c) = (w * t + joint as f64).sin_cos();
        [q + size * s, v + size * w * c, a - size * w * w * s]
    })
}

/// The log of a robot as it is: torques of its own dynamics and `friction(joint, rate)`, with noise; angles of encoders.
fn logged(truth: &SerialChain, friction: impl Fn(usize, f64) -> f64, seed: u64) -> Vec<Recording> {
    let samples = (RATE_HZ * DURATION_S) as usize;
    let (mut torques, mut angles) = (vec![vec![]; JOINTS], vec![vec![]; JOINTS]);
    for k in 0..samples {
        let state = [0, 1, 2].map(|j| motion(j, k as f64 / RATE_HZ));
        let [q, v, a] = [0, 1, 2].map(|d| state.map(|s| s[d]));
        let mut torque = [0.0; JOINTS];
        truth.inverse_dynamics(&q, &v, &a, &mut torque);
        for j in 0..JOINTS {
            let [stiffness, rest] = truth.springs()[j];
            torques[j].push(torque[j] + friction(j, v[j]) + stiffness * (q[j] - rest));
            angles[j].push((q[j] * COUNTS / std::f64::consts::TAU).round() * std::f64::consts::TAU / COUNTS);
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for torque in &mut torques {
        let size = NOISE * (torque.iter().map(|t| t * t).sum::<f64>() / samples as f64).sqrt();
        // Of uniform numbers between −√3 and √3: one in standard deviation.
        torque.iter_mut().for_each(|t| *t += size * 12_f64.sqrt() * (random.random::<f64>() - 0.5));
    }
    let channel =
        |what: &str, quantity, samples: Vec<f64>, j: usize| Channel::new(format!("{what}_{}", ["turn", "lift", "bend"][j]), Unit::si(quantity, true), samples);
    let torques = torques.into_iter().enumerate().map(|(j, s)| channel("torque", Quantity::Effort, s, j));
    let channels = torques.chain(angles.into_iter().enumerate().map(|(j, s)| channel("angle", Quantity::Displacement, s, j)));
    vec![Recording::new(RATE_HZ, channels.collect()).expect("a recording")]
}

/// Friction as a file has it.
fn as_in_the_file(config: &RobotConfig) -> impl Fn(usize, f64) -> f64 + '_ {
    |j, v| config.joints[j].coulomb_nm * v.signum() + config.joints[j].viscous_nm_s_per_rad * v
}

fn judged(config: &RobotConfig, log: &[Recording], without: &[&str]) -> Diagnosis {
    let options = Options { without: without.iter().map(|w| (*w).to_owned()).collect(), ..Options::default() };
    diagnose(&config.chain().expect("builds"), log, &[], &ports(), &options, &mut |_| {}).expect("judged").0
}

fn found(config: &RobotConfig, log: &[Recording], without: &[&str]) -> (Diagnosis, Corrections) {
    let diagnosis = judged(config, log, without);
    let corrections = corrections(&config.chain().expect("builds"), log, &ports(), &diagnosis, &Options::default()).expect("corrected");
    (diagnosis, corrections)
}

fn named(diagnosis: &Diagnosis) -> Vec<String> {
    let mut names: Vec<String> = diagnosis.causes.iter().map(|c| format!("{} {}", c.effect, c.site.axis).trim_end().to_owned()).collect();
    names.sort();
    names
}

/// The written file by itself predicts the held-out part as well as the extended model did, and lacks nothing.
fn keeps_its_promise(file: &str, written: &Written, log: &[Recording], promised: &Diagnosis) {
    let again = judged(&robot(file, &written.text), log, &[]);
    assert_eq!(
        (again.verdict, named(&again)),
        (Verdict::Adequate, vec![]),
        "{} {:?} {:?} {:?}",
        promised.verdict,
        promised.extended.held_out,
        again.baseline.held_out,
        again.discrepancy.notes
    );
    for (kept, promised) in again.baseline.held_out.nrmse.iter().zip(&promised.extended.held_out.nrmse) {
        let (kept, promised) = (kept.expect("finite"), promised.expect("finite"));
        // The same law along the same motion, smoothed up to a frequency that follows from the file's inertia: with the bound of the exam of written files.
        assert!(kept < 1.2 * promised, "{kept} against {promised}");
    }
}

#[test]
fn friction_and_a_rotor_are_written_and_nothing_is_missing_then() {
    let config = robot("arm.toml", TOML);
    let mut truth = config.clone();
    truth.joints[1].rotor_inertia_kg_m2 = 0.25;
    (truth.joints[0].viscous_nm_s_per_rad, truth.joints[2].coulomb_nm) = (1.1, 0.15);
    let log = logged(&truth.chain().expect("builds"), as_in_the_file(&truth), 1);
    let (diagnosis, corrections) = found(&config, &log, &[]);
    assert_eq!(named(&diagnosis), ["coulomb-friction bend", "motor-inertia lift", "viscous-friction turn"]);
    let written = corrections.write("arm.toml", TOML).expect("writes");
    assert!(written.left_out.is_empty(), "{:?}", written.left_out);
    assert!(
        written.text.contains("# coulomb-friction at bend, level_nm = 0.") && written.patch.contains("(95 % ") && written.patch.contains(", probability "),
        "{}",
        written.patch
    );
    keeps_its_promise("arm.toml", &written, &log, &diagnosis);

    // A URDF takes the friction; that it has no rotor is told, and is all that is missing then.
    let written = corrections.write("arm.urdf", URDF).expect("writes");
    assert!(written.left_out.len() == 1 && written.left_out[0].contains("rotor inertia of joint \"lift\""), "{:?}", written.left_out);
    assert_eq!(named(&judged(&robot("arm.urdf", &written.text), &log, &[])), ["motor-inertia lift"]);
}

/// A spring with its rest, and dry friction that turns with the joint where the engine's would turn before it.
#[test]
fn a_spring_and_friction_are_written_into_an_mjcf_as_the_engine_takes_them() {
    let body = |name: &str, axis: &str, at: &str, inertial: &str, inside: &str| {
        format!("<body name=\"{name}_body\" pos=\"{at}\"><inertial {inertial}/><joint name=\"{name}\" axis=\"{axis}\"/>{inside}</body>")
    };
    let fore = body("bend", "0 1 0", "0.3 0 0", "pos=\"0.12 0.01 0\" mass=\"1.5\" diaginertia=\"0.002 0.012 0.012\"", "");
    let upper = body("lift", "0 1 0", "0 0 0.25", "pos=\"0.15 0 0\" mass=\"3\" diaginertia=\"0.004 0.03 0.03\"", &fore);
    let arm = body("turn", "0 0 1", "0 0 0", "pos=\"0 0.01 0.1\" mass=\"4\" diaginertia=\"0.03 0.03 0.02\"", &upper);
    let text = format!("<mujoco><worldbody>{arm}</worldbody></mujoco>");
    let config = robot("arm.xml", &text);
    let mut truth = config.clone();
    (truth.joints[1].stiffness_nm_per_rad, truth.joints[1].spring_rest_rad, truth.joints[2].coulomb_nm) = (6.0, 0.4, 0.5);
    let log = logged(&truth.chain().expect("builds"), as_in_the_file(&truth), 3);
    let (diagnosis, corrections) = found(&config, &log, &[]);
    assert_eq!(named(&diagnosis), ["cable-force lift", "coulomb-friction bend"]);
    let written = corrections.write("arm.xml", &text).expect("writes");
    assert!(written.left_out.is_empty(), "{:?}", written.left_out);
    for word in ["stiffness=\"", "springref=\"", "frictionloss=\"", "solreffriction=\"0.004 1\""] {
        assert!(written.text.contains(word), "{word} {}", written.patch);
    }
    keeps_its_promise("arm.xml", &written, &log, &diagnosis);
    // A file that has dry friction says how it turns; another level says nothing of that.
    truth.joints[2].coulomb_nm = 0.8;
    let (more, level) = found(&robot("arm.xml", &written.text), &logged(&truth.chain().expect("builds"), as_in_the_file(&truth), 4), &[]);
    assert_eq!(named(&more), ["coulomb-friction bend"]);
    let asked: Vec<Corrected> = level.list.iter().map(|c| c.what).collect();
    assert_eq!(asked, [Corrected::Coulomb]);
    // The file's spring is not there.
    (truth.joints[1].stiffness_nm_per_rad, truth.joints[2].coulomb_nm) = (0.0, 0.5);
    let (gone, stiffness) = found(&robot("arm.xml", &written.text), &logged(&truth.chain().expect("builds"), as_in_the_file(&truth), 5), &[]);
    assert_eq!(named(&gone), ["cable-force lift"]);
    let asked: Vec<(Corrected, f64)> = stiffness.list.iter().map(|c| (c.what, c.value)).collect();
    assert_eq!(asked, [(Corrected::Stiffness, 0.0)]);
}

#[test]
fn a_payload_becomes_part_of_the_last_body() {
    let config = robot("arm.urdf", URDF);
    let mut truth = config.clone();
    // 0.8 kg at the flange: by Steiner about the common centre.
    let (own, more) = (1.5, 0.8);
    let away = [0.25 - 0.12, -0.01];
    let shared = own * more / (own + more);
    let fore = &mut truth.joints[2];
    fore.mass_kg = own + more;
    fore.centre_m = [0.12 + more / (own + more) * away[0], 0.01 + more / (own + more) * away[1], 0.0];
    fore.inertia_kg_m2 = [
        0.002 + shared * away[1].powi(2),
        0.012 + shared * away[0].powi(2),
        0.012 + shared * (away[0].powi(2) + away[1].powi(2)),
        -shared * away[0] * away[1],
        0.0,
        0.0,
    ];
    let log = logged(&truth.chain().expect("builds"), as_in_the_file(&truth), 2);
    // In the last link's own parameters it is the same body, and may go by either name.
    let (diagnosis, corrections) = found(&config, &log, &["link-parameters"]);
    assert_eq!(named(&diagnosis), ["payload"]);
    let written = corrections.write("arm.urdf", URDF).expect("writes");
    assert!(written.left_out.is_empty(), "{:?}", written.left_out);
    let found = &robot("arm.urdf", &written.text).joints[2];
    let ci = diagnosis.causes[0].parameters[0].ci95.expect("an interval");
    assert!(found.mass_kg - own >= ci[0] && found.mass_kg - own <= ci[1] && (ci[1] - ci[0]) < 0.1 * more, "{} of {ci:?}", found.mass_kg - own);
    keeps_its_promise("arm.urdf", &written, &log, &diagnosis);
}
