"""Paths in place of objects, numbers out of range, frames and mapping files: what is accepted, and the sentence otherwise."""

import numpy as np
import pytest

import sparflow
from conftest import DATA

MACHINE_PATH = DATA / "machines/loader_crane.yaml"
TRAIN_PATH = DATA / "logs/loader_crane_train.csv"
TEST_PATH = DATA / "logs/loader_crane_test.csv"


def test_paths_stand_for_what_they_hold(tmp_path):
    fitted = sparflow.fit(MACHINE_PATH, TRAIN_PATH)
    path = tmp_path / "model.json"
    fitted.model.save(path)
    by_path = sparflow.compare(path, TEST_PATH)
    assert by_path.json() == sparflow.compare(fitted.model, TEST_PATH).json()
    assert sparflow.compare(MACHINE_PATH, TEST_PATH).json() == sparflow.compare(sparflow.Machine.load(MACHINE_PATH), TEST_PATH).json()


@pytest.mark.parametrize("call, words", [
    (lambda: sparflow.fit(3, TRAIN_PATH), "fit: expected a Machine, or the path of its file; got 3"),
    (lambda: sparflow.compare(None, TRAIN_PATH), "compare: expected a Model or a Machine, or the path of its file; got None"),
    (lambda: sparflow.strategies(3), "strategies: expected a Problem, the path of its file, or several; got 3"),
    (lambda: sparflow.optimize([1]), r"optimize: expected a Problem, or the path of its file; got \[1\]"),
    (lambda: sparflow.simulate(MACHINE_PATH, seconds=1, seed=-1), "seed= got -1; expected a whole number from 0 to"),
    (lambda: sparflow.simulate(MACHINE_PATH, seconds=1, seed=1.5), "seed= got 1.5"),
    (lambda: sparflow.fit(MACHINE_PATH, TRAIN_PATH, threads=-3), "fit: threads= got -3; expected a whole number from 0 to 256"),
    (lambda: sparflow.simulate(MACHINE_PATH, seconds=1, controller=lambda state: {"boom": float("nan")}),
     "levers are no finite numbers at 0.* s"),
])
def test_wrong_arguments_get_a_sentence(call, words):
    with pytest.raises(sparflow.UsageError, match=words):
        call()


def test_a_file_that_is_not_there_gets_the_programs_sentence(tmp_path):
    with pytest.raises(sparflow.InputError, match="cannot read"):
        sparflow.optimize(tmp_path / "none.yaml")


def test_a_frame_of_a_log_is_read_again(tmp_path):
    machine = sparflow.Machine.load(MACHINE_PATH)
    log = sparflow.Log.load(TEST_PATH, machine)
    again = sparflow.Log.from_frame(log.to_frame(), machine)
    assert again.signals == log.signals
    for name in log.signals:
        np.testing.assert_allclose(again[name], log[name], rtol=1e-12)
    with pytest.raises(sparflow.InputError, match="the frame has no rows"):
        sparflow.Log.from_frame(log.to_frame().iloc[:0], machine)


def test_fit_reads_logs_by_a_mapping_file(tmp_path):
    text = TRAIN_PATH.read_text()
    other = tmp_path / "other.csv"
    other.write_text(text.replace("q_boom_rad", "winkel_hub", 1))
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text("columns:\n  q_boom_rad: winkel_hub\n")
    fitted = sparflow.fit(MACHINE_PATH, str(other), mapping=mapping)
    assert fitted.to_dict()["processes"] == sparflow.fit(MACHINE_PATH, TRAIN_PATH).to_dict()["processes"]
