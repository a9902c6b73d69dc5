"""Minima of bounded least-squares problems by scipy.optimize.least_squares, for crates/models/tests/levenberg_marquardt.rs.

Run: python levenberg_marquardt.py > levenberg_marquardt.json
"""
import json
import numpy as np
import scipy
from scipy.optimize import least_squares


def rosenbrock(x):
    return [10 * (x[1] - x[0] ** 2), 1 - x[0]]


def powell(x):
    return [x[0] + 10 * x[1], 5 ** 0.5 * (x[2] - x[3]), (x[1] - 2 * x[2]) ** 2, 10 ** 0.5 * (x[0] - x[3]) ** 2]


T = np.arange(12) / 4


def decay(x):
    """Two exponentials with parameters of very different size; the bounds on the rates tell them apart."""
    y = 2e4 * np.exp(-1.3 * T) + 500 * np.exp(-0.2 * T) + 30 * np.sin(7 * T)
    return x[0] * np.exp(-x[1] * T) + x[2] * np.exp(-x[3] * T) - y


INF = float("inf")
CASES = [
    ("rosenbrock", rosenbrock, [-1.2, 1.0], [-INF] * 2, [INF] * 2),
    ("rosenbrock", rosenbrock, [-1.2, 1.0], [-1.5, -0.5], [0.5, INF]),
    ("powell", powell, [3.0, -1.0, 0.0, 1.0], [0.1, -20, -20, -20], [20.0] * 4),
    ("decay", decay, [1e4, 2.0, 300.0, 0.1], [0.0, 0.8, 0.0, 0.0], [INF, INF, INF, 0.7]),
    ("decay", decay, [1e4, 3.0, 100.0, 0.5], [0.0, 0.8, 0.0, 0.3], [INF, INF, INF, 0.7]),
]
out = []
for name, f, x0, lo, hi in CASES:
    r = least_squares(f, x0, bounds=(lo, hi), method="trf", jac="3-point", ftol=1e-15, xtol=1e-15, gtol=1e-15, x_scale="jac", max_nfev=5000)
    out.append(dict(problem=name, start=x0, lower=[None if v == -INF else v for v in lo], upper=[None if v == INF else v for v in hi], x=list(r.x), cost=r.cost))
print(json.dumps(dict(scipy=scipy.__version__, cases=out), indent=1))
