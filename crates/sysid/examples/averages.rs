//! The paper's two settings, N_MNS = 5 and 45, and what lies between: random error against resolution.
//!
//! `cargo run --release -p ndof-sysid --example averages [FIGURE.svg]` simulates 200 records of 50 s at 500 Hz of two coupled
//! axes, estimates them by Welch's method with segments of several lengths, and prints what the averages are worth: the scatter
//! over records beside what the paper's formula says with the number of segments and ours with their effective number, and
//! the loss of the gain at a resonance that the segments are too short for.

use ndof_report::Figure;
use ndof_report::plot::{Axis, Color, Dash, Panel, Series};
use ndof_signal::{Channel, Quantity, Recording, RecordingError, Unit, Welch};
use ndof_sysid::{Direct, FrequencyResponse, Labels, Ports, SpectralMethod, estimate};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::process::ExitCode;

const RATE_HZ: f64 = 500.0;
const SAMPLES: usize = 25_000;
const RECORDS: u64 = 200;
/// Resonance and damping ratio of the axes: an arm's, and a spring array's.
const MODES: [(f64, f64); 2] = [(2.5, 0.2), (3.5, 0.05)];
/// Each axis is pulled by both forces.
const MIX: [[f64; 2]; 2] = [[1.0, 0.3], [0.3, 1.0]];
/// Force noise of the limb over that of the perturbation.
const NOISE: f64 = 0.3;
/// Where the random error is judged, away from both resonances.
const JUDGED_HZ: [f64; 2] = [5.0, 8.0];

struct Limb([(f64, f64); 2]);

impl Limb {
    fn new() -> Self {
        Limb(MODES.map(|(hz, damping)| {
            let w = TAU * hz / RATE_HZ;
            let (decay, turn) = ((-damping * w).exp(), w * (1.0 - damping * damping).sqrt());
            (2.0 * decay * turn.cos(), -decay * decay)
        }))
    }

    fn at(&self, hz: f64, i: usize, j: usize) -> Complex64 {
        let z = Complex64::from_polar(1.0, -TAU * hz / RATE_HZ);
        let (a1, a2) = self.0[i];
        MIX[i][j] * (1.0 - a1 - a2) / (1.0 - a1 * z - a2 * z * z)
    }

    fn record(&self, seed: u64) -> Result<Recording, RecordingError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || -> f64 { rng.sample(StandardNormal) };
        let (mut state, mut columns) = ([[0.0; 2]; 2], vec![Vec::new(); 4]);
        for k in 0..SAMPLES + 5000 {
            let force = [draw(), draw()];
            let own = [force[0] + NOISE * draw(), force[1] + NOISE * draw()];
            for i in 0..2 {
                let (a1, a2) = self.0[i];
                let y = a1 * state[i][0] + a2 * state[i][1] + (1.0 - a1 - a2) * (MIX[i][0] * own[0] + MIX[i][1] * own[1]);
                state[i] = [y, state[i][0]];
                if k >= 5000 {
                    columns[i].push(force[i]);
                    columns[2 + i].push(y);
                }
            }
        }
        let channel = |(c, samples): (usize, Vec<f64>)| {
            let quantity = if c >= 2 { Quantity::Displacement } else { Quantity::Effort };
            Channel::new(["force_x", "force_y", "pos_x", "pos_y"][c], Unit::si(quantity, false), samples)
        };
        Recording::new(RATE_HZ, columns.into_iter().enumerate().map(channel).collect())
    }
}

/// What one setting gives over all records.
struct Row {
    label: String,
    seconds: f64,
    segments: usize,
    effective: f64,
    /// Standard deviation of the gain over records, over the gain; and as both formulas tell it.
    scatter: f64,
    paper: f64,
    ours: f64,
    /// Mean gain at the sharper resonance over the true one, less one.
    loss: f64,
    example: Option<FrequencyResponse>,
}

fn judge(welch: &Welch, label: &str, records: &[Recording]) -> Option<Row> {
    let ports = Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] };
    let limb = Limb::new();
    let found: Vec<_> =
        records.par_iter().filter_map(|r| estimate(&[r], &ports, &Labels::of(r, &ports), &SpectralMethod::Welch(welch.clone()), Direct::H1).ok()).collect();
    let first = found.first()?;
    let hz = &first.direct.response.frequency_hz;
    let segments = first.spectra.as_ref()?.segments();
    let band: Vec<usize> = (0..hz.len()).filter(|&f| (JUDGED_HZ[0]..=JUDGED_HZ[1]).contains(&hz[f])).collect();
    let (count, bins) = (found.len() as f64, band.len() as f64);
    let (mut scatter, mut paper, mut ours) = (0.0, 0.0, 0.0);
    for &f in &band {
        let gains: Vec<f64> = found.iter().map(|e| e.direct.response.value[[f, 0, 0]].norm()).collect();
        let mean = gains.iter().sum::<f64>() / count;
        scatter += gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0) / mean.powi(2) / bins;
        for estimates in &found {
            let direct = &estimates.direct;
            paper += random_error(direct.coherence.partial[[f, 0, 0]], segments).powi(2) / count / bins;
            ours += direct.response.variance(f, 0, 0) / 2.0 / direct.response.value[[f, 0, 0]].norm_sqr() / count / bins;
        }
    }
    let peak = (0..hz.len()).min_by(|&a, &b| (hz[a] - MODES[1].0).abs().total_cmp(&(hz[b] - MODES[1].0).abs()))?;
    let mean: Complex64 = found.iter().map(|e| e.direct.response.value[[peak, 1, 1]]).sum::<Complex64>() / count;
    Some(Row {
        label: label.to_owned(),
        seconds: welch.nperseg as f64 / RATE_HZ,
        segments,
        effective: first.effective_averages,
        scatter: scatter.sqrt(),
        paper: paper.sqrt(),
        ours: ours.sqrt(),
        loss: mean.norm() / limb.at(hz[peak], 1, 1).norm() - 1.0,
        example: found.into_iter().next().map(|e| e.direct.response),
    })
}

