"""price gives what the verb `evaluate` gives, for files, trajectories, logs, frames and arrays."""

import json
import subprocess

import numpy as np
import pandas as pd
import pytest

import sparflow
from conftest import DATA

MODEL = DATA / "models/loader_crane.json"
LIFT = DATA / "reaches/loader_crane_lift.yaml"
HURRY = DATA / "reaches/loader_crane_hurry.yaml"
LOG = DATA / "logs/loader_crane_test.csv"


@pytest.fixture(scope="module")
def model():
    return sparflow.Model.load(MODEL)


@pytest.fixture(scope="module")
def rows():
    """Columns of a motion that starts and ends at rest: quarter waves of the joints over 8 s."""
    t = np.linspace(0.0, 8.0, 401)
    columns = {"t_s": t}
    for name, unit, begin, way in (("boom", "rad", 0.2, 0.3), ("jib", "rad", -1.2, 0.2), ("extension", "m", 0.6, 0.4)):
        phase = np.pi * t / 8.0
        columns[f"q_{name}_{unit}"] = begin + way * 0.5 * (1.0 - np.cos(phase))
        columns[f"qd_{name}_{unit}_s"] = way * 0.5 * np.pi / 8.0 * np.sin(phase)
        columns[f"qdd_{name}_{unit}_s2"] = way * 0.5 * (np.pi / 8.0) ** 2 * np.cos(phase)
    return columns


