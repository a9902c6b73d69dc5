"""Reference numbers from SciPy for the tests of the crates `signal` and `sysid`.

Run in this folder with Python, NumPy and SciPy:  python make_reference.py
It writes the files beside it, each with the versions that made it. Data: own, made here (no licence restricts them).

Convention: S[a][b] = <A B*> = scipy.signal.csd(b, a), a lower triangle (a >= b) in the order (0,0), (1,0), (1,1), ...
"""
import json
import platform

import numpy as np
import scipy
from scipy import signal

SAMPLE_RATE_HZ = 100.0
CHANNELS = ["force_x", "force_y", "pos_x", "pos_y"]
VERSIONS = {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__}


def plain(value):
    """Nested lists with 15 significant digits; complex arrays as {re, im}."""
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        if np.iscomplexobj(value):
            return {"re": plain(value.real), "im": plain(value.imag)}
        return plain(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.15g}")
    return value


def write(name, **content):
    with open(name, "w") as file:
        json.dump({"made_by": "make_reference.py", "versions": VERSIONS, **plain(content)}, file, separators=(",", ":"))
        file.write("\n")


def records():
    """Two coupled forces through a 2 x 2 system with output noise; rounded, so that the file holds them exactly."""
    rng = np.random.default_rng(20071)
    n = 1200
    force = rng.uniform(-1, 1, (2, n))
    force[1] += 0.4 * np.roll(force[0], 3)
    force[0] += 0.3
    b1, a1 = signal.butter(2, 0.3)
    b2, a2 = signal.butter(1, 0.15)
    x = signal.lfilter(b1, a1, force[0]) + 0.3 * signal.lfilter(b2, a2, force[1]) + 0.05 * rng.standard_normal(n)
    y = -0.2 * signal.lfilter(b2, a2, force[0]) + signal.lfilter(b1, a1, force[1]) + 0.05 * rng.standard_normal(n)
    y += 0.001 * np.arange(n)
    return np.round(np.array([force[0], force[1], x, y]), 6)


def cross_spectra(data, nperseg, noverlap, nfft, window, symmetric, detrend):
    taper = signal.get_window(window, nperseg, fftbins=not symmetric)
    lower = []
    for a in range(len(data)):
        for b in range(a + 1):
            f, s = signal.csd(data[b], data[a], fs=SAMPLE_RATE_HZ, window=taper, nperseg=nperseg, noverlap=noverlap, nfft=nfft, detrend=detrend)
            lower.append(s)
    return f, np.array(lower)


