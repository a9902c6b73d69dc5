"""The recipes with other readers give the numbers of `ndof.read`."""

import importlib.util
import pathlib

import numpy as np
import pytest

import ndof

HERE = pathlib.Path(__file__).parents[1]
FILES = HERE.parent / "io" / "tests" / "fixtures" / "foreign"


@pytest.fixture(scope="module")
def recipes():
    spec = importlib.util.spec_from_file_location("from_other_readers", HERE / "examples" / "from_other_readers.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def same(recipe, read, names, count):
    assert recipe.sample_rate_hz == pytest.approx(read.sample_rate_hz, rel=1e-6)
    for name in names:
        assert np.array_equal(recipe[name][:count], read[name][:count]), name
        assert recipe.units[name] == read.units[name], name


def test_c3d(recipes):
    same(recipes.from_c3d(str(FILES / "plain.c3d")), ndof.read(FILES / "plain.c3d"), ["Fx", "EMG 1"], 120)


def test_tdms(recipes):
    same(recipes.from_tdms(FILES / "plain.tdms", "lab"), ndof.read(FILES / "plain.tdms"), ["force_x", "pos_x"], 120)


def test_xdf(recipes):
    # The last sample lies behind the end of the slower stream.
    same(recipes.from_xdf(str(FILES / "streams.xdf"), "robot"), ndof.read(FILES / "streams.xdf"), ["force_x", "pos_x"], 119)


def test_mcap(recipes):
    joints = recipes.from_mcap(str(FILES / "plain.mcap"), "/joint_states", 200.0)
    assert joints.units == {"angle_shoulder": "rad", "angle_elbow": "rad", "torque_shoulder": "N m", "torque_elbow": "N m"}
    assert len(joints["angle_elbow"]) in (119, 120)
