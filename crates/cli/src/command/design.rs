//! `ndof design`.

use super::simulate::{experiment, write_recordings};
use crate::error::CliError;
use crate::options::{Shared, pair, positive, words};
use crate::output::{self, columns, short};
use crate::progress;
use clap::Args;
use ndof_signal::{AxisPlan, Lines, Sweep};
use ndof_study::file::{Excitation, ExperimentFile};
use ndof_study::result::DesignResult;
use ndof_study::result::design::CoherenceStages;
use ndof_study::{DesignSettings, Limits, LooseLimb, Target, design_report};
use std::path::PathBuf;
use std::process::ExitCode;

/// Design the perturbation to command on a robot, as files with one channel cmd_… an axis.
///
/// Filtered noise is drawn from several seeds, and the one whose axes look least coherent is taken; --decorrelate takes out what
/// is left. Multisines of several axes are orthogonal from trial to trial, so make as many trials as axes, or a multiple.
///
/// With --experiment or --precompensate, axes, rate, length and number of trials follow from that experiment; the forces that
/// will arrive, their coherence and the motion of a soft and a stiff limb are predicted. Without, the motion is that of an arm
/// (a wrist with --rotational) on which the commands act alone.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  ndof design --kind filtered-noise --axes x,y --rms 4 --candidates 300 --trials 6 --out cmd.csv\n  ndof design --precompensate arm --target-ci K=10% --out cmd.csv"
)]
pub struct Arguments {
    /// Robot, hold and limb for which it is meant: EXPERIMENT.toml, or the name of a built-in study
    #[arg(long, value_name = "EXPERIMENT", conflicts_with = "precompensate")]
    experiment: Option<String>,
    /// The same, and commands go through the inverse of that model: forces with the designed properties arrive at the limb
    #[arg(long, value_name = "EXPERIMENT")]
    precompensate: Option<String>,
    /// Correct the commands so many times by what the simulated device, its friction included, fails to deliver
    #[arg(long, value_name = "N", requires = "precompensate")]
    corrections: Option<usize>,
    /// What it is made of [default: filtered-noise, or the experiment's own]
    #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(Excitation::KINDS))]
    kind: Option<String>,
    /// Names of the axes [default: x,y, or the device's]
    #[arg(long, value_delimiter = ',')]
    axes: Option<Vec<String>>,
    /// Torques in N m in place of forces in N
    #[arg(long)]
    rotational: bool,
    /// Files to make, each with a perturbation of its own [default: 1, or the experiment's own]
    #[arg(long, value_name = "N")]
    trials: Option<usize>,
    /// Length of the stretch that will be analysed [default: 50, or the experiment's own]
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Length of what is commanded before it [default: 0, or what the experiment discards]
    #[arg(long, value_name = "S")]
    lead_in: Option<f64>,
    /// Samples a second [default: 500, or the experiment's own]
    #[arg(long, value_name = "HZ")]
    sample_rate: Option<f64>,
    /// Root mean square of each axis; of all together where it is pre-compensated [default: 4, or the experiment's own]
    #[arg(long, value_parser = positive)]
    rms: Option<f64>,
    /// Corner of the noise's low-pass; reach of a binary sequence [default: 15, or the experiment's own]
    #[arg(long, value_name = "HZ")]
    cutoff: Option<f64>,
    /// Order of the noise's low-pass [default: 8, or the experiment's own]
    #[arg(long)]
    order: Option<usize>,
    /// Seeds tried for each trial of noise [default: 100, or the experiment's own]
    #[arg(long, value_name = "N")]
    candidates: Option<usize>,
    /// Of these seeds, simulate so many of the best and take the one whose delivered forces are the least coherent
    #[arg(long, value_name = "N")]
    shortlist: Option<usize>,
    /// Take out of each trial of noise what coherence between the axes the search has left, for the analysis with nperseg 2048
    #[arg(long)]
    decorrelate: bool,
    /// Length of a period of multisine or binary sequence [default: 10, or the experiment's own]
    #[arg(long, value_name = "S")]
    period: Option<f64>,
    /// Lines of a multisine, ends of a sweep, in Hz [default: 0.3-12, or the experiment's own]
    #[arg(long, value_name = "LO-HI", value_parser = pair)]
    lines: Option<(f64, f64)>,
    /// Harmonics of a multisine that carry power [default: odd-with-detection]
    #[arg(long, value_parser = words::<Lines>(&["all", "odd", "odd-with-detection"]))]
    harmonics: Option<Lines>,
    /// How a multisine tells axes apart: orthogonal trials, or lines in turn within one [default: orthogonal]
    #[arg(long, value_parser = words::<AxisPlan>(&["orthogonal", "zippered"]))]
    axis_plan: Option<AxisPlan>,
    /// Amplitudes of a multisine go with frequency to this power [default: 0]
    #[arg(long, allow_hyphen_values = true)]
    slope: Option<f64>,
    /// Steps that lower the peak of a multisine; 0 leaves its phases random [default: 200]
    #[arg(long, value_name = "N")]
    crest_steps: Option<usize>,
    /// How a chirp goes through its frequencies [default: logarithmic]
    #[arg(long, value_parser = words::<Sweep>(&["linear", "logarithmic"]))]
    sweep: Option<Sweep>,
    /// Time over which it fades in and out; periodic ones begin at full size [default: 0, or the experiment's own]
    #[arg(long, value_name = "S")]
    fade: Option<f64>,
    /// Largest magnitude; what is larger is scaled down as a whole
    #[arg(long, value_parser = positive, help_heading = "Limits")]
    peak: Option<f64>,
    /// Largest change per second; what is faster is scaled down as a whole
    #[arg(long, value_name = "PER_S", value_parser = positive, help_heading = "Limits")]
    slew: Option<f64>,
    /// Refuse what would move a soft, nominal or stiff limb further (m, rad) [default: the experiment's safety distance]
    #[arg(long, value_name = "M", value_parser = positive, help_heading = "Limits")]
    max_displacement: Option<f64>,
    /// Refuse what would move it faster (m/s, rad/s) [default: the experiment's safety speed]
    #[arg(long, value_name = "M_PER_S", value_parser = positive, help_heading = "Limits")]
    max_velocity: Option<f64>,
    /// Inertia, damping, stiffness of a soft limb, without an experiment [default: 1.5,8,100 or 0.004,0.03,0.5]
    #[arg(long, value_name = "M,B,K", value_parser = limb, help_heading = "Limits")]
    soft: Option<LooseLimb>,
    /// Inertia, damping, stiffness of a stiff limb, without an experiment [default: 2.5,25,800 or 0.006,0.1,5]
    #[arg(long, value_name = "M,B,K", value_parser = limb, help_heading = "Limits")]
    stiff: Option<LooseLimb>,
    /// Say how long to measure for intervals of ± these shares: M, B, K, an entry such as K_x_y, gain@HZ; e.g. K=10%,gain@2=5%
    #[arg(long, value_name = "WHAT=SHARE", value_delimiter = ',')]
    target_ci: Vec<Target>,
    /// Band of the fit that --target-ci has in mind [default: 0.5-8]
    #[arg(long, value_name = "LO-HI", value_parser = pair)]
    fit_band: Option<(f64, f64)>,
    /// The file to write; several trials are NAME-1.EXT, NAME-2.EXT …
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    shared: Shared,
}

