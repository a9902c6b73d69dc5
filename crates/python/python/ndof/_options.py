"""Settings of a task, under the names of the command line."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

from . import _errors, _ndof

PathLike = Union[str, "os.PathLike[str]"]
Document = Union[PathLike, Mapping[str, Any]]
"""A file that people write (TOML), or the same as a dictionary."""
Stretch = tuple[float, float]


def document(given: Any) -> dict[str, Any]:
    """What people write as a file, given as a path or as a dictionary."""
    if given is None:
        return {"json": None, "path": None}
    if isinstance(given, (str, os.PathLike)):
        return {"json": None, "path": os.fspath(given)}
    if isinstance(given, Mapping):
        return {"json": json.dumps(given), "path": None}
    raise _errors.NdofError(f"{type(given).__name__}: give a path or a dictionary")


def settings(task: str, given: Mapping[str, Any]) -> str:
    """Of the keywords of a call those that are settings of ``task`` and differ from its defaults, as a study's file writes them.

    A keyword may end in the unit of its value: ``duration_s`` is ``duration``.
    """
    keywords = {name.removesuffix("_s").removesuffix("_hz").replace("_", "-"): value for name, value in given.items()}
    known = set(_ndof.settings(task))
    return json.dumps({key: value for key, value in keywords.items() if key in known and value is not None and value is not False})


def stretches(start: float | None, stop: float | None, exclude: Sequence[Stretch]) -> _ndof._Stretches:
    """Which stretches of the recordings are used."""
    return start, stop, list(exclude)
