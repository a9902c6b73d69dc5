"""What an answer may say instead of what is hidden, and why: the one dictionary of allowed synonyms.

Each rule is (name, reason, f(truth, cause) -> [(effect, axes or None for any)]). A name that a rule allows counts as right and as *confusable*.
"""


def one(truth):
    return len(truth["joints"]) == 1


def first(truth, cause):
    return cause["axis"] == truth["joints"][0]


def last(truth, cause):
    return cause["axis"] == truth["joints"][-1]


def part(cause):
    return cause["variant"] if cause["effect"] == "link-parameters" else None


def steady(truth, cause):
    """Whether what changes with the torque and what is constant differ by less than the torque's noise."""
    joint = truth["joints"].index(cause["axis"])
    return truth["torque_spread"][joint] * cause["share"] < truth["noise_share"]


def scaled(truth, cause):
    if not one(truth):
        return []
    if cause["effect"] == "torque-scale":
        return [("link-parameters", truth["joints"])]
    return [("torque-scale", truth["joints"])] if part(cause) == "mass" else []


def carried(truth, cause):
    if cause["effect"] == "payload":
        return [("link-parameters", truth["joints"][-1:])]
    return [("payload", None)] if part(cause) and last(truth, cause) else []


def turned(truth, cause):
    """About the first joint a rotor's inertia is the link's; gravity tells a mass from it unless the axis is upright, as the six-joint arm's."""
    upright = truth["robot"] == "six"
    if cause["effect"] == "motor-inertia" and first(truth, cause):
        return [("link-parameters", truth["joints"][:1])]
    return [("motor-inertia", truth["joints"][:1])] if part(cause) and first(truth, cause) and (upright or part(cause) == "inertia") else []


def leaning(truth, cause):
    return [("link-parameters", truth["joints"])] if one(truth) and cause["effect"] == "base-tilt" else []


def loaded(truth, cause):
    other = {"load-friction": "coulomb-friction", "coulomb-friction": "load-friction", "torque-scale": "torque-offset", "torque-offset": "torque-scale"}.get(cause["effect"])
    return [(other, [cause["axis"]])] if other and steady(truth, cause) else []


def without_a_robot(truth, cause):
    """Beside a simulation of unknown inside a mass is what the joints above it carry; a tilt is a mass beside its line."""
    if cause["effect"] == "link-parameters":
        return [("link-parameters", truth["joints"][: truth["joints"].index(cause["axis"]) + 1])]
    return [("link-parameters", truth["joints"])] if cause["effect"] in ("payload", "base-tilt") else []


RULES = (
    ("one joint, scale", "all torques of a single link are in proportion to its mass with its inertia", scaled),
    ("last link", "what is fixed to the last link is part of it", carried),
    ("first joint's inertia", "only the sum of rotor and link is felt about a fixed axis", turned),
    ("one joint, tilt", "a tilted base is a centre beside its line", leaning),
    ("steady load", "the joint's torque varies so little that what is proportional to it and what is constant differ by less than the torque noise", loaded),
)
COLUMNS = RULES + (("no robot file", "without the robot's links only the joints that carry a mass can be said", without_a_robot),)


def allowed(truth, cause, door):
    """(effect, axes or None, rule) of what else is right, the cause itself first."""
    axes = None if cause["axis"] == "" else [cause["axis"]]
    out = [(cause["effect"], axes, "")]
    for name, _, rule in COLUMNS if door == "columns" else RULES:
        out += [(effect, where, name) for effect, where in rule(truth, cause)]
    return out
