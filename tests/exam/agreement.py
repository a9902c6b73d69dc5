"""Do the numbers of an answer agree with each other? Whatever the judge, each of these holds of a right one.

Each check returns a sentence where it is violated.
"""

import math
import re

UNSURE = 0.6  # of a name that the program doubts
TOLERANCE = 0.01  # the program's default
ROUNDING = 1e-9
# They leave no trace that a prediction of held-out data could have: noise, and what happened once.
UNPREDICTABLE = ("limb-noise", "quantisation", "transient-disturbance")


def numbers(values):
    return [v for v in values if v is not None]


def together(values):
    """rms over outputs; a prediction that is not finite is infinitely bad."""
    return math.inf if any(v is None for v in values) else math.sqrt(sum(v * v for v in values) / len(values))


def checks(answer, periodic=False):
    """All sentences on one answer."""
    return [sentence for check in ALL for sentence in check(answer)] + ([s for s in harmonics(answer)] if periodic else [])


def adequate(answer):
    floor = answer["noise_floor"]["nrmse"]
    if answer["verdict"] == "adequate":
        for told, least in zip(answer["extended"]["held_out"]["nrmse"], floor):
            if told is None or (least is not None and told - least > TOLERANCE):
                yield f"adequate with an error of {told} above a floor of {least}"


def runs_better(gain):
    return together(gain["nrmse_after"]) < together(gain["nrmse_before"])


def worsening(answer):
    for cause in answer["causes"]:
        gain, effect = cause["gain"], cause["effect"]
        interval = gain["log_likelihood_ci95"]
        may_be_nothing = interval is None or interval[0] <= 0
        if effect not in UNPREDICTABLE and may_be_nothing and not runs_better(gain) and not (interval is None and (gain["log_likelihood"] or 0) > 0):
            yield f"{effect} named, and neither the likelihood ({gain['log_likelihood']}, {interval}) nor the free run of the held-out part is better with it"


def contradicted(answer):
    """No name is sure that the held-out part speaks against beyond its interval, whatever the free run says."""
    for cause in answer["causes"]:
        interval = cause["gain"]["log_likelihood_ci95"]
        if interval is not None and interval[1] < 0 and cause["probability"] > UNSURE:
            yield f"{cause['effect']} at {cause['probability']:.3f}, and the held-out part is less likely with it ({interval})"


def free_run(answer):
    for cause in answer["causes"]:
        gain, effect = cause["gain"], cause["effect"]
        if effect not in UNPREDICTABLE and not runs_better(gain):
            yield f"{effect} named, and the free run is no better with it"


def ordered(answer):
    shares = [(c["effect"], c["gain"]["explained_fraction"]) for c in answer["causes"] if c["effect"] not in UNPREDICTABLE and c["gain"]["explained_fraction"] is not None]
    for (first, more), (second, less) in zip(shares, shares[1:]):
        if less > more + ROUNDING:
            yield f"{first} ({more:.3f}) listed before {second}, which explains more ({less:.3f})"


def not_worse(answer):
    before, after = answer["baseline"]["held_out"]["nrmse"], answer["extended"]["held_out"]["nrmse"]
    if together(after) > together(before) * (1 + ROUNDING):
        yield f"the extended model is worse than the baseline: {after} against {before}"
    if not answer["causes"]:
        same = all(a == b or (a is not None and b is not None and abs(a - b) <= ROUNDING * abs(b)) for a, b in zip(after, before))
        value = lambda model: {p["name"]: p["value"] for p in model["parameters"]}
        if not same or any(value(answer["baseline"]).get(name) != v for name, v in value(answer["extended"]).items()):
            yield "nothing named, and the extended model is not the baseline"


def explained(answer):
    if answer["verdict"] == "explained" and together(answer["extended"]["held_out"]["nrmse"]) > together(answer["baseline"]["held_out"]["nrmse"]) * (1 + ROUNDING):
        yield "explained, and the free run of the extended model is worse than the baseline's"


def floor_lowest(answer):
    for p, least in enumerate(answer["noise_floor"]["nrmse"]):
        told = [answer[model]["held_out"]["nrmse"][p] for model in ("baseline", "extended")]
        told += [error[p] for cause in answer["causes"] for error in (cause["gain"]["nrmse_before"], cause["gain"]["nrmse_after"])]
        if least is not None and numbers(told) and least > min(numbers(told)) * (1 + ROUNDING):
            yield f"a floor of {least:.4g} above an error of {min(numbers(told)):.4g}"


