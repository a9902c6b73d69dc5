"""The frequency response with its coherences and confidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _ndof
from ._options import Stretch, settings, stretches
from ._recording import Recordings, recordings_of, roles_of
from ._result import Result

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame


class FrequencyResponse(Result):
    """The response of the outputs to the inputs at each frequency, with intervals: the result ``ndof/estimate/1``.

    Arrays have the shape (outputs, inputs, frequencies); what does not exist is NaN. Where there are commanded
    references, ``value`` and the errors are those of the derived estimate, which feedback does not bias; :attr:`direct`
    has the direct one.

    >>> import ndof
    >>> trials = ndof.simulate("arm", trials=2).recordings
    >>> response = ndof.frequency_response(trials, nperseg=2048, band=(0.25, 15))
    >>> response
    FrequencyResponse(compliance, 2 outputs (pos_x, pos_y) × 2 inputs (force_x, force_y), derived, 60 frequencies 0.4883 … 14.89 Hz)
    >>> response.value.shape
    (2, 2, 60)
    """

    __slots__ = ("_native", "_which")

    def __init__(self, native: _ndof.Estimate, which: str | None = None) -> None:
        super().__init__("")  # written when it is asked for: a large result is mostly used as arrays
        self._native = native
        self._which = which or ("derived" if native.has_derived else "direct")

    def to_json(self) -> str:
        """The result as the bytes that ``ndof estimate --json`` writes.

        >>> import ndof
        >>> response = ndof.frequency_response(ndof.simulate("spring-array", trials=1).recordings, nperseg=256)
        >>> response.to_json().startswith('{"schema":"ndof/estimate/1"')
        True
        """
        if not self._json:
            self._json = self._native.to_json()
        return self._json

    @property
    def inputs(self) -> list[str]:
        """Columns of the response.

        >>> import ndof
        >>> ndof.frequency_response(ndof.simulate("wrist", trials=1).recordings, nperseg=512).inputs
        ['torque_ps', 'torque_fe', 'torque_aa']
        """
        return self._native.inputs

    @property
    def outputs(self) -> list[str]:
        """Rows of the response.

        >>> import ndof
        >>> ndof.frequency_response(ndof.simulate("wrist", trials=1).recordings, nperseg=512).outputs
        ['angle_ps', 'angle_fe', 'angle_aa']
        """
        return self._native.outputs

    @property
    def kind(self) -> str:
        """The physical quantity: ``compliance``, ``dynamic-stiffness``, ``impedance``, ``admittance`` or ``transfer``.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=256, response="impedance").kind
        'impedance'
        """
        return self._native.kind

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """The grid.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500, band=(1, 3)).frequency_hz
        array([1., 2., 3.])
        """
        return self._native.frequency_hz

    @property
    def value(self) -> NDArray[np.complex128]:
        """The response, shape (outputs, inputs, frequencies).

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500, band=(1, 3)).value.dtype
        dtype('complex128')
        """
        return self._native.array(self._which, "re") + 1j * self._native.array(self._which, "im")

    @property
    def gain_std_error(self) -> NDArray[np.float64]:
        """Standard error of the magnitude.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> bool((ndof.frequency_response(trials, nperseg=500, band=(1, 3)).gain_std_error > 0).all())
        True
        """
        return self._native.array(self._which, "gain_std_error")

    @property
    def phase_std_error_rad(self) -> NDArray[np.float64]:
        """Standard error of the phase.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> bool((ndof.frequency_response(trials, nperseg=500, band=(1, 3)).phase_std_error_rad > 0).all())
        True
        """
        return self._native.array(self._which, "phase_std_error_rad")

    @property
    def gain_ci95(self) -> NDArray[np.float64]:
        """95 % interval of the magnitude, shape (outputs, inputs, frequencies, 2).

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500, band=(1, 3)).gain_ci95.shape[-1]
        2
        """
        return self._native.array(self._which, "gain_ci95")

    @property
    def phase_ci95_rad(self) -> NDArray[np.float64]:
        """95 % interval of the phase, shape (outputs, inputs, frequencies, 2); NaN is the full circle.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500, band=(1, 3)).phase_ci95_rad.shape[-1]
        2
        """
        return self._native.array(self._which, "phase_ci95_rad")

    def coherence(self, kind: str = "multiple", *, paper: bool = False) -> NDArray[np.float64]:
        """Magnitude-squared coherences: ``ordinary``, ``partial`` (outputs, inputs, frequencies) or ``multiple``.

        Of the derived estimate they are consistent with its noise; ``paper=True`` gives those under the assumption of
        Palazzolo et al. (2007).

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> bool((ndof.frequency_response(trials, nperseg=500, band=(1, 3)).coherence("partial") <= 1).all())
        True
        """
        which = "derived-paper" if paper and self._which == "derived" else self._which
        return self._native.coherence_array(which, kind)

    @property
    def significance_95(self) -> dict[str, float | None]:
        """Coherences that chance alone exceeds once in twenty, by kind.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> sorted(ndof.frequency_response(trials, nperseg=500).significance_95)
        ['multiple', 'ordinary', 'partial']
        """
        return dict(zip(("ordinary", "partial", "multiple"), self._native.significance_95))

    @property
    def input_coherence(self) -> NDArray[np.float64]:
        """Magnitude-squared coherence between inputs, shape (inputs, inputs, frequencies).

        >>> import ndof
        >>> trials = ndof.simulate("wrist", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=512, band=(1, 3)).input_coherence.shape[:2]
        (3, 3)
        """
        return self._native.input_coherence

    @property
    def effective_averages(self) -> float:
        """Independent averages that the overlapping segments are worth, over all trials.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500).effective_averages > 10
        True
        """
        return self._native.effective_averages

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What the reader should know: code, message and action of each warning.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> isinstance(ndof.frequency_response(trials, nperseg=500).warnings, list)
        True
        """
        return [dict(zip(("code", "message", "action"), parts)) for parts in self._native.warnings]

    @property
    def direct(self) -> FrequencyResponse:
        """The direct estimate, from inputs to outputs as measured.

        >>> import ndof
        >>> trials = ndof.simulate("arm", trials=2).recordings
        >>> ndof.frequency_response(trials, nperseg=2048, band=(1, 2)).direct
        FrequencyResponse(compliance, 2 outputs (pos_x, pos_y) × 2 inputs (force_x, force_y), direct, 4 frequencies 1.221 … 1.953 Hz)
        """
        return FrequencyResponse(self._native, "direct")

    @property
    def derived(self) -> FrequencyResponse:
        """The derived estimate, through the references; an error without them.

        >>> import ndof
        >>> trials = ndof.simulate("arm", trials=2).recordings
        >>> response = ndof.frequency_response(trials, nperseg=2048, band=(1, 2))
        >>> response.derived == response
        True
        """
        self._native.array("derived", "re")
        return FrequencyResponse(self._native, "derived")

    def to_pandas(self) -> _DataFrame:
        """Every element at every frequency, one row each.

        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> list(ndof.frequency_response(trials, nperseg=500, band=(1, 3)).to_pandas().columns)[:6]
        ['output', 'input', 'frequency_hz', 're', 'im', 'gain']
        """
        import pandas

        hz, value = self.frequency_hz, self.value
        low_high, phase_low_high = self.gain_ci95, self.phase_ci95_rad
        gain_error, phase_error = self.gain_std_error, self.phase_std_error_rad
        ordinary, partial, multiple = (self.coherence(kind) for kind in ("ordinary", "partial", "multiple"))
        frames = []
        for i, output in enumerate(self.outputs):
            for j, input in enumerate(self.inputs):
                frames.append(
                    pandas.DataFrame(
                        {
                            "output": output,
                            "input": input,
                            "frequency_hz": hz,
                            "re": value[i, j].real,
                            "im": value[i, j].imag,
                            "gain": np.abs(value[i, j]),
                            "gain_std_error": gain_error[i, j],
                            "gain_low": low_high[i, j, :, 0],
                            "gain_high": low_high[i, j, :, 1],
                            "phase_rad": np.angle(value[i, j]),
                            "phase_std_error_rad": phase_error[i, j],
                            "phase_low_rad": phase_low_high[i, j, :, 0],
                            "phase_high_rad": phase_low_high[i, j, :, 1],
                            "coherence_ordinary": ordinary[i, j],
                            "coherence_partial": partial[i, j],
                            "coherence_multiple": multiple[i] if i < len(multiple) else np.nan,
                        }
                    )
                )
        return pandas.concat(frames, ignore_index=True)

    def plot_bode(self, model: Any = None, fig: Any = None) -> Any:
        """Magnitude and phase of every element with their 95 % bands, with matplotlib; returns the figure.

        ``model`` is a fit of the same channels, drawn as a line.

        >>> import matplotlib; matplotlib.use("Agg")
        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> response = ndof.frequency_response(trials, nperseg=500, band=(1, 10))
        >>> len(response.plot_bode().axes) == 2 * response.value.shape[0] * response.value.shape[1]
        True
        """
        from ._plot import plot_bode

        return plot_bode(self, model, fig)

    def plot_coherence(self, kind: str = "partial", ax: Any = None) -> Any:
        """Coherences over frequency with their 95 % threshold, with matplotlib; returns the axes.

        >>> import matplotlib; matplotlib.use("Agg")
        >>> import ndof
        >>> trials = ndof.simulate("spring-array", trials=1).recordings
        >>> ndof.frequency_response(trials, nperseg=500, band=(1, 10)).plot_coherence("multiple").get_ylabel()
        'multiple coherence γ²'
        """
        from ._plot import plot_coherence

        return plot_coherence(self, kind, ax)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self.to_json(), self._which)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FrequencyResponse) and self._which == other._which and self.to_json() == other.to_json()

    __hash__ = Result.__hash__

    def __repr__(self) -> str:
        def listed(names: list[str], what: str) -> str:
            return f"{len(names)} {what}{'' if len(names) == 1 else 's'} ({', '.join(names)})"

        hz = self.frequency_hz
        return (
            f"FrequencyResponse({self.kind}, {listed(self.outputs, 'output')} × {listed(self.inputs, 'input')}, "
            f"{self._which}, {len(hz)} frequencies {hz[0]:.4g} … {hz[-1]:.4g} Hz)"
        )


