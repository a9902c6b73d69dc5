//! How long to measure for intervals of a wanted width.

use super::{DesignSettings, Lens};
use crate::error::StudyError;
use crate::result::design::{LengthPlan, PredictedInterval, WantedInterval};
use crate::result::number;
use ndarray::{Array2, Array3};
use ndof_devices::{Experiment, Kinematics, Linearised, linearise};
use ndof_models::{Axis, InertiaDampingStiffnessModel, LoopModel, ParametricModel, Smoothing, Symmetry, Transducer, WeightedFit};
use ndof_signal::{CrossSpectra, ExcitationError, Kernel, Welch, effective_averages};
use ndof_sysid::{Confidence, FrequencyResponse, ResponseKind, Uncertainty, averages_for_interval};
use num_complex::Complex64;
use std::f64::consts::PI;
use std::str::FromStr;

/// An interval that is wanted: `K=0.1` for ± 10 % of every entry on the diagonal of K, likewise `M`, `B`; one entry such as
/// `K_x_y=0.2`; `gain@2=5%` for the gain at 2 Hz of every entry on the diagonal of the compliance.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    what: What,
    half_width: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    /// The diagonal of M, B or K.
    Diagonal(String),
    /// One entry.
    Entry(String),
    /// The compliance at a frequency.
    Gain(f64),
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("\"{text}\": write M, B, K, an entry such as K_x_y, or gain@HZ, then = and a share, such as K=0.1 or gain@2=5%");
        let (what, share) = text.split_once('=').ok_or_else(wrong)?;
        let share = match share.trim().strip_suffix('%') {
            Some(percent) => percent.trim().parse::<f64>().map(|p| p / 100.0),
            None => share.trim().parse(),
        };
        let half_width =
            share.ok().filter(|share| *share > 0.0 && *share < 1.0).ok_or_else(|| format!("\"{text}\": the share must lie between 0 and 1 (0 and 100 %)"))?;
        let what = what.trim();
        let what = match what.strip_prefix("gain@") {
            Some(hz) => What::Gain(hz.trim_end_matches("Hz").trim().parse().ok().filter(|hz: &f64| *hz > 0.0 && hz.is_finite()).ok_or_else(wrong)?),
            None if ["M", "B", "K"].contains(&what) => What::Diagonal(what.to_owned()),
            None if ["M_", "B_", "K_"].iter().any(|matrix| what.starts_with(matrix)) => What::Entry(what.to_owned()),
            None => return Err(wrong()),
        };
        Ok(Target { what, half_width })
    }
}

impl Target {
    fn name(&self) -> String {
        match &self.what {
            What::Diagonal(name) | What::Entry(name) => name.clone(),
            What::Gain(hz) => format!("gain@{hz}"),
        }
    }
}

