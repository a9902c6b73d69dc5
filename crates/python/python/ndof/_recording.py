"""Recordings: channels of equal length at one sample rate."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _errors, _ndof
from ._options import Document, PathLike, document

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame
    import xarray

Warnings = list[tuple[str, str, str]]


def _split(text: str) -> tuple[str, str | None]:
    """``pos_x [mm]`` as its name and its unit; an integer in brackets is an index, ``tau_J[0]`` is ``tau_J_0``."""
    text = text.strip()
    if "[" not in text:
        return text, None
    unit = None
    if text.endswith("]") and "[" in text:
        name, _, inside = text[:-1].rpartition("[")
        plain_number = inside.strip() == "1" and name != name.rstrip()
        if plain_number or not inside.strip().isdecimal():
            text, unit = name.strip(), inside.strip()
    return re.sub(r"\s*\[\s*([0-9]{1,9})\s*\]", r"_\1", text), unit


class Recording:
    """Channels of equal length at one sample rate, in SI units: what every analysis starts from.

    ``channels`` maps names to samples. A unit may stand in the name (``"pos_x [mm]"``) or in ``units``; without either it
    follows from the prefix (``force_`` N, ``pos_`` m, ``angle_`` rad, ``torque_`` N m, …). A contiguous ``float64`` array in
    SI units is kept as it is, not copied; the recording only reads it.

    Row *k* of each channel stands for the interval from ``t[k]`` to ``t[k] + 1/sample_rate_hz``.

    >>> import numpy as np, ndof
    >>> recording = ndof.Recording({"force_x": np.ones(500), "pos_x [mm]": np.arange(500.0)}, 500)
    >>> recording
    Recording(2 channels (force_x [N], pos_x [m]), 1.0 s at 500.0 Hz)
    >>> recording["pos_x"][:3]
    array([0.   , 0.001, 0.002])
    """

    __slots__ = ("name", "sample_rate_hz", "start_s", "metadata", "warnings", "_names", "_units", "_samples")

    name: str
    """What messages call it: the file's name, where it was read from one."""
    sample_rate_hz: float
    start_s: float
    """The time of the first sample, on the clock of the file."""
    metadata: dict[str, str]
    """Free-form facts, never a person's name."""
    warnings: Warnings
    """What reading it had to convert or assume: code, message, action."""

    def __init__(
        self,
        channels: Mapping[str, ArrayLike],
        sample_rate_hz: float,
        *,
        units: Mapping[str, str] | None = None,
        start_s: float = 0.0,
        metadata: Mapping[str, str] | None = None,
        name: str = "recording",
    ) -> None:
        units = units or {}
        split = [_split(text) for text in channels]
        names = [channel for channel, _ in split]
        samples = [np.asarray(values, dtype=np.float64) for values in channels.values()]
        for channel, values in zip(names, samples):
            if values.ndim != 1:
                raise _errors.NdofError(
                    f'channel "{channel}" has {values.ndim} dimensions; give one array of numbers a channel'
                )
        _ndof.validate(float(sample_rate_hz), names, [len(values) for values in samples])
        self._names = names
        self._units: list[str] = []
        self._samples: list[NDArray[np.float64]] = []
        for (channel, bracket), values in zip(split, samples):
            symbol, factor = _ndof.unit(channel, units.get(channel, bracket), names)
            self._units.append(symbol)
            self._samples.append(_read_only(values if factor == 1.0 else values * factor))
        self.name = name
        self.sample_rate_hz = float(sample_rate_hz)
        self.start_s = float(start_s)
        self.metadata = dict(metadata or {})
        self.warnings = []

    @classmethod
    def _from_parts(cls, parts: _ndof._Parts) -> Recording:
        self = cls.__new__(cls)
        self.name, self.sample_rate_hz, self.start_s, self.metadata, self.warnings, self._names, self._units, samples = parts
        self._samples = [_read_only(values) for values in samples]
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (
            self.name,
            self.sample_rate_hz,
            self.start_s,
            self.metadata,
            self.warnings,
            self._names,
            self._units,
            [np.asarray(values) for values in self._samples],
        )

    @classmethod
    def from_pandas(
        cls,
        frame: _DataFrame,
        *,
        sample_rate_hz: float | None = None,
        resample: bool | float = False,
        units: Mapping[str, str] | None = None,
        name: str = "data frame",
    ) -> Recording:
        """A recording from a data frame, under the rules of files.

        Time is the column ``t`` or ``time``, else an index of that name or of time stamps, else ``sample_rate_hz`` says it.

        >>> import numpy as np, pandas as pd, ndof
        >>> frame = pd.DataFrame({"time": np.arange(4) / 500, "force_x [N]": [0.0, 1.0, 2.0, 1.0]})
        >>> ndof.Recording.from_pandas(frame)
        Recording(1 channel (force_x [N]), 0.008 s at 500.0 Hz)
        """
        columns = [(str(label), _numbers(frame[label])) for label in frame.columns]
        index = frame.index
        kind = getattr(index.dtype, "kind", "O")
        if kind in "mM":
            since = index - index[0]
            columns.insert(0, ("time", np.asarray(since.total_seconds(), dtype=np.float64)))
        elif isinstance(index.name, str) and _split(index.name)[0].lower() in ("t", "time"):
            columns.insert(0, (index.name, np.asarray(index, dtype=np.float64)))
        metadata = {str(key): str(value) for key, value in frame.attrs.items()}
        return cls._from_parts(_ndof.from_columns(name, columns, metadata, sample_rate_hz, _resample(resample), units or {}))

    @classmethod
    def from_xarray(
        cls,
        data: xarray.Dataset,
        *,
        sample_rate_hz: float | None = None,
        resample: bool | float = False,
        units: Mapping[str, str] | None = None,
        name: str = "dataset",
    ) -> Recording:
        """A recording from a dataset with one variable a channel, and time as a coordinate ``t`` or ``time``.

        Attributes ``units`` of the variables are understood.

        >>> import numpy as np, xarray as xr, ndof
        >>> force = xr.DataArray([0.0, 1.0, 2.0], dims="time", attrs={"units": "kN"})
        >>> data = xr.Dataset({"force_x": force}, coords={"time": [0.0, 0.002, 0.004]})
        >>> ndof.Recording.from_xarray(data)["force_x"]
        array([   0., 1000., 2000.])
        """
        given = {str(label): str(values.attrs["units"]) for label, values in data.data_vars.items() if "units" in values.attrs}
        given.update(units or {})
        columns = [(str(label), _numbers(values)) for label, values in data.data_vars.items()]
        for label, values in data.coords.items():
            if str(label).lower() in ("t", "time"):
                stamps = values.values
                if stamps.dtype.kind in "mM":
                    stamps = (stamps - stamps[0]) / np.timedelta64(1, "s")
                columns.insert(0, (str(label), np.asarray(stamps, dtype=np.float64)))
        metadata = {str(key): str(value) for key, value in data.attrs.items()}
        return cls._from_parts(_ndof.from_columns(name, columns, metadata, sample_rate_hz, _resample(resample), given))

    @property
    def names(self) -> list[str]:
        """The names of the channels, in order.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.0, 1.0]}, 10).names
        ['force_x']
        """
        return list(self._names)

    @property
    def units(self) -> dict[str, str]:
        """The SI unit of each channel.

        >>> import ndof
        >>> ndof.Recording({"angle_wrist [deg]": [0.0, 180.0]}, 10).units
        {'angle_wrist': 'rad'}
        """
        return dict(zip(self._names, self._units))

    @property
    def duration_s(self) -> float:
        """Length in seconds: samples over rate.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.0, 1.0]}, 10).duration_s
        0.2
        """
        return len(self) / self.sample_rate_hz

    @property
    def time_s(self) -> NDArray[np.float64]:
        """The time of each sample, on the clock of the file.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.0, 1.0]}, 10, start_s=3.0).time_s
        array([3. , 3.1])
        """
        return self.start_s + np.arange(len(self)) / self.sample_rate_hz

    def __len__(self) -> int:
        return len(self._samples[0]) if self._samples else 0

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __contains__(self, channel: object) -> bool:
        return channel in self._names

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        try:
            return self._samples[self._names.index(channel)]
        except ValueError:
            raise KeyError(f'no channel "{channel}"; the recording has: {", ".join(self._names)}') from None

    def __repr__(self) -> str:
        named = ", ".join(f"{name} [{unit}]" for name, unit in zip(self._names, self._units))
        count = len(self._names)
        return f"Recording({count} channel{'' if count == 1 else 's'} ({named}), {self.duration_s} s at {self.sample_rate_hz} Hz)"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        facts = (self.sample_rate_hz, self.start_s, self._names, self._units, self.metadata)
        if facts != (other.sample_rate_hz, other.start_s, other._names, other._units, other.metadata):
            return False
        return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(self._samples, other._samples))

    __hash__ = None  # type: ignore[assignment]

    def negate(self, *channels: str) -> Recording:
        """The recording with the sign of these channels turned, such as a transducer that reads the reaction.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.0, 1.0]}, 10).negate("force_x")["force_x"]
        array([-0., -1.])
        """
        return Recording._from_parts(_ndof.negate(self, channels))

    def align(self, other: Recording, by: str | tuple[str, str]) -> Recording:
        """The recording joined with one of the same trial by another clock, through a channel that both have (or its two names).

        Offset and drift of the clocks are fitted and said in ``warnings``; the channels of ``other`` are interpolated.

        >>> import numpy as np, ndof
        >>> noise = np.cumsum(np.random.default_rng(1).normal(size=4000))
        >>> first = ndof.Recording({"pos_x": noise[:3900]}, 100)
        >>> second = ndof.Recording({"sync [m]": noise[50:], "emg [V]": noise[50:] ** 2}, 100, name="amplifier")
        >>> joined = first.align(second, ("pos_x", "sync"))
        >>> joined.names, bool(np.allclose(joined["emg"][100:-100], joined["pos_x"][100:-100] ** 2, rtol=1e-3, atol=1e-3))
        (['pos_x', 'emg'], True)
        """
        return Recording._from_parts(_ndof.align(self, other, (by, by) if isinstance(by, str) else by))

    def tare(self, unloaded: Recording) -> Recording:
        """The recording with the mean forces of a recording without load taken off.

        >>> import ndof
        >>> ndof.Recording({"force_x": [3.0, 5.0]}, 10).tare(ndof.Recording({"force_x": [0.5, 1.5]}, 10))["force_x"]
        array([2., 4.])
        """
        return Recording._from_parts(_ndof.tare(self, unloaded))

    def without_handle(self, mass_kg: float) -> Recording:
        """The recording with the inertial force of a handle beyond the transducer taken off (kg; kg m² for rotations).

        >>> import numpy as np, ndof
        >>> t = np.arange(1000) / 100
        >>> held = ndof.Recording({"force_x": -2.0 * 4.0 * np.sin(2 * t), "pos_x": np.sin(2 * t)}, 100)
        >>> bool(np.abs(held.without_handle(2.0)["force_x"][50:-50]).max() < 0.02)
        True
        """
        return Recording._from_parts(_ndof.without_handle(self, float(mass_kg)))

    def write(self, path: PathLike) -> None:
        """Writes the recording in the format of the suffix (CSV, NPZ, MAT, BIDS motion); the file is there whole or not at all.

        >>> import ndof, tempfile, pathlib
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "trial.csv"
        ...     recording = ndof.Recording({"force_x": [0.1, 0.2]}, 500)
        ...     recording.write(path)
        ...     ndof.read(path) == recording
        True
        """
        _ndof.write(os.fspath(path), self)

    def to_pandas(self) -> _DataFrame:
        """The samples as a data frame with the time as index.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.5, 1.0]}, 10).to_pandas()
              force_x
        time         
        0.0       0.5
        0.1       1.0
        """
        import pandas

        frame = pandas.DataFrame(dict(zip(self._names, self._samples)), index=pandas.Index(self.time_s, name="time"))
        frame.attrs.update(self.metadata)
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """The samples as a dataset with one variable a channel and the time as coordinate.

        >>> import ndof
        >>> ndof.Recording({"force_x": [0.5, 1.0]}, 10).to_xarray()["force_x"].attrs
        {'units': 'N'}
        """
        import xarray

        variables = {
            name: ("time", values, {"units": unit}) for name, unit, values in zip(self._names, self._units, self._samples)
        }
        return xarray.Dataset(variables, coords={"time": self.time_s}, attrs=dict(self.metadata))