def physical(answer):
    for model in ("baseline", "extended"):
        for parameter in answer[model]["parameters"]:
            parts = parameter["name"].split("_")
            diagonal = len(parts) == 1 or (len(parts) == 3 and parts[1] == parts[2])
            value = parameter["value"]
            if parts[0] in ("M", "K") and diagonal and isinstance(value, (int, float)) and value < 0 and not parameter.get("flag"):
                interval = parameter.get("ci95")
                # A stiffness that may well be none is not a negative one.
                if interval is None or interval[1] is None or interval[1] < 0:
                    error = parameter.get("std_error")
                    if error is None or value + 2 * error < 0:
                        yield f"{model}: {parameter['name']} = {value:.4g}, and no flag"


def computed(answer):
    whole = [("residual_white", answer["extended"].get("residual_white"), bool)]
    for name, value, kind in whole:
        if value is not None and not isinstance(value, kind):
            yield f"{name} is {value!r}"
    for cause in answer["causes"]:
        for name in ("probability", "p_value"):
            value = cause[name]
            if value is not None and not 0 <= value <= 1:
                yield f"{cause['effect']}: {name} is {value}"
        for parameter in cause["parameters"]:
            value, interval = parameter["value"], parameter.get("ci95")
            if isinstance(value, (int, float)) and not isinstance(value, bool) and interval is not None and None not in interval:
                if not interval[0] <= value <= interval[1]:
                    yield f"{cause['effect']}: {parameter['name']} = {value:.4g} outside its own interval"
                half = (interval[1] - interval[0]) / 2 / abs(value) if value else 0.0
                if any(abs(half - share) < 1e-9 for share in (0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5)):
                    yield f"{cause['effect']}: the interval of {parameter['name']} is exactly ±{100 * half:.0f} %"


def shares(answer):
    d = answer["discrepancy"]
    four = [d[name] for name in ("linear_share", "nonlinear_share", "time_varying_share", "noise_share")]
    if None not in four and abs(sum(four) - 1) > 1e-6:
        yield f"shares of the discrepancy that add up to {sum(four):.4f}"
    for cause in answer["causes"]:
        share = cause["gain"]["explained_fraction"]
        if share is not None and share > 1 + ROUNDING:
            yield f"{cause['effect']} explains {share:.4f} of all there is to gain"


def harmonics(answer):
    """On a recording whose input repeats."""
    for cause in answer["causes"]:
        if cause["effect"] == "periodic-disturbance":
            yield "a disturbance named at a harmonic of the input"


def fitted(files, answer):
    """Files, or the stretch of the only one, that the baseline was fitted to, as arguments of `ndof fit`."""
    stretch = re.fullmatch(r"([0-9.]+) to ([0-9.]+) s", answer["split"]["estimation"]) if answer else None
    if len(files) > 1:
        return files[: len(files) - math.ceil(len(files) / 3)]
    return [*files, "--start", stretch[1], "--stop", stretch[2]] if stretch else files


def like_the_fit(answer, fit):
    """Whether the baseline is what `ndof fit` finds in the same data, within 2 % and three standard errors; none where there is no fit."""
    if fit is None:
        return None
    told = {p["name"]: p for p in fit["parameters"]}
    for p in answer["baseline"]["parameters"]:
        other = told.get(p["name"])
        if other is None or None in (p["value"], other["value"]):
            continue
        error = max(p.get("std_error") or 0.0, other.get("std_error") or 0.0)
        if abs(p["value"] - other["value"]) > 0.02 * abs(other["value"]) + 3 * error:
            return False
    return True


ALL = (adequate, worsening, contradicted, free_run, ordered, not_worse, explained, floor_lowest, physical, computed, shares)
NAMES = {
    adequate: "no 'adequate' above the floor by more than the tolerance", worsening: "a named cause's removal worsens the held-out likelihood beyond its interval, or the free run",
    contradicted: "no name above 0.6 that the held-out likelihood speaks against",
    free_run: "a named cause makes the free run better", explained: "nothing called explained whose free run is worse than the baseline's",
    ordered: "causes in the order of what they explain", not_worse: "the extended model's free run no worse than the baseline's, and equal to it where nothing is named",
    floor_lowest: "the floor above no reported error", physical: "masses and stiffnesses not negative, or flagged", computed: "numbers computed, or null",
    shares: "shares of the discrepancy add up, and none is above all there is", harmonics: "harmonics of the input never a cause",
}
