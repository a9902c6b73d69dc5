"""Simulators that are known by their log alone (`ndof diagnose log.csv --simulated sim.csv`): what do they lack?

    python3 tests/exam/simulators.py --program NDOF [--seeds 0-167] [--out FILE] [--verbose]

A limb of one axis is pushed by noise for 50 s at 500 Hz; the simulator got the same force. Every second simulator has a dry friction of its own, which
the limb has too. In the limb one thing is hidden in five of six seeds: a dry friction, a spring that hardens, a hysteresis, or a wrong inertia, damping or
stiffness of the simulator. All plants are integrated side by side with a twentieth of the log's step, by this script alone. Needs NumPy.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from tables import Row

RATE, SECONDS, STEPS, FORCE = 500, 50, 20, 4.0
HIDDEN = ["nothing", "coulomb-friction", "cubic-stiffness", "hysteresis", "K", "B", "M"]
PLANT = ["M", "B", "K", "dry", "cubic", "loop", "way"]


def noise(random, rms, cutoff_hz):
    """Noise below a fourth-order low-pass."""
    samples = RATE * SECONDS
    spectrum = np.fft.rfft(random.standard_normal(samples)) / np.sqrt(1 + (np.fft.rfftfreq(samples, 1 / RATE) / cutoff_hz) ** 8)
    made = np.fft.irfft(spectrum, samples)
    return made * rms / made.std()


def question(seed):
    """The simulator's plant and the limb's, what is hidden, and its size."""
    random = np.random.default_rng(seed)
    mass, hertz, ratio = random.uniform(1, 4), random.uniform(1, 3), random.uniform(0.2, 0.8)
    stiffness = mass * (2 * math.pi * hertz) ** 2
    own = dict.fromkeys(PLANT, 0.0) | {"M": mass, "B": 2 * ratio * math.sqrt(mass * stiffness), "K": stiffness, "way": 1.0}
    if seed % 2:
        own["dry"] = random.uniform(0.05, 0.15) * FORCE
    limb, hidden = dict(own), HIDDEN[seed // 2 % len(HIDDEN)]
    # The size of the motion of the linear limb, for laws that depend on it.
    s = 2j * math.pi * np.geomspace(0.01, 100, 4000)
    shape = 1 / (1 + (np.abs(s) / (2 * math.pi * 12)) ** 8)
    response = np.abs(1 / (own["M"] * s**2 + own["B"] * s + own["K"])) ** 2
    moved = FORCE * math.sqrt(np.trapezoid(shape * response, np.abs(s)) / np.trapezoid(shape, np.abs(s)))
    sign = random.choice([-1, 1])
    if hidden == "coulomb-friction":
        limb["dry"] += random.uniform(0.1, 0.25) * FORCE
    elif hidden == "cubic-stiffness":
        limb["cubic"] = random.uniform(0.1, 0.3) * own["K"] / moved**2
    elif hidden == "hysteresis":
        limb["loop"], limb["way"] = random.uniform(0.15, 0.3) * FORCE, random.uniform(0.2, 0.6) * moved
    elif hidden != "nothing":
        limb[hidden] *= 1 + sign * random.uniform(0.15, 0.4)
    force, push = noise(random, FORCE, 12), noise(random, 0.02 * FORCE, 8)
    return own, limb, hidden, force, push, random.standard_normal(RATE * SECONDS)


def run(plants, forces):
    """The mean position of each plant over each interval; hysteresis is Bouc and Wen's."""
    p = {name: np.array([plant[name] for plant in plants]) for name in PLANT}
    x, v, z, dt = np.zeros(len(plants)), np.zeros(len(plants)), np.zeros(len(plants)), 1 / RATE / STEPS
    out = np.empty((RATE * SECONDS, len(plants)))
    for k, force in enumerate(forces.T):
        mean = np.zeros(len(plants))
        for _ in range(STEPS):
            resist = p["B"] * v + p["K"] * x + p["cubic"] * x**3 + p["dry"] * np.tanh(v / 1e-3) + p["loop"] * z
            v = v + (force - resist) / p["M"] * dt
            z = z + (v - 0.5 * np.abs(v) * z * np.abs(z) - 0.5 * v * z * z) / p["way"] * dt
            x = x + v * dt
            mean += x
        out[k] = mean / STEPS
    return out.T


def write(path, force, position):
    np.savetxt(path, np.column_stack([force, position]), delimiter=",", fmt="%.9g", header=f"# sample_rate_hz: {RATE}\nforce_x [N],pos_x [m]", comments="")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--seeds", default="0-167")
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split("-"))
    questions = [question(seed) for seed in range(first, last + 1)]
    simulated = run([q[0] for q in questions], np.array([q[3] for q in questions]))
    measured = run([q[1] for q in questions], np.array([q[3] + q[4] for q in questions]))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for seed, (own, limb, hidden, force, _, scatter), sim, log in zip(range(first, last + 1), questions, simulated, measured):
            write(folder / "sim.csv", force, sim)
            write(folder / "log.csv", force, log + 1e-3 * log.std() * scatter)
            line = [options.program, "diagnose", "log.csv", "--simulated", "sim.csv", "--json", "-", "--quiet"]
            answer = json.loads(subprocess.run(line, cwd=folder, check=True, capture_output=True, text=True).stdout)
            # A force of the limb's own is there in every seed: that it is told is no wrong name.
            named = [c for c in answer["causes"] if c["effect"] != "limb-noise"]
            told = [c["effect"] if c["effect"] != "parameter-error" else next(p["value"] for p in c["parameters"] if p["name"] == "name").strip() for c in named]
            inside = None
            if named and told[0] == hidden and hidden in "MBK":
                ci = next(p for p in named[0]["parameters"] if p["name"] == "value")["ci95"]
                inside = ci and ci[0] <= limb[hidden] <= ci[1]
            elif named and told[0] == hidden == "coulomb-friction":
                ci = next(p for p in named[0]["parameters"] if p["name"].startswith("level"))["ci95"]
                inside = ci and ci[0] <= limb["dry"] - own["dry"] <= ci[1]
            rows.append((bool(own["dry"]), hidden, told, inside, answer["verdict"]))
            if options.verbose and told[:1] != ([] if hidden == "nothing" else [hidden]):
                print(seed, "own friction" if own["dry"] else "linear", hidden, "->", told, answer["verdict"])
    lines = [f"seeds {options.seeds}: {len(rows)} questions", " " * 84 + "measured   95 % interval"]
    for friction, words in ((False, "a linear simulator"), (True, "a simulator with own friction")):
        some = [r for r in rows if r[0] == friction]
        lines.append(Row(f"{words}: the cause right first", sum(r[2][:1] == [r[1]] for r in some if r[1] != "nothing"), sum(r[1] != "nothing" for r in some)).text())
        lines.append(Row(f"{words}: nothing hidden, a name", sum(bool(r[2]) for r in some if r[1] == "nothing"), sum(r[1] == "nothing" for r in some)).text())
    for hidden in HIDDEN[1:]:
        lines.append(Row(f"    {hidden}", sum(r[2][:1] == [hidden] for r in rows if r[1] == hidden), sum(r[1] == hidden for r in rows)).text())
    for friction, words in ((False, "a linear simulator"), (True, "a simulator with own friction")):
        for what, own in (("M, B, K", "MBK"), ("friction", "coulomb-friction")):
            judged = [r[3] for r in rows if r[3] is not None and r[0] == friction and r[1] in own]
            lines.append(Row(f"{words}: {what} inside its interval", sum(judged), len(judged)).text())
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if options.out:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
