"""simulate and benchmark give what the program gives; controllers written in Python drive the plant."""

import json
import subprocess
import sys

import numpy as np
import pytest

import sparflow
from conftest import DATA, SOURCE, interrupted_soon, without_times

CRANE = DATA / "machines/loader_crane.yaml"
TIMES = ("elapsed_s", "times_real_time")


def test_simulate_gives_the_programs_log(machine, program, tmp_path):
    subprocess.run([program, "simulate", "-m", CRANE, "--seconds", "4", "--seed", "3", "--effects",
                    "coulomb_friction:boom=6000,drop_outs", "-o", tmp_path / "log.csv", "--json", tmp_path / "run.json"],
                   check=True, capture_output=True)
    shares = []
    ours = sparflow.simulate(machine, seconds=4, seed=3, effects=["coulomb_friction:boom=6000", "drop_outs"],
                             progress=lambda share, words: shares.append(share))
    assert ours.csv == (tmp_path / "log.csv").read_text()
    theirs = json.loads((tmp_path / "run.json").read_text())
    assert {k: v for k, v in ours.to_dict().items() if k not in TIMES} == {k: v for k, v in theirs.items() if k not in TIMES}
    assert ours.status == "done" and len(ours.log) == 200 and shares == sorted(shares)
    assert list(ours.to_frame().columns) == ours.log.signals
    assert ours.energy_J == pytest.approx(sum(p["energy_J"] for p in theirs["pumps"].values()))


def test_a_function_drives_the_plant(machine):
    seen = []

    def lift(state):
        """Lifts the boom until it stands at 0.3 rad."""
        seen.append(state)
        return {"boom": 0.6 if state["q"]["boom"] < 0.3 else np.float32(0.0)}

    run = sparflow.simulate(machine, seconds=5, controller=lift, start={"boom": 0.1, "jib": -1.2}, payload_kg=300)
    assert len(seen) == 250 and seen[0]["type"] == "state" and seen[0]["t_s"] == 0.0
    assert seen[0]["q"]["boom"] == pytest.approx(0.1) and seen[0]["payload_kg"] == 300
    assert set(seen[0]) == {"type", "t_s", "q", "qd", "length_m", "pA_bar", "pB_bar", "p_bar", "payload_kg", "oil_C"}
    boom = [s["q"]["boom"] for s in seen]
    assert boom[-1] > 0.29 and boom[-1] < 0.45
    # What the plant was told stands in its log.
    assert run.log["u_boom"][0] == pytest.approx(0.6) and run.log["u_jib"][0] == 0.0
    assert run.csv == sparflow.simulate(machine, seconds=5, controller=lift, start={"boom": 0.1, "jib": -1.2},
                                        payload_kg=300).csv


def test_what_a_controller_does_wrong_ends_the_call(machine):
    def divide(state):
        return {"boom": 1 / 0}

    with pytest.raises(ZeroDivisionError):
        sparflow.simulate(machine, seconds=1, controller=divide)
    with pytest.raises(sparflow.UsageError, match="the controller named a cylinder that the machine does not have.*bom"):
        sparflow.simulate(machine, seconds=1, controller=lambda state: {"bom": 1})
    with pytest.raises(sparflow.UsageError, match="the controller gave a command that is no number"):
        sparflow.simulate(machine, seconds=1, controller=lambda state: {"boom": "fast"})
    with pytest.raises(sparflow.UsageError, match="a controller is a function"):
        sparflow.simulate(machine, controller=3)
    with pytest.raises(sparflow.UsageError, match="give one of track, replay, motion, controller"):
        sparflow.simulate(machine, controller=lambda state: {}, motion="1")
    with pytest.raises(sparflow.UsageError, match=r"effects=: the plant has no effect .*sparflow.plant_effects\(\) names them"):
        sparflow.simulate(machine, effects="coulomb_frction")
    assert "coulomb_friction" in sparflow.plant_effects()
    with pytest.raises(KeyError, match='no joint "bom"'):
        sparflow.simulate(machine, controller=lambda state: {}, start={"bom": 1})


def test_an_interrupted_run_keeps_its_log(machine):
    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: sparflow.simulate(machine, seconds=100000, progress=progress))
    run = caught.value.wait(10)
    assert run.status == "interrupted" and run.interrupted and len(run.log) > 0 and "cut at" in run.csv


def test_an_optimised_motion_is_tracked(machine):
    problem = sparflow.Problem.load(DATA / "reaches/loader_crane_short_hop.yaml")
    motion = sparflow.optimize(problem, intervals=20, paths=2).motion
    run = sparflow.simulate(machine, seconds=motion.duration + 1, track=motion, payload_kg=400)
    q = run.log["q_boom"]
    assert abs(q[0] - motion.q[0, 0]) < 0.01 and abs(q[-1] - motion.q[-1, 0]) < 0.03  # [rad] what feedback leaves


class Straight:
    """The controller of examples/own_controller.py."""

    begun = 0

    def begin(self, task):
        Straight.begun += 1
        self.task, self.first = task, None

    def __call__(self, state):
        self.first = self.first or state
        share = min(1.0, (state["t_s"] - self.first["t_s"]) / (0.9 * self.task["duration_s"]))
        levers = {}
        for rod, goal in self.task["goal"]["length_m"].items():
            way = goal - self.first["length_m"][rod]
            error = self.first["length_m"][rod] + share * way - state["length_m"][rod]
            speed = (way / (0.9 * self.task["duration_s"]) if share < 1.0 else 0.0) + 2.0 * error
            valve, side = self.task["valves"][rod], "extend" if speed > 0 else "retract"
            part = abs(speed) / valve[side + "_m_s"]
            dead = valve["dead_" + side] * min(1.0, part / 0.01)
            lever = (1 if speed > 0 else -1) * min(1.0, dead + (1.0 - dead) * part)
            levers[rod] = lever if abs(speed) > 0.002 else 0.0
        return levers


