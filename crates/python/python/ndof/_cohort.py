"""Many recordings: a plain function for one subject, which any engine maps over a table."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._errors import NdofError
from ._fit import fit
from ._options import PathLike
from ._recording import Recordings

if TYPE_CHECKING:
    from pandas import DataFrame as _DataFrame

SUFFIXES = {".csv", ".tsv", ".txt", ".npz", ".mat", ".parquet", ".h5", ".hdf5", ".nxs"}


def subjects(folder: PathLike) -> dict[str, list[str]]:
    """The subjects of a folder as ``ndof cohort`` sees them: each a folder with its trials, or a single file.

    >>> import ndof, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name in ("anna.csv", "ben.csv", "notes.md"):
    ...         pathlib.Path(folder, name).touch()
    ...     list(ndof.subjects(folder))
    ['anna', 'ben']
    """
    found: dict[str, list[str]] = {}
    for path in sorted(Path(folder).iterdir()):
        if path.is_dir():
            files = [str(file) for file in sorted(path.iterdir()) if file.suffix.lower() in SUFFIXES]
            name = path.name
        else:
            files = [str(path)] if path.suffix.lower() in SUFFIXES else []
            name = path.stem
        if (files or path.is_dir()) and name in found:
            raise NdofError(f'two subjects are called "{name}"; rename one of them')
        if files or path.is_dir():
            found[name] = files
    return found


def fit_row(subject: str, recordings: Recordings, **options: Any) -> dict[str, Any]:
    """Fits one subject and returns its row of the table of ``ndof cohort``: a failure is a row that says why.

    ``options`` are those of :func:`fit`. Values and standard errors of the parameters, those at the joints last, then
    ``chi2_reduced``, ``r2``, the codes of its ``warnings``, and ``error``. The same input gives the same row, however often and wherever it is computed.

    >>> import ndof
    >>> row = ndof.fit_row("anna", ndof.simulate("arm").recordings, nperseg=2048, band=(0.5, 8))
    >>> round(row["K_x_x"], -1), row["error"]
    (290.0, '')
    >>> ndof.fit_row("ben", "no-such-file.csv")["error"].startswith("no-such-file.csv: ")
    True
    """
    row: dict[str, Any] = {"subject": subject}
    try:
        result = fit(recordings, **options).to_dict()
    except NdofError as error:
        return {**row, "chi2_reduced": None, "r2": None, "warnings": "", "error": str(error).replace("\n", " ")}
    for parameter in result["parameters"] + (result["joint"] or {"parameters": []})["parameters"]:
        row[parameter["name"]] = parameter["value"]
        row[parameter["name"] + "_std_error"] = parameter["std_error"]
    warnings = " ".join(warning["code"] for warning in result["warnings"])
    return {**row, "chi2_reduced": result["chi2_reduced"], "r2": result["r2"], "warnings": warnings, "error": ""}


def cohort_table(rows: Iterable[Mapping[str, Any]]) -> _DataFrame:
    """Rows of :func:`fit_row` as the table of ``ndof cohort``: sorted by subject, its columns in its order.

    >>> import ndof
    >>> rows = [{"subject": "b", "K": 2.0, "K_std_error": 0.1, "error": ""}, {"subject": "a", "error": "no file"}]
    >>> list(ndof.cohort_table(rows).columns)
    ['subject', 'K', 'K_std_error', 'chi2_reduced', 'r2', 'warnings', 'error']
    """
    import pandas

    ordered = sorted((dict(row) for row in rows), key=lambda row: os.fsencode(str(row["subject"])))
    last = ["chi2_reduced", "r2", "warnings", "error"]
    columns = list(dict.fromkeys(name for row in ordered for name in row if name != "subject" and name not in last))
    return pandas.DataFrame(ordered, columns=["subject", *columns, *last])
