"""Makes the questions of the exam:

    python3 tests/joints/make.py OUT [--seeds 0-299] [--half tuning|held-back|practice]

A folder each with log.csv, robot.urdf (the nominal robot), sim.csv (the nominal robot under the same controller and reference, free of noise) and
question.json (the truth). A seed makes the same question each time.

Strength is what the nominal torque lacks along the actual motion (`tasks.lacking`), as a share of the torque that it has: of the cause's joint;
for payload and link-parameters of the joint with the largest share; for base-tilt of all joints' torques together. The dial starts where its
cause is about as strong as aimed at and is moved by secants of log share over log dial, on one period of the movement, until the share is inside
its class: clear 8.2 to 25 %, weak 2.1 to 3.9 %. A choice that cannot reach it within its dial's range is drawn anew. Beside something weak the
torque noise is at most half of it. Causes of a pair are dialled alone. The share that is written is that of the whole recording, for pairs that of
one period of each alone.
"""

import argparse
import json
import math
import os
import pathlib
import sys
import time
import zlib
from multiprocessing import Pool
from random import Random

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import mujoco
import numpy as np

import causes
import plan
import robots
import tasks

CLASSES = {"clear": (0.082, 0.25, (0.10, 0.18)), "weak": (0.021, 0.039, (0.024, 0.035))}  # least, most, aimed at
ATTEMPTS = 40
STEP_S, FINE_STEP_S = 5e-4, 2.5e-4


def size_of(task, rate_hz):
    """The scene: sizes of the nominal movement."""
    acceleration = np.gradient(task.speed, task.step_s, axis=0)
    rms = tasks.rms
    return causes.Scene(
        task.robot, task.step_s, rate_hz, rms(task.effort), rms(task.speed), rms(acceleration), task.angle.min(0), task.angle.max(0), 1 / np.diag(np.linalg.inv(tasks.inertia(task.robot, task.step_s))),
        (task.effort > 0).mean(0),
    )


def share(choice, robot, lack, needed):
    if choice.variant.effect == "base-tilt":
        return float(math.sqrt((lack**2).sum() / (needed**2).sum()))
    by_joint = tasks.rms(lack) / tasks.rms(needed)
    return float(by_joint.max() if choice.variant.effect in ("payload", "link-parameters") else by_joint[choice.joint])


def run(task, scene, dialled, duration_s):
    """A noise-free run with choices at their dials; the drives' reports in place of torques, what was true beside it."""
    put, parameters = causes.hidden(scene, dialled)
    model = put.model()
    made = tasks.simulate(task, model, duration_s, put.stepping(model))
    return made, put, parameters


def measured(task, scene, choice, dial, duration_s):
    made, put, _ = run(task, scene, [(choice, dial)], duration_s)
    made.effort = put.report(made.effort)
    return share(choice, task.robot, *tasks.lacking(task.robot, made))


def dial(task, scene, choice, strength, aim):
    """The dial at which a choice is as strong as asked, or None."""
    least, most, _ = CLASSES[strength]
    tried = []
    at = aim / 0.1
    for _ in range(7):
        at = min(max(at, 1e-3), choice.variant.most)
        try:
            found = measured(task, scene, choice, at, 1 / tasks.BASE_HZ)
        except FloatingPointError:
            found = math.inf
        if least <= found <= most:
            return at
        if tried and tried[-1][0] == at:
            return None
        tried.append((at, found))
        slope = 1.0
        finite = [t for t in tried if math.isfinite(t[1]) and t[1] > 0]
        if not finite or not math.isfinite(found) or found <= 0:
            at = at / 3 if not math.isfinite(found) else at * 3
            continue
        if len(finite) > 1:
            (d0, s0), (d1, s1) = finite[-2:]
            slope = min(max(math.log(s1 / s0) / math.log(d1 / d0), 0.4), 2.5) if d0 != d1 and s0 != s1 else 1.0
        at *= min(max((aim / found) ** (1 / slope), 0.1), 10.0)
    return None


