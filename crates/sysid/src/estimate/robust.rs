//! Segments that a knock or a cough has wrecked are left out, and reported.

use super::EstimateError;
use crate::labels::Labels;
use crate::ports::Ports;
use ndof_linear::Cholesky;
use ndof_signal::{CrossSpectra, Recording, Welch, robust_spread};
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Robust standard deviations (1.4826 · median absolute deviation) beyond which a segment is out. Clean segments reach
/// it with a probability near 1e-6.
const OUTLYING: f64 = 5.0;

/// Fewer segments do not tell the usual from the unusual.
const FEWEST: usize = 8;

/// Bins that judge a segment; more add little, since one knock shows in all of them.
const JUDGES: usize = 256;

/// A segment that was left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedSegment {
    /// Number of the trial, from 1.
    pub trial: usize,
    /// Its first second, on the recording's clock.
    pub start_s: f64,
    /// Its end.
    pub end_s: f64,
    /// Its residual above the usual one, in robust standard deviations of its logarithm.
    pub residual: f64,
    /// The power of what drives (leverage) above the usual one, in the same measure.
    pub leverage: f64,
}

/// Welch's cross-spectra of all channels without the segments whose residual is far from the usual one.
///
/// The residual is that of inputs and outputs given the references (without references: of outputs given inputs),
/// measured in its own covariance and averaged over frequency. Estimate and judgement are repeated until no segment
/// changes sides; a segment that was wrongly suspected comes back. Without references a leverage far beyond the usual is a
/// reason too. With fewer than eight segments none is rejected.
///
/// # Errors
/// [`EstimateError`] as for Welch's method.
pub fn robust_spectra(trials: &[&Recording], ports: &Ports, welch: &Welch) -> Result<(CrossSpectra, Vec<RejectedSegment>), EstimateError> {
    let first = trials.first().ok_or(EstimateError::NoTrial)?;
    ports.validate(first.channels().len())?;
    super::check::alike(trials)?;
    super::check::sizes(trials, ports, &Labels::of(first, ports))?;
    let all: Vec<usize> = (0..first.channels().len()).collect();
    let whole = |recording: &Recording, from: usize, to: usize, trial: usize| {
        let columns: Vec<&[f64]> = recording.columns(&all).into_iter().map(|c| &c[from..to]).collect();
        welch.spectra(recording.sample_rate_hz(), &columns).map_err(|source| EstimateError::Welch { trial, source })
    };
    // Also checks settings, lengths and samples once, so that segments cannot fail later.
    let per_trial: Result<Vec<CrossSpectra>, EstimateError> = trials.iter().enumerate().map(|(k, r)| whole(r, 0, r.len(), k + 1)).collect();
    let per_trial = per_trial?;
    let clean = CrossSpectra::pool(&per_trial)?;
    let hop = welch.nperseg - welch.noverlap;
    let segments: Vec<Segment> =
        per_trial.iter().enumerate().flat_map(|(trial, s)| (0..s.segments()).map(move |k| Segment { trial, start: k * hop })).collect();
    if segments.len() < FEWEST {
        return Ok((clean, Vec::new()));
    }
    let (drivers, responders) = (ports.drivers(), ports.responders());
    let one = |s: &Segment| whole(trials[s.trial], s.start, s.start + welch.nperseg, s.trial + 1);
    let pooled = |kept: &[bool]| -> Result<CrossSpectra, EstimateError> {
        let runs: Result<Vec<CrossSpectra>, EstimateError> =
            runs(&segments, kept).map(|(trial, from, to)| whole(trials[trial], from, to + welch.nperseg, trial + 1)).collect();
        Ok(CrossSpectra::pool(&runs?)?)
    };

    // First suspicion: power far beyond the usual in any responder, which no estimate is needed for.
    let powers: Vec<Result<Vec<f64>, EstimateError>> = segments
        .par_iter()
        .map(|s| one(s).map(|s| responders.iter().map(|&c| (1..s.frequency_hz().len()).map(|f| s.power(f, c)).sum::<f64>().ln()).collect()))
        .collect();
    // The error of the first segment, whichever thread met one first.
    let powers = powers.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut kept = vec![true; segments.len()];
    for c in 0..responders.len() {
        let scores = scores(&powers.iter().map(|p| p[c]).collect::<Vec<_>>(), &vec![true; segments.len()]);
        kept.iter_mut().zip(&scores).for_each(|(k, &s)| *k &= s < OUTLYING);
    }
    let mut judgement = Vec::new();
    for _ in 0..10 {
        if kept.iter().filter(|k| **k).count() < FEWEST {
            kept = vec![true; segments.len()];
            judgement = vec![(0.0, 0.0); segments.len()];
            break;
        }
        let judge = Judge::new(&pooled(&kept)?, drivers, &responders);
        let measures: Result<Vec<(f64, f64)>, EstimateError> = segments.par_iter().map(|s| one(s).map(|s| judge.measure(&s))).collect();
        let (residual, leverage): (Vec<f64>, Vec<f64>) = measures?.into_iter().unzip();
        let (residual, leverage) = (scores(&residual, &kept), scores(&leverage, &kept));
        let next: Vec<bool> = residual.iter().zip(&leverage).map(|(&r, &l)| r < OUTLYING && (!ports.references.is_empty() || l < 1.6 * OUTLYING)).collect();
        judgement = residual.into_iter().zip(leverage).collect();
        let settled = next == kept;
        kept = next;
        if settled {
            break;
        }
    }
    let rejected: Vec<RejectedSegment> = segments
        .iter()
        .zip(&kept)
        .zip(&judgement)
        .filter(|((_, kept), _)| !**kept)
        .map(|((segment, _), &(residual, leverage))| {
            let recording = trials[segment.trial];
            let start_s = recording.start_s() + segment.start as f64 / recording.sample_rate_hz();
            RejectedSegment { trial: segment.trial + 1, start_s, end_s: start_s + welch.nperseg as f64 / recording.sample_rate_hz(), residual, leverage }
        })
        .collect();
    Ok((if rejected.is_empty() { clean } else { pooled(&kept)? }, rejected))
}

