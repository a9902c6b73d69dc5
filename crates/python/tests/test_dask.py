"""Dask with processes and its real scheduler."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import cohort
import ndof

import dask_cohort  # from examples/, which cohort puts on the path

distributed = pytest.importorskip("dask.distributed")


@pytest.fixture(scope="module")
def client():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            yield client


def test_five_hundred_recordings_with_a_worker_killed_midway_give_the_table_of_the_command_line(client, many, tmp_path):
    folder, expected = many
    assert len(expected) == 501
    before = set(client.run(os.getpid).values())
    killed = []

    def done():
        return sum(task.state == "memory" for task in list(client.cluster.scheduler.tasks.values()))

    def kill():
        # Midway: a tenth of the rows are there, and most are not.
        while done() < len(expected) // 10:
            time.sleep(0.002)
        os.kill(min(before), signal.SIGKILL)
        killed.append((min(before), done()))

    thread = threading.Thread(target=kill)
    thread.start()
    table = dask_cohort.cohort(client, folder, **cohort.OPTIONS)
    thread.join()
    assert killed[0][1] < len(expected) - 50, "the worker was killed after the work"
    assert killed[0][0] not in set(client.run(os.getpid).values())
    cohort.assert_same(table, expected)
    assert table["error"].ne("").sum() == 1 and "torn.csv" in table["error"].iloc[-1]
    table.to_parquet(tmp_path / "a.parquet")
    ndof.cohort_table(list(table.to_dict("records"))).to_parquet(tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def load(start, stop):
    """A stretch of a recording that nobody holds as a whole: any sample follows from its index."""
    k = np.arange(start, stop, dtype=np.float64)
    return np.stack([np.sin(k * k * 1e-5), np.sin(0.1 * k) + np.cos(k * k * 2e-5)])


def test_a_recording_on_seven_tasks_gives_the_bytes_of_one_pass(client):
    spectra = dask_cohort.long_spectra(client, load, 400_000, 7, fs=500, nperseg=512)
    assert spectra.to_bytes() == ndof.cross_spectra(load(0, 400_000), 500, nperseg=512).to_bytes()
