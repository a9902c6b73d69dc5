//! What the program says, asked for nothing, of records that others measured, beside what is known of them.
//!
//! `cargo run --release --example measured [FOLDER]`. The records are not part of the repository: they are looked for in `../shared/data`
//! beside it or in FOLDER, and one that is not there is said to be absent.

use ndof::analysis::result::word;
use ndof::analysis::{RoleNames, Trim, diagnose};
use ndof::io::{ReadOptions, read};
use ndof::{Diagnose, Estimate, Fit, Trial, Trials};
use std::error::Error;
use std::path::{Path, PathBuf};

/// A record: its files, what its channels are where their names do not say, and what is known.
struct Record {
    files: &'static [&'static str],
    roles: Option<(&'static str, &'static str)>,
    /// Seconds of a cycle, where it consists of cycles.
    cycle_s: Option<f64>,
    /// Samples a second and the output's unit, where the file has neither.
    missing: Option<(f64, &'static str)>,
    known: &'static str,
}

const fn record(files: &'static [&'static str], roles: Option<(&'static str, &'static str)>, known: &'static str) -> Record {
    Record { files, roles, cycle_s: None, missing: None, known }
}

const RECORDS: [Record; 14] = [
    record(
        &["anklebot/female.csv"],
        None,
        "no spring: K is 0, within 2.5 N m/rad for the weight of shoe and frame; torque held between samples; dry friction of some 0.5 N m",
    ),
    record(&["emps/DATA_EMPS.csv"], None, "95.11 kg, 203.5 N s/m, dry friction of 20.39 N (Janot, Gautier & Brunot)"),
    record(
        &["ankle/z_pf.csv"],
        Some(("angle_ankle", "torque_ankle")),
        "a stretch reflex to one direction after 40 to 50 ms (Kearney, Stein & Parameswaran 1997)",
    ),
    record(&["ankle/z_df2.csv"], Some(("angle_ankle", "torque_ankle")), "hardly any reflex"),
    Record {
        cycle_s: Some(1.5),
        ..record(
            &["ankle_moving_cycles/small.csv"],
            Some(("angle_ankle", "torque_ankle")),
            "stiffness from 3 to 90 N m/rad over a cycle of 1.5 s, 0.02 kg m² (Guarin & Kearney 2018)",
        )
    },
    record(
        &["mr_damper/magneto_est.csv", "mr_damper/magneto_val.csv"],
        Some(("vel_piston", "force_damper")),
        "hysteresis and yield; linear damping explains 41 %",
    ),
    record(&["damper_backlash/30lb.csv"], Some(("pos_x", "force_x")), "dry friction behind a play; the input is a sine of 0.5 Hz"),
    record(&["damper_backlash/80lb.csv"], Some(("pos_x", "force_x")), "the same, pressed harder"),
    record(&["silverbox/multisine.csv"], None, "a cubic spring"),
    record(&["boucwen/multisine.csv"], None, "hysteresis"),
    record(&["joint_friction/fairino_1.csv"], Some(("angle_1", "torque_1")), "dry friction with a Stribeck part"),
    record(&["joint_friction/franka_2.csv"], Some(("angle_2", "torque_2")), "dry friction with a Stribeck part"),
    record(&["cd_player_arm/cd_player_arm.csv"], None, "light damping, weak coupling (DaISy)"),
    Record {
        files: &["robot_arm/robot_arm.csv"],
        roles: Some(("torque_reaction", "acc_arm")),
        cycle_s: None,
        missing: Some((1.0, "rad/s^2")),
        known: "a second, lightly damped mode (DaISy)",
    },
];

