//! Models by their names, `inertia-damping-stiffness+delay`, and how those that contain each other compare.

use super::evidence::Evidence;
use super::{result as schema, starts};
use crate::error::AnalysisError;
use crate::result::number;
use crate::suggest::nearest;
use ndof_models::blocks::{self, BLOCKS, BlockCard, Composite};
use ndof_models::{Fit, Held, InertiaDampingStiffnessModel, NullLaw, ParametricModel, Sampling, WeightedFit, likelihood_ratio};

/// The model that blocks are added to.
pub const MODEL: &str = "inertia-damping-stiffness";

/// The blocks of a model's name.
pub(super) fn blocks_of(name: &str) -> Result<Vec<&'static BlockCard>, AnalysisError> {
    let names = || std::iter::once(MODEL).chain(BLOCKS.iter().map(BlockCard::name));
    let unknown = |part: &str| AnalysisError::UnknownModel {
        name: name.to_owned(),
        suggestion: nearest(part, names()),
        available: format!("{MODEL}, and behind a + any of {}", BLOCKS.iter().map(BlockCard::name).collect::<Vec<_>>().join(", ")),
    };
    let mut parts = name.split('+').map(str::trim);
    match parts.next() {
        Some(first) if first == MODEL => {
            let mut cards: Vec<&'static BlockCard> = Vec::new();
            for part in parts {
                let card = blocks::find(part).ok_or_else(|| unknown(part))?;
                if cards.iter().any(|known| known.name() == card.name()) {
                    return Err(AnalysisError::RepeatedBlock { name: name.to_owned(), block: card.name().to_owned() });
                }
                cards.push(card);
            }
            Ok(cards)
        }
        other => Err(unknown(other.unwrap_or_default())),
    }
}

/// Fits of the models that are part of this one, of this one, which begins where it is fitted as well, and of each single block where `all`; likelihood
/// ratios against the largest of those before that each contains.
pub(super) fn compared_models(
    settings: &WeightedFit,
    (model, sampling): (&InertiaDampingStiffnessModel, Sampling),
    evidence: &Evidence<'_>,
    (cards, begin): (&[&'static BlockCard], &[f64]),
    all: bool,
) -> Vec<schema::ComparedModel> {
    let response = &*evidence.response;
    if cards.is_empty() && !all {
        return Vec::new();
    }
    let mut sets: Vec<Vec<&'static BlockCard>> = vec![Vec::new()];
    sets.extend(cards.iter().map(|card| vec![*card]));
    if all {
        sets.extend(BLOCKS.iter().map(|card| vec![card]));
    }
    sets.push(cards.to_vec());
    let names = |set: &[&BlockCard]| set.iter().map(|c| c.name()).collect::<Vec<_>>();
    let mut done: Vec<(Vec<&'static str>, Fit)> = Vec::new();
    let mut failed = Vec::new();
    for set in sets {
        if done.iter().any(|(known, _)| *known == names(&set)) {
            continue;
        }
        let composite = Composite::of_cards(model, &set);
        let mut starts = starts::starts(model, &composite, &set, evidence, settings.band_hz).unwrap_or_default();
        // From what it contains, too.
        let inside = done.iter().filter(|(own, _)| own.iter().all(|name| names(&set).contains(name)));
        starts.extend(inside.flat_map(|(_, fit)| composite.starts(&fit.theta[..model.parameters().len()])));
        if names(&set) == names(cards) {
            starts.push(begin.to_vec());
        }
        let composite = Held { model: composite, sampling };
        match settings.fit_from(&composite, response, &starts) {
            Ok(fit) => done.push((names(&set), fit)),
            // A rival that the data cannot carry is said, and takes nothing from the others.
            Err(error) => failed.push(schema::ComparedModel {
                model: composite.name().to_owned(),
                parameters: starts.first().map_or(0, Vec::len),
                failed: Some(error.to_string()),
                ..schema::ComparedModel::default()
            }),
        }
    }
    if done.len() + failed.len() < 2 {
        return Vec::new();
    }
    let compared = |(k, (own, fit)): (usize, &(Vec<&'static str>, Fit))| {
        let inside = done[..k].iter().filter(|(other, _)| other.len() < own.len() && other.iter().all(|name| own.contains(name)));
        let best = inside.max_by(|a, b| a.0.len().cmp(&b.0.len()).then(b.1.chi2.total_cmp(&a.1.chi2)));
        schema::ComparedModel {
            model: fit.model.clone(),
            parameters: fit.theta.len(),
            chi2: number(fit.chi2),
            chi2_reduced: number(fit.chi2_reduced),
            aic: number(fit.aic()),
            bic: number(fit.bic()),
            failed: None,
            likelihood_ratio: best.map(|(inside, smaller)| {
                let added: Vec<_> = own.iter().filter(|name| !inside.contains(name)).filter_map(|name| blocks::find(name)).map(|card| (card.block)()).collect();
                let law = NullLaw::of(&added.iter().map(AsRef::as_ref).collect::<Vec<_>>());
                let ratio = likelihood_ratio(smaller, fit).under(law);
                schema::LikelihoodRatio {
                    against: smaller.model.clone(),
                    statistic: number(ratio.statistic),
                    degrees_of_freedom: ratio.parameters,
                    p_value: number(ratio.p_value),
                    law: law.name().to_owned(),
                }
            }),
        }
    };
    done.iter().enumerate().map(compared).chain(failed).collect()
}
