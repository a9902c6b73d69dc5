"""What calling through Python costs: python measure.py (from anywhere, with ndof installed; on a calm machine)

Small calls: microseconds of a whole call on 64 samples, work and calling together. Twelve channels over an hour: seconds here and of
the same call in Rust (crates/signal/examples/twelve_channels.rs), by turns, the best of each.
"""

import pathlib
import subprocess
import time

import numpy as np

import ndof
from ndof import _ndof

ROOT = pathlib.Path(__file__).resolve().parents[2]


def best(call, repeats, rounds=30):
    """Seconds of one call, the best of several rounds."""
    times = []
    for _ in range(rounds):
        started = time.perf_counter()
        for _ in range(repeats):
            call()
        times.append((time.perf_counter() - started) / repeats)
    return min(times)


def small_calls():
    """Name and seconds of calls on inputs so small that calling is what they cost."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(2, 64))
    columns = {"force_x": x[0], "pos_x": x[1]}
    recording = ndof.Recording(columns, 100)
    spectra = ndof.cross_spectra(x, nperseg=32)
    return {
        "cross_spectra of 2 × 64 samples": best(lambda: ndof.cross_spectra(x, 100.0, nperseg=32), 300),
        "welch of 64 samples": best(lambda: ndof.welch(x[0], 100.0, nperseg=32), 300),
        "coherence of 64 samples": best(lambda: ndof.coherence(x[0], x[1], 100.0, nperseg=32), 300),
        "Recording of 2 × 64 samples": best(lambda: ndof.Recording(columns, 100), 300),
        "merge of two trials": best(lambda: spectra.merge(ndof.cross_spectra(x, nperseg=32, trial=1)), 300),
        "frequency_response of 2 × 64 samples, the estimate included": best(lambda: ndof.frequency_response(recording, nperseg=16), 300),
        "the lower bound: an empty native call": best(_ndof.threads, 1000),
    }


def hour():
    """Seconds here and in Rust, and whether both computed the same."""
    k = np.arange(500 * 3600, dtype=np.float64)
    x = np.stack([np.sin(k * 0.01 * (c + 1)) for c in range(12)])
    rust, python, same = [], [], True
    for _ in range(5):
        run = subprocess.run(
            ["cargo", "run", "--release", "--quiet", "-p", "ndof-signal", "--example", "twelve_channels"],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        )
        seconds, power = map(float, run.stdout.split())
        rust.append(seconds)
        python.append(best(lambda: ndof.cross_spectra(x, 500.0, nperseg=4096), 1, rounds=7))
        # NumPy's sine and that of Rust may differ in the last digit.
        same &= abs(ndof.cross_spectra(x, 500.0, nperseg=4096).power(11)[100] / power - 1) < 1e-6
    return min(rust), min(python), same


if __name__ == "__main__":
    for name, seconds in small_calls().items():
        print(f"{1e6 * seconds:8.1f} µs  {name}")
    rust, python, same = hour()
    print(f"12 channels, 1 h at 500 Hz: Rust {rust:.3f} s, Python {python:.3f} s, {100 * (python / rust - 1):+.1f} %, the same numbers: {same}")
