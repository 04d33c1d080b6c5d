"""plan and optimize give what the program gives; what is infeasible is an exception with its result."""

import json
import subprocess

import numpy as np
import pytest

import sparflow
from conftest import DATA, interrupted_soon, without_times


def test_optimize_gives_the_programs_motion(fitted, program, tmp_path):
    fitted.model.save(tmp_path / "crane.json")
    lift = DATA / "reaches/loader_crane_lift.yaml"
    subprocess.run([program, "optimize", "-p", lift, "--model", tmp_path / "crane.json", "-o", tmp_path / "motion.csv",
                    "--json", tmp_path / "motion.json"], check=True, capture_output=True)
    problem = sparflow.Problem.load(lift, fitted.model)
    shares = []
    ours = sparflow.optimize(problem, progress=lambda share, words: shares.append(share))
    assert without_times(ours.to_dict()) == without_times(json.loads((tmp_path / "motion.json").read_text()))
    assert ours.motion_csv() == (tmp_path / "motion.csv").read_text()
    assert ours.status == "optimal" and shares == sorted(shares)
    assert np.shares_memory(ours.motion.q, ours.motion.q) and not ours.motion.q.flags.owndata
    assert len(ours.to_frame()) == len(ours.motion)


def test_paths_are_planned_and_an_unreachable_goal_is_an_exception(tmp_path):
    lift = DATA / "reaches/loader_crane_lift.yaml"
    plan = sparflow.plan(sparflow.Problem.load(lift))
    assert plan.paths and plan.paths[0].shape[1] == 3 and list(plan.to_frame()["name"])
    import re
    far = re.sub(r"tip: *\[.*?\]", "tip: [90.0, 0.0, 90.0]", lift.read_text())
    far = re.sub(r"(machine|model): *(\.\./|[\w.])", lambda m: f"{m[1]}: {DATA}/reaches/{m[2]}" if m[2] == "../" else m[0], far)
    assert "90.0" in far
    (tmp_path / "far.yaml").write_text(far)
    with pytest.raises(sparflow.InfeasibleError) as caught:
        sparflow.plan(sparflow.Problem.load(tmp_path / "far.yaml"))
    assert str(caught.value) == caught.value.result.headline


def test_ctrl_c_ends_an_optimisation_within_half_a_second(fitted):
    problem = sparflow.Problem.load(DATA / "reaches/loader_crane_lift.yaml", fitted.model)
    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: sparflow.optimize(problem, progress=progress),
                         when=lambda share, words: share > 0.3)
    # Whatever was found until then is there once the work has ended, and stays the same object.
    done = caught.value.wait(20)
    assert caught.value.ended and done is caught.value.result


def test_ctrl_c_during_the_bound_keeps_the_motion(fitted):
    problem = sparflow.Problem.load(DATA / "reaches/loader_crane_lift.yaml", fitted.model)
    with pytest.raises(sparflow.Interrupted) as caught:
        interrupted_soon(lambda progress: sparflow.optimize(problem, intervals=20, bound=True, progress=progress),
                         when=lambda share, words: "bound" in words or "joint grid" in words)
    done = caught.value.wait(20)
    assert done.interrupted and len(done.motion) > 1 and done.energy_exact_J > 0
