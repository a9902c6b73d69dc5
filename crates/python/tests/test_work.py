"""Long work: other threads run, Ctrl-C ends it, progress is heard, and the number of threads does not show."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import ndof


def test_progress_is_heard_and_may_end_the_work(spring):
    heard = []
    ndof.simulate("arm", progress=lambda *step: heard.append(step))
    assert ("design", 6, 6) in heard and ("simulate", 6, 6) in heard

    class Enough(Exception):
        pass

    def stop(what, done, total):
        raise Enough

    with pytest.raises(Enough):
        ndof.diagnose(spring, progress=stop)


def test_other_threads_run_meanwhile(spring):
    counted, done = 0, threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    started = time.perf_counter()
    ndof.diagnose(spring)
    took = time.perf_counter() - started
    done.set()
    thread.join()
    # With the lock held it would not count at all; a busy machine may slow it down tenfold.
    assert counted > 100 * took


INTERRUPTED = """
import os, signal, threading, time
import ndof

trials = ndof.simulate("spring-array", trials=3).recordings
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
started = time.perf_counter()
try:
    ndof.diagnose(trials)
except KeyboardInterrupt:
    print(time.perf_counter() - started)
print(ndof.fit(trials, nperseg=500).K.shape)
"""


def test_control_c_ends_a_diagnosis_at_once():
    run = subprocess.run([sys.executable, "-c", INTERRUPTED], check=True, capture_output=True, text=True)
    waited, shape = run.stdout.split("\n", 1)
    # 0.3 s until the signal; the call returns at the next look, 20 ms later on a calm machine.
    assert float(waited) < 2.0 and shape == "(2, 2)\n"
    assert run.stderr == ""


def test_results_do_not_depend_on_threads(spring):
    results = set()
    for threads in (1, 2, 3):
        ndof.set_threads(threads)
        assert ndof.threads() == threads
        results.add(ndof.fit(spring, nperseg=500).to_json())
    ndof.set_threads(0)
    assert len(results) == 1 and ndof.threads() == os.cpu_count()


def test_an_interrupt_in_progress_is_an_interrupt():
    def interrupt(what, done, total):
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        ndof.simulate("arm", progress=interrupt)
