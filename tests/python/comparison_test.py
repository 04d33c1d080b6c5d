"""strategies, pareto and audit give what the program gives; what is not found or interrupted is an exception with its result."""

import json
import signal
import subprocess
import time

import numpy as np
import pytest

import sparflow
from conftest import DATA, interrupted_soon, without_times

HOP = DATA / "reaches/loader_crane_short_hop.yaml"
LIFT = DATA / "reaches/hmf_lift.yaml"  # of two joints, which are solved faster
HMF = DATA / "models/hmf_2020_k4_load_sensing.json"
QUICK = dict(paths=1, intervals=20, processes=1)
MODEL = DATA / "models/loader_crane.json"
WORDS = ["-p", LIFT, "--model", HMF, "--paths", "1", "--intervals", "20", "--processes", "1"]


@pytest.fixture
def lift():
    return sparflow.Problem.load(LIFT, sparflow.Model.load(HMF))


def test_strategies_gives_the_programs_json_and_a_row_for_each_strategy(lift, program, tmp_path):
    subprocess.run([program, "strategies", "--time", "equal,1.5", "--orders", "0", *WORDS, "--json",
                    tmp_path / "s.json"], check=True, capture_output=True)
    shares = []
    ours = sparflow.strategies(lift, time="equal,1.5", orders=0, **QUICK,
                               progress=lambda share, words: shares.append(share))
    assert without_times(ours.to_dict()) == without_times(json.loads((tmp_path / "s.json").read_text()))
    frame = ours.to_frame()
    equal = frame[frame["time"] == "equal"].set_index("strategy")
    assert equal.loc["optimal", "energy_J"] <= equal.loc["sequential", "energy_J"]
    assert set(frame["time"]) == {"equal", 1.5}
    assert ours.motion("optimal").duration == pytest.approx(25.0) and not ours.motion("optimal").q.flags.owndata
    with pytest.raises(KeyError, match="no motion of strategy"):
        ours.motion("optimum")
    assert shares == sorted(shares) and "energy-optimal motion" in ours.headline


def test_wrong_arguments_are_told_in_the_modules_words():
    problem = sparflow.Problem.load(HOP)
    with pytest.raises(sparflow.UsageError, match='time= has "soon"; expected equal, own'):
        sparflow.strategies(problem, time="soon")
    with pytest.raises(sparflow.UsageError, match="give model=, or name a model in the problem"):
        sparflow.pareto(sparflow.Problem.load(DATA / "reaches/loader_crane_lift.yaml"))
    with pytest.raises(sparflow.UsageError, match="expected at least one problem"):
        sparflow.strategies([])


def test_own_times_without_idle_power_are_warned_of_by_the_arguments_name():
    with pytest.warns(sparflow.SparflowWarning, match="give idle_kW= to weigh time"):
        with pytest.raises(sparflow.Interrupted):
            interrupted_soon(lambda progress: sparflow.strategies(sparflow.Problem.load(HOP), time="own", progress=progress))


def test_pareto_gives_the_programs_curve(lift, program, tmp_path):
    subprocess.run([program, "pareto", "--points", "3", "--longest", "1.5", "--idle", "5", *WORDS, "--json",
                    tmp_path / "p.json", "-o", tmp_path / "p.csv"], check=True, capture_output=True)
    ours = sparflow.pareto(lift, points=3, longest=1.5, idle_kW=[5], **QUICK)
    assert without_times(ours.to_dict()) == without_times(json.loads((tmp_path / "p.json").read_text()))
    assert ours.csv() == (tmp_path / "p.csv").read_text()
    frame = ours.to_frame()
    # The least energy never rises with the time; the last digits of the text are rounded.
    assert (np.diff(frame["energy_J"]) <= 1e-6 * frame["energy_J"][:-1]).all()
    assert ours.motion(0).duration == pytest.approx(frame["duration_s"][0], rel=1e-4)  # the solver's tolerance
    with pytest.raises(IndexError, match="no point"):
        ours.motion(1000)