def tasks_of(robot, seed, rate_hz):
    """The same task at coarse and fine steps."""
    made = {}

    def of(step_s):
        if step_s not in made:
            task = tasks.task(robot, np.random.default_rng([seed, 1]), step_s)
            made[step_s] = task, size_of(task, rate_hz)
        return made[step_s]

    return of


def variants(effect, half, draw):
    """One of an effect's variants; those that are held back are half of theirs, and half of dry friction has Stribeck's curve."""
    found = [v for v in causes.VARIANTS if v.effect == effect and (half == "held-back" or not v.held_back)]
    if effect == "coulomb-friction":
        curved = draw.random() < 0.5
        found = [v for v in found if v.variant.startswith("stribeck") == curved]
    kept = [v for v in found if v.held_back]
    return draw.choice(kept if kept and draw.random() < 0.5 else found)


def choose(question, robot, of, draw):
    """Choices with dials, strengths and shares' aims, on the steps that they need."""
    fine = any(effect in plan.SERIES for effect, _ in question.hidden)
    task, scene = of(FINE_STEP_S if fine else STEP_S)
    joint = draw.randrange(len(robot.links))
    out = []
    for number, (effect, strength) in enumerate(question.hidden):
        aim = draw.uniform(*CLASSES[strength][2])
        for attempt in range(ATTEMPTS):
            variant = variants(effect, question.half, draw)
            if not (question.same_joint and number and attempt < 2):
                joint = draw.randrange(len(robot.links))
            taken = [c.joint for c, *_ in out]
            if not question.same_joint and number and joint in taken and len(robot.links) > 1:
                continue
            # Where the second cannot be at the first's joint it goes where it can be; what must not meet does not.
            if number and joint not in taken and question.same_joint and attempt < 2:
                continue
            choice = causes.Choice(variant, joint, f"{question.seed} {number} {attempt}")
            found = dial(task, scene, choice, strength, aim) if choice.possible(scene) else None
            if found is not None:
                out.append((choice, found, strength))
                break
        else:
            raise RuntimeError(f"seed {question.seed}: no joint of the {robot.name} where {effect} is {strength}")
    return task, scene, out


def rates(question):
    """A delay of one to four samples is clear at slow rates only."""
    late = [strength for effect, strength in question.hidden if effect == "torque-delay"]
    return (100,) if "clear" in late else (100, 200) if late else (100, 200, 250, 500)


