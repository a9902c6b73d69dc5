import os
import pathlib
import subprocess

import pytest

import ndof


@pytest.fixture(scope="session")
def program():
    """Runs the command line; the program is in $NDOF."""
    path = os.environ.get("NDOF")
    if path is None:
        pytest.fail("set NDOF to the program ndof; crates/python/test does")

    def run(*arguments, **more):
        return subprocess.run([path, *map(str, arguments)], check=True, capture_output=True, text=True, **more).stdout

    return run


@pytest.fixture(scope="session")
def arm(program, tmp_path_factory):
    """Six trials on the simulated arm as files."""
    folder = tmp_path_factory.mktemp("arm")
    program("simulate", "arm", "--seed", 1, "--out", folder / "trial.csv", "--quiet")
    return [folder / f"trial-{k}.csv" for k in range(1, 7)]


@pytest.fixture(scope="session")
def spring(tmp_path_factory):
    """Three recordings of a spring array."""
    return ndof.simulate("spring-array", trials=3).recordings


@pytest.fixture(scope="session")
def root():
    return pathlib.Path(__file__).parents[3]


@pytest.fixture(scope="session")
def many(program, tmp_path_factory):
    """500 subjects and a broken file, with the table that `ndof cohort` makes of them."""
    import cohort

    folder = tmp_path_factory.mktemp("many")
    cohort.make(folder, 20, 25)
    out = tmp_path_factory.mktemp("cohort")
    program("cohort", folder, "--out", out, *cohort.FLAGS, "--quiet")
    return folder, cohort.read_csv(out / "cohort.csv")
