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
    """Ctrl-C in a long call: it ends within half a second.

    `result` is what was done until then: the object that the call returns, as far as it came, or None where nothing can be
    kept. Work that is at a part which it cannot leave ends that part in a thread of its own; until then `result` is None, and
    `wait()` waits for it. Where the work failed after Ctrl-C, `wait()` raises what it raised, which is also the `__cause__` once known.
    """

    _result = None
    _left_behind = None

    @property
    def result(self):
        """What was done; None where nothing can be kept, or the work is still at a part that it ends first."""
        if self._result is None and self._left_behind is not None:
            self._result = self._left_behind.result()
        return self._result

    @property
    def ended(self):
        """Whether the work has ended, so that `result` is final."""
        return self._left_behind is None or self._left_behind.ended()

    def wait(self, seconds=None):
        """Waits until the work has ended, at most so many seconds [s] (None: as long as it takes); returns `result`."""
        if self._left_behind is not None:
            try:
                self._left_behind.wait(-1.0 if seconds is None else float(seconds))
            except Exception as failure:
                self.__cause__ = failure
                raise
        elif self.__cause__ is not None:
            raise self.__cause__
        return self.result


class SparflowWarning(UserWarning):
    """A sentence about an input that is unusual, or about what a result lacks."""
