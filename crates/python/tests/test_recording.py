"""Recordings from what Python people have."""

import pickle

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import ndof


def test_samples_are_kept_and_cannot_be_written():
    force = np.arange(10.0)
    recording = ndof.Recording({"force_x": force}, 100)
    assert np.shares_memory(recording["force_x"], force)
    with pytest.raises(ValueError):
        recording["force_x"][0] = 1.0
    force[0] = 7.0


def test_units_are_converted_as_in_files(tmp_path):
    (tmp_path / "a.csv").write_text("# sample_rate_hz: 100\nforce_x [kN],pos_x [mm],vel_x [deg/s],emg [V]\n1,2,3,4\n5,6,7,8\n")
    ours = ndof.Recording({"force_x [kN]": [1, 5], "pos_x [mm]": [2, 6], "vel_x": [3, 7], "emg [V]": [4, 8]}, 100, units={"vel_x": "deg/s"})
    theirs = ndof.read(tmp_path / "a.csv")
    assert ours.units == theirs.units == {"force_x": "N", "pos_x": "m", "vel_x": "rad/s", "emg": "V"}
    assert all(np.array_equal(ours[name], theirs[name]) for name in ours)


def test_a_frame_and_a_dataset_are_read_under_the_rules_of_files(tmp_path):
    time = np.arange(200) / 128
    frame = pd.DataFrame({"time": time, "force_x [N]": np.sin(time), "angle_x [deg]": np.cos(time)})
    frame.to_csv(tmp_path / "a.csv", index=False)
    read = ndof.read(tmp_path / "a.csv")
    plain = ndof.Recording.from_pandas(frame)
    assert plain == read and plain.warnings == read.warnings
    stamped = frame.drop(columns="time").set_index(pd.to_datetime(time, unit="s"))
    assert ndof.Recording.from_pandas(stamped) == read
    named = frame.set_index("time")
    assert ndof.Recording.from_pandas(named) == read
    data = xr.Dataset(
        {"force_x": ("time", np.sin(time), {"units": "N"}), "angle_x": ("time", np.cos(time), {"units": "deg"})}, coords={"time": time}
    )
    assert ndof.Recording.from_xarray(data) == read
    assert ndof.Recording.from_xarray(read.to_xarray()) == read
    assert ndof.Recording.from_pandas(read.to_pandas(), units=read.units) == read


def test_irregular_time_is_an_error_or_repaired():
    time = np.delete(np.arange(1000) / 500, 400)
    frame = pd.DataFrame({"t": time, "force_x": np.sin(time)})
    with pytest.raises(ndof.NdofError, match="sample 400"):
        ndof.Recording.from_pandas(frame)
    repaired = ndof.Recording.from_pandas(frame, resample=True)
    assert repaired.sample_rate_hz == 500 and "resampled" in [code for code, _, _ in repaired.warnings]


def test_what_makes_no_recording_is_refused():
    for channels, rate, text in [
        ({"a": [1.0], "b": [1.0, 2.0]}, 10, 'channel "b" has 2 samples'),
        ({"a": [1.0]}, 0, "sample rate 0 Hz"),
        ({"a": [[1.0]]}, 10, "2 dimensions"),
        ({"a [N]": [1.0], "a": [1.0]}, 10, "a"),
    ]:
        with pytest.raises(ndof.NdofError, match=text):
            ndof.Recording(channels, rate)
    with pytest.raises(OSError, match="no-such.csv"):
        ndof.read("no-such.csv")
    with pytest.raises(KeyError, match="force_x"):
        ndof.Recording({"force_x": [1.0]}, 10)["force_y"]


def test_results_and_recordings_pickle(spring):
    response = ndof.frequency_response(spring, nperseg=500)
    results = [spring[0], response, response.direct, ndof.fit(spring, nperseg=500), ndof.check(spring)]
    again = pickle.loads(pickle.dumps(results))
    assert again == results
    assert repr(again[2]) == repr(response.direct)


def test_preparing_leaves_the_original_alone(spring):
    one = spring[0]
    before = one["force_x"].copy()
    turned = one.negate("force_x", "force_y")
    assert np.array_equal(turned["force_x"], -one["force_x"]) and np.array_equal(turned["pos_x"], one["pos_x"])
    tared = one.tare(one)
    assert abs(tared["force_x"].mean()) < 1e-12 * np.abs(before).max()
    assert not np.array_equal(one.without_handle(0.5)["force_x"], before)
    assert np.array_equal(one["force_x"], before)