def main():
    data = records()
    with open("signals.csv", "w") as file:
        file.write(f"# made_by: make_reference.py\n# versions: {json.dumps(VERSIONS)}\n# sample_rate_hz: {SAMPLE_RATE_HZ:g}\n")
        file.write(",".join(CHANNELS) + "\n")
        file.writelines(",".join(f"{v:.6f}" for v in row) + "\n" for row in data.T)

    names = ["hann", "hamming", "blackman", "blackmanharris", "flattop", "bartlett", "boxcar", "tukey:0.25", "tukey:0.5"]
    windows = []
    for name in names:
        argument = ("tukey", float(name.split(":")[1])) if ":" in name else name
        for n in (16, 17):
            for symmetric in (False, True):
                windows.append({"name": name, "n": n, "symmetric": symmetric, "samples": signal.get_window(argument, n, fftbins=not symmetric)})
    write("windows.json", windows=windows)

    settings = [
        (64, 32, 64, "hann", False, "constant"),
        (64, 48, 128, "hann", False, "linear"),
        (50, 25, 50, "hamming", True, "none"),
        (63, 21, 75, "blackmanharris", False, "constant"),
        (48, 0, 48, "boxcar", False, "linear"),
        (40, 30, 64, "flattop", True, "constant"),
    ]
    cases = []
    for nperseg, noverlap, nfft, window, symmetric, detrend in settings:
        f, lower = cross_spectra(data, nperseg, noverlap, nfft, window, symmetric, False if detrend == "none" else detrend)
        cases.append(dict(nperseg=nperseg, noverlap=noverlap, nfft=nfft, window=window, symmetric=symmetric, detrend=detrend, frequency_hz=f, lower=lower))
    write("csd.json", sample_rate_hz=SAMPLE_RATE_HZ, channels=CHANNELS, cases=cases)

    # Response and coherences with the first setting; inputs 0 and 1, outputs 2 and 3.
    nperseg, noverlap, nfft, window, symmetric, detrend = settings[0]
    f, lower = cross_spectra(data, *settings[0])
    s = np.zeros((4, 4, len(f)), complex)
    for a in range(4):
        for b in range(a + 1):
            s[a, b] = lower[a * (a + 1) // 2 + b]
            s[b, a] = s[a, b].conj()
    suu, syu, syy = s[:2, :2].transpose(2, 0, 1), s[2:, :2].transpose(2, 0, 1), s[2:, 2:].transpose(2, 0, 1)
    h = np.linalg.solve(suu.transpose(0, 2, 1), syu.transpose(0, 2, 1)).transpose(0, 2, 1)
    single = np.array([[s[2 + i, j] / s[j, j] for j in range(2)] for i in range(2)])
    ordinary = [[signal.coherence(data[j], data[2 + i], fs=SAMPLE_RATE_HZ, window=window, nperseg=nperseg, noverlap=noverlap, detrend=detrend)[1] for j in range(2)] for i in range(2)]
    between_inputs = signal.coherence(data[0], data[1], fs=SAMPLE_RATE_HZ, window=window, nperseg=nperseg, noverlap=noverlap, detrend=detrend)[1]
    explained = h @ suu @ h.conj().transpose(0, 2, 1)
    multiple = [explained[:, i, i].real / syy[:, i, i].real for i in range(2)]
    partial = []
    for i in range(2):
        row = []
        for j in range(2):
            inverse = np.linalg.inv(s[np.ix_([0, 1, 2 + i], [0, 1, 2 + i])].transpose(2, 0, 1))
            row.append(np.abs(inverse[:, j, 2]) ** 2 / (inverse[:, j, j].real * inverse[:, 2, 2].real))
        partial.append(row)
    write(
        "response.json",
        sample_rate_hz=SAMPLE_RATE_HZ,
        settings=dict(nperseg=nperseg, noverlap=noverlap, nfft=nfft, window=window, symmetric=symmetric, detrend=detrend),
        inputs=CHANNELS[:2],
        outputs=CHANNELS[2:],
        frequency_hz=f,
        h1=h.transpose(1, 2, 0),
        h1_single_input=single,
        coherence=dict(ordinary=ordinary, partial=partial, multiple=multiple, between_inputs=between_inputs),
    )

    designs = [
        (1, "lowpass", [20.0], 500.0),
        (8, "lowpass", [15.0], 500.0),
        (2, "lowpass", [30.0], 1000.0),
        (5, "lowpass", [8.0], 100.0),
        (3, "highpass", [0.2], 100.0),
        (4, "highpass", [10.0], 100.0),
        (1, "bandpass", [0.3, 12.0], 500.0),
        (3, "bandpass", [5.0, 12.0], 100.0),
        (4, "bandpass", [0.3, 12.0], 100.0),
    ]
    x = data[0, :200]
    filters = []
    for order, kind, corners, rate in designs:
        sos = signal.butter(order, corners if len(corners) > 1 else corners[0], kind, fs=rate, output="sos")
        filters.append(dict(order=order, kind=kind, corners_hz=corners, sample_rate_hz=rate, sos=sos, sosfilt=signal.sosfilt(sos, x), sosfiltfilt=signal.sosfiltfilt(sos, x)))
    write("filters.json", input=dict(channel=CHANNELS[0], samples=len(x)), filters=filters)

    tapers = []
    for n, nw, k in [(64, 4.0, 7), (101, 2.5, 4), (200, 3.0, 5)]:
        samples, concentration = signal.windows.dpss(n, nw, k, return_ratios=True)
        tapers.append(dict(n=n, nw=nw, tapers=samples, concentration=concentration))
    write("dpss.json", dpss=tapers)

    t = np.arange(300) / SAMPLE_RATE_HZ
    sweeps = [
        dict(method=method, from_hz=f0, to_hz=f1, samples=signal.chirp(t, f0, 3.0, f1, method, phi=-90))
        for method, f0, f1 in [("linear", 0.5, 12.0), ("logarithmic", 0.5, 12.0), ("logarithmic", 20.0, 2.0)]
    ]
    write("chirp.json", sample_rate_hz=SAMPLE_RATE_HZ, sweeps=sweeps)


if __name__ == "__main__":
    main()
