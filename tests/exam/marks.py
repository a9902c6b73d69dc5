"""What an answer is worth against the truth."""

import math
from dataclasses import dataclass, field

# Effects whose parameters are counted together.
GROUPS = {
    "coulomb-friction": "friction", "hysteresis": "hysteresis", "cubic-stiffness": "springs", "asymmetric-stiffness": "springs", "dead-zone": "springs",
    "end-stop": "springs", "stiffness-drift": "springs", "measurement-delay": "delays", "channel-filter": "delays", "reflex-delay": "reflex",
}
# An amplitude of a tone whose phase wanders is no constant, nor the size of a noise.
UNSCORED = ("amplitude", "rms")


@dataclass
class Named:
    effect: str
    side: str
    axis: str
    probability: float | None
    beside: set
    right: bool


@dataclass
class Mark:
    truth: dict
    answer: dict | None
    error: str | None
    seconds: float
    named: list = field(default_factory=list)
    intervals: list = field(default_factory=list)  # (group, parameter, inside or None, relative error)

    @property
    def kind(self):
        return self.truth["kind"]

    @property
    def strength(self):
        return self.truth["class"]

    @property
    def foreign(self):
        return self.truth["generator"] != "challenge"

    @property
    def verdict(self):
        return self.answer["verdict"] if self.answer else None

    @property
    def first_right(self):
        """Whether what is hidden is named first, or as not to be told from the first."""
        return bool(self.named) and self.named[0].right

    @property
    def itself(self):
        """Whether the first name is the thing itself."""
        return self.first_right and self.named[0].effect in self.truth["effects"][0]["names"]

    @property
    def both(self):
        hit = lambda effect: any(n.effect in effect["names"] or n.beside & set(effect["names"]) for n in self.named)
        return self.answer is not None and all(hit(effect) for effect in self.truth["effects"])

    @property
    def exactly(self):
        return self.both and len(self.named) == len(self.truth["effects"])

    @property
    def confident_wrong(self):
        """A wrong name above 0.9 with no other beside it; no answer at all is none."""
        return any(not n.right and (n.probability or 0.0) > 0.9 and not n.beside for n in self.named)

    @property
    def on_the_limb(self):
        """Whether anything that is not the robot's is named."""
        return any(n.side not in ("robot", "actuator") for n in self.named)

    @property
    def over_true(self):
        """Held-out error of the extended model over the true model's, all outputs together."""
        if not self.answer or not self.truth["true_model"]:
            return None
        told, true = self.answer["extended"]["held_out"]["nrmse"], self.truth["true_model"]["nrmse"]
        if any(v is None for v in told):
            return math.inf
        return math.sqrt(sum(v * v for v in told) / sum(v * v for v in true))


def mark(truth, found):
    """The mark of one answer."""
    answer = found["result"]
    out = Mark(truth, answer, found["error"], found["seconds"])
    if answer is None:
        return out
    names = {name for effect in truth["effects"] for name in effect["names"]}
    groups = [set(group["effects"]) for group in answer["confusable"]]
    for cause in answer["causes"]:
        effect = cause["effect"]
        # What every limb does by itself is neither asked for nor wrong where it is large enough to be seen.
        if effect in truth["present"] and effect not in names:
            continue
        beside = set().union(*(group for group in groups if effect in group)) - {effect}
        right = effect in names or bool(beside & names)
        out.named.append(Named(effect, cause["site"]["side"], cause["site"]["axis"], cause["probability"], beside, right))
    # Under another name that means the same the numbers mean something else.
    if truth["kind"] in ("single", "against", "noise") and out.itself and out.named[0].effect == truth["effects"][0]["effect"]:
        cause = next(c for c in answer["causes"] if c["effect"] == out.named[0].effect)
        out.intervals = list(intervals(truth["effects"][0], cause))
    return out


def intervals(effect, cause):
    for name, true in effect["parameters"].items():
        if name in UNSCORED or true is None:
            continue
        found = next((p for p in cause["parameters"] if p["name"].startswith(name)), None)
        value = found and found["value"]
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            continue
        ci = found.get("ci95")
        # Which of two channels is the late one is a matter of words.
        if name == "delay" and value < 0:
            value, ci = -value, ci and [-ci[1], -ci[0]]
        inside = None if ci is None else ci[0] <= true <= ci[1]
        yield GROUPS.get(effect["effect"], "others"), f"{effect['effect']} {name}", inside, abs(value / true - 1)
