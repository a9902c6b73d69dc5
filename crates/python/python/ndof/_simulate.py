"""Simulated experiments, perturbations to command, and whole studies."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import _ndof
from ._diagnose import Diagnosis, Progress
from ._fit import Fit
from ._options import Document, PathLike, Stretch, document, settings
from ._recording import Recording, Recordings, recordings_of
from ._response import FrequencyResponse
from ._result import Result

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame


class Simulation:
    """Simulated recordings with the truth behind them.

    >>> import ndof
    >>> ndof.simulate("arm", trials=2)
    Simulation(2 trials: 6 channels (cmd_x [N], cmd_y [N], force_x [N], force_y [N], pos_x [m], pos_y [m]), 50.0 s at 500.0 Hz)
    """

    __slots__ = ("recordings", "truth")

    recordings: list[Recording]
    """One a trial."""
    truth: dict[str, Any]
    """What was simulated: the experiment as it was understood, and the limb's matrices."""

    def __init__(self, recordings: list[Recording], truth: dict[str, Any]) -> None:
        self.recordings = recordings
        self.truth = truth

    def __repr__(self) -> str:
        count = len(self.recordings)
        what = repr(self.recordings[0])[len("Recording(") : -1] if count else ""
        return f"Simulation({count} trial{'' if count == 1 else 's'}: {what})"


def simulate(
    experiment: Document, *, seed: int | None = None, trials: int | None = None, progress: Progress | None = None
) -> Simulation:
    """Simulates an experiment: device, limb, controller, sensors and hidden effects to recordings, as ``ndof simulate``.

    ``experiment`` is the name of a built-in study, a file, or a dictionary with the same keys. The same seed gives the
    same bytes, on any number of threads.

    >>> import ndof
    >>> first, second = ndof.simulate("arm", trials=2, seed=7).recordings
    >>> first == ndof.simulate("arm", trials=1, seed=7).recordings[0]
    True
    """
    parts, truth = _ndof.simulate(document(experiment), seed, trials, progress)
    return Simulation([Recording._from_parts(one) for one in parts], json.loads(truth))


class Design(Result):
    """Perturbations to command on a robot, one recording a trial, and what they will do: the result ``ndof/design/1``.

    Of a ``robot`` it is one motion of its joints, and the result ``ndof/excitation/1``.

    >>> import ndof
    >>> ndof.design("multisine", axes=["x", "y"], trials=2, duration_s=20)
    Design(2 trials: 2 channels (cmd_x [N], cmd_y [N]), 20.0 s at 500.0 Hz)
    """

    __slots__ = ("recordings",)

    recordings: list[Recording]
    """One a trial, with a channel ``cmd_…`` an axis; of a robot with ``angle_…``, ``vel_…``, ``acc_…``, ``torque_…`` of each joint."""

    def __init__(self, text: str, recordings: list[Recording]) -> None:
        super().__init__(text)
        self.recordings = recordings

    @property
    def seeds(self) -> list[int | None]:
        """The seed of the generator behind each: of filtered noise the one picked among the candidates; multisines of one design share theirs.

        >>> import ndof
        >>> ndof.design("multisine", axes=["x", "y"], trials=2, duration_s=20, seed=4).seeds
        [4000012, 4000012]
        """
        return [trial["seed"] for trial in self.to_dict().get("trials", [])]

    @property
    def coherence(self) -> list[float | None]:
        """The largest coherence between the axes of each as it is commanded; None for one axis and for multisines.

        >>> import ndof
        >>> [found] = ndof.design(axes=["x", "y"], candidates=20, duration_s=20).coherence
        >>> 0 < found < 1
        True
        """
        stages = [trial["coherence"] for trial in self.to_dict().get("trials", [])]
        return [stage and stage["commanded"]["max"] for stage in stages]

    def __reduce__(self) -> tuple[Any, ...]:
        return Design, (self.to_json(), self.recordings)

    def __repr__(self) -> str:
        count = len(self.recordings)
        what = repr(self.recordings[0])[len("Recording(") : -1] if count else ""
        return f"Design({count} trial{'' if count == 1 else 's'}: {what})"