fn trials(folder: &Path, record: &Record) -> Result<Trials, Box<dyn Error>> {
    let mut options = ReadOptions { sample_rate_hz: Some(1.0), ..ReadOptions::default() };
    if let (Some((rate, unit)), Some((_, output))) = (record.missing, record.roles) {
        options.sample_rate_hz = Some(rate);
        options.units.insert(output.to_owned(), unit.to_owned());
    }
    let all: Result<Vec<Trial>, _> =
        record.files.iter().map(|file| read(&folder.join(file), &options).map(|found| Trial::of(*file, found.recording))).collect();
    let names = record.roles.map_or_else(RoleNames::default, |(input, output)| RoleNames {
        inputs: Some(vec![input.to_owned()]),
        outputs: Some(vec![output.to_owned()]),
        ..RoleNames::default()
    });
    Ok(Trials::new(all?, &names, &Trim::default())?)
}

/// Four digits.
fn short(value: f64) -> String {
    if (1e-2..1e5).contains(&value.abs()) { format!("{value:.4}") } else { format!("{value:.3e}") }
}

/// Inertia, damping and stiffness of each axis, how the fit came to them, and what it warns of.
fn fitted(trials: &Trials) -> Result<String, Box<dyn Error>> {
    let fit = Fit::default().run(&ndof::analysis::estimate(trials, &Estimate::default())?)?.result;
    let [low, high] = fit.band_hz;
    let chi2 = fit.chi2_reduced.map_or_else(|| "too few averages to judge by".to_owned(), |chi2| format!("reduced χ² {chi2:.3}"));
    let mut out = format!("{low:.3} to {high:.3} Hz, {chi2}");
    for p in fit.parameters.iter().filter(|p| !p.site.axis.contains(',')) {
        let interval = p.ci95.map_or_else(|| "no interval".to_owned(), |[low, high]| format!("{} … {}", short(low), short(high)));
        out += &format!("\n    {} = {} ({interval}) {}", p.name, p.value.map_or_else(|| "–".to_owned(), short), p.unit);
    }
    fit.remarks().iter().for_each(|remark| out += &format!("\n    {remark}"));
    let told = ["model-misfit", "negative-diagonal", "force-sign"];
    fit.head.warnings.iter().filter(|w| told.contains(&w.code.as_str())).for_each(|w| out += &format!("\n    {}: {}", w.code, w.message));
    Ok(out)
}

/// Verdict, and causes with their probabilities.
fn diagnosed(trials: &Trials, settings: &Diagnose) -> Result<String, Box<dyn Error>> {
    let found = diagnose(trials, settings, &mut |_| ())?.result.diagnosis;
    let error = |nrmse: &[Option<f64>]| nrmse.iter().map(|e| e.map_or("not finite".to_owned(), |e| format!("{e:.3}"))).collect::<Vec<_>>().join(", ");
    let causes: Vec<String> = found.causes.iter().map(|c| format!("{} {:.2}", c.effect, c.probability)).collect();
    let named = if causes.is_empty() { "nothing named".to_owned() } else { causes.join(", ") };
    let (before, after) = (error(&found.baseline.held_out.nrmse), error(&found.extended.held_out.nrmse));
    Ok(format!("{}: {named}; held-out error {before} → {after}", word(&found.verdict)))
}

fn main() {
    let folder = std::env::args().nth(1).map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    for record in &RECORDS {
        println!("{}", record.files.join(", "));
        if record.files.iter().any(|file| !folder.join(file).is_file()) {
            println!("  absent\n");
            continue;
        }
        println!("  known: {}", record.known);
        match trials(&folder, record) {
            Ok(trials) => {
                println!("  fit: {}", fitted(&trials).unwrap_or_else(|error| error.to_string()));
                println!("  diagnose: {}", diagnosed(&trials, &Diagnose::default()).unwrap_or_else(|error| error.to_string()));
                if let Some(cycle_s) = record.cycle_s {
                    let settings = Diagnose { schedule: Some("phase".to_owned()), cycle_s: Some(cycle_s), ..Diagnose::default() };
                    let said = diagnosed(&trials, &settings).unwrap_or_else(|error| error.to_string());
                    println!("  diagnose, told of its cycles of {cycle_s} s: {said}");
                }
                println!();
            }
            Err(error) => println!("  not read: {error}\n"),
        }
    }
}
