"""System identification of mechanical systems with any number of degrees of freedom.

The verbs of the command line with NumPy arrays in and out; the numbers are the same, to the last bit.

>>> import ndof
>>> trials = ndof.simulate("arm").recordings
>>> fit = ndof.fit(trials, nperseg=2048, band=(0.5, 8))
>>> fit.K.shape
(2, 2)
"""

from ._check import Check, check
from ._cohort import cohort_table, fit_row, subjects
from ._diagnose import Diagnosis, diagnose
from ._errors import FileError, NdofError
from ._fit import Fit, fit, project
from ._ndof import __version__
from ._recording import Recording, explain, read, read_trials
from ._response import FrequencyResponse, frequency_response
from ._result import Result
from ._simulate import Design, Simulation, StudyCase, StudyResult, design, registry, simulate, study
from ._spectra import CrossSpectra, Share, coherence, cross_spectra, merge, shares, welch
from ._threads import set_threads, threads

__all__ = [
    "Check",
    "CrossSpectra",
    "Design",
    "Diagnosis",
    "FileError",
    "Fit",
    "FrequencyResponse",
    "NdofError",
    "Recording",
    "Result",
    "Share",
    "Simulation",
    "StudyCase",
    "StudyResult",
    "__version__",
    "check",
    "coherence",
    "cohort_table",
    "cross_spectra",
    "design",
    "diagnose",
    "explain",
    "fit",
    "fit_row",
    "frequency_response",
    "merge",
    "project",
    "read",
    "read_trials",
    "registry",
    "set_threads",
    "shares",
    "simulate",
    "study",
    "subjects",
    "threads",
    "welch",
]
