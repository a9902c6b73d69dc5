"""The whole of an estimate as a script does it: reads a file of n forces and n motions, estimates, writes all of it as JSON.

    python program.py scipy|numpy FILE RATE NPERSEG OUT [--warm]

scipy: pandas and scipy.signal. numpy: pyarrow and batched transforms. With --warm it reads and estimates again, without writing, until three
seconds have passed, and prints the least wall time: what a whole process of another program may be compared with.
"""
import json
import sys
import time

who, path, rate, nperseg, out = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4]), sys.argv[5]

import numpy as np
from estimate import all_by_numpy, all_by_scipy


def read():
    if path.endswith(".parquet"):
        import pyarrow.parquet
        table = pyarrow.parquet.read_table(path)
    elif who == "numpy":
        import pyarrow.csv
        table = pyarrow.csv.read_csv(path, read_options=pyarrow.csv.ReadOptions(skip_rows=comments()))
    else:
        import pandas
        return np.ascontiguousarray(pandas.read_csv(path, comment="#").to_numpy().T)
    return np.array([table.column(name).to_numpy() for name in table.column_names])


def comments():
    with open(path) as file:
        return next(k for k, line in enumerate(file) if not line.startswith("#"))


def plain(values):
    return [values.real.tolist(), values.imag.tolist()] if np.iscomplexobj(values) else values.tolist()


def estimate():
    x = read()
    averages = 1 + (x.shape[1] - nperseg) // (nperseg // 2)
    return (all_by_scipy if who == "scipy" else all_by_numpy)(x, averages, rate, nperseg, nperseg // 2, nperseg)


if "--warm" in sys.argv:
    least, begun = float("inf"), time.perf_counter()
    while time.perf_counter() - begun < 3.0:
        clock = time.perf_counter()
        estimate()
        least = min(least, time.perf_counter() - clock)
    print(f"seconds {least:.9f}")
else:
    names = ("response", "noise", "inverse", "multiple", "partial", "condition", "ordinary", "inputs")
    found = {name: plain(values) for name, values in zip(names, estimate())}
    with open(out, "w") as file:
        json.dump(found, file)