/// `M,B,K` of every axis of a limb.
fn limb(text: &str) -> Result<LooseLimb, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| positive(part).ok()).collect();
    match numbers.as_deref() {
        Some(&[inertia, damping, stiffness]) => Ok(LooseLimb { inertia, damping, stiffness }),
        _ => Err("write inertia, damping and stiffness as three numbers above zero, such as 1.5,8,100".to_owned()),
    }
}

/// Refuses what would write a file of nothing.
fn possible(settings: &DesignSettings) -> Result<(), CliError> {
    let samples = (settings.duration_s * settings.sample_rate_hz).round();
    let nameless = settings.axes.iter().any(|axis| axis.trim().is_empty());
    let (fade, whole) = (settings.excitation.fade_s, settings.duration_s + settings.lead_in_s);
    let wrong = [
        (
            !(samples.is_finite() && samples >= 1.0 && settings.sample_rate_hz > 0.0),
            format!("--duration {} at --sample-rate {}: nothing to write; give positive numbers", settings.duration_s, settings.sample_rate_hz),
        ),
        (settings.trials == 0, "--trials 0: no file would be written; ask for at least 1".to_owned()),
        (settings.excitation.candidates == 0, "--candidates 0: no seed would be tried; ask for at least 1".to_owned()),
        (nameless, "--axes: an axis has no name; write for example --axes x,y".to_owned()),
        (!(settings.lead_in_s >= 0.0 && settings.lead_in_s.is_finite()), format!("--lead-in {}: it must not be negative", settings.lead_in_s)),
        (!(0.0..=whole / 2.0).contains(&fade), format!("--fade {fade}: it must lie between 0 and half of the duration, {} s", whole / 2.0)),
    ];
    wrong.into_iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, message)| Err(CliError::Usage(message)))
}

