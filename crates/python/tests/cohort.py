"""What the tests on Dask and Spark share: recordings of many subjects, and the table that the command line makes of them."""

import csv
import math
import pathlib
import sys

import ndof

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "examples"))

OPTIONS = {"nperseg": 512, "band": (0.5, 10)}
FLAGS = ["--nperseg", "512", "--band", "0.5-10"]

EXPERIMENT = {
    "duration_s": 8.0,
    "sample_rate_hz": 250.0,
    "device": {"name": "mit-manus"},
    "limb": {"name": "endpoint-linear", "M": [[2.0, -0.5], [-0.5, 2.0]], "B": [[11.0, -2.0], [-2.0, 15.0]]},
}


def make(folder, groups, subjects):
    """Writes recordings of `groups` × `subjects` subjects, each group with a stiffness of its own, and a broken file."""
    for group in range(groups):
        stiffness = [[200.0 + 20.0 * group, -50.0], [-50.0, 400.0 + 10.0 * group]]
        experiment = {**EXPERIMENT, "seed": group + 1, "trials": subjects, "limb": {**EXPERIMENT["limb"], "K": stiffness}}
        for k, recording in enumerate(ndof.simulate(experiment).recordings):
            recording.write(folder / f"subject-{group:02}-{k:02}.npz")
    (folder / "torn.csv").write_text("time,force_x\n0.0,1.0\n0.002,1.0\n0.009,1.0\n")


def read_csv(path):
    """The table of `ndof cohort`, numbers as numbers."""
    with open(path, newline="", encoding="utf-8") as file:
        return [{name: cell if name in ("subject", "warnings", "error") else float(cell or "nan") for name, cell in row.items()} for row in csv.DictReader(file)]


def assert_same(table, expected):
    """The same rows in the same order, numbers to the last bit."""
    assert list(table.columns) == list(expected[0])
    assert table["subject"].tolist() == [row["subject"] for row in expected]
    for ours, theirs in zip(table.to_dict("records"), expected):
        for name, value in theirs.items():
            same = ours[name] == value or (isinstance(value, float) and math.isnan(value) and math.isnan(ours[name]))
            assert same, (theirs["subject"], name, ours[name], value)
