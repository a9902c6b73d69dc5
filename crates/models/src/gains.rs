//! More inputs than motions: efforts that add up, each with a gain of its own.

use ndarray::Array2;

/// What several inputs make of the effort along each axis: F = W u, W axes × inputs.
///
/// One input of each axis is the measure of all others: its column of W is that of the identity. All other columns are parameters, for what an
/// actuator does to an axis that it is not meant for is a finding too.
///
/// ```
/// use ndof_models::Gains;
/// let gains = Gains::new(2, vec!["force_x".into(), "force_y".into(), "motor".into()], vec![0, 1]);
/// let w = gains.matrix(&[0.7, -0.1]);
/// assert_eq!(w, ndarray::arr2(&[[1.0, 0.0, 0.7], [0.0, 1.0, -0.1]]));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gains {
    pub(crate) axes: usize,
    pub(crate) inputs: Vec<String>,
    pub(crate) reference: Vec<usize>,
    others: Vec<usize>,
}

impl Gains {
    /// Of `inputs` on so many axes; `reference` says of each axis which input has the gain 1 there.
    pub fn new(axes: usize, inputs: Vec<String>, reference: Vec<usize>) -> Self {
        let others = (0..inputs.len()).filter(|input| !reference.contains(input)).collect();
        Gains { axes, inputs, reference, others }
    }

    /// Of each axis the input whose gain is 1.
    pub fn reference(&self) -> &[usize] {
        &self.reference
    }

    /// The inputs whose gains are parameters.
    pub fn others(&self) -> &[usize] {
        &self.others
    }

    /// How many inputs there are.
    pub fn inputs(&self) -> usize {
        self.inputs.len()
    }

    /// How many parameters: one for each axis and each input that is no reference.
    pub fn count(&self) -> usize {
        self.axes * self.others.len()
    }

    /// Axis and input of each parameter: input after input, axis after axis.
    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.others.iter().flat_map(|&input| (0..self.axes).map(move |axis| (axis, input)))
    }

    /// W of its parameters.
    pub fn matrix(&self, parameters: &[f64]) -> Array2<f64> {
        let mut w = Array2::zeros((self.axes, self.inputs.len()));
        self.reference.iter().enumerate().for_each(|(axis, &input)| w[[axis, input]] = 1.0);
        self.places().zip(parameters).for_each(|(at, gain)| w[at] = *gain);
        w
    }
}
