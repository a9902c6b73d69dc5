"""Runs our program and the peers and prints the tables of the book's page on performance. Called by benches/peers/run as
`tables.py PROGRAM NDOF [SECTION …]`; without sections all of them. Each says how many seconds it took."""
import os
import platform
import subprocess
import sys
import tempfile
import time

import mujoco
import numpy
import scipy

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
PROGRAM, NDOF = sys.argv[1], sys.argv[2]
begun = time.time()


def lines(command, **environment):
    """`name value` lines of a command; the smallest value where a name comes twice."""
    text = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, env={**os.environ, **environment}).stdout
    found = {}
    for line in text.splitlines():
        name, value = line.split()
        found[name] = min(float(value), found.get(name, float("inf")))
    return found


def ours(*parts, **environment):
    return lines([PROGRAM, *parts], **environment)


def peer(script):
    return lines([sys.executable, os.path.join(HERE, script)])


def least(*runs):
    return {name: min(run[name] for run in runs) for name in runs[0]}


def table(title, header, rows):
    print(f"\n### {title}\n\n| " + " | ".join(header) + " |\n|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    sys.stdout.flush()


def ms(seconds):
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def times(ratio):
    return f"{ratio:.3g}×"


def child(command):
    """Seconds on the wall, of the processor, and peak memory in MB of a process."""
    clock = time.perf_counter()
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{' '.join(command)} failed")
    return time.perf_counter() - clock, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def processor():
    with open("/proc/cpuinfo") as file:
        return next((line.split(":")[1].strip() for line in file if line.startswith("model name")), platform.processor())


compiler = subprocess.run(["rustc", "--version"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
print(f"{processor()}, {os.cpu_count()} CPUs, load {os.getloadavg()[0]:.1f} before the run; {compiler}; Python {platform.python_version()}, NumPy {numpy.__version__}, "
      f"SciPy {scipy.__version__}, MuJoCo {mujoco.__version__}")


def spectra():
    # Ours before and after the peer, so that a disturbance of some seconds spoils neither.
    first, theirs, second = ours("spectra"), peer("spectra_scipy.py"), ours("spectra")
    own = least(first, second)
    def column(setting):
        t, bare = own[f"spectra.{setting}.response"], own[f"spectra.{setting}.bare"]
        scipy_all, numpy_all, scipy_alone, numpy_alone = (theirs[f"{who}.{setting}"] for who in ("scipy_all", "numpy_all", "scipy", "numpy"))
        return [ms(t), ms(bare), f"{own[f'spectra.{setting}.spectra'] / bare:.2f}", f"{t / bare:.2f}",
                f"{own[f'spectra.{setting}.derived'] / own[f'spectra.{setting}.bare_six']:.2f}", times(scipy_all / t), times(numpy_all / t),
                times(scipy_alone / t), times(numpy_alone / t), times(scipy_alone / bare), times(numpy_alone / bare)]

    what = ["ours", "bare transforms", "spectra over bare transforms", "ours over bare transforms", "derived estimate over bare transforms, six channels",
            "SciPy over ours", "NumPy over ours", "SciPy's response alone over all of ours", "NumPy's response alone over all of ours",
            "SciPy's response alone over bare transforms", "NumPy's response alone over bare transforms"]
    asked = {3: "≤ 1.5", 5: "≥ 40", 6: "≥ 5"}
    rows = [[*row, asked.get(k, "")] for k, row in enumerate(zip(what, column("45"), column("5")))]
    table("2 × 2 estimate of 25 000 samples × 4 channels, one core: response, covariance, all coherences, condition",
          ["what", "45 segments", "5 segments", "asked"], rows)


def hour():
    own = ours("hour")
    one, two = ours("threads", RAYON_NUM_THREADS="1"), ours("threads", RAYON_NUM_THREADS="2")
    table("6 × 6, one hour at 1 kHz (3.6 M samples × 12 channels, segments of 4096)", ["what", "measured", "asked"], [
        ["bare transforms", ms(own["hour.bare"]), ""],
        ["spectra, response, ordinary, partial and multiple coherence", ms(own["hour.plain"]), ""],
        ["over the bare transforms", f"{own['hour.plain'] / own['hour.bare']:.2f}", "≤ 2.2"],
        ["with six commands: derived, ordered coherence, all intervals too, over the plain estimate of the 18 channels",
         f"{own['hour.everything'] / own['hour.plain_eighteen']:.2f}", "≤ 1.25"],
        ["one thread over two, spectra of 12 channels (wall)", f"{one['threads'] / two['threads']:.2f}", "≥ 1.8"],
    ])


def simulation():
    own, theirs = ours("simulation"), peer("simulate_mujoco.py")
    speed = 50 / own["simulation.50s"]
    rows = [["ours, steps by tolerance", f"{own['simulation.error']:.1e}", f"{speed:.0f}×", ""],
            ["ours, two steps a sample", "", f"{50 / own['simulation.50s_two_steps']:.0f}×", ""]]
    for name in ("rk4", "implicitfast"):
        steps = max(int(key.split(".")[2]) for key in theirs if key.startswith(f"mujoco.{name}."))
        seconds, error = theirs[f"mujoco.{name}.{steps}.seconds"], theirs[f"mujoco.{name}.{steps}.error"]
        rows.append([f"MuJoCo {name}, {steps} steps a sample", f"{error:.1e}", f"{1 / seconds:.0f}×", times(speed * seconds)])
    table("Planar arm, nonlinear robot, stiff transducer, sampled controller: 50 s (asked: ≥ 1000 × real time at 1e-6; ≥ 5 × MuJoCo)",
          ["who", "relative error", "of real time", "ours faster by"], rows)


def fit():
    own = ours("fit")
    print(f"\n### Fits\n\nFree-run fit of 3 × 50 s, 13 parameters: {ms(own['fit.planar'])} of processor time. Beside SciPy:\n\n```text", flush=True)
    subprocess.run([sys.executable, os.path.join(HERE, "fit_scipy.py"), "--numba-only"], cwd=ROOT, check=True)
    print("```")


def six():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([PROGRAM, "six", folder], cwd=ROOT, check=True)
        trials = sorted(os.path.join(folder, file) for file in os.listdir(folder))
        rows = []
        for name, options in (("0.3 to 8 Hz", ["--band", "0.3-8"]), ("whole band", [])):
            wall, cpu, memory = child([NDOF, "fit", *trials, *options, "--quiet"])
            rows.append([name, f"{wall:.2f} s", f"{cpu:.2f} s", f"{memory:.0f} MB"])
        table("`ndof fit` of three trials of 50 s of six axes, reading included", ["band", "wall", "processor", "peak memory"], rows)


def diagnosis():
    own = ours("diagnosis")
    table("Diagnosis over the whole registry, one core", ["what", "processor", "asked"], [
        ["three planar trials of 50 s", ms(own["diagnosis.planar"]), "5 s"], ["one axis, one record of 50 s", ms(own["diagnosis.one_axis"]), "1 s"]])


def growth():
    own = ours("growth")
    for name, title, column in (("length", "Spectra of 4 channels with length", "samples"), ("channels", "Spectra of 200 000 samples with channels", "channels"),
                                ("diagnosis_length", "Diagnosis, 3 planar trials, with length", "s a trial"),
                                ("diagnosis_axes", "Diagnosis, 3 × 25 s, with axes", "axes"),
                                ("diagnosis_effects", "Diagnosis, 3 × 25 s planar, with hidden effects", "effects")):
        found = [(key.split(".", 2)[2], value) for key, value in own.items() if key.startswith(f"growth.{name}.")]
        table(title, [column, "processor", "over the first"], [[key, ms(value), f"{value / found[0][1]:.2f}"] for key, value in found])


def script(who, path, rate, nperseg, out, *more):
    return [sys.executable, os.path.join(HERE, "program.py"), who, path, str(rate), str(nperseg), out, *more]


def program():
    """Whole processes, ours and the peers', each reading a file and writing all of its estimate; the best of some runs."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([PROGRAM, "program", folder], cwd=ROOT, check=True)
        for file, what, rate, nperseg, times in (
            ("trial.csv", "2 × 2, 50 s at 500 Hz", 500, 2048, 9), ("hour.parquet", "3 × 3, one hour at 1 kHz", 1000, 4096, 2), ("hour.csv", "the same hour", 1000, 4096, 2),
        ):
            path, out = os.path.join(folder, file), os.path.join(folder, "out.json")
            estimate = [NDOF, "estimate", path, "--method", "welch", "--nperseg", str(nperseg), "--json", out, "--quiet"]
            runs = {"ndof estimate": estimate, "ndof estimate --stream": [*estimate, "--stream"], "ndof check": [NDOF, "check", path, "--quiet"],
                    "NumPy and pyarrow": script("numpy", path, rate, nperseg, out), "pandas and SciPy": script("scipy", path, rate, nperseg, out)}
            best = {name: min(child(command) for _ in range(times)) for name, command in runs.items()}
            rows = [[name, f"{1e3 * wall:.0f} ms", f"{1e3 * cpu:.0f} ms", f"{memory:.0f} MB"] for name, (wall, cpu, memory) in best.items()]
            for who, name in (("numpy", "NumPy and pyarrow"), ("scipy", "pandas and SciPy")):
                seconds = lines(script(who, path, rate, nperseg, out, "--warm"))["seconds"]
                rows.append([f"{name}: read and estimate, inside a warm interpreter", f"{1e3 * seconds:.0f} ms", "", ""])
            table(f"The whole program: {what}, {file} of {os.path.getsize(path) / 1e6:.1f} MB", ["who", "wall", "processor", "peak memory"], rows)
    print(f"\nThe program: {os.path.getsize(NDOF) / 1e6:.1f} MB with Parquet (asked of the default build: under 25 MB).")


SECTIONS = {section.__name__: section for section in (spectra, hour, simulation, fit, six, diagnosis, growth, program)}
wanted = sys.argv[3:] or list(SECTIONS)
unknown = [name for name in wanted if name not in SECTIONS]
if unknown:
    raise SystemExit(f"no section {', '.join(unknown)}; there are {', '.join(SECTIONS)}")
for name in wanted:
    clock = time.time()
    SECTIONS[name]()
    print(f"\n({name}: {time.time() - clock:.0f} s, load {os.getloadavg()[0]:.1f} after it)", flush=True)
print(f"\nAll of this took {time.time() - begun:.0f} s.")
