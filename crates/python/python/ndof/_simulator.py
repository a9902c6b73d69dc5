"""A simulation that is a function: it runs with the commands of each recording, and again with what a diagnosis adds."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _errors
from ._recording import Recording

Channels = dict[str, NDArray[np.float64]]
Simulate = Callable[[Channels, Channels, dict[str, float]], Mapping[str, ArrayLike]]
"""``f(inputs, added_effort, parameters) -> outputs``: every channel of a recording, efforts to be felt beside the simulator's own forces (0 on the
first run), and the parameters that the caller gave; the channels that it simulates."""
Added = tuple[list[str], list[list[NDArray[np.float64]]], list[tuple[int, int, int]]]


class Rerun(TypedDict):
    """What a simulator misses of the held-out part by its own run, alone and with the effort of the named causes."""

    outputs: list[str]
    nrmse_before: list[float]
    """Standard deviation of the error over that of the output, before."""
    nrmse_after: list[float]


def run(simulate: Simulate, recording: Recording, effort: Channels, parameters: Mapping[str, float], told: set[str] | None = None) -> Recording:
    """What the simulator logs at the commands of a recording: its channels, those that the function gives (their names go to ``told``) in place of the
    measured ones."""
    given = simulate({name: recording[name] for name in recording}, effort, dict(parameters))
    if not isinstance(given, Mapping):
        raise _errors.NdofError(f"simulate returned {type(given).__name__}; give a dictionary of channels")
    outputs = {str(name): np.asarray(samples, dtype=np.float64) for name, samples in given.items()}
    for name, samples in outputs.items():
        if name not in recording:
            raise _errors.NdofError(f'simulate returned "{name}"; {recording.name} has: {", ".join(recording)}')
        if samples.shape != (len(recording),):
            raise _errors.NdofError(f'simulate returned "{name}" of shape {samples.shape}; {recording.name} has {len(recording)} samples')
        if not np.isfinite(samples).all():
            raise _errors.NdofError(f'simulate returned "{name}" with numbers that are not finite at the commands of {recording.name}')
    if told is not None:
        told.update(outputs)
    channels = {name: outputs.get(name, recording[name]) for name in recording}
    return Recording(channels, recording.sample_rate_hz, units=recording.units, start_s=recording.start_s, name=f"the simulator at {recording.name}")


def rerun(
    simulate: Simulate,
    recordings: Sequence[Recording],
    before: Sequence[Recording],
    added: Added | None,
    outputs: Sequence[str],
    parameters: Mapping[str, float],
) -> Rerun | None:
    """The held-out error of the simulator's own runs, before and with what was found; ``None`` where stretches were cut out of the recordings, and, with a
    warning, where the simulator fails with what was found: the diagnosis is there without its proof."""
    if added is None or len(added[1]) != len(recordings):
        return None
    channels, efforts, held_out = added
    if any(len(series) != len(recording) for recording, trial in zip(recordings, efforts) for series in trial):
        return None
    try:
        after = {k: run(simulate, recordings[k], dict(zip(channels, efforts[k])), parameters) for k in sorted({k for k, _, _ in held_out})}
    except Exception as failed:  # the user's function, which ran before
        told = f"simulate failed with the efforts that the diagnosis adds, so its own run proves nothing: {type(failed).__name__}: {failed}"
        warnings.warn(told, RuntimeWarning, stacklevel=3)
        return None

    def missed(runs: Union[Sequence[Recording], Mapping[int, Recording]], output: str) -> float:
        error = np.concatenate([recordings[k][output][a:b] - runs[k][output][a:b] for k, a, b in held_out])
        return float(np.std(error) / np.std(np.concatenate([recordings[k][output][a:b] for k, a, b in held_out])))

    return Rerun(
        outputs=list(outputs),
        nrmse_before=[missed(before, output) for output in outputs],
        nrmse_after=[missed(after, output) for output in outputs],
    )
