"""The command line and the package give the same bytes."""

import json
import pickle

import pytest

import ndof

KINEMATICS = """schema = "ndof/kinematics/1"
kind = "planar-two-link"
link_lengths_m = [0.33, 0.34]
posture_rad = [0.785398163397448, 1.5707963267949]
mean_force_n = "measured"
sd = { link_lengths_m = 0.01, posture_rad = 0.05 }
"""


def files(paths):
    return [str(path) for path in paths]


@pytest.mark.parametrize(
    "flags, options",
    [
        ([], {}),
        (["--nperseg", "1024", "--window", "blackman", "--detrend", "linear"], {"nperseg": 1024, "window": "blackman", "detrend": "linear"}),
        (["--method", "multitaper", "--time-bandwidth", "6", "--band", "0.5-20"], {"method": "multitaper", "time_bandwidth": 6, "band": (0.5, 20)}),
        (["--method", "local-polynomial", "--response", "impedance"], {"method": "local-polynomial", "response": "impedance"}),
        (["--nperseg", "512", "--robust", "--sliding", "20"], {"nperseg": 512, "robust": True, "sliding": 20}),
        (["--start", "5", "--exclude", "20-25", "--spectra", "--nperseg", "512"], {"start": 5, "exclude": [(20, 25)], "spectra": True, "nperseg": 512}),
    ],
)
def test_an_estimate_is_that_of_the_command_line(program, arm, flags, options):
    theirs = program("estimate", *arm[:2], *flags, "--quiet", "--json", "-")
    ours = ndof.frequency_response(files(arm[:2]), **options)
    assert ours.to_json() == theirs
    assert pickle.loads(pickle.dumps(ours)).to_json() == theirs


def test_a_fit_and_its_projection_are_those_of_the_command_line(program, arm, tmp_path):
    kinematics = tmp_path / "arm.toml"
    kinematics.write_text(KINEMATICS)
    flags = ["--nperseg", "2048", "--band", "0.5-8", "--quiet", "--json", "-"]
    plain = ndof.fit(files(arm), nperseg=2048, band=(0.5, 8))
    assert plain.to_json() == program("fit", *arm, *flags)
    theirs = program("fit", *arm, *flags, "--kinematics", kinematics)
    assert ndof.fit(files(arm), nperseg=2048, band=(0.5, 8), kinematics=kinematics).to_json() == theirs
    assert ndof.project(pickle.loads(pickle.dumps(plain)), kinematics).to_json() == theirs


def test_arrays_are_the_numbers_of_the_json(arm):
    response = ndof.frequency_response(arm[0], nperseg=1024)
    written = response.to_dict()["derived"]
    assert response.value[1, 0].real.tolist()[1:] == written["re"][1][0][1:]
    assert response.gain_ci95[0, 1, 5].tolist() == written["gain_ci95"][0][1][5]
    assert response.coherence("multiple")[1].tolist()[1:] == written["coherence_iv"]["multiple"][1][1:]
    assert response.direct.value[0, 0, 3].imag == response.to_dict()["direct"]["im"][0][0][3]


def test_check_is_that_of_the_command_line(program, arm):
    assert ndof.check(files(arm[:2])).to_json() == program("check", *arm[:2], "--quiet", "--json", "-")


def test_a_diagnosis_is_that_of_the_command_line(program, spring, tmp_path):
    names = []
    for k, recording in enumerate(spring):
        names.append(str(tmp_path / f"{k}.npz"))
        recording.write(names[-1])
    theirs = program("diagnose", *names, "--band", "0.5-10", "--seed", 3, "--quiet", "--json", "-")
    assert ndof.diagnose(names, band=(0.5, 10), seed=3).to_json() == theirs


def test_a_simulation_is_that_of_the_command_line(arm):
    simulated = ndof.simulate("arm", seed=1)
    assert [trial["pos_x"].tolist() for trial in simulated.recordings] == [ndof.read(file)["pos_x"].tolist() for file in arm]
    assert simulated.truth == json.loads(arm[0].with_name("trial.truth.json").read_text())


def test_a_study_is_that_of_the_command_line(program, tmp_path):
    program("study", "arm", "--out", tmp_path, "--quiet")
    study = ndof.study("arm")
    assert study.to_json() == (tmp_path / "study.json").read_text()
    assert study.cases[0].estimate.to_json() == (tmp_path / "estimate.json").read_text()
    assert study.cases[0].fit.to_json() == (tmp_path / "fit.json").read_text()


def test_a_design_is_that_of_the_command_line(program, tmp_path):
    program("design", "--kind", "multisine", "--trials", 2, "--duration", 20, "--seed", 4, "--out", tmp_path / "cmd.npz", "--quiet")
    ours = ndof.design("multisine", trials=2, duration_s=20, seed=4).recordings
    theirs = [ndof.read(tmp_path / f"cmd-{k}.npz") for k in (1, 2)]
    assert [trial["cmd_y"].tolist() for trial in ours] == [trial["cmd_y"].tolist() for trial in theirs]


def test_errors_have_the_text_of_the_command_line(program, arm):
    import subprocess

    with pytest.raises(subprocess.CalledProcessError) as theirs:
        program("estimate", arm[0], "--input", "force_X")
    with pytest.raises(ndof.NdofError) as ours:
        ndof.frequency_response(arm[0], input="force_X")
    assert f"error: {ours.value}\n" == theirs.value.stderr
