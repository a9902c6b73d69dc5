//! `ndof diagnose`.

use crate::error::CliError;
use crate::options::{CycleOptions, Limb, Reading, Recordings, Shared};
use crate::output::{self, columns, p_value, short};
use crate::progress::Progress;
use clap::Args;
use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_analysis::file::{self, BaselineFile};
use ndof_analysis::options::pair;
use ndof_analysis::{AnalysisError, Diagnose, Diagnosed, Estimate, Fit, HeldOut, diagnose_simulator};
use ndof_devices::RobotConfig;
use ndof_diagnose::{Cause, Site, Verdict};
use ndof_models::effects::Value;
use ndof_report::{diagnosis_report, percent, sentence};
use ndof_study::file::StudyDocument;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Say what the simulation gets wrong, name the cause, extend the model and measure the gain on held-out data.
///
/// Without --baseline the simulation is the linear inertia-damping-stiffness model, fitted. Of several files the last third
/// is held out, of one the last 30 % of its time; of a robot whose joints move one after the other, of each of as few
/// stretches as it takes.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  ndof diagnose trial-1.csv trial-2.csv trial-3.csv --json diagnosis.json --report diagnosis.html\n  ndof diagnose log.csv --robot arm.urdf --write corrected.urdf"
)]
pub struct Arguments {
    /// Recordings; `-` is CSV on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The simulation to be judged: its model and parameters, each fixed, nominal or free
    #[arg(long, value_name = "FILE.toml")]
    baseline: Option<PathBuf>,
    /// The robot whose joints are judged, URDF, MJCF or TOML: recordings hold torque_JOINT and angle_JOINT of each joint
    #[arg(long, value_name = "FILE", conflicts_with = "baseline")]
    robot: Option<PathBuf>,
    /// Link at the end of the robot's chain
    #[arg(long, value_name = "LINK", requires = "robot")]
    tip: Option<String>,
    /// What a simulator, any, logged at the same commands, one file a recording: it is judged then, a robot's best with its --robot
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["baseline", "study"])]
    simulated: Vec<PathBuf>,
    /// Write the robot's file as corrected by what was found, in its own format; with the patch, and what files have no word for
    #[arg(long, value_name = "OUT", requires = "robot")]
    write: Option<PathBuf>,
    /// Data that no fit sees: files, or a stretch of time in seconds
    #[arg(long, value_name = "FILE|FROM-TO", num_args = 1..)]
    held_out: Vec<String>,
    #[command(flatten)]
    diagnose: Diagnose,
    #[command(flatten)]
    cycles: CycleOptions,
    #[command(flatten)]
    limb: Limb,
    /// End with code 1 if a cause is found, or something that cannot be explained
    #[arg(long)]
    exit_code: bool,
    #[command(flatten)]
    reading: Reading,
    /// Write recordings and settings as a study: `ndof study OUT.toml` gives the same numbers
    #[arg(long, value_name = "OUT.toml", help_heading = "Output")]
    study: Option<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

