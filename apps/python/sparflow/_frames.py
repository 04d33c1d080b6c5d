"""Tables of results for pandas, which is imported only when one is asked for."""

import json

from . import _sparflow as core


def _pandas():
    import pandas
    return pandas


def to_dict(result):
    """The result as Python's own types, with the keys of `--json` (docs/commands.md)."""
    return json.loads(result.json())


def _scores(stages):
    rows = []
    for stage, places in stages.items():
        for at, values in places.items():
            if not isinstance(values, dict):
                continue
            nested = {k: v for k, v in values.items() if isinstance(v, dict) and k in ("extend", "retract")}
            for regime, scores in (nested or {"": values}).items():
                rows.append({"stage": stage, "at": at, "regime": regime,
                             **{k: v for k, v in scores.items() if not isinstance(v, (dict, list))}})
    return rows


def compare_frame(result):
    """Scores of every stage, a row each: stage, at, regime, rmse, unit, fit_percent, n, ..."""
    return _pandas().DataFrame(_scores(to_dict(result)["stages"]))


def fit_frame(result):
    """The pressure models, a row each: cylinder, direction, samples, rmse_bar, noise_bar, ..."""
    return _pandas().DataFrame(to_dict(result)["processes"])


def diagnosis_frame(result):
    """The effects that passed their proofs, most probable first: id, at, stage, probability, parameters, ..."""
    return _pandas().DataFrame(to_dict(result)["effects"])


def extend_frame(result):
    """The steps, a row each: added, removed, judged_on, error_ratio, ..."""
    return _pandas().DataFrame(to_dict(result)["steps"])


def selftest_frame(result):
    """Every effect with its power on these logs, a row each."""
    return _pandas().DataFrame(to_dict(result)["effects"])


def plan_frame(result):
    """The paths, a row each: name, planner, waypoints, shortest_duration_s, end."""
    return _pandas().DataFrame(to_dict(result)["paths"])


def motion_frame(result):
    """The motion by its rows, columns as in MOTION.csv (docs/commands.md)."""
    import io
    return _pandas().read_csv(io.StringIO(result.motion_csv()))


def log_frame(log):
    """All signals in SI, indexed by time [s]."""
    pandas = _pandas()
    return pandas.DataFrame({name: log[name] for name in log.signals}, index=pandas.Index(log.time, name="t_s"))


def log_from_frame(frame, machine, name="frame", mapping=None):
    """Makes a log of a DataFrame whose columns are named as in a file, with units ('t_s', 'q_boom_rad', ...).

    An index named 't_s' serves as that column. Raises InputError.
    """
    if "t_s" not in frame.columns and frame.index.name == "t_s":
        frame = frame.reset_index()
    numbers = frame.select_dtypes("number")
    return core.Log.from_arrays({str(c): numbers[c].to_numpy(dtype=float) for c in numbers.columns},
                                machine, name, mapping)


def attach():
    """Gives the classes of the library their tables."""
    core.Result.to_dict = to_dict
    core.FitResult.to_frame = fit_frame
    core.CompareResult.to_frame = compare_frame
    core.Diagnosis.to_frame = diagnosis_frame
    core.ExtendResult.to_frame = extend_frame
    core.Selftest.to_frame = selftest_frame
    core.PlanResult.to_frame = plan_frame
    core.OptimizeResult.to_frame = motion_frame
    core.Log.to_frame = log_frame
    core.Log.from_frame = staticmethod(log_from_frame)
