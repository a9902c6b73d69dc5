"""Data quality before numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import _ndof
from ._options import Stretch, stretches
from ._recording import Recordings, recordings_of, roles_of
from ._result import Result

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame


class Check(Result):
    """Whether data are fit to judge by: the result ``ndof/check/1``.

    >>> import ndof
    >>> ndof.check(ndof.simulate("spring-array", trials=1).recordings)
    Check(good, 0 findings)
    """

    __slots__ = ()

    @property
    def verdict(self) -> str:
        """``good``, ``usable`` (remarks only) or ``faulty``.

        >>> import ndof
        >>> ndof.check(ndof.simulate("spring-array", trials=1).recordings).verdict
        'good'
        """
        verdict: str = self.to_dict()["verdict"]
        return verdict

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Everything found: code, severity, trial, channel, message and action.

        >>> import numpy as np, ndof
        >>> force = np.random.default_rng(1).normal(size=2000)
        >>> [f["code"] for f in ndof.check(ndof.Recording({"force_x": force, "pos_x": np.ones(2000)}, 100)).findings]
        ['constant']
        """
        findings: list[dict[str, Any]] = self.to_dict()["findings"]
        return findings

    def to_pandas(self) -> _DataFrame:
        """Every channel of every trial, one row each.

        >>> import ndof
        >>> table = ndof.check(ndof.simulate("spring-array", trials=2).recordings).to_pandas()
        >>> sorted(set(table["trial"]))
        [1, 2]
        """
        import pandas

        rows = []
        for k, trial in enumerate(self.to_dict()["trials"]):
            rows += [{"trial": k + 1, **channel} for channel in trial["channels"]]
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        count = len(self.findings)
        return f"Check({self.verdict}, {count} finding{'' if count == 1 else 's'})"


def check(
    recordings: Recordings,
    *,
    reference: str | Sequence[str] | None = None,
    input: str | Sequence[str] | None = None,
    output: str | Sequence[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
    exclude: Sequence[Stretch] = (),
) -> Check:
    """Looks at every channel before any number is computed, as ``ndof check`` does.

    >>> import numpy as np, ndof
    >>> recording = ndof.Recording({"force_x": np.random.default_rng(1).normal(size=2000), "pos_x": np.ones(2000)}, 100)
    >>> ndof.check(recording).verdict
    'faulty'
    """
    return Check(_ndof.check(recordings_of(recordings), roles_of(reference, input, output), stretches(start, stop, exclude)))
