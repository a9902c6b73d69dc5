"""What inertia, damping and stiffness leave of a recording's efforts: least squares in the frequency domain, without the program."""

import numpy as np


def lines(effort, motion, rate_hz, band_hz, lead_s=0.0, slow=False):
    """Frequencies within the band, lines of the efforts, and lines of displacement, velocity and acceleration [order][axis][line], all under
    a Hann window. Derivatives are exact: those of the window are taken off, F{w x'} = s F{w x} - F{w' x}, so that nothing leaks. Motion that
    is known `lead_s` before the middle of what its sample of force stands for is moved there."""
    samples = len(effort[0])
    phase = np.pi * (np.arange(samples) + 0.5) / samples
    rate = 2 * np.pi * rate_hz / samples
    windows = np.array([np.sin(phase) ** 2, 0.5 * rate * np.sin(2 * phase), 0.5 * rate**2 * np.cos(2 * phase)])
    hz = np.fft.rfftfreq(samples, 1 / rate_hz)
    first = rate_hz / samples if slow else band_hz[0]
    chosen = (hz >= first) & (hz <= min(band_hz[1], 0.4 * rate_hz))
    s = 2j * np.pi * hz[chosen]
    forces = np.array([np.fft.rfft((row - np.mean(row)) * windows[0])[chosen] for row in effort])
    plain, once, twice = (np.array([np.fft.rfft((row - np.mean(row)) * window)[chosen] for row in motion]) for window in windows)
    orders = np.array([plain, s * plain - once, s * s * plain - 2 * s * once + twice])
    return hz[chosen], forces, orders * np.exp(s * lead_s)


def left(effort, orders):
    """Residual lines of effort = M a + B v + K x with a symmetric M, each row weighted by its effort, and the coefficients
    [row][order and axis]."""
    n, count = effort.shape
    sizes = np.linalg.norm(effort, axis=1)
    columns, places = [], []
    for i, j, order in ((i, j, order) for i in range(n) for j in range(n) for order in range(3)):
        if order < 2 or j >= i:
            column = np.zeros((n, count), complex)
            both = {(i, j), (j, i)} if order == 2 else {(i, j)}
            for row, axis in both:
                column[row] = orders[order][axis] / sizes[row]
            columns.append(column.ravel())
            places.append((both, order))
    parts = lambda rows: np.concatenate([rows.real, rows.imag], axis=-1)
    design, wanted = parts(np.array(columns)).T, parts((effort / sizes[:, None]).ravel())
    scale = np.linalg.norm(design, axis=0)
    fit = np.linalg.lstsq(design / scale, wanted, rcond=None)[0] / scale
    coefficients = np.zeros((n, 3 * n))
    for value, (both, order) in zip(fit, places):
        for row, axis in both:
            coefficients[row, order * n + axis] = value
    return effort - coefficients @ np.concatenate(orders), coefficients


def through(hz, force, coefficients):
    """What a force makes of the displacement of M, B, K with these coefficients."""
    n = len(force)
    s = 2j * np.pi * hz
    stiffness = sum(coefficients[:, None, order * n : (order + 1) * n] * (s**order)[None, :, None] for order in range(3))
    return np.linalg.solve(stiffness.transpose(1, 0, 2), force.T[..., None])[..., 0].T


def power(lines):
    return float(np.sum(np.abs(lines) ** 2))
