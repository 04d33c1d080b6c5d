"""Exceptions and warnings of Sparflow: each says in one sentence where, what was found, what was expected, what to do."""


class Error(Exception):
    """Anything that Sparflow refuses or does not find."""


class InputError(Error, ValueError):
    """Bad input file or data (exit code 3 of the program).

    file, line, column (1-based, 0 = not known) and key name the place.
    """

    file: str = ""
    line: int = 0
    column: int = 0
    key: str = ""


class UsageError(Error, ValueError):
    """Arguments that do not go together (exit code 2)."""


class InfeasibleError(Error):
    """There is no motion within all limits, or none was found (exit code 4). `result` is what was tried."""

    result = None


class NotConvergedError(InfeasibleError):
    """The solver failed (exit code 4)."""


class DefectError(Error, RuntimeError):
    """A defect of the program (exit code 1); please report it."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C in a long call. `result` is what was done until then, None where nothing can be kept."""

    result = None


class SparflowWarning(UserWarning):
    """A sentence about an input that is unusual, or about what a result lacks."""