/// Options, in front of what the experiment says, in front of the defaults.
fn settings(arguments: &Arguments, experiment: Option<ExperimentFile>) -> Result<DesignSettings, CliError> {
    let own = experiment.as_ref().map(|file| file.excitation.clone()).filter(|own| !own.replays());
    let own = own.unwrap_or_else(|| Excitation { candidates: 100, ..Excitation::default() });
    let shared = &arguments.shared;
    let band_hz = shared.band.unwrap_or((0.25, 15.0));
    let excitation = Excitation {
        kind: arguments.kind.clone().unwrap_or(own.kind),
        file: None,
        folder: PathBuf::new(),
        rms: arguments.rms.unwrap_or(own.rms),
        cutoff_hz: arguments.cutoff.unwrap_or(own.cutoff_hz),
        order: arguments.order.unwrap_or(own.order),
        candidates: arguments.candidates.unwrap_or(own.candidates),
        shortlist: arguments.shortlist.unwrap_or(own.shortlist),
        search_band_hz: [band_hz.0, band_hz.1],
        decorrelate: arguments.decorrelate || own.decorrelate,
        precompensate: arguments.precompensate.is_some(),
        corrections: arguments.corrections.unwrap_or(if arguments.precompensate.is_some() { own.corrections } else { 0 }),
        period_s: arguments.period.unwrap_or(own.period_s),
        band_hz: arguments.lines.map_or(own.band_hz, |(low, high)| [low, high]),
        harmonics: arguments.harmonics.unwrap_or(own.harmonics),
        axis_plan: arguments.axis_plan.unwrap_or(own.axis_plan),
        slope: arguments.slope.unwrap_or(own.slope),
        crest_steps: arguments.crest_steps.unwrap_or(own.crest_steps),
        sweep: arguments.sweep.unwrap_or(own.sweep),
        fade_s: arguments.fade.unwrap_or(own.fade_s),
        peak: arguments.peak.or(own.peak),
        slew_per_s: arguments.slew.or(own.slew_per_s),
    };
    let from = |value: Option<f64>, own: fn(&ExperimentFile) -> f64, default| value.or(experiment.as_ref().map(own)).unwrap_or(default);
    let [soft, stiff] = LooseLimb::soft_and_stiff(arguments.rotational);
    let device = experiment.as_ref().map(|file| file.experiment().axes()).transpose().map_err(ndof_study::StudyError::from)?;
    Ok(DesignSettings {
        axes: arguments.axes.clone().or(device).unwrap_or_else(|| vec!["x".to_owned(), "y".to_owned()]),
        rotational: arguments.rotational,
        trials: arguments.trials.or(experiment.as_ref().map(|file| file.trials)).unwrap_or(1),
        duration_s: from(arguments.duration, |file| file.duration_s, 50.0),
        lead_in_s: from(arguments.lead_in, |file| file.discard_s, 0.0),
        sample_rate_hz: from(arguments.sample_rate, |file| file.sample_rate_hz, 500.0),
        seed: shared.seed.or(experiment.as_ref().map(|file| file.seed)).unwrap_or(1),
        band_hz,
        limbs: [arguments.soft.unwrap_or(soft), arguments.stiff.unwrap_or(stiff)],
        limits: Limits { displacement: arguments.max_displacement, velocity: arguments.max_velocity },
        targets: arguments.target_ci.clone(),
        fit_band_hz: arguments.fit_band.map_or([0.5, 8.0], |(low, high)| [low, high]),
        excitation,
        experiment,
    })
}

