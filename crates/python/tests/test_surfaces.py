"""What a task can be asked is the same at the command line, in a study's file, in Python and in the settings of a report."""

import inspect
import re

import pytest

import ndof
from ndof import _ndof

FUNCTIONS = {"estimate": ndof.frequency_response, "fit": ndof.fit, "diagnose": ndof.diagnose, "design": ndof.design}

# Settings that a surface has by another name or for a reason not at all.
STUDIES_ONLY = {"estimate": {"name"}, "diagnose": {"hide"}}
# The keys of a file of kinematics that the command line takes one by one; Python takes them in a dictionary.
KINEMATICS = {"arm", "link-lengths", "hand", "posture", "mean-force", "shoulder"}

# Options of reading, and where Python has them.
READING = {
    "sample-rate": (ndof.read, "sample_rate_hz"),
    "resample": (ndof.read, "resample"),
    "columns": (ndof.read, "columns"),
    "channels": (ndof.read, "channels"),
    "trial": (ndof.read, "trial"),
    "negate": (ndof.Recording.negate, "channels"),
    "tare": (ndof.Recording.tare, "unloaded"),
    "handle-mass": (ndof.Recording.without_handle, "mass_kg"),
    "align": (ndof.Recording.align, "other"),
    "align-by": (ndof.Recording.align, "by"),
}
# A robot's file and a simulator's logs: no settings of the search, and read by either surface itself; a function is a simulator in Python alone.
ROBOT = {"tip", "simulated", "simulate", "parameters"}
ROLES = {"reference", "input", "output", "start", "stop", "exclude"}
# What a program does with its result, and how it runs, which a caller in Python does himself.
PROGRAM = {"json", "report", "plots", "out", "study", "write", "quiet", "verbose", "threads", "stream", "exit-code", "help", "seed"}


def asked_of_python(function):
    """Keywords of a function under the names of the command line."""
    return {name.removesuffix("_s").removesuffix("_hz").replace("_", "-") for name in inspect.signature(function).parameters}


@pytest.fixture(scope="module")
def options(program):
    """Long options by subcommand, as the help lists them."""

    def of(command):
        return set(re.findall(r"^ +(?:-\w, )?--([a-z0-9-]+)", program(command, "--help"), re.MULTILINE))

    return {command: of(command) for command in [*FUNCTIONS, "check"]}


@pytest.mark.parametrize("task", FUNCTIONS)
def test_every_setting_of_a_task_can_be_asked_for(task, options):
    keys = set(_ndof.settings(task)) - STUDIES_ONLY.get(task, set())
    assert len(keys) > 5
    assert keys - options[task] == set()
    assert keys - asked_of_python(FUNCTIONS[task]) == set()


@pytest.mark.parametrize("task", FUNCTIONS)
def test_no_option_is_of_one_surface_alone(task, options):
    keys = set(_ndof.settings(task))
    if task == "fit":
        keys |= set(_ndof.settings("estimate"))
    of_recordings = set() if task == "design" else ROLES | set(READING)
    assert options[task] - keys - of_recordings - PROGRAM - ROBOT - (KINEMATICS if task in {"fit", "diagnose"} else set()) == set()
    python = asked_of_python(FUNCTIONS[task]) - {"recordings", "progress"}
    assert python - keys - of_recordings - ROBOT - {"report"} == set()


def test_every_option_of_reading_has_its_place(options):
    for command in ["estimate", "fit", "diagnose", "check"]:
        assert set(READING) | ROLES <= options[command], command
        assert ROLES <= asked_of_python({**FUNCTIONS, "check": ndof.check}[command]), command
    for option, (function, name) in READING.items():
        assert name in inspect.signature(function).parameters, option


@pytest.mark.parametrize("task", ["estimate", "fit", "diagnose"])
def test_every_setting_is_a_key_of_a_study(task):
    for key in _ndof.settings(task):
        # No setting is such a table, so that nothing runs: the error is about the value, and not about the key.
        with pytest.raises(ndof.NdofError) as refused:
            ndof.study({task: {key: {"no such": {}}}, "experiment": {"device": {"name": "none of that name"}}})
        assert f"unknown field `{key}`" not in str(refused.value), refused.value
    with pytest.raises(ndof.NdofError, match="no-such-key"):
        ndof.study({task: {"no-such-key": 1}, "experiment": {}})


@pytest.mark.parametrize("command", ["estimate", "fit", "diagnose"])
def test_a_report_shows_every_setting(command, program, spring, tmp_path):
    files = []
    for k, recording in enumerate(spring):
        files.append(tmp_path / f"{k}.npz")
        recording.write(files[-1])
    program(command, *files, "--band", "0.5-10", "--quiet", "--report", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    shown = set(re.findall(r"<t[dh][^>]*>([a-z0-9-]+)</t[dh]>", page))
    keys = set(_ndof.settings(command)) | (set(_ndof.settings("estimate")) if command == "fit" else set())
    assert keys - STUDIES_ONLY.get(command, set()) - {"name"} - shown == set()