def test_a_class_and_the_same_controller_as_a_process_give_the_same_rows(scenario):
    Straight.begun = 0
    process = f"{sys.executable} {SOURCE}/examples/own_controller.py"
    result = sparflow.benchmark(scenario, functions={"mine": Straight}, processes={"theirs": process}, optimum=False)
    frame = result.to_frame().set_index(["controller", "seed"])
    assert result.controllers == ["theirs", "mine"] and Straight.begun == 2  # one goal in each of two runs
    assert (frame["status"] == "done").all()
    for key in ("energy_J", "time_s", "tip_error_end_m"):
        for seed in (1, 2):
            # Numbers pass as text of all digits in both ways.
            assert frame.loc[("mine", seed), key] == frame.loc[("theirs", seed), key]


def test_benchmark_gives_the_programs_rows_and_failures_have_reasons(scenario, program, tmp_path):
    subprocess.run([program, "benchmark", scenario, "--controllers", "joint_pi", "--seeds", "1", "--no-optimum", "--json",
                    tmp_path / "b.json"], capture_output=True, check=True)

    def broken(state):
        raise ValueError("no idea")

    ours = sparflow.benchmark(scenario, "joint_pi", functions={"broken": broken}, seeds=1, optimum=False)
    rows = ours.to_dict()["rows"]
    keep = lambda row: {k: v for k, v in row.items() if not k.startswith("step_")}
    assert keep(rows[0]) == keep(json.loads((tmp_path / "b.json").read_text())["rows"][0])
    assert rows[1]["status"] == "failed" and rows[1]["reason"] == "its function raised ValueError: no idea at t = 0.00 s"
    with pytest.raises(sparflow.UsageError, match="no controller \"joint_pl\", did you mean joint_pi"):
        sparflow.benchmark(scenario, "joint_pl")
    with pytest.raises(sparflow.UsageError, match="gains= joint_pi.proportional=1000"):
        sparflow.benchmark(scenario, "joint_pi", gains={"joint_pi.proportional": 1000})


def test_what_a_function_raises_may_have_any_text(scenario):
    class Untold(Exception):
        def __str__(self):
            raise TypeError("no text")

    def surrogate(state):
        raise ValueError("\udcff")

    def untold(state):
        raise Untold()

    result = sparflow.benchmark(scenario, functions={"surrogate": surrogate, "untold": untold}, seeds=1, optimum=False)
    reasons = [row["reason"] for row in result.to_dict()["rows"]]
    assert reasons == ["its function raised ValueError: ? at t = 0.00 s", "its function raised Untold at t = 0.00 s"]


def test_numbers_outside_their_ranges_are_refused(machine, scenario):
    for wrong, words in ((dict(seeds=10**9), "seeds= got 1000000000; expected 0 to 1000"),
                         (dict(step_budget_s=float("nan")), "step_budget_s= got nan; expected 0.001 to 600"),
                         (dict(jobs=-1), "jobs= got -1; expected 0 to 256")):
        with pytest.raises(sparflow.UsageError, match=words):
            sparflow.benchmark(scenario, "joint_pi", **wrong)
    with pytest.raises(sparflow.UsageError, match="payload_kg= got -5; expected 0 to 1"):
        sparflow.simulate(machine, payload_kg=-5)


def test_a_trajectory_of_another_machine_is_not_tracked(machine):
    hop = DATA / "reaches/loader_crane_short_hop.yaml"
    motion = sparflow.optimize(sparflow.Problem.load(hop), intervals=20, paths=2).motion
    other = sparflow.Machine.load(DATA / "machines/swing_crane.yaml")
    with pytest.raises(sparflow.UsageError, match="the motion to track has 3 joints; machine .* has 4"):
        sparflow.simulate(other, track=motion)


def test_an_interrupted_benchmark_keeps_its_runs(scenario):
    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: sparflow.benchmark(scenario, "joint_pi", seeds=200, optimum=False, jobs=1,
                                                             progress=progress),
                         when=lambda share, words: words == "lift, joint_pi")
    result = caught.value.wait(10)
    status = result.to_frame()["status"]
    assert result.interrupted and (status == "done").any() and (status == "failed").any()


def test_the_loop_of_trust_gives_both_models_and_their_errors(machine):
    result = sparflow.loop_of_trust(machine, train_seconds=60, test_seconds=20, most_effects=1, moves=1, seed=3)
    told = json.loads(result.json())
    assert len(told["moves"]) == 1
    move = told["moves"][0]
    for way in ("before", "after"):
        assert move[way]["done"], move[way]
        assert move[way]["relative_error"] == pytest.approx(move[way]["predicted_J"] / move[way]["true_J"] - 1)
    assert result.before.effects == [] and len(result.after.effects) == len(told["steps"])
    with pytest.raises(sparflow.UsageError, match="moves"):
        sparflow.loop_of_trust(machine, moves=0)
