"""A 2 x 2 response of 25 000 samples x 4 channels by SciPy and by NumPy, single core. Prints `name seconds` lines, best of many.

scipy: scipy.signal.csd for each of the ten pairs of channels, as a SciPy user writes it, then the response.
numpy: all segments of all channels in one array, one batched real transform, one product; then the response.
Both give the same response (checked here to 1e-10).
"""
import os
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
import time
import numpy as np
from scipy.signal import csd, get_window

RATE = 500.0


def response(s):
    """S_yu S_uu^-1 of spectra s[f, a, b] with inputs 0, 1 and outputs 2, 3."""
    return np.linalg.solve(s[:, :2, :2].transpose(0, 2, 1), s[:, 2:, :2].transpose(0, 2, 1)).transpose(0, 2, 1)


def by_scipy(x, nperseg, noverlap, nfft):
    n = nfft // 2 + 1
    s = np.empty((n, 4, 4), complex)
    for a in range(4):
        for b in range(a + 1):
            # csd(x, y) is the mean of conj(X) Y; ours is A B*.
            s[:, a, b] = csd(x[b], x[a], RATE, "hann", nperseg, noverlap, nfft)[1]
            s[:, b, a] = s[:, a, b].conj()
    return response(s[1:])


def by_numpy(x, nperseg, noverlap, nfft):
    window = get_window("hann", nperseg)
    segments = np.lib.stride_tricks.sliding_window_view(x, nperseg, axis=1)[:, :: nperseg - noverlap]
    segments = (segments - segments.mean(axis=2, keepdims=True)) * window
    z = np.fft.rfft(segments, nfft, axis=2).transpose(2, 0, 1)
    s = z @ z.conj().transpose(0, 2, 1) * (2 / (z.shape[2] * RATE * np.sum(window**2)))
    return response(s[1:])


def best(work, runs):
    least = float("inf")
    for _ in range(runs):
        begun = time.thread_time()
        work()
        least = min(least, time.thread_time() - begun)
    return least


x = np.random.default_rng(1).uniform(-1, 1, (4, 25_000))
for name, setting in (("45", (2048, 1536, 8192)), ("5", (8192, 4096, 8192))):
    a, b = by_scipy(x, *setting), by_numpy(x, *setting)
    # At the Nyquist frequency SciPy does not double, which the response does not see.
    assert np.max(np.abs(a - b)) < 1e-10 * np.max(np.abs(a))
    print(f"scipy.{name} {best(lambda: by_scipy(x, *setting), 30):.9f}", flush=True)
    print(f"numpy.{name} {best(lambda: by_numpy(x, *setting), 30):.9f}", flush=True)