def design(
    kind: str | None = None,
    *,
    experiment: Document | None = None,
    precompensate: bool = False,
    corrections: int | None = None,
    axes: Sequence[str] | None = None,
    rotational: bool = False,
    trials: int | None = None,
    duration_s: float | None = None,
    lead_in_s: float | None = None,
    sample_rate_hz: float | None = None,
    rms: float | None = None,
    cutoff_hz: float | None = None,
    order: int | None = None,
    candidates: int | None = None,
    shortlist: int | None = None,
    decorrelate: bool = False,
    period_s: float | None = None,
    lines_hz: Stretch | None = None,
    harmonics: str | None = None,
    axis_plan: str | None = None,
    slope: float | None = None,
    crest_steps: int | None = None,
    sweep: str | None = None,
    fade_s: float | None = None,
    peak: float | None = None,
    slew: float | None = None,
    max_displacement: float | None = None,
    max_velocity: float | None = None,
    soft: tuple[float, float, float] | None = None,
    stiff: tuple[float, float, float] | None = None,
    target_ci: Sequence[str] = (),
    fit_band: Stretch | None = None,
    band: Stretch | None = None,
    robot: PathLike | None = None,
    tip: str | None = None,
    speed_limit: float | Sequence[float] = (),
    acceleration_limit: float | Sequence[float] = (),
    margin: float | None = None,
    fourier_terms: int | None = None,
    starts: int | None = None,
    torque_noise: float | None = None,
    interest: Sequence[str] = (),
    seed: int | None = None,
    progress: Progress | None = None,
) -> Design:
    """Designs the perturbation to command on a robot, as ``ndof design`` does.

    ``kind`` is ``filtered-noise`` (drawn from ``candidates`` seeds; the one whose axes look least coherent is taken),
    ``multisine`` (orthogonal from trial to trial), ``prbs`` or ``chirp``. ``rms`` is that of each axis in N, or in N m
    where ``rotational``. With ``experiment`` (the name of a built-in study, a file, or a dictionary) what is not given follows
    from it, and forces and motion are predicted; ``precompensate`` sends the commands through the inverse of its linear model.
    With ``robot`` (a URDF or TOML file) it is a motion of its joints within range, speed and torque that tells inertial parameters and
    friction, in periods of ``period_s``, with ``fourier_terms`` sines and cosines a joint.
    ``target_ci`` (such as ``"K=10%"``, ``"gain@2=5%"``) asks how long to measure. Every option is that of the command line, with
    its default.

    >>> import ndof
    >>> noise = ndof.design(axes=["x", "y"], candidates=20, duration_s=20).recordings[0]
    >>> round(float(noise["cmd_x"].std()), 1)
    4.0
    """
    asked = locals()
    asked["axes"] = None if axes is None else list(axes)
    asked["target_ci"] = list(target_ci)
    asked["robot"] = None if robot is None else os.fspath(robot)
    for name, limit in {"speed_limit": speed_limit, "acceleration_limit": acceleration_limit}.items():
        asked[name] = [limit] if isinstance(limit, (int, float)) else list(limit)
    asked["interest"] = list(interest)
    given = None if experiment is None else document(experiment)
    # An empty list asks for nothing, and what is of robots' motions is no setting of perturbations.
    told = settings("design", {name: value for name, value in {**asked, "experiment": None}.items() if value != []})
    parts, text = _ndof.design(told, given, progress) if robot is None else _ndof.excite(told, progress)
    return Design(text, [Recording._from_parts(one) for one in parts])


