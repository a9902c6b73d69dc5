"""How many threads compute."""

from __future__ import annotations

from . import _ndof


def set_threads(count: int) -> None:
    """Sets how many threads this process computes with; 0 stands for one a processor. Results do not depend on it.

    Where an engine runs several workers on one machine, give each its share.

    >>> import ndof
    >>> ndof.set_threads(2)
    >>> ndof.threads()
    2
    """
    _ndof.set_threads(count)


def threads() -> int:
    """How many threads this process computes with.

    >>> import ndof
    >>> ndof.threads() > 0
    True
    """
    return _ndof.threads()
