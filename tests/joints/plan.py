"""Which question a seed is: robot, what is hidden, how strongly; a hundred for tuning, a hundred held back, and a hundred of the families for tuning
with other seeds, to try a change on."""

from dataclasses import dataclass
from random import Random

import causes

ROBOTS = ("pendulum", "planar", "six")
HALF = 100  # seeds of each; below it is tuning
NOTHING, PAIRS = 20, 20  # of a half; the rest has one thing hidden

# Nobody can tell these from each other on one joint, so they are no pair there.
ALIKE_ON_ONE_JOINT = {"torque-scale", "link-parameters", "payload", "base-tilt", "motor-inertia"}
# What is put at the motor of a joint in series must not be steep: the rotor is light.
BESIDE_SERIES = {"viscous-friction", "torque-offset", "torque-scale", "torque-delay", "payload", "link-parameters", "base-tilt"}
ALIKE_AT_A_JOINT = ({"coulomb-friction", "gear-hysteresis"}, {"coulomb-friction", "load-friction"}, {"gear-hysteresis", "load-friction"}, {"end-stop", "cable-force"}, {"payload", "link-parameters"})
SERIES = ("joint-flexibility", "backlash")


@dataclass(frozen=True)
class Question:
    seed: int
    half: str
    robot: str
    hidden: tuple  # of (effect, strength)
    same_joint: bool

    @property
    def kind(self):
        return ("nothing", "single", "pair")[len(self.hidden)]


def held_back(effect, robot):
    """Families that only the held-back half has: at most one robot of an effect, and play between motor and link altogether."""
    return effect == "backlash" or (causes.EFFECTS.index(effect) + ROBOTS.index(robot)) % 4 == 1


def families(half):
    return [(e, r) for e in causes.EFFECTS for r in ROBOTS if half == "held-back" or not held_back(e, r)]


def singles(half, count):
    """Each family in turn, clear and weak in turn; the second time round the other strength."""
    found = families(half)
    return [(*found[i % len(found)], ("clear", "weak")[(i + i // len(found) + (len(found) % 2) * (i // len(found))) % 2]) for i in range(count)]


def pair(draw, half, robot):
    """Two effects that can be told apart, and whether they sit at one joint."""
    allowed = [e for e, r in families(half) if r == robot]
    while True:
        two = draw.sample(allowed, 2)
        same = robot == "pendulum" or draw.random() < 0.4
        if robot == "pendulum" and set(two) <= ALIKE_ON_ONE_JOINT:
            continue
        if set(two) in ALIKE_AT_A_JOINT and (same or "payload" in two):
            continue
        series = [e for e in two if e in SERIES]
        if same and series and (len(series) == 2 or not set(two) - set(series) <= BESIDE_SERIES):
            continue
        return tuple(zip(two, ("clear", draw.choice(("clear", "clear", "weak"))))), same


def questions():
    out = []
    for half, first in (("tuning", 0), ("held-back", HALF), ("practice", 2 * HALF)):
        draw = Random(half)
        made = [(ROBOTS[i % 3], (), False) for i in range(NOTHING)]
        made += [(robot, ((effect, strength),), False) for effect, robot, strength in singles(half, HALF - NOTHING - PAIRS)]
        for i in range(PAIRS):
            robot = ROBOTS[(i + 1) % 3]
            made.append((robot, *pair(draw, half, robot)))
        draw.shuffle(made)
        out += [Question(first + i, half, *q) for i, q in enumerate(made)]
    return out
