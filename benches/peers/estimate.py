"""A response with all that our direct estimate gives beside it, by SciPy and by NumPy: for x[channel, sample] with as many inputs as outputs.

Pairs: scipy.signal.csd for each pair of channels, as a SciPy user writes it. Batched: segments of all channels in one array, a batched real
transform and one product for some hundred segments at a time.
"""
import numpy as np
from scipy.signal import coherence, csd, get_window

AT_ONCE = 128  # segments


def response(s):
    """S_yu S_uu^-1 of spectra s[f, a, b], the inputs first."""
    p = s.shape[1] // 2
    return np.linalg.solve(s[:, :p, :p].transpose(0, 2, 1), s[:, p:, :p].transpose(0, 2, 1)).transpose(0, 2, 1)


def ordinary(s):
    """Ordinary coherences |s_ab|^2 / (s_aa s_bb) of outputs with inputs, [f, output, input], and of pairs of inputs, [pair, f]."""
    p = s.shape[1] // 2
    power = np.einsum("faa->fa", s).real
    square = np.abs(s) ** 2 / (power[:, :, None] * power[:, None, :])
    return square[:, p:, :p], np.array([square[:, i, j] for i in range(p) for j in range(i)])


def everything(s, averages, coherences):
    """Response, output noise and inverse of the inputs (the two sides of the covariance), coherences, condition of the scaled inputs."""
    p = s.shape[1] // 2
    uu, yu, yy = s[:, :p, :p], s[:, p:, :p], s[:, p:, p:]
    inverse = np.linalg.inv(uu)
    h = yu @ inverse
    noise = yy - h @ yu.conj().transpose(0, 2, 1)
    left, power = np.einsum("fii->fi", noise).real, np.einsum("fii->fi", yy).real
    multiple = 1 - left / power
    square = np.abs(h) ** 2
    partial = square / (square + left[:, :, None] * np.einsum("fii->fi", inverse).real[:, None, :])
    scale = np.sqrt(np.einsum("fii->fi", uu).real)
    condition = np.linalg.cond(uu / (scale[:, :, None] * scale[:, None, :]))
    return [h, noise / (averages - p), inverse, multiple, partial, condition, *coherences]


def pairs(x, rate, nperseg, noverlap, nfft):
    count = len(x)
    s = np.empty((nfft // 2 + 1, count, count), complex)
    for a in range(count):
        for b in range(a + 1):
            # csd(x, y) is the mean of conj(X) Y; ours is A B*.
            s[:, a, b] = csd(x[b], x[a], rate, "hann", nperseg, noverlap, nfft)[1]
            s[:, b, a] = s[:, a, b].conj()
    return s[1:]


def batched(x, rate, nperseg, noverlap, nfft):
    window = get_window("hann", nperseg)
    all_segments = np.lib.stride_tricks.sliding_window_view(x, nperseg, axis=1)[:, :: nperseg - noverlap]
    count = all_segments.shape[1]
    s = np.zeros((nfft // 2 + 1, len(x), len(x)), complex)
    for first in range(0, count, AT_ONCE):
        segments = all_segments[:, first:first + AT_ONCE]
        segments = (segments - segments.mean(axis=2, keepdims=True)) * window
        z = np.fft.rfft(segments, nfft, axis=2).transpose(2, 0, 1)
        s += z @ z.conj().transpose(0, 2, 1)
    return s[1:] * (2 / (count * rate * np.sum(window**2)))


def all_by_scipy(x, averages, rate, *setting):
    p = len(x) // 2

    def one(a, b):
        return coherence(x[a], x[b], rate, "hann", *setting)[1][1:]

    between = np.array([[one(p + i, j) for j in range(p)] for i in range(p)]).transpose(2, 0, 1)
    return everything(pairs(x, rate, *setting), averages, [between, np.array([one(i, j) for i in range(p) for j in range(i)])])


def all_by_numpy(x, averages, rate, *setting):
    s = batched(x, rate, *setting)
    return everything(s, averages, ordinary(s))
