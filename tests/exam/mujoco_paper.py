"""Which questions MuJoCo's plants ask: families are a plant with an effect, and half of them are asked in the final run only."""

import random
from dataclasses import dataclass


@dataclass
class Question:
    id: str
    kind: str  # single, other, null
    plant: str
    name: str  # effect and form, or "nothing"
    effect: str | None
    form: str
    held_back: bool
    aim: str
    slow: float
    every: int  # ticks of the controller in a sample
    sampling: str  # mean, instant, held
    trials: int
    periodic: bool
    own: float


# Plant, effect, form where it is not the registry's.
TUNING = [
    ("slide", "coulomb-friction", ""), ("slide", "end-stop", "limit"), ("slide", "cubic-stiffness", "cords"), ("slide", "viscoelastic", ""),
    ("slide", "extra-resonance", ""), ("slide", "measurement-delay", "force"), ("slide", "stiffness-drift", ""), ("slide", "periodic-disturbance", ""),
    ("slide", "quantisation", ""), ("slide", "hysteresis", "slips"), ("slide", "channel-filter", "force"), ("planar", "coulomb-friction", ""),
    ("planar", "measurement-delay", "force"), ("planar", "sensor-misalignment", ""), ("planar", "asymmetric-stiffness", "slack"), ("planar", "viscoelastic", ""),
    ("ankle", "coulomb-friction", ""), ("ankle", "end-stop", "limit"), ("ankle", "posture-drift", ""), ("free", "coulomb-friction", ""), ("free", "measurement-delay", "force"),
]
FINAL = [
    ("slide", "end-stop", "contact"), ("slide", "dead-zone", ""), ("slide", "asymmetric-stiffness", "slack"), ("slide", "channel-filter", "actuator"),
    ("slide", "measurement-delay", "queue"), ("slide", "actuator-saturation", "clipped"), ("slide", "reflex-delay", "muscle"), ("slide", "transient-disturbance", "knock"),
    ("slide", "posture-drift", ""), ("pendulum", "coulomb-friction", ""), ("pendulum", "end-stop", "limit"), ("pendulum", "viscoelastic", ""),
    ("pendulum", "measurement-delay", "force"), ("pendulum", "hysteresis", "slips"), ("pendulum", "extra-resonance", ""), ("arm", "coulomb-friction", "joint"),
    ("arm", "viscoelastic", "joint"), ("arm", "measurement-delay", "force"), ("planar", "extra-resonance", ""), ("planar", "hysteresis", "slips"),
    ("planar", "stiffness-drift", ""), ("planar", "dead-zone", ""), ("ankle", "dead-zone", ""), ("ankle", "stiffness-drift", ""), ("free", "hysteresis", "slips"), ("free", "extra-resonance", ""),
]
# Forms that the registry has.
OWN = ("", "force", "queue", "clipped", "knock")
# A wall at rest is a spring of two slopes: both names are right.
NAMES = {
    "asymmetric-stiffness": ["asymmetric-stiffness", "end-stop"],
    "posture-drift": ["posture-drift", "sensor-offset-drift"],
}


def paper(which):
    draw = random.Random({"tuning": 5003, "practice": 41_011, "final": 90_017}[which])
    questions = []

    def ask(kind, plant, effect, form, aim):
        slow = draw.choice([0.5, 1, 1, 1, 1, 2, 4, 8]) if plant != "free" else draw.choice([0.5, 1])
        sampling = draw.choice(["mean", "instant", "held"] if plant in ("slide", "pendulum") else ["mean", "instant"])
        every = draw.choice([1, 2, 2, 4, 5] if slow < 8 else [5]) if plant != "ankle" else draw.choice([1, 2])
        if form in ("actuator", "queue", "clipped"):
            sampling, every = "mean", min(every, 2)
        questions.append(Question(
            id=f"mujoco-{which}-{len(questions):03d}", kind=kind, plant=plant, name=(effect or "nothing") + (f"/{form}" if form else ""), effect=effect, form=form,
            held_back=which == "final", aim=aim, slow=slow, every=every, sampling=sampling, trials=draw.choice([1, 1, 3]),
            periodic=plant in ("slide", "ankle") and draw.random() < 0.25, own=draw.choice([0.3, 1.0]) if effect is None else 1.0,
        ))

    for plant, effect, form in FINAL if which == "final" else TUNING:
        for aim in ("clear", "weak") * (3 if which == "practice" else 1):
            # Steps and clipping are strong or below the tolerance.
            if aim == "clear" or effect not in ("quantisation", "actuator-saturation"):
                ask("single" if form in OWN else "other", plant, effect, form, aim)
    for _ in range({"tuning": 3, "practice": 9, "final": 5}[which]):
        for plant in ("slide", "planar", "ankle", "free", "pendulum", "arm"):
            ask("null", plant, None, "", "clear")
    return questions
