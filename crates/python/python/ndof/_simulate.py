"""Simulated experiments, perturbations to command, and whole studies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import _ndof
from ._diagnose import Diagnosis, Progress
from ._fit import Document, Fit
from ._recording import PathLike, Recording, Recordings, recordings_of
from ._response import FrequencyResponse
from ._result import Result, document

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


class Design:
    """Perturbations to command on a robot, one recording a trial.

    >>> import ndof
    >>> ndof.design("multisine", axes=["x", "y"], trials=2, duration_s=20)
    Design(2 trials: 2 channels (cmd_x [N], cmd_y [N]), 20.0 s at 500.0 Hz)
    """

    __slots__ = ("recordings", "seeds", "coherence")

    recordings: list[Recording]
    """One a trial, with a channel ``cmd_…`` an axis."""
    seeds: list[int]
    """The seed that each was drawn from."""
    coherence: list[float | None]
    """The largest coherence between its axes, where several seeds were tried."""

    def __init__(self, recordings: list[Recording], seeds: list[int], coherence: list[float | None]) -> None:
        self.recordings = recordings
        self.seeds = seeds
        self.coherence = coherence

    def __repr__(self) -> str:
        count = len(self.recordings)
        what = repr(self.recordings[0])[len("Recording(") : -1] if count else ""
        return f"Design({count} trial{'' if count == 1 else 's'}: {what})"


def design(
    kind: str = "filtered-noise",
    *,
    axes: Sequence[str] = ("x", "y"),
    rotational: bool = False,
    trials: int = 1,
    duration_s: float = 50.0,
    sample_rate_hz: float = 500.0,
    rms: float = 4.0,
    peak: float | None = None,
    cutoff_hz: float = 15.0,
    order: int = 8,
    candidates: int = 100,
    period_s: float = 10.0,
    lines_hz: tuple[float, float] = (0.3, 12.0),
    fade_s: float = 0.0,
    seed: int = 1,
    progress: Progress | None = None,
) -> Design:
    """Designs the perturbation to command on a robot, as ``ndof design`` does.

    ``kind`` is ``filtered-noise`` (drawn from ``candidates`` seeds; the one whose axes look least coherent is taken),
    ``multisine`` (orthogonal from trial to trial), ``prbs`` or ``chirp``. ``rms`` is that of each axis in N, or in N m
    where ``rotational``.

    >>> import ndof
    >>> noise = ndof.design(axes=["x", "y"], candidates=20, duration_s=20).recordings[0]
    >>> round(float(noise["cmd_x"].std()), 1)
    4.0
    """
    excitation = {
        "kind": kind,
        "rms": rms,
        "cutoff_hz": cutoff_hz,
        "order": order,
        "candidates": candidates,
        "period_s": period_s,
        "search_band_hz": (0.25, 15.0),
        "band_hz": lines_hz,
        "peak": peak,
    }
    parts, found = _ndof.design(
        json.dumps(excitation), list(axes), rotational, trials, duration_s, sample_rate_hz, fade_s, seed, progress
    )
    return Design([Recording._from_parts(one) for one in parts], [s for s, _ in found], [c for _, c in found])


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
    """What there is of ``effects``, ``devices``, ``limbs`` or ``studies``, each with a line on it.

    >>> import ndof
    >>> list(ndof.registry("studies"))
    ['arm', 'arm-hidden', 'sensitivity', 'drift', 'masses', 'spring-array', 'wrist']
    """
    return dict(_ndof.registry(what))
