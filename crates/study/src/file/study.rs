//! `ndof/study/1`: an experiment with its analysis.

use super::{ExperimentFile, KinematicsFile, check_schema};
use crate::error::StudyError;
use crate::pipeline::{EstimateSettings, FitCost, FitSettings, MethodName};
use ndof_signal::{Detrend, Window};
use ndof_sysid::{Direct, ResponseKind};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A whole study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// `ndof/study/1`.
    #[serde(default)]
    pub schema: Option<String>,
    /// Title of the report.
    #[serde(default)]
    pub title: Option<String>,
    /// What is simulated.
    pub experiment: ExperimentSource,
    /// How the response is estimated.
    #[serde(default)]
    pub estimate: EstimateSection,
    /// Other settings, fitted beside it.
    #[serde(default)]
    pub also: Vec<EstimateSection>,
    /// What is fitted.
    #[serde(default)]
    pub fit: FitSection,
    /// Where the joints are.
    #[serde(default)]
    pub kinematics: Option<KinematicsFile>,
}

/// An experiment inline, or in a file of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ExperimentSource {
    /// `file = "…"`, from the folder of the study's file.
    File(ExperimentPath),
    /// Inline.
    Inline(Box<ExperimentFile>),
}

/// The path of an experiment's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentPath {
    /// Relative to the study's file.
    pub file: String,
}

/// Keys are the long options of `ndof estimate`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct EstimateSection {
    /// What tables call it.
    pub name: Option<String>,
    /// The spectral method.
    pub method: MethodName,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share.
    pub noverlap: Option<usize>,
    /// Length of the transform.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Option<String>,
    /// Symmetric instead of periodic.
    pub window_symmetric: bool,
    /// What is taken off each segment.
    pub detrend: Detrend,
    /// Where the noise of the direct estimate is thought to be.
    pub estimator: Direct,
    /// The physical quantity to report.
    pub response: Option<ResponseKind>,
    /// Cuts the arrays, never the computation.
    pub band: Option<[f64; 2]>,
    /// Add the cross-spectra.
    pub spectra: bool,
}

/// What is fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FitSection {
    /// The model's name.
    pub model: Option<String>,
    /// The band that is fitted.
    pub band_hz: Option<[f64; 2]>,
    /// Weighted by the covariance, or the paper's.
    pub cost: FitCost,
}

impl StudyFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/study/1";

    /// Reads a study; an experiment in a file of its own is read too.
    ///
    /// # Errors
    /// [`StudyError`] with file and line.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let study: StudyFile = super::read(path)?;
        study.resolve(&path.display().to_string(), path.parent())
    }

    /// A study from text that `file` names in errors.
    ///
    /// # Errors
    /// [`StudyError`] with line.
    pub fn parse(text: &str, file: &str) -> Result<Self, StudyError> {
        super::parse::<StudyFile>(text, file)?.resolve(file, None)
    }

    fn resolve(mut self, file: &str, folder: Option<&Path>) -> Result<Self, StudyError> {
        check_schema(self.schema.as_deref(), Self::SCHEMA, file)?;
        if let ExperimentSource::File(ExperimentPath { file: path }) = &self.experiment {
            let path = folder.unwrap_or_else(|| Path::new("")).join(path);
            let experiment: ExperimentFile = super::read(&path)?;
            experiment.check(&path.display().to_string())?;
            self.experiment = ExperimentSource::Inline(Box::new(experiment));
        } else if let ExperimentSource::Inline(experiment) = &self.experiment {
            experiment.check(file)?;
        }
        for section in std::iter::once(&self.estimate).chain(&self.also) {
            section.settings(file)?;
        }
        Ok(self)
    }

    /// The experiment, which reading has put in place.
    pub fn experiment(&self) -> Option<&ExperimentFile> {
        match &self.experiment {
            ExperimentSource::Inline(experiment) => Some(experiment),
            ExperimentSource::File(_) => None,
        }
    }

    /// What the fit is asked for.
    pub fn fit_settings(&self) -> FitSettings {
        FitSettings {
            model: self.fit.model.clone(),
            band_hz: self.fit.band_hz,
            cost: self.fit.cost,
            kinematics: self.kinematics.clone(),
            ..FitSettings::default()
        }
    }
}

impl EstimateSection {
    /// What the keys mean.
    ///
    /// # Errors
    /// [`StudyError::Meaning`] if there is no such window.
    pub fn settings(&self, file: &str) -> Result<EstimateSettings, StudyError> {
        let window = match &self.window {
            Some(name) => name.parse::<Window>().map_err(|error| StudyError::Meaning { file: file.to_owned(), what: error.to_string() })?,
            None => Window::default(),
        };
        Ok(EstimateSettings {
            method: self.method,
            nperseg: self.nperseg,
            noverlap: self.noverlap,
            nfft: self.nfft,
            window,
            window_symmetric: self.window_symmetric,
            detrend: self.detrend,
            estimator: self.estimator,
            response: self.response,
            band_hz: self.band.map(|[low, high]| (low, high)),
            spectra: self.spectra,
        })
    }
}