def test_an_interrupted_comparison_keeps_the_problems_that_are_done(lift):
    problems = [lift, sparflow.Problem.load(HOP)]
    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: sparflow.strategies(problems, orders=0, **QUICK, progress=progress),
                         when=lambda share, words: words.startswith("1 of 2"))
    done = caught.value.wait(20)
    first, second = done.to_dict()["problems"]
    assert done.interrupted and not first["interrupted"] and first["strategies"]["optimal"]["energy_J"] > 0
    assert second["interrupted"]


def test_audit_gives_the_programs_json_and_proposes_motions(program, tmp_path):
    test = DATA / "logs/loader_crane_test.csv"
    subprocess.run([program, "audit", test, "--model", MODEL, "--moves", "1", "--no-bound", "--json", tmp_path / "a.json"],
                   check=True, capture_output=True)
    model = sparflow.Model.load(MODEL)
    ours = sparflow.audit(model, test, moves=1, bound=False)
    assert without_times(ours.to_dict()) == without_times(json.loads((tmp_path / "a.json").read_text()))
    (move,) = ours.moves
    assert move.not_judged == "" and move.saving_J > 0
    assert move.proposed.duration == pytest.approx(move.recorded.duration, rel=1e-9)
    rows = ours.motion_csv(0).splitlines()
    assert rows[0].startswith("t_s,") and len(rows) == len(move.proposed) + 1
    assert ours.to_frame()["saving_J"][0] == pytest.approx(move.saving_J)
    with pytest.raises(sparflow.UsageError, match="either litres_per_kWh or engine_map"):
        sparflow.audit(model, test, litres_per_kWh=0.4, engine_map="map.yaml")


def test_numbers_outside_their_ranges_are_refused(lift):
    model, test = sparflow.Model.load(MODEL), DATA / "logs/loader_crane_test.csv"
    nan = float("nan")
    for call, wrong, words in (
            (sparflow.pareto, dict(points=10**9), "pareto: points= got 1000000000; expected 3 to 200"),
            (sparflow.pareto, dict(longest=0.5), "longest= got 0.5; expected 1.2 to 100"),
            (sparflow.pareto, dict(idle_kW=[5, -1]), "idle_kW= got -1; expected 0 to 1000"),
            (sparflow.strategies, dict(intervals=1), "strategies: intervals= got 1; expected 10 to 5000"),
            (sparflow.strategies, dict(idle_kW=-1), "strategies: idle_kW= got -1; expected 0 to 1000"),
            (sparflow.optimize, dict(intervals=1), "optimize: intervals= got 1; expected 10 to 5000"),
            (sparflow.plan, dict(seconds=nan), "plan: seconds= got nan; expected 0.001 to"),
            (lambda _, **a: sparflow.audit(model, test, **a), dict(moves=0), "audit: moves= got 0; expected 1 to 100000"),
            (lambda _, **a: sparflow.audit(model, test, **a), dict(moves=-1), "moves= got -1"),
            (lambda _, **a: sparflow.audit(model, test, **a), dict(payload_kg=-1), "payload_kg= got -1; expected 0 to"),
            (lambda _, **a: sparflow.audit(model, test, **a), dict(pause_s=nan), "pause_s= got nan")):
        with pytest.raises(sparflow.UsageError, match=words):
            call(lift, **wrong)


def test_what_the_work_raises_after_ctrl_c_is_not_lost():
    # The same log many times, without a move, because a move must be longer than any: the signals of all of them are made
    # before that is known, and nothing asks whether to stop between them.
    model = sparflow.Model.load(MODEL)
    still = {name: np.full(20000, at) for name, at in (("q_boom_rad", 0.3), ("q_jib_rad", -1.1), ("q_extension_m", 1.0))}
    logs = [sparflow.Log.from_arrays({"t_s": np.arange(20000) * 0.02, **still}, model.machine) for _ in range(10)]
    begin = time.monotonic()
    with pytest.raises(sparflow.InputError, match="no move"):
        sparflow.audit(model, logs)
    whole = time.monotonic() - begin

    def press(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, press)
    try:
        signal.setitimer(signal.ITIMER_REAL, whole / 4)
        with pytest.raises(sparflow.Interrupted) as caught:
            sparflow.audit(model, logs)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    for _ in range(2):
        with pytest.raises(sparflow.InputError, match="no move"):
            caught.value.wait()
    assert isinstance(caught.value.__cause__, sparflow.InputError) and caught.value.result is None
