"""The verbs of the program as functions (docs/commands.md). Logs are a Log, a path, or a sequence of these."""

from . import _sparflow as core


def fit(machine, logs, test=None, *, threads=0, effects=None, progress=None):
    """Identifies pressure models, margins, standby and valve gains from logs; returns a FitResult.

    test: logs to judge the model on, from which nothing is learned; without any, motions are held out.
    threads: for learning; 0 is one for each processor.
    effects: effects of your own (paths of YAML files) that the model's file shall contain.
    progress: called as progress(share, words) in this thread.
    Raises InputError where nothing could be learned, UsageError for a log given twice.
    """
    return core.fit(machine, dict(logs=logs, test=test, threads=threads, effects=effects, progress=progress))


def compare(model, logs):
    """Compares a Model with logs at every stage and shows where it fails; returns a CompareResult.

    With a Machine in place of the model, static forces and measured flows alone.
    """
    return core.compare(model, logs)
