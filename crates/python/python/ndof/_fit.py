"""Mechanical models fitted to recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _ndof
from ._options import Document, Stretch, document, settings, stretches
from ._recording import Recordings, recordings_of, roles_of
from ._result import Result

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame


class Fit(Result):
    """Inertia, damping and stiffness with their covariance: the result ``ndof/fit/1``.

    >>> import ndof
    >>> fit = ndof.fit(ndof.simulate("arm").recordings, nperseg=2048, band=(0.5, 8))
    >>> fit
    Fit(inertia-damping-stiffness, 2 axes, 0.7324 … 7.812 Hz, derived)
    >>> fit.K.shape
    (2, 2)
    """

    __slots__ = ("_native", "_page")

    def __init__(self, native: _ndof.Fit, page: str | None = None) -> None:
        super().__init__(native.to_json())
        self._native = native
        self._page = page

    def _matrix(self, name: str) -> NDArray[np.float64]:
        return np.array(self.to_dict()["matrices"][name], dtype=np.float64)

    @property
    def M(self) -> NDArray[np.float64]:
        """Inertia at the endpoint (kg, or kg m² for rotations).

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> fit.M.shape == fit.K.shape
        True
        """
        return self._matrix("M")

    @property
    def B(self) -> NDArray[np.float64]:
        """Damping (N s/m, or N m s/rad).

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> fit.B.shape == fit.K.shape
        True
        """
        return self._matrix("B")

    @property
    def K(self) -> NDArray[np.float64]:
        """Stiffness (N/m, or N m/rad).

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> bool((fit.K.diagonal() > 0).all())
        True
        """
        return self._matrix("K")

    @property
    def std_error(self) -> dict[str, NDArray[np.float64]]:
        """Standard errors of the entries of M, B and K.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> sorted(fit.std_error)
        ['B', 'K', 'M']
        """
        errors = self.to_dict()["matrices"]["std_error"]
        return {name: np.array(errors[name], dtype=np.float64) for name in "MBK"}

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """Name, unit, site, value, standard error, interval of each parameter, and whether the data determine it.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> sorted(fit.parameters[0])
        ['ci95', 'identifiable', 'name', 'site', 'std_error', 'unit', 'value']
        """
        parameters: list[dict[str, Any]] = self.to_dict()["parameters"]
        return parameters

    @property
    def comparison(self) -> list[dict[str, Any]]:
        """This model and those that are part of it, with ``compare=True`` every single extension too: parameters, χ², AIC and
        BIC of each, and the likelihood ratio against the one that it extends.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500, compare=True)
        >>> "inertia-damping-stiffness+delay" in [entry["model"] for entry in fit.comparison]
        True
        """
        comparison: list[dict[str, Any]] = self.to_dict().get("comparison", [])
        return comparison

    @property
    def schedule(self) -> dict[str, Any] | None:
        """M, B and K over the schedule, where one was asked for: the places ``at``, the ``entries`` with value, standard error and bands at
        each, whether they vary (``tests``), what that explains (``held_out``) and the mean movement.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500, band=(0.5, 8), schedule="time", knots=6)
        >>> sorted({entry["name"][0] for entry in fit.schedule["entries"]}), len(fit.schedule["at"])
        (['B', 'K', 'M'], 101)
        """
        schedule: dict[str, Any] | None = self.to_dict().get("schedule")
        return schedule

    @property
    def in_time(self) -> dict[str, Any] | None:
        """The fit with force laws in time, where ``law`` was given: its ``parameters``, how near the free run stays (``nrmse``, ``vaf``), and what
        models fitted to the rest leave of a part that is ``held_out``, with the laws and without.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500, band=(0.5, 8), law=["cubic-stiffness:x"])
        >>> fit.in_time["laws"], fit.in_time["parameters"][-1]["name"]
        (['cubic-stiffness:x'], 'k3_n_per_m3_x')
        """
        in_time: dict[str, Any] | None = self.to_dict().get("in_time")
        return in_time

    @property
    def joint(self) -> dict[str, NDArray[np.float64]] | None:
        """M, B and K at the joints, where the fit was projected.

        >>> import ndof
        >>> ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500).joint is None
        True
        """
        joint = self.to_dict()["joint"]
        return None if joint is None else {name: np.array(joint[name], dtype=np.float64) for name in "MBK"}

    @property
    def report(self) -> str:
        """The page of the fit as HTML, if it was asked for with ``report=True``.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500, report=True)
        >>> fit.report.lower().startswith("<!doctype html>")
        True
        """
        return self._page or ""

    def response(self, frequency_hz: Sequence[float] | NDArray[np.float64], kind: str = "compliance") -> NDArray[np.complex128]:
        """The response of the fitted model, shape (axes, axes, frequencies).

        >>> import numpy as np, ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> bool(np.allclose(fit.response([1e-9], "dynamic-stiffness")[..., 0], fit.K))
        True
        """
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        parts = self.M[..., None] * s**2 + self.B[..., None] * s + self.K[..., None]
        stiffness: NDArray[np.complex128] = parts.astype(np.complex128)
        if kind == "dynamic-stiffness":
            return stiffness
        if kind == "impedance":
            impedance: NDArray[np.complex128] = stiffness / s
            return impedance
        inverse: NDArray[np.complex128] = np.linalg.inv(np.moveaxis(stiffness, -1, 0)).astype(np.complex128)
        compliance = np.moveaxis(inverse, 0, -1)
        if kind == "admittance":
            compliance = compliance * s
        return compliance

    def to_pandas(self) -> _DataFrame:
        """The parameters, those at the joints last, one row each.

        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> list(fit.to_pandas().columns)
        ['name', 'unit', 'axis', 'value', 'std_error', 'low', 'high', 'identifiable']
        """
        import pandas

        result = self.to_dict()
        rows = [
            {
                "name": p["name"],
                "unit": p["unit"],
                "axis": p["site"]["axis"],
                "value": p["value"],
                "std_error": p["std_error"],
                "low": (p["ci95"] or (None, None))[0],
                "high": (p["ci95"] or (None, None))[1],
                "identifiable": p["identifiable"],
            }
            for p in result["parameters"] + (result["joint"] or {"parameters": []})["parameters"]
        ]
        return pandas.DataFrame(rows)

    def plot_parameters(self, ax: Any = None) -> Any:
        """The parameters with their 95 % intervals, each over its own size, with matplotlib; returns the axes.

        >>> import matplotlib; matplotlib.use("Agg")
        >>> import ndof
        >>> fit = ndof.fit(ndof.simulate("spring-array", trials=2).recordings, nperseg=500)
        >>> len(fit.plot_parameters().get_yticks()) == len(fit.parameters)
        True
        """
        from ._plot import plot_parameters

        return plot_parameters(self, ax)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self._native.to_bytes(), self._page)

    def __repr__(self) -> str:
        result = self.to_dict()
        axes = len(result["matrices"]["M"])
        low, high = result["band_hz"]
        where = ", at the joints too" if result["joint"] else ""
        return f"Fit({result['model']}, {axes} ax{'i' if axes == 1 else 'e'}s, {low:.4g} … {high:.4g} Hz, {result['estimate']}{where})"


def _unpickle(data: bytes, page: str | None) -> Fit:
    return Fit(_ndof.Fit.from_bytes(data), page)


def fit(
    recordings: Recordings,
    *,
    model: str | None = None,
    cost: str = "weighted",
    vaf_weight: str = "gamma-squared",
    hold: str | None = None,
    kinematics: Document | None = None,
    transducer_stiffness: float | None = None,
    transducer_damping: float | None = None,
    symmetry: str = "symmetric",
    systematic: bool = False,
    compare: bool = False,
    law: Sequence[str] | None = None,
    schedule: str | None = None,
    cycle: float | None = None,
    cycle_by: str | None = None,
    event: Sequence[float] | Sequence[Sequence[float]] | None = None,
    varying: Sequence[str] | None = None,
    knots: int | None = None,
    report: bool = False,
    reference: str | Sequence[str] | None = None,
    input: str | Sequence[str] | None = None,
    output: str | Sequence[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    exclude: Sequence[Stretch] = (),
    method: str | None = None,
    nperseg: int | None = None,
    noverlap: int | None = None,
    nfft: int | None = None,
    window: str | None = None,
    window_symmetric: bool = False,
    detrend: str | None = None,
    time_bandwidth: float | None = None,
    tapers: int | None = None,
    adaptive: bool = False,
    order: int | None = None,
    denominator: int | None = None,
    half_width: int | None = None,
    leave_one_out: bool = False,
    robust: bool = False,
    period: float | None = None,
    estimator: str | None = None,
    response: str | None = None,
    band: Stretch | None = None,
) -> Fit:
    """Fits inertia, damping and stiffness to the frequency response of recordings, as ``ndof fit`` does.

    Several recordings are repeated trials of one experiment. ``band`` (Hz) is what is fitted; ``kinematics`` (a file or a
    dictionary) adds the matrices at the joints; ``cost`` is ``weighted`` or ``paper``; ``symmetry`` is
    ``symmetric``, ``positive-semidefinite`` or ``free``; ``hold`` is what forces do between samples, ``zero``, ``linear``,
    ``band-limited``, ``read-after`` or ``read-before``, else what the data say; ``systematic`` widens intervals by what calibration leaves; ``compare``
    fits every single extension of the model too (:attr:`Fit.comparison`); ``law`` fits the matrices with force laws in time, ``NAME`` on every
    axis or ``NAME:AXIS`` (:attr:`Fit.in_time`). ``schedule`` is what M, B and K change with, ``phase`` (of a
    ``cycle`` in seconds, or of one that the channel ``cycle_by`` or an ``event`` begins, whose times in seconds are one list or one a trial),
    ``time`` or a channel: then :attr:`Fit.schedule` has the matrices that are ``varying`` as curves of at most ``knots`` splines. The other
    options are those of :func:`frequency_response`.

    >>> import ndof
    >>> fit = ndof.fit(ndof.simulate("arm").recordings, nperseg=2048, band=(0.5, 8))
    >>> [float(k) for k in fit.K.diagonal().round(-1)]
    [290.0, 510.0]
    """
    asked = locals()
    native, page = _ndof.fit(
        recordings_of(recordings),
        roles_of(reference, input, output),
        stretches(start, stop, exclude),
        settings("estimate", {**asked, "cycle": None, "cycle_by": None, "event": None}),
        settings("fit", {**asked, "kinematics": None}),
        document(kinematics),
        report,
    )
    return Fit(native, page)


def project(fit: Fit, kinematics: Document) -> Fit:
    """The fit with its matrices at the joints too: K_q = Jᵀ K J + Γ, with the uncertainty of the kinematics.

    ``kinematics`` is a file or a dictionary (``ndof/kinematics/1``).

    >>> import ndof
    >>> fit = ndof.fit(ndof.simulate("arm").recordings, nperseg=2048, band=(0.5, 8))
    >>> arm = {"kind": "planar-two-link", "link_lengths_m": [0.33, 0.34], "posture_rad": [0.785, 1.571]}
    >>> projected = ndof.project(fit, arm | {"mean_force_n": "measured"})
    >>> [float(k) for k in projected.joint["K"].diagonal().round(-1)]
    [70.0, 40.0]
    """
    return Fit(_ndof.project(fit._native, document(kinematics)), None)
