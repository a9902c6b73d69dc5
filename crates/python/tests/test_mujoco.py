"""The book's page of a foreign simulator, with MuJoCo itself: a load that its file lacks is named, proved by its own run, and written into the file."""

import importlib.util
import json
import sys

import numpy as np
import pytest

import ndof

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def example(root):
    path = root / "crates/python/examples/mujoco_arm/what_is_wrong.py"
    spec = importlib.util.spec_from_file_location("what_is_wrong", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_prints_what_it_says(example, root, tmp_path, monkeypatch, capsys, program):
    monkeypatch.chdir(tmp_path)
    example.main()
    # Words alike, numbers up to two units of the last digit that the page prints, as on every page that is followed.
    sys.path.insert(0, str(root / "book"))
    from follow_tutorials import listings, missing

    page = listings((root / "book/src/tutorials/simulator.md").read_text())
    said = next(text for language, text in page if language == "text")
    assert missing(said, capsys.readouterr().out) is None

    told = program("diagnose", "log.csv", "--robot", example.HERE / "arm.xml", "--simulated", "simulated.csv", "--write", "corrected.xml", "--json", "found.json", cwd=tmp_path)
    assert "corrected.xml" in told
    promised = json.loads((tmp_path / "found.json").read_text())["extended"]["held_out"]["nrmse"]
    log = ndof.read("log.csv")
    again = example.simulate(example.measured(), {}, {}, model=tmp_path / "corrected.xml")
    held_out = slice(int(0.7 * len(log)), None)
    for output, share in zip(["torque_shoulder", "torque_elbow"], promised):
        missed = np.std((log[output] - again[output])[held_out]) / np.std(log[output][held_out])
        # The promise is of torques below the band's edge and along the measured angles, whose steps the controller does not see.
        assert missed < 1.2 * share, (output, missed, share)


def test_a_simulator_that_answers_wrongly_is_told_so(example):
    log = example.measured()
    for answer, said in [
        (None, "dictionary"),
        ({"torque_wrist": np.zeros(len(log))}, 'returned "torque_wrist"'),
        ({"torque_elbow": np.zeros(3)}, "samples"),
        ({"angle_elbow": log["angle_elbow"]}, 'returned no "torque_'),
        ({"torque_elbow": np.full(len(log), np.nan)}, "not finite"),
    ]:
        with pytest.raises(ndof.NdofError, match=said):
            ndof.diagnose(log, robot=example.HERE / "arm.xml", simulate=lambda *_, answer=answer: answer)
    with pytest.raises(ndof.NdofError, match="one of the two"):
        ndof.diagnose(log, robot=example.HERE / "arm.xml", simulate=example.simulate, simulated=log)


def test_a_simulator_that_fails_with_what_is_found_leaves_the_diagnosis(example):
    def falls_over(inputs, added_effort, parameters):
        if added_effort:
            raise FloatingPointError("the simulation diverged")
        return example.simulate(inputs, added_effort, parameters)

    log, robot = example.measured(), example.HERE / "arm.xml"
    with pytest.warns(RuntimeWarning, match="proves nothing: FloatingPointError: the simulation diverged"):
        found = ndof.diagnose(log, robot=robot, simulate=falls_over)
    assert found.rerun is None
    assert found.to_dict() == ndof.diagnose(log, robot=robot, simulate=example.simulate).to_dict()