impl Arguments {
    /// Refuses to write a robot in another format than it has.
    fn check_written(&self) -> Result<(), CliError> {
        let (Some(out), Some(robot)) = (&self.write, &self.robot) else { return Ok(()) };
        let format = |path: &Path| path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let (own, asked) = (format(robot), format(out));
        if own == asked {
            return Ok(());
        }
        Err(CliError::Usage(format!("--write {}: it keeps the format of {}; give it the ending \".{own}\", not \".{asked}\"", out.display(), robot.display())))
    }
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    arguments.check_written()?;
    let mut settings = settings(arguments)?;
    let mut files = arguments.files.clone();
    if let HeldOut::Files(held_out) = &settings.held_out {
        files.extend(held_out.iter().map(PathBuf::from).filter(|file| !arguments.files.contains(file)));
    }
    let trials = arguments.reading.trials_with(&files, &settings.channels())?;
    settings.event_s = arguments.cycles.times(&trials)?;
    let simulated = if arguments.simulated.is_empty() { None } else { Some(arguments.reading.simulated_with(&arguments.simulated, &settings.channels())?) };
    output::understood(shared, &trials);
    let bar = Progress::spinner(shared.quiet);
    let mut progress = |what: &str| bar.say(what);
    let diagnosed = match &simulated {
        Some(simulated) => diagnose_simulator(&trials, simulated, &settings, &mut progress)?,
        None => ndof_analysis::diagnose(&trials, &settings, &mut progress)?,
    };
    drop(bar);
    if let Some(path) = &arguments.study {
        let experiment = Recordings { files, reading: arguments.reading.clone() };
        let (estimate, fit) = (shared.estimate(&Estimate::default()), Fit { band_hz: shared.band, ..Fit::default() });
        Recordings::write(StudyDocument { experiment, estimate, fit, diagnose: Some(settings), ..StudyDocument::default() }, path)?;
    }
    if shared.pictured() {
        output::report(shared, &diagnosis_report(&diagnosed, "What the simulation gets wrong", &output::command_line())?)?;
    }
    let result = &diagnosed.result;
    output::told(shared, result, &result.head.warnings, &summary(result))?;
    if let Some(written) = write_robot(arguments, &diagnosed)? {
        output::table(shared, &written)?;
    }
    let found = result.diagnosis.verdict != Verdict::Adequate;
    Ok(if arguments.exit_code && found { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

fn settings(arguments: &Arguments) -> Result<Diagnose, CliError> {
    let held_out = match arguments.held_out.as_slice() {
        [] => HeldOut::Auto,
        [one] if !PathBuf::from(one).exists() => {
            let stretch = pair(one).map_err(|why| CliError::Usage(format!("--held-out {one}: no such file, and no stretch of time: {why}")))?;
            HeldOut::Time(stretch)
        }
        files => HeldOut::Files(files.to_vec()),
    };
    let CycleOptions { cycle: cycle_s, cycle_by, .. } = arguments.cycles.clone();
    Ok(Diagnose {
        band_hz: arguments.shared.band,
        cycle_s,
        cycle_by,
        held_out,
        seed: arguments.shared.seed.unwrap_or(arguments.diagnose.seed),
        baseline: arguments.baseline.as_deref().map(read_baseline).transpose()?,
        kinematics: arguments.limb.read()?,
        robot: arguments.robot.as_deref().map(|path| read_robot(path, arguments.tip.as_deref())).transpose()?,
        ..arguments.diagnose.clone()
    })
}

fn read_robot(path: &Path, tip: Option<&str>) -> Result<RobotConfig, CliError> {
    ndof_io::keep(path);
    Ok(file::robot(path, tip)?)
}

/// Writes the corrected robot where `--write` says, and tells what changed and what could not.
fn write_robot(arguments: &Arguments, diagnosed: &Diagnosed) -> Result<Option<String>, CliError> {
    let (Some(out), Some(robot), Some(corrections)) = (&arguments.write, &arguments.robot, &diagnosed.corrections) else { return Ok(None) };
    let (file, text) = file::read_text(robot)?;
    let written = corrections.write(&file, &text).map_err(AnalysisError::from)?;
    ndof_io::write_atomic(out, written.text.as_bytes())?;
    let mut told = format!("\nwritten: {}\n", out.display());
    told += if written.text == text { "nothing in the file was corrected\n" } else { &written.patch };
    for sentence in &written.left_out {
        told += &format!("left out: {sentence}\n");
    }
    Ok(Some(told))
}

fn read_baseline(path: &Path) -> Result<BaselineFile, CliError> {
    ndof_io::keep(path);
    let baseline: BaselineFile = file::read(path)?;
    baseline.check(&path.display().to_string())?;
    Ok(baseline)
}

/// Verdict, causes with evidence, gain, and what else to know.
pub fn summary(result: &DiagnosisResult) -> String {
    let d = &result.diagnosis;
    let mut text = format!("{}\n\nverdict: {}\nfitted: {}; held out: {}\n", sentence(d), d.verdict, d.split.estimation, d.split.held_out);
    for cause in &d.causes {
        text += &cause_lines(cause);
    }
    let mut rows = vec![vec!["held-out NRMSE".to_owned()]];
    rows[0].extend(result.outputs.iter().cloned());
    for (name, values) in [("baseline", &d.baseline.held_out.nrmse), ("extended", &d.extended.held_out.nrmse), ("noise floor", &d.noise_floor.nrmse)] {
        rows.push(std::iter::once(name.to_owned()).chain(values.iter().map(|v| short(*v))).collect());
    }
    text += &format!("\n{}", columns(&rows));
    for shift in &d.extended.parameter_shift {
        text += &format!("{}: {} → {} {}\n", shift.name, short(shift.before), short(shift.after), shift.unit);
    }
    for confusable in &d.confusable {
        text += &format!("cannot be told apart here: {}; next experiment: {}\n", confusable.effects.join(", "), confusable.next_experiment);
        for prospect in &confusable.predicted {
            let verdict = if prospect.decides { "decides" } else { "does not decide" };
            text += &format!("  {}: separates by {}, {verdict}\n", prospect.experiment, short(prospect.separation));
        }
    }
    for minor in &d.minor {
        text += &format!("minor: {} ({}), {}\n", minor.effect, place(&minor.site), minor.why);
    }
    for note in &d.discrepancy.notes {
        text += &format!("note: {note}\n");
    }
    text
}

fn place(site: &Site) -> String {
    if site.axis.is_empty() { site.side.clone() } else { format!("{} {}", site.side, site.axis) }
}

fn cause_lines(cause: &Cause) -> String {
    let mut text = format!("\n{} ({}), probability {}, p {}\n", cause.effect, place(&cause.site), short(cause.probability), p_value(cause.p_value));
    for p in &cause.parameters {
        let value = match &p.value {
            Value::Number(value) => short(*value),
            Value::Text(text) => text.clone(),
            Value::Flag(flag) => flag.to_string(),
            Value::Matrix(rows) => rows.iter().map(|row| row.iter().map(|v| short(*v)).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("; "),
        };
        let interval = p.ci95.map(|[low, high]| format!(" ({} … {})", short(Some(low)), short(Some(high)))).unwrap_or_default();
        text += &format!("  {} = {value}{interval} {}\n", p.name, p.unit);
    }
    if let Some(share) = cause.gain.explained_fraction {
        let interval = cause.gain.explained_fraction_ci95.map(|[low, high]| format!(" ({:.0} … {:.0} %)", 100.0 * low, 100.0 * high)).unwrap_or_default();
        text += &format!("  explains {}{interval} of what there is to gain on the held-out part\n", percent(share));
    }
    for sentence in &cause.evidence {
        text += &format!("  - {sentence}\n");
    }
    text
}