fn figure(rows: &[Row]) -> Figure {
    let x: Vec<f64> = rows.iter().map(|r| r.seconds).collect();
    let percent = |value: &dyn Fn(&Row) -> f64| rows.iter().map(|r| 100.0 * value(r)).collect::<Vec<f64>>();
    let error = Panel::new(Axis::log("Length of a segment", "s"), Axis::log("Error of the gain", "%"))
        .with(Series::line("random: scatter over records", x.clone(), percent(&|r| r.scatter), Color::Blue))
        .with(Series::line("random, as told by effective averages", x.clone(), percent(&|r| r.ours), Color::Vermillion).dash(Dash::Dashed))
        .with(Series::points("random, as told by the number of segments (paper)", x.clone(), percent(&|r| r.paper), Color::Orange))
        .with(Series::line("loss at a resonance of ζ = 0.05", x, percent(&|r| -r.loss), Color::Green))
        .height(300.0);
    let mut gain = Panel::new(Axis::linear("Frequency", "Hz").range(2.0, 6.0), Axis::log("Gain y ← y", "")).height(300.0);
    let limb = Limb::new();
    let grid: Vec<f64> = (0..400).map(|k| 2.0 + 0.01 * f64::from(k)).collect();
    let truth = grid.iter().map(|hz| limb.at(*hz, 1, 1).norm()).collect();
    gain = gain.with(Series::line("truth", grid, truth, Color::Ink));
    for (row, color) in rows.iter().filter(|r| r.segments == 5 || r.segments == 45).zip([Color::Purple, Color::Sky]) {
        let Some(response) = &row.example else { continue };
        let shown = response.band(2.0, 6.0);
        let gains = (0..shown.len()).map(|f| shown.value[[f, 1, 1]].norm()).collect();
        gain = gain.with(Series::line(row.label.clone(), shown.frequency_hz.clone(), gains, color));
    }
    Figure::new("averages", "Random error against resolution")
        .caption("Records of 50 s at 500 Hz. Short segments average more and resolve less.")
        .columns(2)
        .panel("Both errors", error)
        .panel("One record at both of the paper's settings", gain)
}

/// The paper's normalised random error of gain for two inputs, {(1 − γ²) / (2 (N − 1) γ²)}^½ with the partial coherence γ² and the number of
/// segments N, which it takes for independent (Palazzolo et al., IEEE TNSRE 15(1), 2007).
fn random_error(partial_coherence: f64, segments: usize) -> f64 {
    ((1.0 - partial_coherence) / (2.0 * (segments as f64 - 1.0) * partial_coherence)).sqrt()
}

fn main() -> ExitCode {
    let records: Result<Vec<Recording>, RecordingError> = (0..RECORDS).into_par_iter().map(|seed| Limb::new().record(seed)).collect();
    let Ok(records) = records else {
        eprintln!("the simulation left the range of numbers");
        return ExitCode::FAILURE;
    };
    let half = |nperseg: usize| Welch { nfft: 8192, ..Welch::new(nperseg) };
    let settings = [
        (Welch::fine(), "N_MNS = 5 (8192, 4096)"),
        (half(4096), "4096, 2048"),
        (half(2048), "2048, 1024"),
        (Welch::smooth(), "N_MNS = 45 (2048, 1536)"),
        (half(1024), "1024, 512"),
        (half(512), "512, 256"),
    ];
    let rows: Vec<Row> = settings.iter().filter_map(|(welch, label)| judge(welch, label, &records)).collect();
    println!("{RECORDS} records; random error of the gain x ← x, {} to {} Hz, in %; gain lost at a resonance of 3.5 Hz, ζ = 0.05", JUDGED_HZ[0], JUDGED_HZ[1]);
    println!("{:<26}{:>9}{:>11}{:>10}{:>8}{:>8}{:>8}", "segments", "N_MNS", "effective", "scatter", "paper", "ours", "loss");
    for r in &rows {
        println!(
            "{:<26}{:>9}{:>11.2}{:>10.2}{:>8.2}{:>8.2}{:>8.1}",
            r.label,
            r.segments,
            r.effective,
            100.0 * r.scatter,
            100.0 * r.paper,
            100.0 * r.ours,
            -100.0 * r.loss
        );
    }
    if let Some(path) = std::env::args().nth(1)
        && let Err(error) = std::fs::write(&path, figure(&rows).to_svg())
    {
        eprintln!("{path}: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