def make(question, folder):
    began = time.monotonic()
    draw, rng = Random(f"joints {question.seed}"), np.random.default_rng([question.seed, 2])
    robot = robots.ROBOTS[question.robot]
    instruments = tasks.Instruments.draw(rng, rates(question))
    task, scene, chosen = choose(question, robot, tasks_of(robot, question.seed, instruments.rate_hz), draw)
    for _ in range(4):
        dialled = [(choice, at) for choice, at, _ in chosen]
        made, put, parameters = run(task, scene, dialled, robot.duration_s)
        true_effort, made.effort = made.effort, put.report(made.effort)
        lack, needed = tasks.lacking(robot, made)
        if len(chosen) != 1:
            shares = [measured(task, scene, choice, at, 1 / tasks.BASE_HZ) for choice, at, _ in chosen]
            break
        choice, at, strength = chosen[0]
        shares = [share(choice, robot, lack, needed)]
        least, most, aims = CLASSES[strength]
        if least <= shares[0] <= most:
            break
        # One period is not the whole, of an oscillation that dies out.
        chosen = [(choice, min(at * sum(aims) / 2 / shares[0], choice.variant.most), strength)]
    else:
        raise RuntimeError(f"seed {question.seed}: {shares[0]} of the whole recording is not {strength}")
    instruments.noise_share = min([instruments.noise_share] + [s / 2 for s in shares])
    # What is nominal repeats itself from the warm-up on.
    period = tasks.simulate(task, tasks.nominal(robot, task.step_s), 1 / tasks.BASE_HZ)
    times = round(robot.duration_s * tasks.BASE_HZ)
    simulated = tasks.Run(task.step_s, *(np.tile(x, (times, 1)) for x in (period.angle, period.speed, period.effort)))
    made.effort = true_effort
    t, effort, angle, speed = tasks.logged(made, instruments, rng, put.report)
    folder.mkdir(parents=True, exist_ok=True)
    tasks.write_log(folder / "log.csv", robot, t, effort, angle, speed)
    rows = slice(None, None, round(1 / instruments.rate_hz / task.step_s))
    tasks.write_log(folder / "sim.csv", robot, t, simulated.effort[rows], simulated.angle[rows], simulated.speed[rows] if instruments.speeds else None)
    (folder / "robot.urdf").write_text(robots.urdf(robot))
    truth = {
        "id": folder.name, "seed": question.seed, "half": question.half, "robot": robot.name, "joints": robot.joints, "kind": question.kind,
        "causes": [
            {"effect": choice.variant.effect, "variant": choice.variant.variant, "engine": choice.variant.own, "axis": choice.axis(robot), "strength": strength,
             "share": round(s, 5), "dial": at, "parameters": values, "scored": choice.scored(robot)}
            for (choice, at, strength), values, s in zip(chosen, parameters, shares)
        ],
        "rate_hz": instruments.rate_hz, "encoder_bits": instruments.bits, "noise_share": instruments.noise_share, "noise_coloured": instruments.coloured,
        "speeds": instruments.speeds, "step_s": task.step_s, "lacking_share_by_joint": [round(float(s), 5) for s in tasks.rms(lack) / tasks.rms(needed)],
        "torque_rms_nm": [float(v) for v in tasks.rms(needed)], "torque_spread": [round(float(v), 4) for v in np.std(needed, axis=0) / tasks.rms(needed)],
        "travel_rad": [round(float(v), 4) for v in np.ptp(made.angle, axis=0)], "seconds": round(time.monotonic() - began, 2),
    }
    (folder / "question.json").write_text(json.dumps(truth, indent=1))
    return truth


def fingerprint():
    """Of the files that make questions: those that are there of the same files are kept."""
    here = pathlib.Path(__file__).parent
    text = "".join((here / name).read_text() for name in ("robots.py", "tasks.py", "causes.py", "plan.py", "make.py"))
    return f"{zlib.crc32(text.encode()):08x} mujoco {mujoco.__version__} numpy {np.__version__}"


def one(asked):
    question, out, stamp = asked
    folder = out / f"{question.seed:03}"
    kept = folder / "made"
    if kept.exists() and kept.read_text() == stamp:
        return None, None
    try:
        truth = make(question, folder)
    except Exception as error:  # a question that cannot be made is told with its seed
        return question.seed, f"{type(error).__name__}: {error}"
    kept.write_text(stamp)
    return truth, None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--seeds", default="0-299", help="first-last, both included")
    parser.add_argument("--half", choices=("tuning", "held-back", "practice"))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    first, last = (int(s) for s in (options.seeds.split("-") * 2)[:2])
    asked = [q for q in plan.questions() if first <= q.seed <= last and options.half in (None, q.half)]
    failed, stamp = [], fingerprint()
    # The slow ones first, so that no process is left with one at the end.
    asked.sort(key=lambda q: -len(robots.ROBOTS[q.robot].links))
    with Pool(options.jobs) as pool:
        for truth, error in pool.imap_unordered(one, [(q, options.out, stamp) for q in asked]):
            if error:
                failed.append((truth, error))
                print(f"{truth}: {error}", file=sys.stderr)
    if failed:
        print(f"{len(failed)} of {len(asked)} questions could not be made, and are not asked", file=sys.stderr)
    if len(failed) == len(asked):
        sys.exit(1)


if __name__ == "__main__":
    main()
