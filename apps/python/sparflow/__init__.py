"""Sparflow: identifies the working pressures of hydraulic machines and computes energy-optimal motions.

    import sparflow
    machine = sparflow.Machine.load("crane.yaml")
    fitted = sparflow.fit(machine, "monday.csv", test="tuesday.csv")
    fitted.model.save("crane.json")

Everything is SI; a unit that is not stands in the name (`_bar`, `_lpm`). Every result has `.json()` (the text that the
program's `--json` writes), `.to_dict()`, `.to_frame()` (pandas), `.report(path)`, and shows its summary in a notebook.
Every verb of the program is a function here: `help(sparflow.fit)`.
"""

from ._effects import Effect, Formula, effect, positive, quantity, step
from ._errors import (DefectError, Error, InfeasibleError, InputError, Interrupted, NotConvergedError,
                      SparflowWarning, UsageError)
from ._sparflow import *  # noqa: F401,F403
from ._sparflow import __version__
from ._verbs import (audit, benchmark, compare, derivatives, diagnose, evaluate, extend, fit, improve, loop_of_trust, optimize,
                     pareto, plan, price, propose_mapping, selftest, simulate, strategies)
from . import _frames

_frames.attach()
for _thing in list(globals().values()):
    if getattr(_thing, "__module__", "") == "sparflow._sparflow" and isinstance(_thing, type):
        _thing.__module__ = "sparflow"  # where help() and error messages shall find it
del _frames, _thing
