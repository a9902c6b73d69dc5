//! What the linear model says about an estimate before there is one.

use super::result::PredictedInterval;
use super::specification::Specification;
use super::target::{Target, What};
use crate::error::StudyError;
use ndarray::{Array2, Array3};
use ndof_analysis::result::number;
use ndof_devices::{Experiment, Linearised};
use ndof_models::robot::EndpointKinematics;
use ndof_models::{Axis, InertiaDampingStiffnessModel, LoopModel, ParametricModel, Smoothing, Symmetry, Transducer, WeightedFit};
use ndof_signal::{CrossSpectra, ExcitationError, Kernel};
use ndof_sysid::{Confidence, FrequencyResponse, ResponseKind, Uncertainty};
use num_complex::Complex64;
use std::f64::consts::PI;

/// What the linear model says about an estimate before there is one.
pub(super) struct Theory {
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
        let counts = experiment.sensors.encoder_counts(joints.encoder_counts);
        let mut place = EndpointKinematics::new(axes, bench.rest.len());
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
    pub(super) fn new(asked: &Specification, experiment: &Experiment, linear: Linearised, spectra: CrossSpectra) -> Result<Self, StudyError> {
        let q = asked.axes.len();
        let band_hz = asked.fit_band_hz;
        let rotational = experiment.build()?.device.robot.axes().iter().map(|axis| axis.rotational).collect::<Vec<_>>();
        let axes: Vec<Axis> = asked.axes.iter().zip(rotational).map(|(name, rotational)| Axis { name: name.clone(), rotational }).collect();
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
            FrequencyResponse { frequency_hz: hz.clone(), inputs: asked.axes.clone(), outputs: asked.axes.clone(), kind, value, uncertainty: None }
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
            axes: asked.axes.clone(),
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
    pub(super) fn coherence(&self, hz: f64) -> f64 {
        1.0 / (1.0 + self.relative_variance(hz))
    }

    /// The interval of the gain at a frequency, of the worst axis.
    pub(super) fn gain(&self, name: String, hz: f64, averages: f64) -> PredictedInterval {
        let freedom = averages - self.axes.len() as f64;
        let unit = Confidence::new(0.95, freedom).gain_phase(1.0.into(), self.relative_variance(hz) / freedom);
        let worst = self.compliance(hz).map(|c| c.diag().iter().map(|v| v.norm()).fold(f64::INFINITY, f64::min));
        PredictedInterval { name, value: worst.and_then(number), half_width: number(unit.gain_interval[1] - 1.0) }
    }

    /// Half widths of all parameters over their values, with `averages` effective averages; `None` where there is no fit.
    pub(super) fn predicted(&self, averages: f64) -> Option<Vec<PredictedInterval>> {
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
                unexplained: None,
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
    pub(super) fn averages(&self, target: &Target) -> Option<f64> {
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

    /// Names of the parameters.
    pub(super) fn parameters(&self) -> Vec<String> {
        self.model.parameters().iter().map(|p| p.name.clone()).collect()
    }

    fn names(&self, what: &What) -> Vec<String> {
        let names = self.parameters();
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
