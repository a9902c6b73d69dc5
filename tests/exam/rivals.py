"""What others say of the same recordings: PySINDy, and a rule that correlates the linear model's residual with candidates.

    python tests/exam/rivals.py FOLDER ID…

prints {id: {rival: [names, the first first]}} for questions of one axis. Each names what it can express; neither has an "I do not know".
"""

import json
import math
import pathlib
import sys
import warnings

import numpy as np
import pysindy
from scipy.signal import butter, sosfiltfilt

LEAST_CORRELATION = 0.3
LEAST_SHARE = 0.02  # of the effort, for a term of PySINDy


def one_axis(truth, folder):
    """Effort, displacement, and rate, all trials one after the other as lists; none where the motion is not a displacement."""
    trials = []
    for name in truth["files"]:
        lines = (folder / name).read_text().splitlines()
        header = [h.split(" ")[0] for h in lines[1].split(",")]
        table = np.loadtxt(lines[2:], delimiter=",").T
        of = lambda *words: next((table[k] for k, h in enumerate(header) if h.startswith(words)), None)
        effort, motion = of("force_", "torque_"), of("pos_", "angle_")
        if motion is None:
            return None
        trials.append((effort, motion))
    return trials


def derivatives(truth, trials):
    """Rows of time, effort, x, v, a within the band, at 125 Hz or less; trials are cut at their ends, where filters ring."""
    rate = truth["sample_rate_hz"]
    band = min(20.0 / truth.get("slow", 1.0), 0.35 * rate)
    low = butter(4, 2 * band / rate, output="sos")
    rows = []
    for effort, motion in trials:
        f, x = (sosfiltfilt(low, row - np.mean(row)) for row in (effort, motion))
        v = np.gradient(x) * rate
        a = np.gradient(v) * rate
        t = np.arange(len(x)) / rate
        cut = slice(int(rate / band), -int(rate / band), max(1, int(rate // 125)))
        rows.append(np.array([t - t[-1] / 2, f, x, v, a])[:, cut])
    return np.concatenate(rows, axis=1)


def candidates(t, f, x, v, a, rate):
    """What an effect would add to the effort, by its name; several rows of a name are several shapes of it."""
    sx, sv = np.std(x), np.std(v)
    shift = lambda row, seconds: np.concatenate([np.full(max(int(seconds * rate), 1), row[0]), row])[: len(row)]
    lag = lambda row, seconds: low_pass(row, seconds * rate)
    rows = [("coulomb-friction", np.tanh(v / (0.05 * sv))), ("cubic-stiffness", x**3), ("asymmetric-stiffness", x**2), ("stiffness-drift", t * x), ("posture-drift", t)]
    rows += [("dead-zone", np.clip(x, -g * sx, g * sx)) for g in (0.3, 0.7)]
    rows += [("end-stop", np.maximum(sign * x - p * sx, 0)) for sign in (-1, 1) for p in (0.7, 1.3)]
    rows += [("reflex-delay", lag(shift(v, d), 0.05)) for d in (0.03, 0.05)] + [("reflex-delay", lag(shift(np.maximum(s * v, 0), 0.04), 0.05)) for s in (-1, 1)]
    rows += [("measurement-delay", np.gradient(f) * rate), ("viscoelastic", lag(x, 0.15))]
    rows += [("hysteresis", play(x, w * sx)) for w in (0.3, 0.8)]
    rows += [("periodic-disturbance", part) for part in tone(t, f, x, v, a)]
    return rows


def low_pass(row, samples):
    keep, out, level = math.exp(-1 / max(samples, 1e-9)), np.empty_like(row), row[0]
    for k, value in enumerate(row):
        level = keep * level + (1 - keep) * value
        out[k] = level
    return out


def play(x, half):
    out, at = np.empty_like(x), x[0]
    for k, value in enumerate(x):
        at = min(max(at, value - half), value + half)
        out[k] = at
    return out


def tone(t, *rows):
    """Sine and cosine at the largest line of the residual."""
    rest = without(np.array(rows[1:]), rows[0])
    lines = np.abs(np.fft.rfft(rest * np.hanning(len(rest))))
    hz = np.argmax(lines) / len(rest)
    k = np.arange(len(rest))
    return np.sin(2 * np.pi * hz * k), np.cos(2 * np.pi * hz * k)


def without(basis, row):
    """A row less its projection on others."""
    basis = np.vstack([basis, np.ones(len(row))]).T
    basis = basis / np.linalg.norm(basis, axis=0)
    return row - basis @ np.linalg.lstsq(basis, row, rcond=None)[0]


def correlated(rows, rate):
    """Names in the order of their correlation with what a linear model leaves."""
    t, f, x, v, a = rows
    linear = np.array([x, v, a])
    rest = without(linear, f)
    best = {}
    for name, row in candidates(t, f, x, v, a, rate):
        row = without(linear, row)
        size = np.linalg.norm(row) * np.linalg.norm(rest)
        if size > 0:
            best[name] = max(best.get(name, 0.0), abs(row @ rest) / size)
    named = sorted((name for name in best if best[name] >= LEAST_CORRELATION), key=lambda name: -best[name])
    return named[:1]


# Terms of PySINDy's library, and the effects that they are.
TERMS = [
    (lambda x, v, f, t: x, "linear"), (lambda x, v, f, t: v, "linear"), (lambda x, v, f, t: f, "linear"), (lambda x, v, f, t: np.ones_like(x), "linear"),
    (lambda x, v, f, t: np.tanh(v / 0.05), "coulomb-friction"), (lambda x, v, f, t: x**3, "cubic-stiffness"), (lambda x, v, f, t: x**2, "asymmetric-stiffness"),
    (lambda x, v, f, t: x * t, "stiffness-drift"), (lambda x, v, f, t: t, "posture-drift"), (lambda x, v, f, t: v * np.abs(v), "quadratic damping"),
    (lambda x, v, f, t: x * np.abs(x), "quadratic stiffness"), (lambda x, v, f, t: x**2 * v, "van der Pol damping"), (lambda x, v, f, t: x * v, "damping by place"),
]


def sparse(rows):
    """Names of the terms beyond the linear ones that sequentially thresholded least squares keep, the largest first."""
    t, f, x, v, a = (row / max(np.std(row), 1e-30) for row in rows)
    library = pysindy.CustomLibrary(library_functions=[function for function, _ in TERMS], function_names=[lambda *_, k=k: f"term {k}" for k in range(len(TERMS))], interaction_only=True)
    states = np.array([x, v, f, t]).T
    library.fit(states)
    features = np.array(library.transform(states))
    optimizer = pysindy.STLSQ(threshold=LEAST_SHARE, alpha=1e-6, normalize_columns=False)
    scale = np.std(features, axis=0)
    scale[scale == 0] = 1.0
    optimizer.fit(features / scale, a[:, None])
    sizes = np.abs(optimizer.coef_[0])
    found = sorted((k for k in range(len(TERMS)) if sizes[k] > 0 and TERMS[k][1] != "linear"), key=lambda k: -sizes[k])
    return [TERMS[k][1] for k in found]


def main():
    folder = pathlib.Path(sys.argv[1])
    out = {}
    warnings.simplefilter("ignore")
    for name in sys.argv[2:]:
        truth = json.loads((folder / f"{name}.truth.json").read_text())
        if len(truth["axes"]) > 1 or truth["baseline"]:
            continue
        trials = one_axis(truth, folder)
        if trials is None:
            continue
        rows = derivatives(truth, trials)
        out[name] = {"PySINDy": sparse(rows), "correlation": correlated(rows, min(truth["sample_rate_hz"], 125.0))}
    print(json.dumps(out))


if __name__ == "__main__":
    main()