def _unpickle(text: str, which: str) -> FrequencyResponse:
    return FrequencyResponse(_ndof.Estimate.from_json(text), which)


def frequency_response(
    recordings: Recordings,
    *,
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
    sliding: float | None = None,
    sliding_step: float | None = None,
    cycle: float | None = None,
    cycle_by: str | None = None,
    event: Sequence[float] | Sequence[Sequence[float]] | None = None,
    spectra: bool = False,
) -> FrequencyResponse:
    """Estimates the frequency response of the outputs to the inputs, as ``ndof estimate`` does.

    ``recordings`` is a recording or a file, or several trials of one experiment, which are pooled. Roles follow from the
    prefixes (``cmd_`` reference, ``force_``/``torque_`` input, ``pos_``/``angle_`` output) or are named. Every option is
    that of the command line, with its default: ``method`` (``auto``, ``welch``, ``multitaper``, ``local-polynomial``,
    ``local-rational``, ``periodic``), ``estimator`` (``h1``, ``h2``, ``hv``), ``response`` (``compliance``, ``dynamic-stiffness``,
    ``impedance``, ``admittance``), ``band`` in Hz, ``start``, ``stop`` and ``exclude`` in seconds. ``sliding`` adds estimates in windows of so many seconds along time or,
    with ``cycle``, ``cycle_by`` or ``event``, about each phase of a movement's cycles: ``course`` of :meth:`FrequencyResponse.to_dict`.

    Raises :class:`NdofError` with the text of the command line.

    >>> import numpy as np, ndof
    >>> force = np.random.default_rng(1).normal(size=10_000)
    >>> recording = ndof.Recording({"force_x": force, "pos_x": force / 300}, 500)
    >>> response = ndof.frequency_response(recording, nperseg=512)
    >>> bool(np.allclose(response.value[0, 0, 1:], 1 / 300))
    True
    """
    asked = locals()
    return FrequencyResponse(
        _ndof.frequency_response(
            recordings_of(recordings),
            roles_of(reference, input, output),
            stretches(start, stop, exclude),
            settings("estimate", asked),
        )
    )
