"""How well can the arm study be done? Root mean square errors of M, B, K over many seeds, by an implementation of its own.

Simulates the planar robot (five-bar, Coulomb friction, sampled PD hold, stiff transducer) that holds the patient-like arm P1,
six trials of 50 s at 500 Hz, estimates the compliance by Welch (both settings of Palazzolo et al. 2007), directly and derived
(S_yr S_ur^-1), and fits symmetric M, B, K to it by weighted least squares over 0.5 to 8 Hz.  `rms.json` is what it prints; the
acceptance test of the arm study compares ndof with it.

    python make_rms.py --seeds 100 > rms.json        # 12 minutes on one core
"""
import argparse
import json
import platform
import sys

import numba
import numpy as np
import scipy
import scipy.signal as sg
from numba import njit
from scipy.optimize import least_squares

FS, N, TRIALS = 500.0, 25_000, 6
L1, L2, BASE_Y = 0.4064, 0.51435, -0.65
H11, H22, H12 = 0.215, 0.180, 0.030          # absolute angles, kg m^2
KP, KD = 100.0, 5.0
KF, BF = 1e6, 800.0                          # transducer
M = np.array([[2.1, -0.55], [-0.55, 1.9]])
B = np.array([[11.0, -2.0], [-2.0, 15.0]])
K = np.array([[300.0, -60.0], [-60.0, 520.0]])
SETTINGS = {"fine": (8192, 4096, 4.79), "smooth": (2048, 512, 23.65)}
NFFT, BAND = 8192, (0.5, 8.0)


@njit(cache=True)
def simulate(command, limb_force, q_start, mi, b_limb, k_limb, substeps):
    """Classical Runge-Kutta; returns force and displacement, each averaged over the sample interval."""
    n = command.shape[1]
    h = 1.0 / (FS * substeps)
    s = np.zeros(8)
    s[0], s[1] = q_start
    x0 = L1 * np.cos(s[0]) + L2 * np.cos(s[1])
    y0 = L1 * np.sin(s[0]) + L2 * np.sin(s[1])
    force, motion = np.zeros((2, n)), np.zeros((2, n))
    g = np.tan(np.pi * 20.0 / FS)
    gain, pole = g / (1 + g), (g - 1) / (g + 1)
    last_d, last_v, v_f = np.zeros(2), np.zeros(2), np.zeros(2)
    k = np.zeros((4, 8))
    f = np.zeros(2)
    for i in range(n):
        d = np.array([L1 * np.cos(s[0]) + L2 * np.cos(s[1]) - x0, L1 * np.sin(s[0]) + L2 * np.sin(s[1]) - y0])
        v = (d - last_d) * FS
        v_f = gain * (v + last_v) - pole * v_f
        last_d, last_v = d, v
        cx = command[0, i] - KP * d[0] - KD * v_f[0]
        cy = command[1, i] - KP * d[1] - KD * v_f[1]
        for _ in range(substeps):
            for stage in range(4):
                c = 0.0 if stage == 0 else (0.5 if stage < 3 else 1.0)
                y = s.copy() if stage == 0 else s + c * h * k[stage - 1]
                s1, c1, s2, c2 = np.sin(y[0]), np.cos(y[0]), np.sin(y[1]), np.cos(y[1])
                dx, dy = L1 * c1 + L2 * c2 - x0, L1 * s1 + L2 * s2 - y0
                vx, vy = -L1 * s1 * y[2] - L2 * s2 * y[3], L1 * c1 * y[2] + L2 * c2 * y[3]
                f[0] = KF * (dx - y[4]) + BF * (vx - y[6])
                f[1] = KF * (dy - y[5]) + BF * (vy - y[7])
                if stage == 0:
                    force[:, i] += f / substeps
                    motion[0, i] += dx / substeps
                    motion[1, i] += dy / substeps
                ax, ay = cx - f[0], cy - f[1]
                sd = s1 * c2 - c1 * s2
                t1 = -L1 * s1 * ax + L1 * c1 * ay - 0.34 * np.tanh(y[2] / 0.005) - 0.01 * y[2] - H12 * sd * y[3] ** 2
                t2 = -L2 * s2 * ax + L2 * c2 * ay - 0.43 * np.tanh(y[3] / 0.005) - 0.01 * y[3] + H12 * sd * y[2] ** 2
                h12 = H12 * (c1 * c2 + s1 * s2)
                det = H11 * H22 - h12 * h12
                fx = f[0] + limb_force[0, i] - b_limb[0, 0] * y[6] - b_limb[0, 1] * y[7] - k_limb[0, 0] * y[4] - k_limb[0, 1] * y[5]
                fy = f[1] + limb_force[1, i] - b_limb[1, 0] * y[6] - b_limb[1, 1] * y[7] - k_limb[1, 0] * y[4] - k_limb[1, 1] * y[5]
                k[stage, 0], k[stage, 1] = y[2], y[3]
                k[stage, 2], k[stage, 3] = (H22 * t1 - h12 * t2) / det, (H11 * t2 - h12 * t1) / det
                k[stage, 4], k[stage, 5] = y[6], y[7]
                k[stage, 6] = mi[0, 0] * fx + mi[0, 1] * fy
                k[stage, 7] = mi[1, 0] * fx + mi[1, 1] * fy
            s = s + h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
    return force, motion