#[derive(Clone, Copy)]
struct Segment {
    trial: usize,
    start: usize,
}

/// Stretches of kept neighbours: trial, start of the first segment, start of the last.
fn runs<'a>(segments: &'a [Segment], kept: &'a [bool]) -> impl Iterator<Item = (usize, usize, usize)> + 'a {
    let mut found: Vec<(usize, usize, usize)> = Vec::new();
    let mut open = false;
    for (segment, &keep) in segments.iter().zip(kept) {
        match found.last_mut() {
            Some(run) if keep && open && run.0 == segment.trial => run.2 = segment.start,
            _ if keep => found.push((segment.trial, segment.start, segment.start)),
            _ => {}
        }
        open = keep;
    }
    found.into_iter()
}

/// How far each value lies above the median of the kept ones, in robust standard deviations.
fn scores(values: &[f64], kept: &[bool]) -> Vec<f64> {
    let kept: Vec<f64> = values.iter().zip(kept).filter(|(_, k)| **k).map(|(v, _)| *v).collect();
    let (centre, spread) = robust_spread(&kept);
    values.iter().map(|v| if spread > 0.0 { (v - centre) / spread } else { 0.0 }).collect()
}

/// Response and residual covariance at the bins that judge.
struct Judge<'a> {
    drivers: &'a [usize],
    responders: &'a [usize],
    bins: Vec<Bin>,
}

/// One bin that judges.
struct Bin {
    /// Its index.
    at: usize,
    /// The response, row by row.
    response: Vec<Complex64>,
    /// The covariance of what drives.
    input: Cholesky<Complex64>,
    /// That of what the response leaves.
    residual: Cholesky<Complex64>,
}

impl<'a> Judge<'a> {
    fn new(spectra: &CrossSpectra, drivers: &'a [usize], responders: &'a [usize]) -> Self {
        let (q, m) = (drivers.len(), responders.len());
        let stride = (spectra.frequency_hz().len() / JUDGES).max(1);
        let mut bins = Vec::new();
        for f in (stride..spectra.frequency_hz().len()).step_by(stride) {
            let mut input = Cholesky::new(q);
            if !input.factor(|i, j| spectra.at(f, drivers[i], drivers[j])) {
                continue;
            }
            let mut rows = vec![Complex64::default(); m * q];
            for (i, row) in rows.chunks_exact_mut(q).enumerate() {
                row.iter_mut().zip(drivers).for_each(|(r, &d)| *r = spectra.at(f, responders[i], d));
                input.whiten(row);
            }
            let mut residual = Cholesky::new(m);
            let explained = |i: usize, j: usize| -> Complex64 { (0..q).map(|k| rows[i * q + k] * rows[j * q + k].conj()).sum() };
            if !residual.factor(|i, j| spectra.at(f, responders[i], responders[j]) - explained(i, j)) {
                continue;
            }
            rows.chunks_exact_mut(q).for_each(|row| input.unwhiten(row));
            bins.push(Bin { at: f, response: rows, input, residual });
        }
        Judge { drivers, responders, bins }
    }

    /// Logarithms of a segment's residual and of its leverage, each in its own covariance, mean over the bins.
    fn measure(&self, segment: &CrossSpectra) -> (f64, f64) {
        let (q, m) = (self.drivers.len(), self.responders.len());
        let (mut residual, mut leverage) = (0.0, 0.0);
        let (mut e, mut x) = (vec![Complex64::default(); m], vec![Complex64::default(); q]);
        for Bin { at: f, response: g, input, residual: covariance } in &self.bins {
            // One segment's spectra are z zᴴ: any column over the root of its power is z up to a common phase.
            let anchor = self.responders.iter().chain(self.drivers).copied().max_by(|&a, &b| segment.power(*f, a).total_cmp(&segment.power(*f, b)));
            let Some(anchor) = anchor.filter(|&a| segment.power(*f, a) > 0.0) else { continue };
            let root = segment.power(*f, anchor).sqrt();
            let z = |c: usize| segment.at(*f, c, anchor) / root;
            x.iter_mut().zip(self.drivers).for_each(|(x, &d)| *x = z(d));
            for (i, e) in e.iter_mut().enumerate() {
                *e = z(self.responders[i]) - g[i * q..(i + 1) * q].iter().zip(&x).map(|(g, x)| g * x).sum::<Complex64>();
            }
            // Rows are whitened by b L⁻ᴴ; a column z needs the conjugate.
            e.iter_mut().for_each(|v| *v = v.conj());
            x.iter_mut().for_each(|v| *v = v.conj());
            covariance.whiten(&mut e);
            input.whiten(&mut x);
            residual += e.iter().map(|v| v.norm_sqr()).sum::<f64>();
            leverage += x.iter().map(|v| v.norm_sqr()).sum::<f64>();
        }
        (residual.max(f64::MIN_POSITIVE).ln(), leverage.max(f64::MIN_POSITIVE).ln())
    }
}
