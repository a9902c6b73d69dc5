"""Options of the spectral estimate, under the names of the command line."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import _ndof

Stretch = tuple[float, float]


def settings(**options: Any) -> str:
    """Options that differ from the command line's defaults, as its study files write them."""
    given = {key.replace("_", "-"): value for key, value in options.items() if value is not None and value is not False}
    return json.dumps(given) if given else "{}"


def stretches(start: float | None, stop: float | None, exclude: Sequence[Stretch]) -> _ndof._Stretches:
    """Which stretches of the recordings are used."""
    return start, stop, list(exclude)
