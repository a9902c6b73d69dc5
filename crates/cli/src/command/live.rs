//! `ndof live`.

use super::estimate::fraction;
use crate::error::CliError;
use crate::interrupt;
use crate::options::{Channels, Shared};
use crate::output::{self, columns, headed, interval, short};
use crate::source::{Arrival, Source};
use clap::Args;
use ndof_analysis::fit::result::Parameter;
use ndof_analysis::live::result::LiveResult;
use ndof_analysis::options::positive;
use ndof_analysis::result::word;
use ndof_analysis::{AnalysisError, Enough, Estimate, Live, log_spaced};
use ndof_io::{CsvStream, Piece};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Watch a trial while it is measured: coherence, impedance, stiffness with its interval, and whether it is enough.
///
/// Reads CSV from standard input, or a file that grows. At each look inertia, damping and stiffness are those that `ndof fit` finds in what has
/// been measured, or in the --last seconds of it, which follow a stiffness that changes. Enough has been measured when the 95 % interval of the response's
/// magnitude is within ± --within of it, at --share of the frequencies of each diagonal entry in --band. Ctrl-C ends the
/// watch with what is known so far (exit code 130). --json - writes one line of JSON at each look, for other programs.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof live trial-1.csv --band 0.5-8 --within 0.1 --until-enough --wait 2")]
pub struct Arguments {
    /// A CSV file that grows; `-` is standard input
    #[arg(default_value = "-", value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    enough: Enough,
    /// Only the last S seconds count at each look, to follow what changes slowly: fatigue, relaxation, a drug
    #[arg(long, value_name = "S", value_parser = positive)]
    last: Option<f64>,
    /// End as soon as it is enough
    #[arg(long)]
    until_enough: bool,
    /// Seconds of new data between two looks
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = positive)]
    every: f64,
    /// End when a file has not grown for so many seconds
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = positive)]
    wait: f64,
    #[command(flatten)]
    channels: Channels,
    #[command(flatten, next_help_heading = "Estimate")]
    estimate: Estimate,
    #[command(flatten)]
    shared: Shared,
}

/// How often Ctrl-C and the file are looked at.
const TICK: Duration = Duration::from_millis(50);
/// When nothing has come for so long, what came last is looked at without waiting for more.
const PAUSE: Duration = Duration::from_millis(300);

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    if arguments.enough.share > 1.0 {
        return Err(CliError::Usage(format!("--share {}: a share is at most 1; write 0.9 for 90 % of the frequencies", arguments.enough.share)));
    }
    interrupt::handle();
    let mut source = Source::open(&arguments.file)?;
    let name = source.name();
    let mut stream = CsvStream::new(&name, arguments.channels.reading());
    let estimate = shared.estimate(&arguments.estimate);
    let mut live = Live::new(&name, arguments.channels.roles(), estimate, arguments.enough.clone()).of_last(arguments.last);
    let mut screen = Screen::new(shared);
    let mut last: Option<LiveResult> = None;
    let mut looked_s = 0.0;
    let mut quiet_for = Duration::ZERO;
    loop {
        let arrival = source.next(TICK)?;
        let pieces = match &arrival {
            Arrival::Bytes(bytes) => {
                quiet_for = Duration::ZERO;
                stream.push(bytes)?
            }
            Arrival::Nothing => {
                quiet_for += TICK;
                Vec::new()
            }
            Arrival::End => stream.finish()?,
        };
        take(&mut live, arguments, pieces, &name)?;
        let idle = source.grows() && quiet_for.as_secs_f64() >= arguments.wait;
        let over = matches!(arrival, Arrival::End) || idle || interrupt::requested();
        if over && !matches!(arrival, Arrival::End) && live.duration_s() > 0.0 {
            take(&mut live, arguments, stream.finish()?, &name)?;
        }
        let paused = quiet_for >= PAUSE && live.duration_s() > looked_s;
        let due = live.duration_s() >= looked_s + arguments.every || paused;
        if over || due {
            looked_s = live.duration_s();
            match live.state() {
                Ok(Some(state)) => {
                    screen.show(&state)?;
                    last = Some(state);
                }
                Ok(None) => screen.waiting(looked_s, "too short for a look yet")?,
                // Of a limb at rest nothing can be estimated; that passes, and what was known before stands.
                Err(error @ (AnalysisError::Estimate { .. } | AnalysisError::Constant { .. })) if !over || last.is_some() => {
                    screen.waiting(looked_s, &error.to_string())?;
                }
                Err(error) => return Err(error.into()),
            }
        }
        if over || (arguments.until_enough && last.as_ref().is_some_and(|state| state.enough)) {
            break;
        }
    }
    let interrupted = interrupt::requested();
    match &last {
        Some(state) => {
            if !shared.json_on_stdout() {
                output::json(shared, state)?;
            }
            output::warnings(shared, &state.head.warnings);
            screen.close(state)?;
        }
        None if interrupted => {}
        None => {
            return Err(CliError::Usage(format!(
                "{name}: {:.3} s are too short for an estimate; measure longer, or shorten the segments with --nperseg",
                live.duration_s().max(0.0)
            )));
        }
    }
    Ok(if interrupted { ExitCode::from(interrupt::EXIT_CODE) } else { ExitCode::SUCCESS })
}