def inverse_kinematics(x, y):
    y = y - BASE_Y
    bend = np.arccos((x * x + y * y - L1**2 - L2**2) / (2 * L1 * L2))
    q1 = np.arctan2(y, x) - np.arctan2(L2 * np.sin(bend), L1 + L2 * np.cos(bend))
    return q1, q1 + bend


def trial(rng, limb_rms):
    low_pass = sg.butter(8, 15, fs=FS, output="sos")
    command = sg.sosfilt(low_pass, rng.uniform(-1, 1, (2, N + 2000)), axis=1)[:, 1000:]
    command *= 4.0 / command.std(axis=1, keepdims=True)
    limb = sg.sosfilt(sg.butter(2, 2, fs=FS, output="sos"), rng.standard_normal((2, N + 3000)), axis=1)[:, 2000:]
    limb *= limb_rms / limb.std(axis=1, keepdims=True)
    force, motion = simulate(command, limb, inverse_kinematics(0.0, 0.0), np.linalg.inv(M), B, K, 20)
    force = force + 0.03 * rng.standard_normal(force.shape)
    motion = np.round(motion / 5e-5) * 5e-5
    return np.vstack([command, force, motion])[:, 1000:]      # the first 2 s are left out


def spectra(trials, nperseg, hop):
    """S[f, a, b] = <A B*>, pooled over trials."""
    window = sg.get_window("hann", nperseg)
    total, count = 0, 0
    for z in trials:
        for start in range(0, z.shape[1] - nperseg + 1, hop):
            segment = z[:, start : start + nperseg]
            segment = np.fft.rfft((segment - segment.mean(1, keepdims=True)) * window, NFFT, axis=1)
            total = total + np.einsum("af,bf->fab", segment, segment.conj())
            count += 1
    return np.fft.rfftfreq(NFFT, 1 / FS), total / count


def hermitian(a):
    return np.conj(np.swapaxes(a, 1, 2))


def estimates(s):
    """Direct and derived compliance, each with the variances of its elements (up to the number of averages)."""
    r, u, y = slice(0, 2), slice(2, 4), slice(4, 6)
    inverse = np.linalg.inv(s[:, u, u])
    direct = s[:, y, u] @ inverse
    noise = np.real(np.einsum("fii->fi", s[:, y, y] - direct @ s[:, u, y]))
    direct_var = noise[:, :, None] * np.real(np.einsum("fii->fi", inverse))[:, None, :]
    derived = s[:, y, r] @ np.linalg.inv(s[:, u, r])
    coherent = s[:, u, r] @ np.linalg.solve(s[:, r, r], s[:, r, u])
    e = s[:, y, y] - derived @ s[:, u, y] - s[:, y, u] @ hermitian(derived) + derived @ s[:, u, u] @ hermitian(derived)
    e_r = s[:, y, r] - derived @ s[:, u, r]
    e = np.real(np.einsum("fii->fi", e - e_r @ np.linalg.solve(s[:, r, r], hermitian(e_r))))
    derived_var = e[:, :, None] * np.real(np.einsum("fii->fi", np.linalg.inv(coherent)))[:, None, :]
    return {"direct": (direct, direct_var), "derived": (derived, derived_var)}


def fit(f, c, var):
    """Symmetric M, B, K by least squares on the compliance, each element with its own weight."""
    keep = (f >= BAND[0]) & (f <= BAND[1])
    s, c, sd = 2j * np.pi * f[keep], c[keep], np.sqrt(np.maximum(var[keep], 1e-18))

    def matrices(p):
        return [np.array([[p[i], p[i + 1]], [p[i + 1], p[i + 2]]]) for i in (0, 3, 6)]

    def residual(p):
        m, b, k = matrices(p)
        model = np.linalg.inv(s[:, None, None] ** 2 * m + s[:, None, None] * b + k)
        e = ((c - model) / sd).ravel()
        return np.concatenate([e.real, e.imag])

    truth = np.array([X[i] for X in (M, B, K) for i in ((0, 0), (0, 1), (1, 1))])
    scale = np.repeat([np.abs(X).max() for X in (M, B, K)], 3)
    start = truth + 0.2 * scale * np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])     # 20 % off: the start is not the subject here
    return matrices(least_squares(residual, start, x_scale=scale, max_nfev=200).x)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    seeds = parser.parse_args().seeds
    rows = []
    for limb_rms in (0.0, 0.5, 1.5):
        errors = {}
        for seed in range(seeds):
            trials = [trial(np.random.default_rng([seed, t]), limb_rms) for t in range(TRIALS)]
            for name, (nperseg, hop, _) in SETTINGS.items():
                f, s = spectra(trials, nperseg, hop)
                for estimator, (c, var) in estimates(s).items():
                    found = fit(f, c, var)
                    error = [np.linalg.norm(x - t) / np.linalg.norm(t) for x, t in zip(found, (M, B, K))]
                    errors.setdefault((name, estimator), []).append(error)
            print(limb_rms, seed, file=sys.stderr, flush=True)
        for (name, estimator), values in errors.items():
            rms = np.sqrt(np.mean(np.square(values), axis=0))
            rows.append({"limb_noise_rms_n": limb_rms, "setting": name, "estimator": estimator, "rms_error": dict(zip("MBK", map(float, rms)))})
    versions = {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__, "numba": numba.__version__}
    json.dump({"made_by": "make_rms.py", "seeds": seeds, "band_hz": BAND, "versions": versions, "rows": rows}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
