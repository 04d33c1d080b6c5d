"""diagnose, extend, improve and selftest give what the program gives; Ctrl-C ends them within half a second."""

import json
import signal
import subprocess
import threading
import time

import pytest

import sparflow
from conftest import DATA

TRAIN, TEST = DATA / "logs/loader_crane_friction_train.csv", DATA / "logs/loader_crane_friction_test.csv"
FEW = ["coulomb_friction", "viscous_friction:boom"]


@pytest.fixture(scope="module")
def off(machine):
    return sparflow.fit(machine, TRAIN).model


def without_times(values):
    if isinstance(values, dict):
        return {k: without_times(v) for k, v in values.items() if k != "seconds"}
    return [without_times(v) for v in values] if isinstance(values, list) else values


def test_diagnose_and_extend_give_the_programs_json(off, program, tmp_path):
    off.save(tmp_path / "off.json")
    subprocess.run([program, "diagnose", "--model", tmp_path / "off.json", "-l", TRAIN, "-t", TEST, "--candidates", *FEW,
                    "--json", tmp_path / "why.json"], check=True, capture_output=True)
    ours = sparflow.diagnose(off, TRAIN, test=TEST, candidates=FEW)
    assert without_times(ours.to_dict()) == without_times(json.loads((tmp_path / "why.json").read_text()))
    assert ours.verdict == "missing" and ours.named == ["coulomb_friction:boom"]
    assert list(ours.to_frame()["id"]) == ["coulomb_friction"]
    subprocess.run([program, "extend", "--model", tmp_path / "off.json", "-a", "coulomb_friction:boom", "-l", TRAIN, "-t",
                    TEST, "-o", tmp_path / "better.json", "--json", tmp_path / "steps.json"], check=True, capture_output=True)
    better = sparflow.extend(off, TRAIN, "coulomb_friction:boom", TEST)
    assert better.model.json() == (tmp_path / "better.json").read_text()
    assert better.model.effects == ["coulomb_friction:boom"] and better.model.effect("coulomb_friction:boom")
    assert "Coulomb friction" in better._repr_html_()


def test_improve_and_selftest_answer(off):
    best = sparflow.improve(off, TRAIN, test=TEST, candidates=FEW, max_steps=1)
    assert best.model.effects == ["coulomb_friction:boom"] and not best.interrupted
    seen = sparflow.selftest(off, TRAIN, candidates=["coulomb_friction:boom"], check=0).to_frame()
    assert list(seen["id"]) == ["coulomb_friction"]


def test_wrong_arguments_are_told(off):
    with pytest.raises(sparflow.UsageError, match="can be only one"):
        sparflow.diagnose(off, TRAIN, references=TRAIN)
    with pytest.raises(sparflow.UsageError, match="either add"):
        sparflow.extend(off, TRAIN)
    with pytest.raises(sparflow.InputError, match="coulomb_friction"):
        sparflow.extend(off, TRAIN, "coulom_friction:boom")


@pytest.mark.parametrize("verb", [sparflow.diagnose, sparflow.improve])
def test_ctrl_c_ends_a_long_call_within_half_a_second(off, verb):
    began = threading.Event()
    pressed = []

    def press():
        began.wait(30)
        time.sleep(0.2)
        pressed.append(time.monotonic())
        signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(sparflow.Interrupted) as caught:
        verb(off, TRAIN, progress=lambda share, words: began.set())
    answered = time.monotonic() - pressed[0]
    thread.join()
    assert answered < 0.5
    assert isinstance(caught.value, KeyboardInterrupt)
