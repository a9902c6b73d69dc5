"""Spectra against SciPy, shared out, merged and pickled."""

import os
import itertools
import multiprocessing
import pickle
import subprocess
import sys

import numpy as np
import pytest
import scipy.signal

import ndof

# One part in 1e12 of the largest value: both transform in double precision and differ in the order of sums.
ROUND_OFF = 1e-12


def noise(*shape):
    return np.random.default_rng(1).normal(size=shape)


@pytest.mark.parametrize("options", [{}, {"nperseg": 300, "noverlap": 200}, {"nperseg": 200, "nfft": 512, "window": "blackman"}, {"nperseg": 128, "detrend": "linear"}])
def test_welch_csd_and_coherence_are_those_of_scipy(options):
    x, y = noise(2, 5000)
    for name, arguments in (("welch", (x,)), ("coherence", (x, x + 0.5 * y))):
        f, ours = getattr(ndof, name)(*arguments, fs=50.0, **options)
        g, theirs = getattr(scipy.signal, name)(*arguments, fs=50.0, **options)
        assert np.allclose(f, g, rtol=ROUND_OFF, atol=0)
        # At 0 Hz the mean is gone: 0/0.
        assert np.abs(ours - theirs)[1:].max() < 100 * ROUND_OFF * theirs.max(), name
    ours = ndof.cross_spectra({"x": x, "y": y}, 50.0, **options)
    theirs = scipy.signal.csd(x, y, fs=50.0, **options)[1]
    assert np.abs(ours.csd("x", "y") - theirs).max() < ROUND_OFF * np.abs(theirs).max()
    assert np.array_equal(ours.matrix()[1, 0], ours.csd("x", "y"))
    assert np.array_equal(ours.matrix()[0, 1], ours.csd("y", "x"))


def split(x, tasks, **options):
    return [ndof.cross_spectra(x[:, s.slice], share=s, **options) for s in ndof.shares(x.shape[1], tasks=tasks, nperseg=options["nperseg"])]


def test_seven_tasks_give_the_bytes_of_one_pass_in_any_order_of_merging():
    x = noise(3, 200_000)
    options = {"fs": 500, "nperseg": 256, "detrend": "linear"}
    whole = ndof.cross_spectra(x, **options)
    for tasks in (1, 2, 7, 13, 1000):
        parts = split(x, tasks, **options)
        assert len(parts) == min(tasks, -(-whole.segments // 64))
        for shuffled in (parts, parts[::-1], list(np.random.default_rng(tasks).permutation(parts))):
            assert ndof.merge(shuffled).to_bytes() == whole.to_bytes(), tasks
    parts = split(x, 7, **options)
    pairs = [a.merge(b) for a, b in zip(parts[::2], parts[1::2])] + parts[6:]
    assert ndof.merge(pairs).to_bytes() == whole.to_bytes()


def test_trials_merge_in_any_order_to_the_same_bytes():
    trials = [ndof.cross_spectra(x, 500, nperseg=256, trial=k) for k, x in enumerate(noise(4, 2, 10_000))]
    merged = {ndof.merge(order).to_bytes() for order in itertools.permutations(trials)}
    assert len(merged) == 1
    together = ndof.merge(trials)
    assert together.segments == 4 * trials[0].segments
    mean = sum(trial.matrix() for trial in trials) / 4
    assert np.abs(together.matrix() - mean).max() < ROUND_OFF * np.abs(mean).max()


def part_of(task):
    x, share = task
    return ndof.cross_spectra(x, 500, nperseg=256, share=share)


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_any_number_of_processes_gives_the_same_bytes(workers):
    x = noise(2, 120_000)
    tasks = [(x[:, s.slice], s) for s in ndof.shares(120_000, tasks=7, nperseg=256)]
    # Forked after threads were used here: the children make threads of their own.
    ndof.frequency_response(ndof.Recording({"force_x": x[0], "pos_x": x[1]}, 500))
    with multiprocessing.get_context("fork").Pool(workers) as pool:
        merged = ndof.merge(pool.imap_unordered(part_of, tasks))
    assert merged.to_bytes() == ndof.cross_spectra(x, 500, nperseg=256).to_bytes()


def estimate(x):
    return ndof.frequency_response(ndof.Recording({"force_x": x[0], "pos_x": x[1]}, 500), nperseg=256).to_json()


def test_a_forked_process_estimates_too():
    x = noise(2, 300_000)
    here = estimate(x)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(estimate, (x,)).get(timeout=120) == here


def test_what_does_not_fit_together_is_refused():
    x = noise(2, 60_000)
    first, second, third = split(x, 3, fs=500, nperseg=256)
    with pytest.raises(ndof.NdofError, match="both hold the same block"):
        first.merge(second, first)
    with pytest.raises(ndof.NdofError, match="blocks of trial 0 are missing"):
        first.merge(third).matrix()
    with pytest.raises(ndof.NdofError, match="give each trial a number"):
        ndof.cross_spectra(x, 500, nperseg=256).merge(first)
    with pytest.raises(ndof.NdofError, match="same channels at one rate"):
        ndof.cross_spectra(x, 500).merge(ndof.cross_spectra(x, 400, trial=1))
    with pytest.raises(ndof.NdofError, match="nperseg"):
        ndof.welch(x[0, :100], nperseg=200)
    with pytest.raises(ndof.NdofError, match="one segment only"):
        ndof.coherence(x[0, :300], x[1, :300], nperseg=256)


def test_unfinished_spectra_pickle():
    x = noise(2, 60_000)
    parts = pickle.loads(pickle.dumps(split(x, 3, fs=500, nperseg=256)))
    assert ndof.merge(parts) == ndof.cross_spectra(x, 500, nperseg=256)


MEMORY = """
import numpy as np, ndof

# Not ru_maxrss, which a process inherits from the one that starts it.
peak = lambda: next(int(line.split()[1]) * 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))
x = np.zeros((2, 20_000_000))
x += 1e-3  # touched, 320 MB
{copy}
ndof.cross_spectra(x[:, :10_000], 500, nperseg=4096)
before = peak()
ndof.cross_spectra({given}, 500, nperseg=4096)
print((peak() - before) / x.nbytes)
"""


def grown(given, copy=""):
    """By which share of the input the memory of a process grows in a call."""
    run = subprocess.run([sys.executable, "-c", MEMORY.format(given=given, copy=copy)], check=True, capture_output=True, text=True)
    return float(run.stdout)


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="the peak of memory is read from /proc")
def test_contiguous_input_is_not_copied():
    assert grown("x") < 0.02
    assert grown("{'a': x[0], 'b': x[1]}") < 0.02
    assert grown("ndof.Recording({'a': x[0], 'b': x[1]}, 500)") < 0.02
    # The measure sees a copy where there is one.
    assert grown("x[:, ::2]") > 0.4
