"""The same free-run fit by SciPy: three 50 s trials of a planar limb, thirteen parameters and each trial's initial state.

Usage: python benches/peers/fit_scipy.py [--numba-only]
Builds and runs the example `free_run_speed` of ndof-models, which writes the trials and times our fit, and fits the same
model to the same trials with scipy.optimize.least_squares. The model is stepped exactly for a force that is linear between
samples by both: here once with scipy.signal.lsim, as a SciPy user would, and once with the same recursion compiled by
numba, as a SciPy user in a hurry would. Derivatives are least_squares' own differences. Prints versions, times, the ratio
and how far the optima are apart in standard errors.
"""
import json, os, platform, resource, subprocess, sys, tempfile, time
import numpy as np, scipy
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lsim

RATE = 500.0
START = np.array([1, 0, 1, 8, 0, 8, 200, 0, 200, 0, 0, 0, 0], float)
root = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def system(p):
    m, b, k = (np.array([[p[i], p[i + 1]], [p[i + 1], p[i + 2]]]) for i in (0, 3, 6))
    inverse = np.linalg.inv(m)
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ k, -inverse @ b]])
    return a, np.vstack([np.zeros((2, 2)), inverse]), np.hstack([np.eye(2), np.zeros((2, 2))]), np.zeros((2, 2))


def by_lsim(p, force, state):
    t = np.arange(len(force)) / RATE
    return lsim(system(p), force, t, X0=state)[1]


try:
    import numba

    @numba.njit(cache=False)
    def recursion(phi, gamma, feed, u, y):
        out = np.empty((len(u), 2))
        for k in range(len(u)):
            out[k] = y[:2] + feed[:2] @ u[k]
            y = phi @ y + gamma @ u[k]
        return out

    def by_numba(p, force, state):
        phi, gamma, c, feed, _ = cont2discrete(system(p), 1 / RATE, "foh")
        # First-order hold of cont2discrete moves the state: x = z + D u.
        full = cont2discrete((system(p)[0], system(p)[1], np.eye(4), np.zeros((4, 2))), 1 / RATE, "foh")
        return recursion(full[0], full[1], full[3], force, state - full[3] @ force[0])
except ImportError:
    by_numba = None


def fit(run, trials):
    t = np.arange(len(trials[0])) / RATE
    weight = np.ones(2)

    def residual(x):
        out = []
        for i, trial in enumerate(trials):
            force = trial[:, :2] - x[9:11] - np.outer(t, x[11:13])
            out.append(((trial[:, 2:] - run(x, force, x[13 + 4 * i:17 + 4 * i])) * weight).ravel())
        return np.concatenate(out)

    initial = np.concatenate([np.r_[d[0, 2:], (d[5, 2:] - d[0, 2:]) * RATE / 5] for d in trials])
    x = np.r_[START, initial]
    begun = time.perf_counter()
    weight = 1 / np.concatenate([d[:, 2:] for d in trials]).std(axis=0)
    first = least_squares(residual, x, method="lm", x_scale="jac", ftol=1e-5)
    weight = weight / residual(first.x).reshape(-1, 2).std(axis=0)
    found = least_squares(residual, first.x, method="lm", x_scale="jac", ftol=1e-12, xtol=1e-10)
    seconds = time.perf_counter() - begun
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    return seconds, found.x[:13], np.sqrt(np.diag(covariance))[:13], first.nfev + found.nfev


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "planar.csv")
        example = ["--release", "--quiet", "-p", "ndof-models", "--example", "free_run_speed"]
        subprocess.run(["cargo", "build", *example], cwd=root, check=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        ours = json.loads(subprocess.run(["cargo", "run", *example, path], cwd=root, check=True, capture_output=True, text=True).stdout)
        cpu = (resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before) / 5
        table = np.loadtxt(path, delimiter=",", skiprows=1)
    trials = [table[table[:, 0] == k, 1:] for k in range(3)]
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}, {os.cpu_count()} CPUs")
    print(f"ndof: {ours['seconds']:.3f} s, {cpu:.3f} s of processor time (making the data included)")
    for name, run in [("lsim", by_lsim), ("numba " + (numba.__version__ if by_numba else ""), by_numba)]:
        if run is None or ("--numba-only" in sys.argv and run is by_lsim):
            continue
        run(START, trials[0][:10, :2], np.zeros(4))
        begun = time.process_time()
        seconds, theta, sigma, calls = fit(run, trials)
        spent = time.process_time() - begun
        apart = np.max(np.abs(theta - ours["theta"]) / sigma)
        print(f"SciPy least_squares, {name}: {seconds:.2f} s, {spent:.2f} s of processor time ({calls} evaluations with differences), "
              f"{seconds / ours['seconds']:.0f} and {spent / cpu:.0f} times ours; optima apart by {apart:.1e} standard errors at most")


if __name__ == "__main__":
    main()
