//! `ndof design`.

mod robot;

use super::simulate::{experiment, write_recordings};
use crate::error::CliError;
use crate::options::Shared;
use crate::output::{self, headed, short};
use crate::progress::Progress;
use clap::Args;
use ndof_study::design::result::{CoherenceSize, CoherenceStages, DesignResult, Motion};
use ndof_study::{Design, RobotMotion, design_report};
use std::path::PathBuf;

/// Design the perturbation to command on a robot, as files with one channel cmd_… an axis.
///
/// Filtered noise is drawn from several seeds, and the one whose axes look least coherent is taken; --decorrelate takes out what
/// is left. Multisines of several axes are orthogonal from trial to trial, so make as many trials as axes, or a multiple.
///
/// With --experiment or --precompensate, axes, rate, length and number of trials follow from that experiment; the forces that
/// will arrive, their coherence and the motion of a soft and a stiff limb are predicted. Without, the motion is that of an arm
/// (a wrist with --rotational) on which the commands act alone.
///
/// With --robot it is a motion of the robot's joints in place of forces: a Fourier series within range, speed and torque, from rest to rest,
/// by which inertial parameters and friction are determined well from measured torques.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  ndof design --kind filtered-noise --axes x,y --rms 4 --candidates 300 --trials 6 --out cmd.csv\n  ndof design --precompensate arm --target-ci K=10% --out cmd.csv\n  ndof design --robot arm.urdf --speed-limit 2 --out motion.csv"
)]
pub struct Arguments {
    /// Experiment with the robot, its controller and the limb that it is for: EXPERIMENT.toml, or the name of a built-in study
    #[arg(long, value_name = "EXPERIMENT", conflicts_with = "precompensate")]
    experiment: Option<String>,
    /// The same, with commands filtered by the inverse of its model, so that the designed forces arrive at the limb
    #[arg(long, value_name = "EXPERIMENT")]
    precompensate: Option<String>,
    #[command(flatten)]
    design: Design,
    #[command(flatten)]
    robot: RobotMotion,
    /// The file to write; several trials are NAME-1.EXT, NAME-2.EXT …
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments, studies: &[(&str, &str)]) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let name = arguments.precompensate.as_deref().or(arguments.experiment.as_deref());
    let settings = Design {
        experiment: name.map(|name| experiment(name, studies)).transpose()?,
        precompensate: arguments.precompensate.is_some(),
        band_hz: shared.band,
        seed: shared.seed,
        ..arguments.design.clone()
    };
    if arguments.robot.robot.is_some() {
        return robot::run(&arguments.robot.with(&settings)?, &arguments.out, shared);
    }
    let bars = Progress::steps(shared.quiet);
    let designed = ndof_study::design(&settings, &|what, done, total| bars.show(what, done, total))?;
    let files = write_recordings(&arguments.out, &designed.recordings)?;
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    output::json(shared, &designed.result)?;
    output::report(shared, &design_report(&designed, &output::command_line())?)?;
    output::warnings(shared, &designed.result.head.warnings);
    output::table(shared, &format!("{}\n{}\n", summary(&designed.result), files.join("\n")))
}

/// The tables for people.
fn summary(result: &DesignResult) -> String {
    let mut tables = vec![signals(result)];
    tables.extend(coherences(result));
    tables.extend(motion(result));
    tables.extend(length(result));
    tables.join("\n")
}

fn signals(result: &DesignResult) -> String {
    let rows = result.trials.iter().enumerate().flat_map(|(k, trial)| {
        trial.signals.iter().map(move |signal| {
            vec![
                format!("trial {}, {}", k + 1, signal.axis),
                trial.seed.map_or_else(|| "–".to_owned(), |seed| seed.to_string()),
                short(Some(signal.rms)),
                short(Some(signal.peak)),
                short(signal.crest_factor),
                short(Some(signal.slew_per_s)),
                short(Some(signal.power_share)),
                short(signal.delivered_rms),
            ]
        })
    });
    let unit = &result.unit;
    let [low, high] = result.analysis.band_hz;
    let (rms, peak, slew) = (format!("rms {unit}"), format!("peak {unit}"), format!("slew {unit}/s"));
    headed(&["", "seed", &rms, &peak, "crest", &slew, &format!("power in {low}-{high} Hz"), "delivered rms"], rows)
}

fn coherences(result: &DesignResult) -> Option<String> {
    let pooled = result.pooled.as_ref()?;
    let row = |name: String, stages: &CoherenceStages, chance: Option<f64>| {
        let max = |size: Option<CoherenceSize>| short(size.map(|size| size.max));
        vec![name, max(Some(stages.commanded)), max(stages.delivered_linear), max(stages.delivered), max(stages.delivered_restless), short(chance)]
    };
    let trials = result.trials.iter().enumerate().filter_map(|(k, trial)| Some(row(format!("trial {}", k + 1), trial.coherence.as_ref()?, trial.chance)));
    let mut rows: Vec<Vec<String>> = trials.collect();
    rows.push(row(format!("{} trial(s) pooled", result.trials.len()), pooled, None));
    let analysis = &result.analysis;
    let how = if analysis.name == "lines" {
        "on the lines of the multisine".to_owned()
    } else {
        format!("{}-{} Hz, segments of {} samples that share {}", analysis.band_hz[0], analysis.band_hz[1], analysis.nperseg, analysis.noverlap)
    };
    let head = ["largest coherence", "commanded", "delivered, linear", "delivered, simulated", "restless limb", "by chance"];
    Some(format!("coherence of each axis with the others, {how}\n{}", headed(&head, rows)))
}

fn motion(result: &DesignResult) -> Option<String> {
    let rotational = result.unit != "N";
    let (length, speed) = if rotational { ("rad", "rad/s") } else { ("m", "m/s") };
    let cells = |m: &Motion| {
        vec![format!("{} limb, {}", m.limb, m.axis), short(Some(m.displacement_rms)), short(Some(m.displacement_peak)), short(Some(m.velocity_peak))]
    };
    let head = [format!("displacement rms {length}"), format!("peak {length}"), format!("peak velocity {speed}")];
    let head = ["predicted motion", &head[0], &head[1], &head[2]];
    (!result.motion.is_empty()).then(|| headed(&head, result.motion.iter().map(cells)))
}

fn length(result: &DesignResult) -> Option<String> {
    let plan = result.length.as_ref()?;
    let percent = |share: f64| format!("± {} %", short(Some(100.0 * share)));
    let seconds = |s: Option<f64>| s.map_or_else(|| "out of reach".to_owned(), |s| format!("{s:.0}"));
    let wanted = plan.wanted.iter().map(|w| vec![w.what.clone(), percent(w.half_width), short(w.effective_averages), seconds(w.duration_s)]);
    let each = format!("s, each of {}", plan.trials);
    let predicted = plan.predicted.iter().map(|p| vec![p.name.clone(), short(p.value), p.half_width.map_or_else(|| "–".to_owned(), percent)]);
    let all = match (plan.duration_s, plan.trials_of_this_length) {
        (Some(s), Some(trials)) => format!("all of them: {} trial(s) of {s:.0} s, or {trials} of {} s\n", plan.trials, result.duration_s),
        _ => "all of them: out of reach; make the perturbation larger or the interval wider\n".to_owned(),
    };
    Some(format!(
        "{}{all}\n{}",
        headed(&["wanted 95 % interval", "half width", "effective averages", &each], wanted),
        headed(&["this design gives", "value", "half width"], predicted)
    ))
}