/// The plan for `settings.targets`.
///
/// Signal: the spectrum of the commands through the linear model, S^c = T S_rr Tᴴ. Noise: the limb's own force, that of the
/// transducer and the encoders' steps, S_εε = C (S_ww + S_nn) Cᴴ + S_dd. From both the covariance of the derived estimate for
/// n_e effective averages of the paper's second setting, Cov(vec C) = (S^c)⁻ᵀ ⊗ S_εε / (n_e − q), on which the fit of M, B and K
/// is run as it is run on data. Dry friction of the robot is left out.
///
/// # Errors
/// [`StudyError`] if the experiment cannot be built, a target names nothing, or the band is empty.
pub(super) fn plan(settings: &DesignSettings, experiment: &Experiment, commanded: &[Vec<Vec<f64>>]) -> Result<LengthPlan, StudyError> {
    let linear = linearise(experiment)?;
    let fs = settings.sample_rate_hz;
    let samples = commanded.first().and_then(|trial| trial.first()).map_or(0, Vec::len);
    let Lens::Welch(welch) = Lens::welch(samples) else { return Err(ExcitationError::NoCandidates.into()) };
    let spectra = commanded
        .iter()
        .map(|trial| welch.spectra(fs, &trial.iter().map(Vec::as_slice).collect::<Vec<_>>()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(ExcitationError::from)?;
    let pooled = CrossSpectra::pool(&spectra).map_err(|error| StudyError::Estimate { file: "the design".to_owned(), source: error.into() })?;
    let here = pooled.effective_averages();
    let theory = Theory::new(settings, experiment, linear, pooled)?;
    let known: Vec<String> = theory.model.parameters().iter().map(|p| p.name.clone()).collect();
    if let Some(What::Entry(name)) = settings.targets.iter().map(|t| &t.what).find(|what| matches!(what, What::Entry(name) if !known.contains(name))) {
        let what = format!("no parameter \"{name}\"; there are M, B, K, {}, and gain@HZ", known.join(", "));
        return Err(StudyError::Meaning { file: "--target-ci".to_owned(), what });
    }
    let q = settings.axes.len();
    let trials = settings.trials.max(1) as f64;
    let wanted: Vec<WantedInterval> = settings
        .targets
        .iter()
        .map(|target| {
            let averages = match target.what {
                What::Gain(hz) => Some(averages_for_interval(theory.coherence(hz), q, target.half_width, 0.95)),
                _ => theory.averages(target),
            };
            let averages = averages.and_then(number);
            let duration_s = averages.and_then(|averages| record_s(&welch, fs, averages / trials));
            WantedInterval { what: target.name(), half_width: target.half_width, effective_averages: averages, duration_s }
        })
        .collect();
    let longest = |value: fn(&WantedInterval) -> Option<f64>| wanted.iter().map(value).try_fold(0.0_f64, |most, value| Some(most.max(value?)));
    let gains = settings.targets.iter().filter_map(|target| if let What::Gain(hz) = target.what { Some((target.name(), hz)) } else { None });
    let mut predicted = theory.predicted(here).unwrap_or_default();
    predicted.extend(gains.map(|(name, hz)| theory.gain(name, hz, here)));
    Ok(LengthPlan {
        band_hz: settings.fit_band_hz,
        trials: settings.trials,
        duration_s: longest(|w| w.duration_s),
        trials_of_this_length: longest(|w| w.effective_averages).map(|averages| (averages * trials / here).ceil() as usize),
        predicted,
        wanted,
    })
}

/// Longest record that is worth planning (s): a day.
const LONGEST_S: f64 = 86_400.0;

/// The shortest record with so many effective averages.
fn record_s(welch: &Welch, sample_rate_hz: f64, averages: f64) -> Option<f64> {
    let window = welch.window.samples(welch.nperseg, welch.window_symmetric);
    let hop = welch.nperseg - welch.noverlap;
    let most = (LONGEST_S * sample_rate_hz / hop as f64) as usize;
    let enough = |segments: usize| effective_averages(&window, hop, segments) >= averages;
    // Averages grow with the number of segments.
    let (mut low, mut high) = (0, most);
    if !enough(most) {
        return None;
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if enough(middle) { high = middle } else { low = middle }
    }
    Some((welch.nperseg + (high - 1) * hop) as f64 / sample_rate_hz)
}

/// What the linear model says about an estimate before there is one.
struct Theory {
    linear: Linearised,
    model: InertiaDampingStiffnessModel,
    start: Vec<f64>,
    fit: WeightedFit,
    hz: Vec<f64>,
    /// Inverse of the forces' coherent part and noise of the motion at each frequency.
    signal_inverse: Vec<Array2<Complex64>>,
    noise: Vec<Array2<Complex64>>,
    kernel: Kernel,
    independent_spacing_hz: f64,
    density: Noise,
    spectra: CrossSpectra,
    axes: Vec<String>,
}

/// One-sided densities of the sources of noise.
struct Noise {
    /// Of the limb's own force at 0 Hz, each axis, and its corner.
    limb: Vec<f64>,
    limb_cutoff_hz: f64,
    /// Of the force channels.
    force: f64,
    /// Of the measured motion, axes × axes.
    motion: Array2<f64>,
}

impl Noise {
    fn of(experiment: &Experiment, axes: usize) -> Result<Self, StudyError> {
        let bench = experiment.build()?;
        let fs = experiment.sample_rate_hz;
        let defaults = bench.device.defaults;
        let quantum = experiment.sensors.force_quantum.unwrap_or(defaults.force_quantum);
        let rms = experiment.sensors.force_noise_rms.unwrap_or(defaults.force_noise_rms);
        let (limb, limb_cutoff_hz) = match experiment.limb.noise() {
            // ∫ df/(1 + (f/f_c)⁴) = f_c π/(2√2): a second-order Butterworth filter of white noise.
            Some(noise) => {
                let level = |rms: &f64| rms * rms * 2.0 * std::f64::consts::SQRT_2 / (PI * noise.cutoff_hz);
                (noise.rms_n.values(axes).unwrap_or_else(|| vec![0.0; axes]).iter().map(level).collect(), noise.cutoff_hz)
            }
            None => (vec![0.0; axes], 1.0),
        };
        let robot = bench.device.robot.as_ref();
        let joints = robot.joints();
        let counts = match experiment.sensors.encoder_bits {
            None => joints.encoder_counts,
            Some(0) => f64::INFINITY,
            Some(bits) => 2f64.powi(bits.min(64) as i32),
        };
        let mut place = Kinematics::new(axes, bench.rest.len());
        robot.kinematics(&bench.rest, &vec![0.0; bench.rest.len()], &mut place);
        let n = bench.rest.len();
        let step = |joint: usize| joints.encoder_range[joint] / counts;
        let entry =
            |(a, b): (usize, usize)| (0..n).map(|j| place.jacobian[a * n + j] * place.jacobian[b * n + j] * step(j).powi(2) / 12.0).sum::<f64>() * 2.0 / fs;
        Ok(Noise { limb, limb_cutoff_hz, force: (rms * rms + quantum * quantum / 12.0) * 2.0 / fs, motion: Array2::from_shape_fn((axes, axes), entry) })
    }
}

fn adjoint(a: &Array2<Complex64>) -> Array2<Complex64> {
    a.t().mapv(|v| v.conj())
}

impl Theory {
    fn new(settings: &DesignSettings, experiment: &Experiment, linear: Linearised, spectra: CrossSpectra) -> Result<Self, StudyError> {
        let q = settings.axes.len();
        let band_hz = settings.fit_band_hz;
        let rotational = experiment.build()?.device.robot.axes().iter().map(|axis| axis.rotational).collect::<Vec<_>>();
        let axes: Vec<Axis> = settings.axes.iter().zip(rotational).map(|(name, rotational)| Axis { name: name.clone(), rotational }).collect();
        let model = InertiaDampingStiffnessModel::new(axes, Symmetry::Symmetric);
        let matrices = [&linear.limb.inertia, &linear.limb.damping, &linear.limb.stiffness];
        let start = matrices.iter().flat_map(|m| model.entries().iter().map(|&(i, j)| m[[i, j]])).collect();
        let density = Noise::of(experiment, q)?;
        let hz: Vec<f64> = spectra.frequency_hz().iter().copied().filter(|hz| *hz > 0.0 && (band_hz[0]..=band_hz[1]).contains(hz)).collect();
        if hz.is_empty() {
            return Err(ExcitationError::EmptyBand { low_hz: band_hz[0], high_hz: band_hz[1] }.into());
        }
        let response = |of: &dyn Fn(f64) -> Option<Array2<Complex64>>, kind| -> FrequencyResponse {
            let mut value = Array3::from_elem((hz.len(), q, q), Complex64::new(f64::NAN, 0.0));
            for (f, &hz) in hz.iter().enumerate() {
                if let Some(matrix) = of(hz) {
                    value.index_axis_mut(ndarray::Axis(0), f).assign(&matrix);
                }
            }
            FrequencyResponse { frequency_hz: hz.clone(), inputs: settings.axes.clone(), outputs: settings.axes.clone(), kind, value, uncertainty: None }
        };
        let t = response(&|hz| Some(linear.sampled_responses(hz)?.0), ResponseKind::Transfer);
        let r = response(&|hz| Some(linear.sampled_responses(hz)?.1), ResponseKind::Transfer);
        let smoothing = LoopModel::estimate(&t, &r, band_hz).map_or(Smoothing::Open, Smoothing::Derived);
        let transducer = Some(Transducer { stiffness: linear.transducer.stiffness, damping: linear.transducer.damping });
        let fit = WeightedFit { band_hz, smoothing, transducer, ..WeightedFit::default() };
        let mut theory = Theory {
            model,
            start,
            fit,
            signal_inverse: Vec::with_capacity(hz.len()),
            noise: Vec::with_capacity(hz.len()),
            kernel: spectra.kernel().clone(),
            independent_spacing_hz: spectra.independent_spacing_hz(),
            density,
            spectra,
            axes: settings.axes.clone(),
            linear,
            hz,
        };
        for k in 0..theory.hz.len() {
            let (signal_inverse, noise) = theory.at(theory.hz[k]);
            theory.signal_inverse.push(signal_inverse);
            theory.noise.push(noise);
        }
        Ok(theory)
    }

    /// (S^c)⁻¹ and S_εε at a frequency; the commands are taken as independent of each other.
    fn at(&self, hz: f64) -> (Array2<Complex64>, Array2<Complex64>) {
        let q = self.axes.len();
        let none = || Array2::from_elem((q, q), Complex64::new(f64::NAN, 0.0));
        let grid = self.spectra.frequency_hz();
        let nearest = (hz / grid.get(1).copied().unwrap_or(1.0)).round() as usize;
        let bin = nearest.min(grid.len() - 1);
        let inverse = self.linear.precompensation(hz).unwrap_or_else(none);
        let power = Array2::from_diag(&(0..q).map(|axis| Complex64::from(1.0 / self.spectra.power(bin, axis))).collect::<ndarray::Array1<_>>());
        let signal_inverse = adjoint(&inverse).dot(&power).dot(&inverse);
        let c = self.linear.limb_compliance(hz).unwrap_or_else(none);
        let limb = |axis: usize| self.density.limb[axis] / (1.0 + (hz / self.density.limb_cutoff_hz).powi(4));
        let force = Array2::from_diag(&(0..q).map(|axis| Complex64::from(limb(axis) + self.density.force)).collect::<ndarray::Array1<_>>());
        let noise = c.dot(&force).dot(&adjoint(&c)) + self.density.motion.mapv(Complex64::from);
        (signal_inverse, noise)
    }

    fn compliance(&self, hz: f64) -> Option<Array2<Complex64>> {
        self.linear.compliance_with_transducer(hz)
    }

    /// |δC_ii|²/|C_ii|² of the worst axis for one degree of freedom of the noise.
    fn relative_variance(&self, hz: f64) -> f64 {
        let (signal_inverse, noise) = self.at(hz);
        let Some(c) = self.compliance(hz) else { return f64::NAN };
        (0..self.axes.len()).map(|i| noise[[i, i]].re * signal_inverse[[i, i]].re / c[[i, i]].norm_sqr()).fold(0.0, f64::max)
    }

    /// The partial coherence of the worst entry on the diagonal.
    fn coherence(&self, hz: f64) -> f64 {
        1.0 / (1.0 + self.relative_variance(hz))
    }

    fn gain(&self, name: String, hz: f64, averages: f64) -> PredictedInterval {
        let freedom = averages - self.axes.len() as f64;
        let unit = Confidence::new(0.95, freedom).gain_phase(1.0.into(), self.relative_variance(hz) / freedom);
        let worst = self.compliance(hz).map(|c| c.diag().iter().map(|v| v.norm()).fold(f64::INFINITY, f64::min));
        PredictedInterval { name, value: worst.and_then(number), half_width: number(unit.gain_interval[1] - 1.0) }
    }

    /// Half widths of all parameters over their values, with `averages` effective averages; `None` where there is no fit.
    fn predicted(&self, averages: f64) -> Option<Vec<PredictedInterval>> {
        let (q, bins) = (self.axes.len(), self.hz.len());
        let freedom = averages - q as f64;
        let stack = |part: &dyn Fn(usize) -> Array2<Complex64>| {
            let mut out = Array3::zeros((bins, q, q));
            for f in 0..bins {
                out.index_axis_mut(ndarray::Axis(0), f).assign(&part(f));
            }
            out
        };
        let value = stack(&|f| self.compliance(self.hz[f]).unwrap_or_else(|| Array2::from_elem((q, q), Complex64::new(f64::NAN, 0.0))));
        let response = FrequencyResponse {
            frequency_hz: self.hz.clone(),
            inputs: self.axes.clone(),
            outputs: self.axes.clone(),
            kind: ResponseKind::Compliance,
            value,
            uncertainty: Some(Uncertainty {
                noise: stack(&|f| self.noise[f].mapv(|v| v / freedom)),
                input_inverse: stack(&|f| self.signal_inverse[f].clone()),
                degrees_of_freedom: freedom,
                independent_spacing_hz: self.independent_spacing_hz,
                kernel: self.kernel.clone(),
                inverted: false,
            }),
        };
        let fit = self.fit.fit(&self.model, &response, &self.start).ok()?;
        let interval = |(parameter, truth): (&ndof_models::Parameter, &f64)| PredictedInterval {
            name: parameter.name.clone(),
            value: number(*truth),
            half_width: number(fit.interval_quantile * parameter.std_error / truth.abs()),
        };
        Some(fit.parameters.iter().zip(&self.start).map(interval).collect())
    }

    /// Effective averages at which a parameter's interval is as narrow as wanted; `None` beyond any record.
    fn averages(&self, target: &Target) -> Option<f64> {
        const MOST: f64 = 1e6;
        let entries: Vec<String> = self.names(&target.what);
        let width = |averages: f64| -> f64 {
            let Some(predicted) = self.predicted(averages) else { return f64::INFINITY };
            predicted.iter().filter(|p| entries.contains(&p.name)).map(|p| p.half_width.unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
        };
        // The width goes with one over the root of the averages, but for the few that estimating the noise itself costs.
        let (mut low, mut high) = (self.axes.len() as f64 + 2.0, MOST);
        if width(high) > target.half_width {
            return None;
        }
        while high / low > 1.002 {
            let middle = (low * high).sqrt();
            if width(middle) > target.half_width { low = middle } else { high = middle }
        }
        Some(high)
    }

    fn names(&self, what: &What) -> Vec<String> {
        let names: Vec<String> = self.model.parameters().iter().map(|p| p.name.clone()).collect();
        match what {
            What::Entry(name) => vec![name.clone()],
            What::Gain(_) => Vec::new(),
            What::Diagonal(letter) => {
                let entries = self.model.entries();
                let block = ["M", "B", "K"].iter().position(|l| l == letter).unwrap_or(0) * entries.len();
                entries.iter().enumerate().filter(|(_, (i, j))| i == j).map(|(k, _)| names[block + k].clone()).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_read_as_they_are_written() {
        let of = |text: &str| text.parse::<Target>();
        assert_eq!(of("K=0.1"), Ok(Target { what: What::Diagonal("K".to_owned()), half_width: 0.1 }));
        assert_eq!(of("B_x_y = 20 %"), Ok(Target { what: What::Entry("B_x_y".to_owned()), half_width: 0.2 }));
        assert_eq!(of("gain@2Hz=5%"), Ok(Target { what: What::Gain(2.0), half_width: 0.05 }));
        for wrong in ["K", "Q=0.1", "K=0", "K=120%", "gain@=0.1", "gain@-1=0.1", "K=x"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_shortest_record_has_just_enough_averages() {
        let welch = Welch::smooth();
        let window = welch.window.samples(2048, false);
        // The paper's 45 segments: 23.65 effective averages in 24 576 samples.
        let seconds = record_s(&welch, 500.0, effective_averages(&window, 512, 45)).expect("within a day");
        assert_eq!(seconds, (2048 + 44 * 512) as f64 / 500.0);
        assert!(record_s(&welch, 500.0, 1e9).is_none());
    }
}
