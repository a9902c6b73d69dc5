//! What the order of a controller's tick makes of a recording, and no recording tells.

use crate::result::{Cause, UNSURE};
use ndof_models::effects::Value;
use std::f64::consts::{SQRT_2, TAU};

/// Says of a delay or filter that may be of half a sample or less that a loop which reads its sensors before or after it writes its command makes as much:
/// no such name is sure.
pub(super) fn doubt(causes: &mut [Cause], sample_rate_hz: f64) {
    for cause in causes.iter_mut().filter(|cause| least_delay_s(cause).is_some_and(|least| least <= 0.5 / sample_rate_hz)) {
        cause.believe_at_most(UNSURE);
        cause.evidence.push(
            "no more than half a sample: a loop that reads its sensors before it writes its command, or after, makes as much, and no recording tells in which order"
                .to_owned(),
        );
    }
}

/// The shortest delay in the interval of a channel's delay, or of the delay at low frequencies of its low-pass.
fn least_delay_s(cause: &Cause) -> Option<f64> {
    let parameter = |name: &str| cause.parameters.iter().find(|p| p.name == name);
    let least = |[low, high]: [f64; 2]| if low <= 0.0 && high >= 0.0 { 0.0 } else { low.abs().min(high.abs()) };
    match cause.effect.as_str() {
        "measurement-delay" => parameter("delay_s")?.ci95.map(least),
        "channel-filter" => {
            let order = parameter("order").map(|p| &p.value);
            let share = if matches!(order, Some(Value::Number(2.0))) { SQRT_2 } else { 1.0 };
            parameter("cutoff_hz")?.ci95.map(|[_, high]| share / (TAU * high))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::CauseParameter;

    fn doubted(effect: &str, name: &str, ci95: [f64; 2]) -> bool {
        let gain = serde_json::json!({ "nrmse_before": [1.0], "nrmse_after": [0.1], "vaf_before": [0.0], "vaf_after": [99.0], "log_likelihood": null,
            "log_likelihood_ci95": null, "explained_fraction": 1.0, "explained_fraction_ci95": null, "delta_bic": -9.0 });
        let cause = serde_json::json!({ "effect": effect, "site": { "side": "sensor", "axis": "" }, "parameters": [], "probability": 0.99, "p_value": 0.0,
            "gain": gain, "evidence": [] });
        let mut cause: Cause = serde_json::from_value(cause).expect("a cause");
        let value = Value::Number(0.5 * (ci95[0] + ci95[1]));
        cause.parameters = vec![CauseParameter { name: name.to_owned(), unit: String::new(), value, ci95: Some(ci95) }];
        cause.at_most = 1.0;
        let mut causes = [cause];
        doubt(&mut causes, 500.0);
        assert_eq!(causes[0].probability <= UNSURE, !causes[0].evidence.is_empty());
        causes[0].probability <= UNSURE
    }

    #[test]
    fn half_a_sample_is_doubted_and_what_is_surely_more_is_not() {
        assert!(doubted("measurement-delay", "delay_s", [0.9e-3, 1.1e-3]) && doubted("measurement-delay", "delay_s", [-1.2e-3, -0.8e-3]));
        assert!(!doubted("measurement-delay", "delay_s", [1.1e-3, 1.3e-3]) && !doubted("measurement-delay", "delay_s", [-6e-3, -5e-3]));
        // 1/(2π 1 ms) is 159 Hz.
        assert!(doubted("channel-filter", "cutoff_hz", [150.0, 170.0]) && !doubted("channel-filter", "cutoff_hz", [20.0, 25.0]));
        assert!(!doubted("coulomb-friction", "level_nm", [0.0, 1e-4]));
    }
}
