"""Calling overhead; the whole table, and the comparison with Rust, is what measure.py prints."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

import measure  # noqa: E402

# What a call may cost besides its work; the best of thirty rounds, which a busy machine hardly touches.
LIMIT_S = 20e-6


def test_small_calls_are_cheap():
    calls = measure.small_calls()
    for name in ("cross_spectra of 2 × 64 samples", "welch of 64 samples", "Recording of 2 × 64 samples"):
        assert calls[name] < LIMIT_S, (name, calls[name])
