"""Questions of the exam whose plants another engine simulates.

    python tests/exam/mujoco_plants.py SET FOLDER [--only TEXT] [--jobs N]

writes recordings as CSV and the truth beside them as `ID.truth.json`, as crates/challenge does; SET is tuning, practice or final. Needs mujoco and
numpy (tests/exam/requirements.txt). A question that is there already is left as it is.
"""

import json
import math
import pathlib
import random
import sys
import zlib
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import mujoco_paper
from mujoco_models import PLANTS
from mujoco_plant import Plant


def size_of(question, alone, bare, floor):
    """Share of what a linear model leaves, its size over the effort, and over the output. `alone` is the residual of the quiet recording,
    without noise and the limb's own force, which would bias least squares, `bare` that of its twin without the effect, and `floor` that
    of the twin with noise and own force."""
    effort, output = (max(alone[key] - bare[key], 0.0) for key in ("effort", "output"))
    output = alone["steps"] if question.effect == "quantisation" else math.sqrt(output / alone["all_output"])
    return {"share": effort / (effort + floor["effort"]), "size": math.sqrt(effort / alone["all_effort"]), "output": output}


MATERIAL = 0.0125  # a quarter above the tolerance, as in crates/challenge/src/exam/pose.rs


def class_of(strength, tolerated):
    if tolerated or strength["size"] < 0.01 or strength["output"] < MATERIAL:
        return "faint"
    return "clear" if strength["share"] >= 0.5 else "middle" if strength["share"] >= 0.2 else "weak" if strength["share"] >= 0.05 else "faint"


# Severities below which instruments tolerate a latency or a lag (in a band of 12 Hz), an angle, steps.
LATE = {"measurement-delay": 0.075, "channel-filter": 0.07}
LEAST = {"sensor-misalignment": 0.14, "quantisation": 0.2}


def least_severity(question):
    late = LATE.get(question.effect)
    return LEAST.get(question.effect, 1e-3) if late is None else late * 12.0 / PLANTS[question.plant]["band"]


def calibrated(question, seed):
    """Severity and loudness of the limb at which the effect has the strength that the question aims at."""
    draw = random.Random(seed)
    weak = question.aim == "weak"
    share = draw.uniform(0.08, 0.17)
    odds = share / (1 - share) if weak else math.exp(draw.uniform(math.log(1.5), math.log(100)))
    severity, own, least = 0.3, question.own, least_severity(question)
    bare = Plant(question, seed, 0.0, own, quiet=True).trial(0)["left"]
    for last in (False, False, False, True):
        floor = Plant(question, seed, 0.0, own).trial(0)["left"]
        for _ in range(6):
            found = size_of(question, Plant(question, seed, severity, own, quiet=True).trial(0)["left"], bare, floor)
            share = min(max(found["share"], 1e-6), 1 - 1e-6)
            by_odds = math.sqrt(odds * (1 - share) / share)
            by_size = 1.1 * MATERIAL / max(found["output"], 1e-6)
            factor = by_odds if weak else max(by_odds, by_size)
            wanted = min(max(severity * min(max(factor, 0.15), 5.0), least), 1.0)
            if 0.85 < wanted / severity < 1.18:
                break
            severity = wanted
        # A weak effect is made weak by a louder limb where it would be too small else.
        more = max(1.25 * MATERIAL / max(found["output"], 1e-6), 0.0115 / max(found["size"], 1e-6), 1 / by_odds if severity <= least else 0.0)
        if not weak or more < 1.1 or last:
            break
        own = min(own * min(more, 4.0), 10.0)
    return severity, own


def posed(question):
    """The question with its strength set; one whose class is not what it aims at is drawn again, twice at most."""
    for again in range(3):
        out = attempt(question, zlib.crc32(f"{question.id}{'+' * again}".encode()))
        if out[2] is None or class_of(out[2], out[0].tolerated()) == question.aim:
            break
    return out


def attempt(question, seed):
    severity, own = (0.0, question.own) if question.effect is None else calibrated(question, seed)
    plant = Plant(question, seed, severity, own)
    trials = [plant.trial(k) for k in range(question.trials)]
    strength = None
    if question.effect is not None:
        alone, bare, floor = (
            [Plant(question, seed, *numbers).trial(k)["left"] for k in range(question.trials)] for numbers in ((severity, own, True), (0.0, own, True), (0.0, own))
        )
        total = lambda lefts: {key: sum(left[key] for left in lefts) for key in lefts[0]}
        strength = size_of(question, total(alone) | {"steps": alone[0].get("steps", 0.0)}, total(bare), total(floor))
    return plant, trials, strength


def write(question, folder):
    plant, trials, strength = posed(question)
    files = []
    for k, trial in enumerate(trials):
        files.append(f"{question.id}-{k + 1}.csv")
        header = f"# sample_rate_hz: {plant.rate_hz:.12g}\n" + ",".join(trial["names"])
        np.savetxt(folder / files[-1], np.array(trial["channels"]).T, fmt="%.9g", delimiter=",", header=header, comments="")
    truth = plant.truth(trials)
    own = truth and max(truth["own_force"])
    effects = [] if question.effect is None else [plant.told()]
    result = {
        "schema": "ndof/exam/1", "id": question.id, "generator": "mujoco", "kind": question.kind,
        "family": f"{question.plant}: {question.name}", "held_back": question.held_back,
        "class": None if strength is None else class_of(strength, plant.tolerated()),
        "plant": f"mujoco-{question.plant}", "axes": plant.constants["axes"], "files": files, "arguments": plant.arguments(), "baseline": None,
        "trials": question.trials, "duration_s": plant.duration_s, "sample_rate_hz": plant.rate_hz, "sampling": question.sampling,
        "slow": question.slow, "periodic": question.periodic, "effects": effects, "strength": strength, "present": ["limb-noise"] if own is None or own >= 0.01 else [], "true_model": truth,
    }
    (folder / f"{question.id}.truth.json").write_text(json.dumps(result, indent=2) + "\n")


def main():
    which, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    value = lambda name, default: sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default
    only, jobs = value("--only", ""), int(value("--jobs", "1"))
    folder.mkdir(parents=True, exist_ok=True)
    asked = [q for q in mujoco_paper.paper(which) if only in f"{q.id} {q.plant} {q.name}" and not (folder / f"{q.id}.truth.json").exists()]
    with ProcessPoolExecutor(jobs) as pool:
        for _ in pool.map(write, asked, [folder] * len(asked)):
            pass


if __name__ == "__main__":
    main()
