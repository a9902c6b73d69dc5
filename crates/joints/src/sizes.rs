//! How much of a joint's torque forms are.

use crate::causes::Form;
use crate::table::{Series, View};
use rayon::prelude::*;
use std::sync::Arc;

/// Products of each form's columns with each other, joint by joint, over the samples and the variance of the joint's torque.
pub(crate) struct Sizes(Vec<Vec<Vec<f64>>>);

impl Sizes {
    pub fn new(view: &View<'_>, forms: &[Form]) -> Self {
        let of = |form: &Form| {
            let series = view.series(&form.columns);
            view.scene.joints.iter().enumerate().map(|(j, joint)| products(&series, j, joint.torque)).collect()
        };
        Sizes(forms.par_iter().map(of).collect())
    }

    /// rms of a form's torque with these factors over the deviation of the joint's, where it is largest.
    pub fn share(&self, form: usize, factors: &[f64]) -> f64 {
        let square = |products: &Vec<f64>| {
            products.chunks_exact(factors.len()).zip(factors).map(|(row, f)| f * row.iter().zip(factors).map(|(p, f)| p * f).sum::<f64>()).sum()
        };
        self.0[form].iter().map(square).fold(0.0, f64::max).sqrt()
    }
}

/// Of the columns that a joint feels.
fn products(series: &[Arc<Series>], joint: usize, torque: f64) -> Vec<f64> {
    let felt = |s: &Arc<Series>| -> Vec<f64> { s.0.iter().filter_map(|piece| piece[joint].as_deref()).flatten().map(|x| x / torque).collect() };
    let felt: Vec<Vec<f64>> = series.iter().map(felt).collect();
    let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len().max(1) as f64;
    felt.iter().flat_map(|a| felt.iter().map(|b| product(a, b))).collect()
}
