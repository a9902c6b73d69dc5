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
from scipy.signal import coherence, csd, get_window

RATE = 500.0


def response(s):
    """S_yu S_uu^-1 of spectra s[f, a, b] with inputs 0, 1 and outputs 2, 3."""
    return np.linalg.solve(s[:, :2, :2].transpose(0, 2, 1), s[:, 2:, :2].transpose(0, 2, 1)).transpose(0, 2, 1)


def ordinary(s):
    """Ordinary coherences |s_ab|^2 / (s_aa s_bb) of outputs with inputs, [f, output, input], and between the inputs, [f]."""
    power = np.einsum("faa->fa", s).real
    return np.abs(s[:, 2:, :2]) ** 2 / (power[:, 2:, None] * power[:, None, :2]), np.abs(s[:, 0, 1]) ** 2 / (power[:, 0] * power[:, 1])


def everything(s, averages, coherences):
    """Response, output noise and inverse of the inputs (the two sides of the covariance), coherences, condition of the scaled inputs."""
    uu, yu, yy = s[:, :2, :2], s[:, 2:, :2], s[:, 2:, 2:]
    inverse = np.linalg.inv(uu)
    h = yu @ inverse
    noise = yy - h @ yu.conj().transpose(0, 2, 1)
    left, power = np.einsum("fii->fi", noise).real, np.einsum("fii->fi", yy).real
    multiple = 1 - left / power
    square = np.abs(h) ** 2
    partial = square / (square + left[:, :, None] * np.einsum("fii->fi", inverse).real[:, None, :])
    scale = np.sqrt(np.einsum("fii->fi", uu).real)
    condition = np.linalg.cond(uu / (scale[:, :, None] * scale[:, None, :]))
    return [h, noise / (averages - 2), inverse, multiple, partial, condition, *coherences]


def pairs(x, nperseg, noverlap, nfft):
    n = nfft // 2 + 1
    s = np.empty((n, 4, 4), complex)
    for a in range(4):
        for b in range(a + 1):
            # csd(x, y) is the mean of conj(X) Y; ours is A B*.
            s[:, a, b] = csd(x[b], x[a], RATE, "hann", nperseg, noverlap, nfft)[1]
            s[:, b, a] = s[:, a, b].conj()
    return s[1:]


def batched(x, nperseg, noverlap, nfft):
    window = get_window("hann", nperseg)
    segments = np.lib.stride_tricks.sliding_window_view(x, nperseg, axis=1)[:, :: nperseg - noverlap]
    segments = (segments - segments.mean(axis=2, keepdims=True)) * window
    z = np.fft.rfft(segments, nfft, axis=2).transpose(2, 0, 1)
    s = z @ z.conj().transpose(0, 2, 1) * (2 / (z.shape[2] * RATE * np.sum(window**2)))
    return s[1:]


def by_scipy(x, *setting):
    return response(pairs(x, *setting))


def by_numpy(x, *setting):
    return response(batched(x, *setting))


def all_by_scipy(x, averages, *setting):
    def one(a, b):
        return coherence(x[a], x[b], RATE, "hann", *setting)[1][1:]

    between = np.array([[one(2, 0), one(2, 1)], [one(3, 0), one(3, 1)]]).transpose(2, 0, 1)
    return everything(pairs(x, *setting), averages, [between, one(0, 1)])


def all_by_numpy(x, averages, *setting):
    s = batched(x, *setting)
    return everything(s, averages, ordinary(s))


def best(work, runs):
    least = float("inf")
    for _ in range(runs):
        begun = time.thread_time()
        work()
        least = min(least, time.thread_time() - begun)
    return least


x = np.random.default_rng(1).uniform(-1, 1, (4, 25_000))
for name, setting in (("45", (2048, 1536, 8192)), ("5", (8192, 4096, 8192))):
    averages = float(name)
    both = zip([by_scipy(x, *setting), *all_by_scipy(x, averages, *setting)], [by_numpy(x, *setting), *all_by_numpy(x, averages, *setting)])
    for a, b in both:
        # At the Nyquist frequency SciPy does not double, which powers see and what is made of ratios does not.
        assert np.max(np.abs(a - b)[:-1]) < 1e-10 * np.max(np.abs(a[:-1]))
    for kind, work in (("scipy", by_scipy), ("numpy", by_numpy)):
        print(f"{kind}.{name} {best(lambda: work(x, *setting), 30):.9f}", flush=True)
    for kind, work in (("scipy_all", all_by_scipy), ("numpy_all", all_by_numpy)):
        print(f"{kind}.{name} {best(lambda: work(x, averages, *setting), 30):.9f}", flush=True)