def _unpickle(*parts: Any) -> Recording:
    return Recording._from_parts(parts)


def _read_only(values: NDArray[np.float64]) -> NDArray[np.float64]:
    view = values.view()
    view.flags.writeable = False
    return view


def _numbers(values: Any) -> NDArray[np.float64]:
    return np.ascontiguousarray(values, dtype=np.float64)


def _resample(resample: bool | float) -> float | None:
    """``None`` for no, 0 for the median rate of the file."""
    if resample is True:
        return 0.0
    return None if resample is False else float(resample)


def read_trials(
    path: PathLike,
    *,
    sample_rate_hz: float | None = None,
    resample: bool | float = False,
    units: Mapping[str, str] | None = None,
    columns: Document | None = None,
    channels: Document | None = None,
    trial: str | int | None = None,
) -> list[Recording]:
    """Reads every trial that a file holds: one, except in archives of KINARM, episodes of Parquet and the like.

    Every format of the command line is read, told by its content: CSV, NPZ, MAT, C3D and KINARM's archives of it, OpenSim, XDF,
    TDMS, MCAP, Parquet, HDF5, as far as the package was built with it (``ndof.explain`` says). ``sample_rate_hz`` is the rate of a
    file that says nothing about time; ``resample`` interpolates irregular time onto a regular grid, of the file's median rate
    (``True``) or of a rate in Hz; ``columns`` (a file or a dictionary) says what the columns of a table without a header are,
    ``channels`` (the same) what channels are that are called otherwise, their units, signs and matrices; ``trial`` takes one trial, by its name or its number from 1. What was converted or assumed is in ``warnings``.

    >>> import ndof, tempfile, pathlib
    >>> layout = {"sample_rate_hz": 200, "columns": {"angle_ie": {"number": 2, "unit": "rad"}}}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "log.asc"
    ...     _ = path.write_text("1 0.5 3\\n2 0.25 4\\n3 0.125 5\\n")
    ...     ndof.read_trials(path, columns=layout)
    [Recording(1 channel (angle_ie [rad]), 0.015 s at 200.0 Hz)]
    """
    given = None if trial is None else str(trial)
    read = _ndof.read_trials(os.fspath(path), sample_rate_hz, _resample(resample), units or {}, document(columns), document(channels), given)
    return [Recording._from_parts(parts) for parts in read]