pub fn run(arguments: &Arguments, studies: &[(&str, &str)]) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let name = arguments.precompensate.as_deref().or(arguments.experiment.as_deref());
    let settings = settings(arguments, name.map(|name| experiment(name, studies)).transpose()?)?;
    possible(&settings)?;
    let bars = progress::Steps::new(shared.quiet);
    let designed = ndof_study::design(&settings, "design", &|what, done, total| bars.show(what, done, total))?;
    let files = write_recordings(&arguments.out, &designed.recordings)?;
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    output::json(shared, &designed.result)?;
    output::report(shared, &design_report(&designed, &output::command_line())?)?;
    output::warnings(shared, &designed.result.warnings);
    output::table(shared, &format!("{}\n{}\n", summary(&designed.result), files.join("\n")))?;
    Ok(ExitCode::SUCCESS)
}

/// The tables for people.
fn summary(result: &DesignResult) -> String {
    let mut tables = vec![signals(result)];
    tables.extend(coherences(result));
    tables.extend(motion(result));
    tables.extend(length(result));
    tables.join("\n")
}

fn table(head: &[&str], rows: Vec<Vec<String>>) -> String {
    let all: Vec<Vec<String>> = std::iter::once(head.iter().map(|cell| (*cell).to_owned()).collect()).chain(rows).collect();
    columns(&all)
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
    table(&["", "seed", &rms, &peak, "crest", &slew, &format!("power in {low}-{high} Hz"), "delivered rms"], rows.collect())
}

fn coherences(result: &DesignResult) -> Option<String> {
    let pooled = result.pooled.as_ref()?;
    let row = |name: String, stages: &CoherenceStages, chance: Option<f64>| {
        let max = |size: Option<ndof_study::result::design::CoherenceSize>| short(size.map(|size| size.max));
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
    Some(format!("coherence of each axis with the others, {how}\n{}", table(&head, rows)))
}

fn motion(result: &DesignResult) -> Option<String> {
    let rotational = result.unit != "N";
    let (length, speed) = if rotational { ("rad", "rad/s") } else { ("m", "m/s") };
    let cells = |m: &ndof_study::result::design::Motion| {
        vec![format!("{} limb, {}", m.limb, m.axis), short(Some(m.displacement_rms)), short(Some(m.displacement_peak)), short(Some(m.velocity_peak))]
    };
    let head = [format!("displacement rms {length}"), format!("peak {length}"), format!("peak velocity {speed}")];
    let head = ["predicted motion", &head[0], &head[1], &head[2]];
    (!result.motion.is_empty()).then(|| table(&head, result.motion.iter().map(cells).collect()))
}

fn length(result: &DesignResult) -> Option<String> {
    let plan = result.length.as_ref()?;
    let percent = |share: f64| format!("± {} %", short(Some(100.0 * share)));
    let seconds = |s: Option<f64>| s.map_or_else(|| "out of reach".to_owned(), |s| format!("{s:.0}"));
    let wanted = plan.wanted.iter().map(|w| vec![w.what.clone(), percent(w.half_width), short(w.effective_averages), seconds(w.duration_s)]).collect();
    let each = format!("s, each of {}", plan.trials);
    let predicted = plan.predicted.iter().map(|p| vec![p.name.clone(), short(p.value), p.half_width.map_or_else(|| "–".to_owned(), percent)]).collect();
    let all = match (plan.duration_s, plan.trials_of_this_length) {
        (Some(s), Some(trials)) => format!("all of them: {} trial(s) of {s:.0} s, or {trials} of {} s\n", plan.trials, result.duration_s),
        _ => "all of them: out of reach; make the perturbation larger or the interval wider\n".to_owned(),
    };
    Some(format!(
        "{}{all}\n{}",
        table(&["wanted 95 % interval", "half width", "effective averages", &each], wanted),
        table(&["this design gives", "value", "half width"], predicted)
    ))
}
