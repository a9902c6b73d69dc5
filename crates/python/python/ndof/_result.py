"""What all results have in common."""

from __future__ import annotations

import json
from typing import Any

from ._options import PathLike


class Result:
    """A result of the command line's contract: its JSON, to the last bit, and its warnings.

    >>> import ndof
    >>> result = ndof.check(ndof.simulate("spring-array", trials=1).recordings)
    >>> isinstance(result, ndof.Result), result.to_dict()["schema"]
    (True, 'ndof/check/1')
    """

    __slots__ = ("_json",)

    def __init__(self, text: str) -> None:
        self._json = text

    def to_json(self) -> str:
        """The result as the bytes that the command line writes with ``--json``.

        >>> import ndof
        >>> result = ndof.check(ndof.simulate("spring-array", trials=1).recordings)
        >>> result.to_json().startswith('{"schema":"ndof/check/1"')
        True
        """
        return self._json

    def to_dict(self) -> dict[str, Any]:
        """The result as a dictionary, under the names of the contract.

        >>> import ndof
        >>> ndof.check(ndof.simulate("spring-array", trials=1).recordings).to_dict()["command"]
        'check'
        """
        result: dict[str, Any] = json.loads(self.to_json())
        return result

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What the reader should know: code, message and action of each warning.

        >>> import ndof
        >>> ndof.check(ndof.simulate("spring-array", trials=1).recordings).warnings
        []
        """
        warnings: list[dict[str, str]] = self.to_dict()["warnings"]
        return warnings

    def write(self, path: PathLike) -> None:
        """Writes the JSON to a file.

        >>> import ndof, tempfile, pathlib
        >>> result = ndof.check(ndof.simulate("spring-array", trials=1).recordings)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "check.json"
        ...     result.write(path)
        ...     path.read_text() == result.to_json()
        True
        """
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(self.to_json())

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.to_json(),)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash(self.to_json())