fn take(live: &mut Live, arguments: &Arguments, pieces: Vec<Piece>, name: &str) -> Result<(), CliError> {
    for mut piece in pieces {
        arguments.channels.apply(&mut piece.recording, name)?;
        live.push(&piece.recording, piece.follows, piece.notes)?;
    }
    Ok(())
}

/// Where the looks go: drawn over each other on a terminal, one line each elsewhere, one line of JSON each with `--json -`.
struct Screen<'a> {
    shared: &'a Shared,
    terminal: bool,
    drawn: usize,
}

impl<'a> Screen<'a> {
    fn new(shared: &'a Shared) -> Self {
        Screen { shared, terminal: std::io::stdout().is_terminal() && !shared.quiet, drawn: 0 }
    }

    fn show(&mut self, state: &LiveResult) -> Result<(), CliError> {
        if self.shared.json_on_stdout() {
            return output::json(self.shared, state);
        }
        if self.terminal {
            return self.draw(&format!("{}\n{}", line(state), table(state)));
        }
        output::table(self.shared, &format!("{}{}\n", line(state), stiffness(state)))
    }

    /// Why there is no look: for those who watch; elsewhere each line is a look.
    fn waiting(&mut self, duration_s: f64, why: &str) -> Result<(), CliError> {
        if self.terminal { self.draw(&format!("{duration_s:.1} s; {why}\n")) } else { Ok(()) }
    }

    /// The last look in full.
    fn close(&mut self, state: &LiveResult) -> Result<(), CliError> {
        if self.terminal { Ok(()) } else { output::table(self.shared, &format!("\n{}", table(state))) }
    }

    fn draw(&mut self, text: &str) -> Result<(), CliError> {
        // Up to the first line that was drawn, and everything below it away.
        let over = if self.drawn > 0 { format!("\x1b[{}A\x1b[J", self.drawn) } else { String::new() };
        output::print((over + text).as_bytes())?;
        self.drawn = text.lines().count();
        Ok(())
    }
}

fn line(state: &LiveResult) -> String {
    let wanted = 100.0 * state.wanted_half_width;
    let verdict = match state.needed_s {
        _ if state.enough => "enough".to_owned(),
        Some(needed_s) => format!("about {:.0} s more", (needed_s - state.used_s).max(1.0)),
        None => "not enough".to_owned(),
    };
    let counted = if state.used_s < state.duration_s { format!(" (the last {:.1} s count)", state.used_s) } else { String::new() };
    let share = 100.0 * state.share;
    format!("{:.1} s{counted}, {:.1} averages: {share:.0} % within ±{wanted:.0} %; {verdict}", state.duration_s, state.effective_averages)
}

/// "; K_x_x 294.7 ± 13.20, K_y_y 512.3 ± 17.80 N/m": the stiffness along each axis, with the half width of its interval.
fn stiffness(state: &LiveResult) -> String {
    let own: Vec<&Parameter> = state.parameters.iter().filter(|p| p.is_diagonal_stiffness()).collect();
    let mut text = String::new();
    for (k, p) in own.iter().enumerate() {
        let half = p.ci95.map(|[low, high]| format!(" ± {}", short(0.5 * (high - low)))).unwrap_or_default();
        // Neighbours in one unit say it once.
        let unit = if own.get(k + 1).is_some_and(|next| next.unit == p.unit) { String::new() } else { format!(" {}", p.unit) };
        text += &format!("{} {} {}{half}{unit}", if k == 0 { ";" } else { "," }, p.name, short(p.value));
    }
    text
}

fn table(state: &LiveResult) -> String {
    const ROWS: usize = 6;
    let mut text = String::new();
    for (i, output) in state.outputs.iter().enumerate() {
        for (j, input) in state.inputs.iter().enumerate() {
            let usable: Vec<usize> = (0..state.frequency_hz.len()).filter(|&f| state.frequency_hz[f] > 0.0 && state.gain[[i, j, f]].is_finite()).collect();
            let rows = log_spaced(&usable, &state.frequency_hz, ROWS).into_iter().map(|f| {
                let (gain, [low, high]) = (state.gain[[i, j, f]], [0, 1].map(|end| state.gain_ci95[[i, j, f, end]]));
                vec![
                    short(state.frequency_hz[f]),
                    short(gain),
                    interval((low.is_finite() && high.is_finite()).then_some([low, high])),
                    if high.is_finite() { format!("{:.0} %", 100.0 * (high - gain) / gain) } else { "–".to_owned() },
                    fraction(state.partial_coherence[[i, j, f]]),
                ]
            });
            text += &format!("{output} ← {input}\n{}\n", headed(&["Hz", &word(&state.response), "95 % interval", "±", "coherence"], rows));
        }
    }
    let rows: Vec<_> = state.parameters.iter().map(|p| vec![p.name.clone(), p.unit.clone(), short(p.value), interval(p.ci95)]).collect();
    text + &columns(&rows)
}
