"""What a simulation gets wrong, and why."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

from . import _ndof
from ._errors import NdofError
from ._options import Document, PathLike, Stretch, document, settings, stretches
from ._recording import Recordings, recordings_of, roles_of
from ._result import Result
from ._simulator import Rerun, Simulate, rerun, run

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame

Progress = Callable[[str, int, int], object]
"""Called with what is being done, how much of it is done, and of how much (0 where that is not known)."""


class Diagnosis(Result):
    """What a simulation gets wrong, the cause by name, the extended model and the gain: the result ``ndof/diagnosis/1``.

    >>> diagnosis  # of ndof.diagnose(ndof.simulate("spring-array", trials=3).recordings)
    Diagnosis(adequate)
    """

    __slots__ = ("_page", "rerun")

    rerun: Rerun | None
    """Of a simulator that was given as a function: what it misses of the held-out part by its own run, alone and with the effort of the causes.
    ``None`` where stretches were cut out of the recordings, and, with a warning, where it failed with that effort."""

    def __init__(self, text: str, page: str = "", rerun: Rerun | None = None) -> None:
        super().__init__(text)
        self._page = page
        self.rerun = rerun

    @property
    def verdict(self) -> str:
        """``adequate``, ``explained``, ``partly-explained`` or ``unexplained``.

        >>> diagnosis.verdict
        'adequate'
        """
        verdict: str = self.to_dict()["verdict"]
        return verdict

    @property
    def causes(self) -> list[dict[str, Any]]:
        """Named causes, strongest first, with parameters, probability, gain and evidence.

        >>> diagnosis.causes
        []
        """
        causes: list[dict[str, Any]] = self.to_dict()["causes"]
        return causes

    @property
    def report(self) -> str:
        """The page of the diagnosis as HTML.

        >>> diagnosis.report.lower().startswith("<!doctype html>")
        True
        """
        return self._page

    def to_pandas(self) -> _DataFrame:
        """The causes and everything else that was considered, one row each.

        >>> list(diagnosis.to_pandas().columns)
        ['effect', 'side', 'axis', 'named', 'explained_fraction', 'p_value', 'why_not']
        """
        import pandas

        result = self.to_dict()
        columns = ["effect", "side", "axis", "named", "explained_fraction", "p_value", "why_not"]

        def row(found: dict[str, Any], named: bool, share: Any) -> dict[str, Any]:
            own = {"effect": found["effect"], **found["site"], "named": named}
            return {**own, "explained_fraction": share, "p_value": found["p_value"], "why_not": found.get("why_not", "")}

        rows = [row(cause, True, cause["gain"]["explained_fraction"]) for cause in result["causes"]]
        rows += [row(other, False, other["explained_fraction"]) for other in result["considered"]]
        return pandas.DataFrame(rows, columns=columns)

    def plot_gain(self, ax: Any = None) -> Any:
        """The held-out error of each output, with the baseline and with its causes, with matplotlib; returns the axes.

        >>> import matplotlib; matplotlib.use("Agg")
        >>> diagnosis.plot_gain().get_ylabel()
        'held-out NRMSE'
        """
        from ._plot import plot_gain

        return plot_gain(self, ax)

    def __reduce__(self) -> tuple[Any, ...]:
        return Diagnosis, (self.to_json(), self._page, self.rerun)

    def __repr__(self) -> str:
        causes = ", ".join(f"{c['effect']} ({c['site']['side']} {c['site']['axis']})".replace(" )", ")") for c in self.causes)
        return f"Diagnosis({self.verdict}{': ' + causes if causes else ''})"


def diagnose(
    recordings: Recordings,
    *,
    baseline: Document | None = None,
    kinematics: Document | None = None,
    robot: PathLike | None = None,
    tip: str | None = None,
    simulated: Recordings | None = None,
    simulate: Simulate | None = None,
    parameters: Mapping[str, float] | None = None,
    held_out: Union[Stretch, PathLike, Sequence[PathLike], None] = None,
    tolerance: float = 0.01,
    hold: str | None = None,
    without: str | Sequence[str] = (),
    plan: bool = False,
    schedule: str | None = None,
    cycle: float | None = None,
    cycle_by: str | None = None,
    event: Sequence[float] | Sequence[Sequence[float]] | None = None,
    seed: int | None = None,
    band: Stretch | None = None,
    reference: str | Sequence[str] | None = None,
    input: str | Sequence[str] | None = None,
    output: str | Sequence[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    exclude: Sequence[Stretch] = (),
    progress: Progress | None = None,
) -> Diagnosis:
    """Says what the simulation gets wrong, names the cause, extends the model and measures the gain, as ``ndof diagnose``.

    Without ``baseline`` (a file or a dictionary) the simulation is the linear inertia-damping-stiffness model, fitted.
    ``kinematics`` (a file or a dictionary, ``ndof/kinematics/1``) is the arm whose curved geometry is then a cause like any other.
    ``robot`` is a file (URDF, MJCF or TOML) whose joints are judged, to the link ``tip``: recordings hold ``torque_JOINT`` and ``angle_JOINT`` of each
    joint. ``simulated`` is what a simulator, any, logged at the same commands, one recording for each: it is judged then, a robot's best with its
    file in ``robot``. ``simulate`` is the simulator itself, ``f(inputs, added_effort, parameters) -> outputs``: it is given every channel of a recording, and
    gives those that it simulates; ``added_effort`` holds efforts by channel that are to act beside its own forces, none in the first run, and
    ``parameters`` what was given here. What is found is then proved by its own run, in :attr:`Diagnosis.rerun`.
    ``held_out`` is a stretch of time (two numbers, in seconds) or the files or names of the recordings that no fit may
    see; without it the last third of the recordings, or the last 30 % of a single one. ``hold`` is what forces do between samples, as in
    :func:`fit`, where neither ``baseline``, ``robot`` nor a simulator is given. ``plan`` simulates the next experiments
    that would tell confusable causes apart. ``schedule`` is what stiffness or damping may vary with, as one cause beside the others: ``phase``
    (of a ``cycle`` in seconds, or of one that the channel ``cycle_by`` or an ``event`` begins, whose times in seconds are one list or one a trial),
    ``time`` or a channel. ``progress`` is called with what is being done; Ctrl-C ends the work at its next step.

    >>> import numpy as np, ndof
    >>> steps = []
    >>> trials = ndof.simulate("spring-array", trials=3).recordings
    >>> ndof.diagnose(trials, progress=lambda what, done, total: steps.append(what))
    Diagnosis(adequate)
    >>> len(steps) > 0
    True

    A simulation of a mass on a spring, and a recording of one with dry friction:

    >>> def simulate(inputs, added_effort, parameters):
    ...     force = inputs["force_x"] + added_effort.get("force_x", 0.0)
    ...     x = v = 0.0
    ...     motion = []
    ...     for f in np.repeat(force, 10):
    ...         v += (f - 12 * v - parameters["stiffness"] * x - parameters["dry"] * np.tanh(v / 0.005)) / 2 / 5000
    ...         x += v / 5000
    ...         motion.append(x)
    ...     return {"pos_x": np.reshape(motion, (-1, 10)).mean(axis=1)}
    >>> force = ndof.simulate("spring-array", trials=1).recordings[0]["force_x"][:15000]
    >>> moved = simulate({"force_x": force}, {}, {"stiffness": 300, "dry": 1.0})
    >>> measured = ndof.Recording({"force_x": force, **moved}, 500)
    >>> found = ndof.diagnose(measured, simulate=simulate, parameters={"stiffness": 300, "dry": 0.0})
    >>> found.causes[0]["effect"]
    'coulomb-friction'
    >>> found.rerun["nrmse_after"][0] < 0.5 * found.rerun["nrmse_before"][0]
    True
    """
    asked = locals()
    trials = recordings_of(recordings)
    if simulate is not None and simulated is not None:
        raise NdofError("simulate and simulated are both the simulator; give one of the two")
    apart: list[Any] = [held_out] if isinstance(held_out, (str, os.PathLike)) else list(held_out or ())
    if not (len(apart) == 2 and all(isinstance(one, (int, float)) for one in apart)):
        apart = [os.fspath(one) for one in apart]
        known = {trial.name for trial in trials}
        trials += recordings_of([file for file in apart if file not in known])
    asked["held_out"] = apart or None
    asked["without"] = [without] if isinstance(without, str) else list(without)
    given = dict(parameters or {})
    logs = [] if simulated is None else recordings_of(simulated)
    if simulate is not None:
        told: set[str] = set()
        logs = [run(simulate, trial, {}, given, told) for trial in trials]
    text, page, added = _ndof.diagnose(
        trials,
        roles_of(reference, input, output),
        stretches(start, stop, exclude),
        settings("diagnose", {**asked, "baseline": None, "kinematics": None, "robot": None}),
        document(baseline),
        document(kinematics),
        None if robot is None else (os.fspath(robot), tip),
        logs,
        progress,
    )
    found = Diagnosis(text, page)
    if simulate is not None:
        outputs = found.to_dict()["outputs"]
        missing = [output for output in outputs if output not in told]
        if missing:
            raise NdofError(f'simulate returned no "{missing[0]}", which is judged; give all of: {", ".join(outputs)}')
        found.rerun = rerun(simulate, trials, logs, added, outputs, given)
    return found
