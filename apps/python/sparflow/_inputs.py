"""What the functions accept: an object or the path of its file, numbers in their ranges; a sentence for anything else."""

import collections.abc
import numbers
import os

from . import _frames
from . import _sparflow as core
from ._errors import UsageError


def one(verb, given, *kinds):
    """`given`, or what the file of that path holds; of several kinds a file that ends with .json is the first (a model)."""
    if isinstance(given, kinds):
        return given
    if isinstance(given, (str, os.PathLike)):
        first = len(kinds) == 1 or os.fspath(given).lower().endswith(".json")
        return kinds[0 if first else -1].load(given)
    words = " or a ".join(kind.__name__ for kind in kinds)
    raise UsageError(f"{verb}: expected a {words}, or the path of its file; got {given!r}")


def several(verb, given, kind):
    """A list of these, from one or several."""
    if isinstance(given, (kind, str, os.PathLike)):
        given = [given]
    try:
        given = list(given)
    except TypeError:
        raise UsageError(f"{verb}: expected a {kind.__name__}, the path of its file, or several; got {given!r}") from None
    return [one(verb, g, kind) for g in given]


def whole(verb, name, value, lowest, highest):
    """A whole number within its range."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not lowest <= value <= highest:
        raise UsageError(f"{verb}: {name}= got {value!r}; expected a whole number from {lowest} to {highest}")
    return int(value)


def seed(verb, value):
    """A random seed."""
    return whole(verb, "seed", value, 0, 2**64 - 1)


def threads(verb, value):
    """Threads for learning; 0 is one for each processor."""
    return whole(verb, "threads", value, 0, 256)


def logs(given, machine, mapping):
    """Logs read by a mapping file; without one they stay as they are given."""
    if mapping is None or given is None:
        return given
    given = [given] if isinstance(given, (core.Log, str, os.PathLike)) else list(given)
    return [g if isinstance(g, core.Log) else core.Log.load(g, machine, mapping) for g in given]


def motion(given):
    """A motion as the library takes it: a Trajectory, a Log, a path, or columns by their names."""
    if isinstance(given, (core.Trajectory, core.Log, str, os.PathLike, dict)):
        return given
    if hasattr(given, "columns"):
        return _frames.columns_of(given, "frame")
    if isinstance(given, collections.abc.Mapping):
        return dict(given)
    raise UsageError("price: expected a Trajectory, a Log, a DataFrame, arrays by column name, or the path of a motion or log; "
                     f"got {given!r}")
