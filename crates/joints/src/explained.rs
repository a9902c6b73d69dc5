//! What each cause explains beside the causes that explain more.

use crate::held_out::{Sum, gain};
use crate::model::Model;
use crate::table::View;
use rayon::prelude::*;

/// Log-likelihood of the held-out part that each form of a model gains beside the forms that gain more.
///
/// The form that gains least beside all others is taken away, what stays is fitted anew, and so on until none is left. These gains add up to that of all
/// forms; those beside all others do not, as friction of one kind is in part the damping of another.
pub(crate) fn explained(fitted: &View<'_>, held: &View<'_>, model: &Model) -> Vec<Sum> {
    let mut left: Vec<usize> = (0..model.forms.len()).collect();
    let mut gains = vec![None; left.len()];
    let mut whole = model.clone();
    while !left.is_empty() {
        let one_less = |k: usize| {
            let less = whole.without(fitted, k);
            (k, gain(held, &less, &whole), less)
        };
        let all: Vec<(usize, Sum, Model)> = (0..left.len()).into_par_iter().map(one_less).collect();
        let Some((k, gained, less)) = all.into_iter().min_by(|a, b| a.1.value.total_cmp(&b.1.value)) else { break };
        gains[left.remove(k)] = Some(gained);
        whole = less;
    }
    gains.into_iter().flatten().collect()
}
