"""What can go wrong, with the text that the command line gives."""


class NdofError(ValueError):
    """Something that cannot be done with this input: what is wrong, where, and what to do about it.

    >>> import ndof
    >>> try:
    ...     ndof.study("arms")
    ... except ndof.NdofError as error:
    ...     print(error)
    no study "arms" (did you mean "arm"?); built in: arm, arm-moving, arm-hidden, sensitivity, drift, masses, spring-array, wrist; or give a file, STUDY.toml
    """


class FileError(NdofError, OSError):
    """A file that cannot be read or written, whatever it holds.

    >>> import ndof
    >>> try:
    ...     ndof.read("no-such-file.csv")
    ... except OSError as error:
    ...     print(type(error).__name__)
    FileError
    """