class StudyCase:
    """One case of a study: recordings, response, fit, and the table of what was found beside what was simulated.

    >>> case = study.cases[0]  # of ndof.study("arm")
    >>> case.estimate.kind, case.fit.to_dict()["estimate"]
    ('compliance', 'derived')
    """

    __slots__ = ("name", "recordings", "estimate", "fit", "diagnosis", "truth", "_table")

    name: str
    recordings: list[Recording]
    """The trials, simulated or given."""
    estimate: FrequencyResponse
    fit: Fit
    diagnosis: Diagnosis | None
    """What a linear model misses, where the study asks for it."""
    truth: dict[str, Any] | None
    """What was simulated."""

    def __init__(self, native: _ndof.Case, recordings: list[Recording]) -> None:
        self.name = native.name
        self.recordings = recordings
        self.estimate = FrequencyResponse(native.estimate)
        self.fit = Fit(native.fit)
        self.diagnosis = None if native.diagnosis_json is None else Diagnosis(native.diagnosis_json)
        self.truth = None if native.truth_json is None else json.loads(native.truth_json)
        self._table = native.table

    def to_pandas(self) -> _DataFrame:
        """The parameters, those at the joints last: what was simulated beside what was found.

        >>> table = study.cases[0].to_pandas().set_index("name")
        >>> bool(table.loc["K_x_x", "low"] < table.loc["K_x_x", "simulated"] < table.loc["K_x_x", "high"])
        True
        """
        import pandas

        rows = [
            {
                "name": name,
                "unit": unit,
                "simulated": truth,
                "estimate": value,
                "low": None if ends is None else ends[0],
                "high": None if ends is None else ends[1],
                "identifiable": identifiable,
            }
            for name, unit, truth, value, ends, identifiable in self._table
        ]
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        return f"StudyCase({self.name!r}, {len(self.recordings)} trials)"


class StudyResult(Result):
    """A whole study with its cases: the result ``ndof/study/1``, the page, and what each case gave.

    >>> study  # of ndof.study("arm")
    StudyResult('Impedance of a patient-like arm on MIT-MANUS', 1 case)
    >>> study.cases[0].fit.K.shape
    (2, 2)
    """

    __slots__ = ("title", "cases", "report")

    title: str
    cases: list[StudyCase]
    report: str
    """The page as HTML."""

    def __init__(self, text: str, title: str, report: str, cases: list[StudyCase]) -> None:
        super().__init__(text)
        self.title = title
        self.report = report
        self.cases = cases

    def write_report(self, path: PathLike) -> None:
        """Writes the page, which needs no other file.

        >>> import tempfile, pathlib
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "report.html"
        ...     study.write_report(path)
        ...     path.stat().st_size > 100_000
        True
        """
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(self.report)

    def __reduce__(self) -> tuple[Any, ...]:
        return StudyResult, (self.to_json(), self.title, self.report, self.cases)

    def __repr__(self) -> str:
        count = len(self.cases)
        return f"StudyResult({self.title!r}, {count} case{'' if count == 1 else 's'})"


def study(
    study: Document, *, recordings: Recordings | None = None, seed: int | None = None, progress: Progress | None = None
) -> StudyResult:
    """Runs a whole study, as ``ndof study`` does: simulate (or take ``recordings``), estimate, fit, project, diagnose.

    ``study`` is a built-in one (``arm``, ``wrist``, ``spring-array``), a file, or a dictionary with the same keys.

    >>> import ndof
    >>> ndof.study("arm")
    StudyResult('Impedance of a patient-like arm on MIT-MANUS', 1 case)
    """
    given = None if recordings is None else recordings_of(recordings)
    title, text, page, cases = _ndof.study(document(study), given, seed, progress)
    made = [StudyCase(native, [Recording._from_parts(one) for one in parts]) for native, parts in cases]
    return StudyResult(text, title, page, made)


def registry(what: str) -> dict[str, str]:
    """What there is of ``effects``, ``joints``, ``devices``, ``limbs`` or ``studies``, each with a line on it.

    >>> import ndof
    >>> list(ndof.registry("studies"))
    ['arm', 'arm-moving', 'arm-hidden', 'sensitivity', 'drift', 'masses', 'spring-array', 'wrist']
    """
    return dict(_ndof.registry(what))
