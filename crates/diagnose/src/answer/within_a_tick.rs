//! What a recording does not tell of its clock: what efforts do between samples, and in which order a controller's tick reads and writes.

use crate::result::{Cause, UNSURE};
use ndof_models::effects::{Latency, Value};

/// Takes half a sample into the interval of what makes channels late, where nothing tells the hold of these `efforts`: if they stay until their next sample, motion follows that
/// late. And says of what may be of half a sample or less that a loop which reads its sensors before or after it writes its command makes as much: no such name is sure.
pub(super) fn told(cause: &mut Cause, latency: &Latency, efforts: Option<&[String]>, half_s: f64) {
    let named = |name: &str| cause.parameters.iter().find(|p| p.name == name);
    let order = named("order").map_or(1.0, |p| if let Value::Number(order) = p.value { order } else { 1.0 });
    let channels = named("channel").map_or("", |p| if let Value::Text(channels) = &p.value { channels } else { "" });
    let effort_is_late = efforts.is_some_and(|efforts| channels.split(", ").any(|channel| efforts.iter().any(|effort| effort == channel)));
    // A clock that runs away is no order of a tick.
    let grows = latency.grows_by.and_then(named).and_then(|p| p.ci95).is_some_and(|[low, high]| low > 0.0 || high < 0.0);
    let own = cause.parameters.iter_mut().find(|p| p.name == latency.parameter).map(|p| &mut p.ci95);
    let Some((ci95, [low, high])) = own.and_then(|ci95| ci95.map(|ends| (ci95, ends))) else { return };
    let turned = |ends: [f64; 2]| {
        let [a, b] = ends.map(|end| (latency.turned)(end, order));
        [a.min(b), a.max(b)]
    };
    let [mut least_s, mut most_s] = turned([low, high]);
    if efforts.is_some() {
        if effort_is_late {
            most_s += half_s;
        } else {
            least_s -= half_s;
        }
        // A filter that may take no time has any corner.
        *ci95 = (least_s > latency.beyond_s).then(|| turned([least_s, most_s]));
        cause.evidence.push(
            "beside a delay the data do not tell whether the effort stays until its next sample, which makes half a sample of it: the interval holds both, and telling the hold narrows it"
                .to_owned(),
        );
    }
    let nearest_s = if least_s <= 0.0 && most_s >= 0.0 { 0.0 } else { least_s.abs().min(most_s.abs()) };
    if !grows && nearest_s <= half_s {
        cause.believe_at_most(UNSURE);
        cause.evidence.push(
            "no more than half a sample: a loop that reads its sensors before it writes its command, or after, makes as much, and no recording tells in which order"
                .to_owned(),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::CauseParameter;
    use ndof_models::effects::find;

    /// A cause at 500 Hz, of such parameters with their intervals, of such a channel, beside efforts of which nothing tells the hold if there are any.
    fn after(effect: &str, parameters: &[(&str, [f64; 2])], channel: &str, efforts: Option<&[String]>) -> Cause {
        let gain = serde_json::json!({ "nrmse_before": [1.0], "nrmse_after": [0.1], "vaf_before": [0.0], "vaf_after": [99.0], "log_likelihood": null,
            "log_likelihood_ci95": null, "explained_fraction": 1.0, "explained_fraction_ci95": null, "delta_bic": -9.0 });
        let cause = serde_json::json!({ "effect": effect, "site": { "side": "sensor", "axis": "" }, "parameters": [], "probability": 0.99, "p_value": 0.0,
            "gain": gain, "evidence": [] });
        let mut cause: Cause = serde_json::from_value(cause).expect("a cause");
        let parameter = |name: &str, value, ci95| CauseParameter { name: name.to_owned(), unit: String::new(), value, ci95 };
        cause.parameters = parameters.iter().map(|(name, ends)| parameter(name, Value::Number(0.5 * (ends[0] + ends[1])), Some(*ends))).collect();
        cause.parameters.push(parameter("channel", Value::Text(channel.to_owned()), None));
        cause.at_most = 1.0;
        let latency = find(effect).expect("an effect").latency.expect("one that makes channels late");
        told(&mut cause, &latency, efforts, 1e-3);
        cause
    }

    fn doubted(effect: &str, parameters: &[(&str, [f64; 2])]) -> bool {
        let cause = after(effect, parameters, "pos_x", None);
        assert_eq!(cause.probability <= UNSURE, !cause.evidence.is_empty());
        cause.probability <= UNSURE
    }

    #[test]
    fn half_a_sample_is_doubted_and_what_is_surely_more_is_not() {
        let delay = |ends: [f64; 2]| doubted("measurement-delay", &[("delay_s", ends)]);
        assert!(delay([0.9e-3, 1.1e-3]) && delay([-1.2e-3, -0.8e-3]) && delay([-1.5e-3, 1.5e-3]));
        assert!(!delay([1.1e-3, 1.3e-3]) && !delay([-6e-3, -5e-3]));
        // Half a sample at the beginning, and more with every second.
        let growing = |drift: [f64; 2]| doubted("measurement-delay", &[("delay_s", [-4e-4, 1e-4]), ("drift_s_per_s", drift)]);
        assert!(!growing([2.9e-4, 3.1e-4]) && growing([-1e-6, 1e-6]));
        // 1/(2π 1 ms) is 159 Hz, √2 of it 225 Hz.
        let filter = |order: f64, ends: [f64; 2]| doubted("channel-filter", &[("order", [order, order]), ("cutoff_hz", ends)]);
        assert!(filter(1.0, [150.0, 170.0]) && !filter(1.0, [20.0, 25.0]) && !filter(2.0, [150.0, 170.0]) && filter(2.0, [200.0, 230.0]));
    }

    /// Motion that a held effort makes half a sample late is less late by itself, and an effort that is late beside it is more.
    #[test]
    fn half_a_sample_is_in_the_interval_where_nothing_tells_the_hold() {
        let efforts = Some(&["force_x".to_owned()][..]);
        let widened = |effect: &str, parameter: (&str, [f64; 2]), channel: &str| after(effect, &[parameter], channel, efforts).parameters[0].ci95;
        let near = |found: Option<[f64; 2]>, [low, high]: [f64; 2]| found.is_some_and(|[a, b]| (a / low - 1.0).abs() < 1e-12 && (b / high - 1.0).abs() < 1e-12);
        assert!(near(widened("measurement-delay", ("delay_s", [6.5e-3, 7.4e-3]), "pos_x, pos_y"), [5.5e-3, 7.4e-3]));
        assert!(near(widened("measurement-delay", ("delay_s", [6.5e-3, 7.4e-3]), "force_x"), [6.5e-3, 8.4e-3]));
        // 20 to 25 Hz are 8.0 to 6.4 ms.
        let tau = std::f64::consts::TAU;
        assert!(near(widened("channel-filter", ("cutoff_hz", [20.0, 25.0]), "pos_x"), [20.0, 1.0 / (1.0 / 25.0 - 1e-3 * tau)]));
        assert!(near(widened("channel-filter", ("cutoff_hz", [20.0, 25.0]), "force_x"), [1.0 / (1.0 / 20.0 + 1e-3 * tau), 25.0]));
        assert_eq!(widened("channel-filter", ("cutoff_hz", [200.0, 250.0]), "pos_x"), None);
    }
}
