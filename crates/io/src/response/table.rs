//! A frequency response as a table, without anything that was inferred from it.

use num_complex::Complex;
use std::collections::BTreeMap;

/// A measured frequency response: output = H · input, at each frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResponseTable {
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Units of the outputs as symbols; "" where the file gives none.
    pub output_units: Vec<String>,
    /// Units of the inputs as symbols; "" where the file gives none.
    pub input_units: Vec<String>,
    /// Frequencies in Hz, increasing.
    pub frequency_hz: Vec<f64>,
    /// H by `[output][input][frequency]`; NaN where there is no value.
    pub values: Vec<Vec<Vec<Complex<f64>>>>,
    /// Standard error of the gain |H|, which is that of the real and of the imaginary part, by `[output][input][frequency]`.
    pub std: Option<Vec<Vec<Vec<f64>>>>,
    /// Magnitude-squared coherence by `[output][input][frequency]`.
    pub coherence: Option<Vec<Vec<Vec<f64>>>>,
    /// Other facts.
    pub metadata: BTreeMap<String, String>,
}

impl ResponseTable {
    /// Checks that all parts have one size and that the frequencies increase; what does not fit, in words.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self) -> Result<(), String> {
        let (outputs, inputs, frequencies) = (self.outputs.len(), self.inputs.len(), self.frequency_hz.len());
        if outputs == 0 || inputs == 0 || frequencies == 0 {
            return Err(format!("a response of {outputs} outputs, {inputs} inputs and {frequencies} frequencies"));
        }
        if self.output_units.len() != outputs || self.input_units.len() != inputs {
            return Err("units of another number of channels than there are".to_owned());
        }
        for names in [&self.outputs, &self.inputs] {
            if let Some(name) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)).map(|(_, name)| name) {
                return Err(format!("two channels called \"{name}\""));
            }
        }
        let increasing = self.frequency_hz.windows(2).all(|pair| pair[1] > pair[0]) && self.frequency_hz.iter().all(|f| f.is_finite() && *f >= 0.0);
        if !increasing {
            return Err("frequencies that do not increase from 0 Hz or above".to_owned());
        }
        let sizes = [outputs, inputs, frequencies];
        let real = |part: &Option<Vec<Vec<Vec<f64>>>>| part.as_ref().is_none_or(|part| fits(part, sizes));
        if fits(&self.values, sizes) && real(&self.std) && real(&self.coherence) {
            Ok(())
        } else {
            Err(format!("arrays that are not of {outputs} outputs, {inputs} inputs and {frequencies} frequencies"))
        }
    }
}

fn fits<T>(part: &[Vec<Vec<T>>], [outputs, inputs, frequencies]: [usize; 3]) -> bool {
    part.len() == outputs && part.iter().all(|row| row.len() == inputs && row.iter().all(|values| values.len() == frequencies))
}
