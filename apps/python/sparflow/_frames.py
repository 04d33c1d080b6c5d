"""Tables of results for pandas, which is imported only when one is asked for."""

import json
import warnings

from . import _sparflow as core
from ._errors import InputError, SparflowWarning


_SUFFIXES = {"degC": "C"}  # units of signals that columns write otherwise


def _pandas():
    import pandas
    return pandas


def to_dict(self):
    """The result as Python's own types, with the keys of `--json` (docs/commands.md)."""
    return json.loads(self.json())


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


def compare_frame(self):
    """Scores of every stage, a row each: stage, at, regime, rmse, unit, fit_percent, n, ..."""
    return _pandas().DataFrame(_scores(to_dict(self)["stages"]))


def fit_frame(self):
    """The pressure models, a row each: cylinder, direction, samples, rmse_bar, noise_bar, ..."""
    return _pandas().DataFrame(to_dict(self)["processes"])


def mapping_frame(self):
    """The machine's signals, a row each: meaning, column, channel, confidence, sure, reasons, other, ..."""
    return _pandas().DataFrame(to_dict(self)["proposal"]["meanings"])


def channels_frame(self):
    """The channels of the log, a row each: name, unit, rate_Hz, smallest, largest, gaps, missing_share, noise, ..."""
    return _pandas().DataFrame(to_dict(self)["channels"])


def diagnosis_frame(self):
    """The effects that passed their proofs, most probable first: id, at, stage, probability, parameters, ..."""
    return _pandas().DataFrame(to_dict(self)["effects"])


def extend_frame(self):
    """The steps, a row each: added, removed, judged_on, error_ratio, ..."""
    return _pandas().DataFrame(to_dict(self)["steps"])


def selftest_frame(self):
    """Every effect with its power on these logs, a row each."""
    return _pandas().DataFrame(to_dict(self)["effects"])


def plan_frame(self):
    """The paths, a row each: name, planner, waypoints, shortest_duration_s, end."""
    return _pandas().DataFrame(to_dict(self)["paths"])


def motion_frame(self):
    """The motion by its rows, columns as in MOTION.csv (docs/commands.md)."""
    return _csv_frame(self.motion_csv())


def strategies_frame(self):
    """The strategies, a row each: problem, time ('equal', 'own', a factor), strategy, energy_J, duration_s, ..."""
    rows = []
    for problem in to_dict(self)["problems"]:
        times = [(f["factor"], f["strategies"]) for f in problem.get("factors", [])]
        if "own_time" in problem:
            times.insert(0, ("own", problem["own_time"]))
        if problem["strategies"] and problem["strategies"] != problem.get("own_time"):
            times.insert(0, ("equal", problem["strategies"]))
        for time, outcomes in times:
            for strategy, outcome in outcomes.items():
                rows.append({"problem": problem["name"], "time": time, "strategy": strategy, **_plain(outcome)})
    return _pandas().DataFrame(rows)


def _plain(values):
    return {k: v for k, v in values.items() if not isinstance(v, (dict, list))}


def _csv_frame(text):
    import io
    return _pandas().read_csv(io.StringIO(text))


def pareto_frame(self):
    """The curve, a row a duration: duration_s, energy_J, sequential_J, simultaneous_J, share_moving_0, ..."""
    return _csv_frame(self.csv())


def audit_frame(self):
    """The moves, a row each: log, from_s, to_s, payload_kg, measured_J, model_J, optimum_J, saving_J, ..."""
    return _pandas().DataFrame([{"log": move["log"], "from_s": move["t_s"][0], "to_s": move["t_s"][1], **_plain(move)}
                                for move in to_dict(self)["moves"]])


def simulation_frame(self):
    """The log of the run: all signals in SI, indexed by time [s]."""
    return log_frame(self.log)


def benchmark_frame(self):
    """The runs, a row each: scenario, controller, seed, status, energy_J, ... (docs/benchmark.md)."""
    return _csv_frame(self.csv())


def log_frame(self):
    """All signals in SI, indexed by time [s]; their units stand in `frame.attrs["units"]`, where Log.from_frame finds them."""
    pandas = _pandas()
    frame = pandas.DataFrame({name: self[name] for name in self.signals}, index=pandas.Index(self.time, name="t_s"))
    frame.attrs["units"] = {name: self.unit(name) for name in self.signals}
    return frame


def columns_of(frame, name):
    """The columns of a DataFrame as arrays of floats, named as in a file."""
    if len(frame) == 0:
        raise InputError(f"{name}: the frame has no rows; expected at least two samples")
    units = {label: _SUFFIXES.get(unit, unit) for label, unit in frame.attrs.get("units", {}).items() if unit}
    if "t_s" not in frame.columns and frame.index.name == "t_s":
        frame = frame.reset_index()
    columns = {}
    for position, label in enumerate(frame.columns):
        if str(label) in columns:
            raise InputError(f"{label}: two columns of the frame have this name; rename one")
        numbers = _numbers(frame.iloc[:, position], str(label))
        if numbers is not None:
            unit = units.get(str(label))
            columns[f"{label}_{unit}" if unit else str(label)] = numbers
    return columns


def log_from_frame(frame, machine, name="frame", mapping=None):
    """Makes a log of a DataFrame whose columns are named as in a file, with units ('t_s', 'q_boom_rad', ...).

    An index named 't_s' serves as that column. Columns without a unit in their names have that of `frame.attrs["units"]`, as
    Log.to_frame writes it. Raises InputError.
    """
    return core.Log.from_arrays(columns_of(frame, name), machine, name, mapping)


def _numbers(column, name):
    """A column as floats, NaN where a value is missing; None, with a warning, where it holds text alone."""
    pandas = _pandas()
    if pandas.api.types.is_datetime64_any_dtype(column) or pandas.api.types.is_timedelta64_dtype(column):
        raise InputError(f"{name}: expected numbers, found times; give seconds, "
                              "such as (t - t[0]).dt.total_seconds()")
    numbers = pandas.to_numeric(column, errors="coerce")
    unread = column[numbers.isna() & column.notna()]
    if len(unread) > 0 and len(unread) == int(column.notna().sum()):
        warnings.warn(f"{name} holds no numbers and is left out (its first value is {unread.iloc[0]!r})", SparflowWarning, stacklevel=3)
        return None
    if len(unread) > 0:
        raise InputError(f"{name}: expected numbers, found {unread.iloc[0]!r} at {unread.index[0]!r}; "
                              "remove it or write NaN")
    return numbers.to_numpy(dtype=float, na_value=float("nan"))


def attach():
    """Gives the classes of the library their tables."""
    core.Result.to_dict = to_dict
    core.FitResult.to_frame = fit_frame
    core.CompareResult.to_frame = compare_frame
    core.MappingProposal.to_frame = mapping_frame
    core.MappingProposal.channels = channels_frame
    core.Diagnosis.to_frame = diagnosis_frame
    core.ExtendResult.to_frame = extend_frame
    core.Selftest.to_frame = selftest_frame
    core.PlanResult.to_frame = plan_frame
    core.OptimizeResult.to_frame = motion_frame
    core.PriceResult.to_frame = motion_frame
    core.StrategiesResult.to_frame = strategies_frame
    core.ParetoResult.to_frame = pareto_frame
    core.AuditResult.to_frame = audit_frame
    core.Simulation.to_frame = simulation_frame
    core.BenchmarkResult.to_frame = benchmark_frame
    core.Log.to_frame = log_frame
    core.Log.from_frame = staticmethod(log_from_frame)
