"""Spectra by Welch's method, with SciPy's names; shared out among workers and merged exactly."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _errors, _ndof
from ._recording import Recording

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame

Channels = Union[Recording, Mapping[str, ArrayLike], ArrayLike]


class CrossSpectra:
    """Auto- and cross-spectral densities of all channels, one-sided, in unit_a · unit_b / Hz.

    **The convention that bites**: ``matrix()[a, b]`` is ⟨A B*⟩, the conjugate on the *second* channel, which is
    ``scipy.signal.csd(b, a)``; :meth:`csd` takes SciPy's order. Spectra merge exactly: however a sum is shared out among
    workers, on the borders that :func:`shares` gives, and in whatever order it is merged, the bytes are the same.

    >>> import numpy as np, ndof
    >>> x, y = np.random.default_rng(1).normal(size=(2, 10_000))
    >>> spectra = ndof.cross_spectra({"force_x": x, "pos_x": y}, fs=500, nperseg=512)
    >>> spectra
    CrossSpectra(2 channels (force_x, pos_x), 38 segments of 1 trial, 257 frequencies to 250.0 Hz)
    """

    __slots__ = ("_native",)

    def __init__(self, native: _ndof.Spectra) -> None:
        self._native = native

    @property
    def names(self) -> list[str]:
        """The names of the channels, in the order of rows and columns.

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros((2, 512)), nperseg=256).names
        ['0', '1']
        """
        return self._native.names

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate of the recording.

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros((2, 512)), fs=500, nperseg=256).sample_rate_hz
        500.0
        """
        return self._native.sample_rate_hz

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """The grid, 0 to Nyquist.

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros((2, 512)), fs=8, nperseg=8).frequency_hz
        array([0., 1., 2., 3., 4.])
        """
        return self._native.frequency_hz

    @property
    def segments(self) -> int:
        """Segments averaged, over all trials.

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros(512), nperseg=256).segments
        3
        """
        return self._native.segments

    @property
    def effective_averages(self) -> float:
        """Independent averages that the overlapping segments are worth, over all trials.

        >>> import numpy as np, ndof
        >>> spectra = ndof.cross_spectra(np.zeros(10_000), nperseg=256)
        >>> spectra.segments, round(spectra.effective_averages)
        (77, 73)
        """
        return self._native.effective_averages

    @property
    def trials(self) -> list[int]:
        """The numbers of the trials in it.

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros(512), nperseg=256, trial=4).trials
        [4]
        """
        return self._native.trials

    @property
    def is_complete(self) -> bool:
        """Whether no block of any trial is missing.

        >>> import numpy as np, ndof
        >>> first, _ = ndof.shares(40_000, tasks=2, nperseg=256)
        >>> ndof.cross_spectra(np.zeros(first.stop - first.start), nperseg=256, share=first).is_complete
        False
        """
        return self._native.is_complete

    def _index(self, channel: int | str) -> int:
        if isinstance(channel, str):
            names = self._native.names
            if channel not in names:
                raise KeyError(f'no channel "{channel}"; there are: {", ".join(names)}')
            return names.index(channel)
        return channel

    def matrix(self) -> NDArray[np.complex128]:
        """The Hermitian matrix ⟨A B*⟩, shape (channels, channels, frequencies).

        >>> import numpy as np, ndof
        >>> ndof.cross_spectra(np.zeros((3, 512)), nperseg=256).matrix().shape
        (3, 3, 129)
        """
        return self._native.matrix()

    def power(self, channel: int | str) -> NDArray[np.float64]:
        """The power density of a channel, as ``scipy.signal.welch`` gives it.

        >>> import numpy as np, ndof
        >>> x = np.random.default_rng(1).normal(size=4096)
        >>> power = ndof.cross_spectra({"x": x}, fs=2.0, nperseg=256).power("x")
        >>> bool(abs(power[1:-1].mean() - 1) < 0.1)  # white noise of variance 1 over 0 to 1 Hz
        True
        """
        return self._native.power(self._index(channel))

    def csd(self, x: int | str, y: int | str) -> NDArray[np.complex128]:
        """The cross-spectral density ⟨X* Y⟩, as ``scipy.signal.csd(x, y)`` gives it.

        >>> import numpy as np, scipy.signal, ndof
        >>> x, y = np.random.default_rng(1).normal(size=(2, 4096))
        >>> ours = ndof.cross_spectra({"x": x, "y": y}, fs=2.0, nperseg=256).csd("x", "y")
        >>> theirs = scipy.signal.csd(x, y, fs=2.0, nperseg=256)[1]
        >>> bool(np.abs(ours - theirs).max() < 1e-14)
        True
        """
        return self._native.pair(self._index(y), self._index(x))

    def coherence(self, x: int | str, y: int | str) -> NDArray[np.float64]:
        """The magnitude-squared coherence of two channels, uncorrected.

        >>> import numpy as np, ndof
        >>> x = np.random.default_rng(1).normal(size=4096)
        >>> gamma2 = ndof.cross_spectra({"x": x, "y": 2 * x}, nperseg=256).coherence("x", "y")
        >>> bool(np.allclose(gamma2[1:], 1.0))
        True
        """
        cross = self.csd(x, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            result: NDArray[np.float64] = (cross.real**2 + cross.imag**2) / (self.power(x) * self.power(y))
        return result

    def merge(self, *others: CrossSpectra) -> CrossSpectra:
        """All of them together: other blocks of one trial, or other trials. The order does not matter.

        The same block twice is an error, so that nothing is counted twice.

        >>> import numpy as np, ndof
        >>> x = np.random.default_rng(1).normal(size=(2, 60_000))
        >>> parts = [ndof.cross_spectra(x[:, s.slice], nperseg=256, share=s) for s in ndof.shares(60_000, tasks=3, nperseg=256)]
        >>> parts[2].merge(parts[0], parts[1]) == ndof.cross_spectra(x, nperseg=256)
        True
        """
        native = self._native
        for other in others:
            native = native.merge(other._native)
        return CrossSpectra(native)

    def to_bytes(self) -> bytes:
        """All of it as bytes, the same for the same spectra; pickling uses them.

        >>> import numpy as np, ndof, pickle
        >>> spectra = ndof.cross_spectra(np.zeros((2, 512)), nperseg=256)
        >>> pickle.loads(pickle.dumps(spectra)) == spectra == ndof.CrossSpectra.from_bytes(spectra.to_bytes())
        True
        """
        return self._native.to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> CrossSpectra:
        """Spectra from the bytes of :meth:`to_bytes`.

        >>> import ndof
        >>> ndof.CrossSpectra.from_bytes(b"nonsense")
        Traceback (most recent call last):
        ...
        ndof._errors.NdofError: these bytes are not spectra of this version of ndof: Hit the end of buffer, expected more data
        """
        return cls(_ndof.Spectra.from_bytes(data))

    def to_pandas(self) -> _DataFrame:
        """Every pair at every frequency, one row each.

        >>> import numpy as np, ndof
        >>> list(ndof.cross_spectra(np.zeros((2, 512)), nperseg=256).to_pandas().columns)
        ['a', 'b', 'frequency_hz', 're', 'im']
        """
        import pandas

        hz, names = self.frequency_hz, self.names
        frames = []
        for i, a in enumerate(names):
            for j, b in enumerate(names):
                pair = self._native.pair(i, j)
                frames.append(pandas.DataFrame({"a": a, "b": b, "frequency_hz": hz, "re": pair.real, "im": pair.imag}))
        return pandas.concat(frames, ignore_index=True)

    def plot_power(self, ax: Any = None) -> Any:
        """The power density of every channel over frequency, with matplotlib; returns the axes.

        >>> import matplotlib; matplotlib.use("Agg")
        >>> import numpy as np, ndof
        >>> x = np.random.default_rng(1).normal(size=4096)
        >>> ndof.cross_spectra({"x": x}, nperseg=256).plot_power().get_xlabel()
        'frequency (Hz)'
        """
        from ._plot import plot_power

        return plot_power(self, ax)

    def __reduce__(self) -> tuple[Any, ...]:
        return CrossSpectra.from_bytes, (self.to_bytes(),)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CrossSpectra) and self._native == other._native

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __repr__(self) -> str:
        names = self.names
        channels = f"{len(names)} channel{'' if len(names) == 1 else 's'} ({', '.join(names)})"
        if not self.is_complete:
            return f"CrossSpectra({channels}, blocks missing)"
        trials = len(self.trials)
        hz = self.frequency_hz
        return (
            f"CrossSpectra({channels}, {self.segments} segments of {trials} trial{'' if trials == 1 else 's'}, "
            f"{len(hz)} frequencies to {hz[-1]} Hz)"
        )