def read(
    path: PathLike,
    *,
    sample_rate_hz: float | None = None,
    resample: bool | float = False,
    units: Mapping[str, str] | None = None,
    columns: Document | None = None,
    channels: Document | None = None,
    trial: str | int | None = None,
) -> Recording:
    """Reads a recording file, as :func:`read_trials` does, that holds one trial or of which ``trial`` takes one.

    >>> import ndof, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "trial.csv"
    ...     _ = path.write_text("time,force_x [N],pos_x [mm]\\n0.000,1.5,2\\n0.002,1.25,2.5\\n")
    ...     ndof.read(path)
    Recording(2 channels (force_x [N], pos_x [m]), 0.004 s at 500.0 Hz)
    """
    trials = read_trials(path, sample_rate_hz=sample_rate_hz, resample=resample, units=units, columns=columns, channels=channels, trial=trial)
    if len(trials) != 1:
        names = ", ".join(recording.name for recording in trials)
        raise _errors.NdofError(f"{os.fspath(path)} holds {len(trials)} trials: {names}; name one with `trial`, or use `read_trials`")
    return trials[0]


def explain(path: PathLike) -> dict[str, Any]:
    """What a file is: what was understood of it, what was not, and what would make it readable.

    >>> import ndof, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "log.asc"
    ...     _ = path.write_text("1 0.5 3\\n2 0.25 4\\n3 0.125 5\\n")
    ...     told = ndof.explain(path)
    >>> told["readable"], any("--columns" in remedy for remedy in told["remedies"])
    (False, True)
    """
    told: dict[str, Any] = json.loads(_ndof.explain(os.fspath(path)))
    return told


Recordings = Union["Recording", PathLike, Iterable[Union["Recording", PathLike]]]
"""One recording or file, or several trials of one experiment."""


def recordings_of(given: Recordings) -> list[Recording]:
    """What a caller gives, as recordings: files are read."""
    if isinstance(given, Recording):
        return [given]
    if isinstance(given, (str, os.PathLike)):
        return read_trials(given)
    return [trial for one in given for trial in ([one] if isinstance(one, Recording) else read_trials(one))]


def roles_of(
    reference: str | Sequence[str] | None, input: str | Sequence[str] | None, output: str | Sequence[str] | None
) -> _ndof._Roles:
    """Names of channels by role, a single one written as a string."""
    return tuple(  # type: ignore[return-value]
        [names] if isinstance(names, str) else None if names is None else list(names) for names in (reference, input, output)
    )
