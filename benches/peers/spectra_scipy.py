"""A 2 x 2 response of 25 000 samples x 4 channels by SciPy and by NumPy, single core. Prints `name seconds` lines, best of many.

scipy: scipy.signal.csd for each of the ten pairs of channels, as a SciPy user writes it, then the response.
numpy: all segments of all channels in one array, one batched real transform, one product; then the response.
scipy_all, numpy_all: everything that our direct estimate gives: besides the response its covariance, ordinary, partial, multiple and
input coherence and the inputs' condition number. scipy_all takes the ordinary coherences from scipy.signal.coherence.
All give the same numbers (checked here to 1e-10).
"""
import os
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
import time
import numpy as np
from estimate import all_by_numpy, all_by_scipy, batched, pairs, response

RATE = 500.0


def best(work, runs):
    least = float("inf")
    for _ in range(runs):
        begun = time.thread_time()
        work()
        least = min(least, time.thread_time() - begun)
    return least


x = np.random.default_rng(1).uniform(-1, 1, (4, 25_000))
for name, setting in (("45", (RATE, 2048, 1536, 8192)), ("5", (RATE, 8192, 4096, 8192))):
    averages = float(name)
    by_scipy, by_numpy = (lambda: response(pairs(x, *setting))), (lambda: response(batched(x, *setting)))
    both = zip([by_scipy(), *all_by_scipy(x, averages, *setting)], [by_numpy(), *all_by_numpy(x, averages, *setting)])
    for a, b in both:
        # At the Nyquist frequency SciPy does not double, which powers see and what is made of ratios does not.
        assert np.max(np.abs(a - b)[:-1]) < 1e-10 * np.max(np.abs(a[:-1]))
    for kind, work in (("scipy", by_scipy), ("numpy", by_numpy)):
        print(f"{kind}.{name} {best(work, 30):.9f}", flush=True)
    for kind, work in (("scipy_all", all_by_scipy), ("numpy_all", all_by_numpy)):
        print(f"{kind}.{name} {best(lambda: work(x, averages, *setting), 30):.9f}", flush=True)