@dataclass(frozen=True)
class Share:
    """One worker's part of a long recording, cut so that merging gives the bytes of one pass.

    >>> import ndof
    >>> ndof.shares(40_000, tasks=2, nperseg=256)
    [Share(start=0, stop=16512, blocks=(0, 2), samples=40000), Share(start=16384, stop=39936, blocks=(2, 5), samples=40000)]
    """

    start: int
    """The first sample that the worker needs."""
    stop: int
    """One past the last."""
    blocks: tuple[int, int]
    """The blocks of 64 segments that it sums, the second not included."""
    samples: int
    """Samples in the whole recording."""

    @property
    def slice(self) -> slice:
        """The samples that the worker needs, to index with.

        >>> import ndof
        >>> ndof.shares(40_000, tasks=2, nperseg=256)[0].slice
        slice(0, 16512, None)
        """
        return slice(self.start, self.stop)


def shares(samples: int, *, tasks: int, nperseg: int, noverlap: int | None = None) -> list[Share]:
    """How to share a recording of ``samples`` samples out among ``tasks`` workers, as evenly as whole blocks allow.

    There are fewer shares than ``tasks`` where there are fewer blocks (of 64 segments) than that.

    >>> import ndof
    >>> [s.blocks for s in ndof.shares(1_000_000, tasks=3, nperseg=1024)]
    [(0, 10), (10, 20), (20, 31)]
    """
    if tasks < 1:
        raise _errors.NdofError(f"tasks={tasks}; at least one task is needed")
    blocks = _ndof.blocks(samples, nperseg, noverlap)
    borders = sorted({blocks * task // tasks for task in range(tasks + 1)})
    found = []
    for first, end in zip(borders, borders[1:]):
        start, stop = _ndof.block_samples(samples, nperseg, noverlap, first, end)
        found.append(Share(start, stop, (first, end), samples))
    return found


def merge(spectra: Iterable[CrossSpectra]) -> CrossSpectra:
    """All spectra together, whatever their order: those of a recording's shares, or of several trials.

    >>> import numpy as np, ndof
    >>> x = np.random.default_rng(1).normal(size=(3, 2, 5000))
    >>> ndof.merge(ndof.cross_spectra(trial, nperseg=256, trial=k) for k, trial in enumerate(x)).trials
    [0, 1, 2]
    """
    first, *rest = spectra
    return first.merge(*rest)


def _channels(x: Channels) -> tuple[list[NDArray[np.float64]], list[str], float | None]:
    """Arrays, names and rate of what a caller gives."""
    if isinstance(x, Recording):
        return x._samples, x._names, x.sample_rate_hz
    if isinstance(x, Mapping):
        return [np.asarray(values, dtype=np.float64) for values in x.values()], [str(name) for name in x], None
    labels: Any = getattr(x, "columns", None)
    if labels is not None:  # a data frame
        frame: Any = x
        return [np.asarray(frame[label], dtype=np.float64) for label in labels], [str(label) for label in labels], None
    array = np.asarray(x, dtype=np.float64)
    if array.ndim == 1:
        return [array], ["0"], None
    if array.ndim != 2:
        raise _errors.NdofError(f"an array of {array.ndim} dimensions; give one channel, or channels by samples")
    return list(array), [str(k) for k in range(len(array))], None


def cross_spectra(
    x: Channels,
    fs: float | None = None,
    window: str = "hann",
    nperseg: int | None = None,
    noverlap: int | None = None,
    nfft: int | None = None,
    detrend: str | bool = "constant",
    *,
    window_symmetric: bool = False,
    trial: int = 0,
    share: Share | None = None,
) -> CrossSpectra:
    """Cross-spectra of all channels by Welch's method, in one pass: each channel is transformed once per segment.

    ``x`` is a :class:`Recording`, a mapping or data frame of channels, or an array (channels by samples); contiguous
    ``float64`` arrays are read where they lie. Settings are those of ``scipy.signal.csd``: the last incomplete segment is
    dropped, ``nperseg`` is 256 where it is not given (the length of a shorter recording), ``fs`` is 1 where neither it nor
    the recording says a rate. With ``share``, ``x`` is the stretch that the share names, and the result is to be merged.

    >>> import numpy as np, ndof
    >>> x = np.random.default_rng(1).normal(size=(12, 100_000))
    >>> ndof.cross_spectra(x, fs=1000, nperseg=4096)
    CrossSpectra(12 channels (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11), 47 segments of 1 trial, 2049 frequencies to 500.0 Hz)
    """
    arrays, names, own_rate = _channels(x)
    rate = own_rate if fs is None else float(fs)
    if nperseg is None:
        whole = share.samples if share else len(arrays[0]) if arrays else 0
        nperseg = max(1, min(256, whole))
    return CrossSpectra(
        _ndof.cross_spectra(
            arrays,
            names,
            1.0 if rate is None else rate,
            nperseg,
            noverlap,
            nfft,
            window,
            window_symmetric,
            detrend if isinstance(detrend, str) else "constant" if detrend else "none",
            trial,
            None if share is None else (*share.blocks, share.samples),
        )
    )


def welch(
    x: ArrayLike,
    fs: float = 1.0,
    window: str = "hann",
    nperseg: int | None = None,
    noverlap: int | None = None,
    nfft: int | None = None,
    detrend: str | bool = "constant",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power spectral density, with the arguments, the defaults and the result of ``scipy.signal.welch``.

    Several channels are the rows of a two-dimensional array. A segment longer than the record is an error here.

    >>> import numpy as np, scipy.signal, ndof
    >>> x = np.random.default_rng(1).normal(size=(2, 4096))
    >>> f, power = ndof.welch(x, fs=500, nperseg=512)
    >>> bool(np.allclose(power, scipy.signal.welch(x, fs=500, nperseg=512)[1], rtol=1e-12, atol=0))
    True
    """
    array = np.asarray(x, dtype=np.float64)
    if array.ndim == 2:
        each = [cross_spectra(row, fs, window, nperseg, noverlap, nfft, detrend) for row in array]
        return each[0].frequency_hz, np.stack([one.power(0) for one in each])
    spectra = cross_spectra(array, fs, window, nperseg, noverlap, nfft, detrend)
    return spectra.frequency_hz, spectra.power(0)


def coherence(
    x: ArrayLike,
    y: ArrayLike,
    fs: float = 1.0,
    window: str = "hann",
    nperseg: int | None = None,
    noverlap: int | None = None,
    nfft: int | None = None,
    detrend: str | bool = "constant",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Magnitude-squared coherence, with the arguments, the defaults and the result of ``scipy.signal.coherence``.

    A single segment, whose coherence is 1 whatever the data are, is an error here. Partial and multiple coherences are in
    :class:`FrequencyResponse`.

    >>> import numpy as np, scipy.signal, ndof
    >>> x, noise = np.random.default_rng(1).normal(size=(2, 4096))
    >>> f, gamma2 = ndof.coherence(x, x + noise, fs=500, nperseg=512)
    >>> bool(np.allclose(gamma2, scipy.signal.coherence(x, x + noise, fs=500, nperseg=512)[1], rtol=1e-10, atol=0))
    True
    """
    spectra = cross_spectra({"x": x, "y": y}, fs, window, nperseg, noverlap, nfft, detrend)
    if spectra.segments < 2:
        raise _errors.NdofError(
            "one segment only: its coherence is 1 whatever the data are; lower nperseg or record longer"
        )
    return spectra.frequency_hz, spectra.coherence("x", "y")