@pytest.fixture
def file(rows, tmp_path):
    path = tmp_path / "own.csv"
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def by_program(program, tmp_path, *arguments, code=0):
    """What the verb writes: JSON and motion."""
    done = subprocess.run([program, "evaluate", *arguments, "--json", tmp_path / "e.json", "-o", tmp_path / "out.csv"],
                          capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return json.loads((tmp_path / "e.json").read_text()), (tmp_path / "out.csv").read_text(), done.stdout


def without_name(values):
    return {k: v for k, v in values.items() if k != "motion"}


def test_a_file_costs_what_the_program_says(program, model, file, tmp_path):
    told, motion, text = by_program(program, tmp_path, file, "--model", MODEL, "--payload", "500")
    ours = sparflow.price(file, model=model, payload_kg=500)
    assert ours.to_dict() == told and ours.motion_csv() == motion and str(ours) == text
    assert ours.energy_exact_J == told["energy_exact_J"] > 0 and ours.payload_kg == 500
    assert ours.duration_s == 8 and ours.limits_kept == told["limits_kept"]
    assert len(ours.to_frame()) == len(ours.motion) == 401 and not ours.motion.q.flags.owndata
    assert f"{told['energy_exact_J'] / 1e3:.1f} kJ in 8.00 s" in ours.headline and "kJ" in ours._repr_html_()
    ours.report(tmp_path / "e.html")
    assert "own.csv" in (tmp_path / "e.html").read_text()
    # the load on the hook costs
    assert sparflow.price(file, model=MODEL).energy_exact_J < ours.energy_exact_J


def test_arrays_frames_and_trajectories_cost_what_their_file_costs(model, rows, file):
    told = without_name(sparflow.price(file, model=model, payload_kg=500).to_dict())
    frame = pd.DataFrame(rows)
    by_file = sparflow.price(file, model=model)
    for motion in (rows, frame, frame.set_index("t_s"), by_file.motion, by_file.to_frame()):
        ours = without_name(sparflow.price(motion, model=model, payload_kg=500).to_dict())
        # motion_csv writes twelve digits of every number
        assert ours["energy_exact_J"] == pytest.approx(told["energy_exact_J"], rel=1e-9)
        assert ours["limits_kept"] == told["limits_kept"] and not ours["from_positions"]


def test_a_problem_judges_and_a_broken_limit_is_no_exception(program, model, file, tmp_path):
    told, _, _ = by_program(program, tmp_path, file, "-p", HURRY, "--model", MODEL, code=5)
    by_path = sparflow.price(file, problem=HURRY, model=MODEL)
    by_object = sparflow.price(file, problem=sparflow.Problem.load(HURRY, model))
    assert by_path.to_dict() == by_object.to_dict() == told
    assert not by_path.limits_kept and by_path.to_dict()["limits"]


def test_a_log_is_priced_by_its_positions(program, model, test_log, tmp_path):
    told, _, _ = by_program(program, tmp_path, LOG, "--model", MODEL)
    assert told["from_positions"] and told["notes"]
    by_path = sparflow.price(LOG, model=model)
    assert by_path.to_dict() == told == sparflow.price(test_log, model=model).to_dict()
    assert by_path.notes == told["notes"]
    by_frame = sparflow.price(test_log.to_frame(), model=model).to_dict()
    assert by_frame["energy_exact_J"] == pytest.approx(told["energy_exact_J"], rel=1e-9)


def test_other_column_names_are_read_by_a_mapping_file(model, rows, tmp_path):
    positions = {k: v for k, v in rows.items() if k == "t_s" or k.startswith("q_")}
    (tmp_path / "mapping.yaml").write_text("columns:\n  q_boom_rad: winkel_hub\n")
    other = {k.replace("q_boom_rad", "winkel_hub"): v for k, v in positions.items()}
    told = sparflow.price(positions, model=model)
    assert sparflow.price(other, model=model, mapping=tmp_path / "mapping.yaml").energy_exact_J == told.energy_exact_J
    with pytest.raises(sparflow.InputError, match="boom"):
        sparflow.price(other, model=model)


def changed(rows, **columns):
    return {**rows, **columns}


@pytest.mark.parametrize("call, kind, words", [
    (lambda r, m: sparflow.price(r), sparflow.UsageError, "price: give model=, or problem= whose file names a model"),
    (lambda r, m: sparflow.price(3, model=m), sparflow.UsageError, "price: expected a Trajectory, a Log, a DataFrame"),
    (lambda r, m: sparflow.price(r, model=m, payload_kg=-1), sparflow.UsageError, "price: payload_kg= got -1; expected 0 to 1000000"),
    (lambda r, m: sparflow.price(r, model=m, payload_kg=float("nan")), sparflow.UsageError, "price: payload_kg= got nan"),
    (lambda r, m: sparflow.price(r, model=m, problem=sparflow.Problem.load(LIFT, m)), sparflow.UsageError, "either model= or a Problem"),
    (lambda r, m: sparflow.price(changed(r, q_jib_rad=r["q_jib_rad"][:7]), model=m), sparflow.InputError,
     "columns: q_jib_rad: 7 values, but t_s has 401"),
    (lambda r, m: sparflow.price(changed(r, qd_jib_rad_s=np.where(r["t_s"] == 0.02, np.nan, 0)), model=m), sparflow.InputError,
     "columns: qd_jib_rad_s: got nan in row 2, expected a number"),
    (lambda r, m: sparflow.price(changed(r, t_s=r["t_s"][::-1]), model=m), sparflow.InputError,
     "columns: t_s: time must increase from row to row; it goes from 8 to 7.98 s in row 2"),
    (lambda r, m: sparflow.price({k: v[:1] for k, v in r.items()}, model=m), sparflow.InputError, "a motion needs at least two rows"),
    (lambda r, m: sparflow.price({k: v for k, v in r.items() if k != "t_s"}, model=m), sparflow.InputError,
     "columns: t_s: column is missing"),
])
def test_what_cannot_be_priced_gets_a_sentence(model, rows, call, kind, words):
    with pytest.raises(kind, match=words):
        call(rows, model)


def test_a_trajectory_of_another_machine_is_refused(model, rows):
    motion = sparflow.price(rows, model=model).motion
    other = next(p for p in sorted((DATA / "machines").glob("*.yaml")) if len(sparflow.Machine.load(p).joints) != 3)
    with pytest.raises(sparflow.UsageError, match="trajectory: a motion of 3 joints; machine .* has"):
        sparflow.price(motion, model=sparflow.Model.untrained(sparflow.Machine.load(other)))


def test_a_file_that_is_not_there_gets_the_programs_sentence(model, tmp_path):
    with pytest.raises(sparflow.InputError, match="cannot read"):
        sparflow.price(tmp_path / "none.csv", model=model)
