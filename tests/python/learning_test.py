"""fit and compare give what the program gives; logs come from files, arrays and frames; errors are the same sentences."""

import gc
import json
import subprocess
import threading

import numpy as np
import pytest

import sparflow
from conftest import DATA


def run(program, *words):
    return subprocess.run([str(program), *map(str, words)], capture_output=True, text=True, check=False)


def without(values, *keys):
    return {k: v for k, v in values.items() if k not in keys}


def test_fit_and_compare_give_the_programs_json(machine, fitted, test_log, program, tmp_path):
    made = run(program, "fit", "-m", DATA / "machines/loader_crane.yaml", "-l", DATA / "logs/loader_crane_train.csv",
               "-t", DATA / "logs/loader_crane_test.csv", "-o", tmp_path / "model.json", "--json", tmp_path / "fit.json")
    assert made.returncode == 0, made.stderr
    # Only the time taken differs from run to run.
    assert without(fitted.to_dict(), "seconds") == without(json.loads((tmp_path / "fit.json").read_text()), "seconds")
    fitted.model.save(tmp_path / "ours.json")
    assert (tmp_path / "ours.json").read_text() == (tmp_path / "model.json").read_text()
    run(program, "compare", "--model", tmp_path / "model.json", "-l", DATA / "logs/loader_crane_test.csv", "--json",
        tmp_path / "compare.json")
    ours = sparflow.compare(sparflow.Model.load(tmp_path / "model.json"), test_log)
    assert ours.json() == (tmp_path / "compare.json").read_text()


def test_a_machine_alone_is_compared_by_forces(machine, test_log):
    stages = sparflow.compare(machine, test_log).to_dict()["stages"]
    assert [name for name, places in stages.items() if places] == ["force"]


def test_signals_are_views_that_keep_their_log_alive(machine):
    log = sparflow.Log.load(DATA / "logs/loader_crane_test.csv", machine)
    pressure = log["pA_boom"]
    again = log["pA_boom"]
    assert np.shares_memory(pressure, again)
    assert not pressure.flags.owndata and not pressure.flags.writeable
    with pytest.raises(ValueError):
        pressure[0] = 0.0
    expected = pressure.copy()
    del log, again
    gc.collect()
    assert np.array_equal(pressure, expected, equal_nan=True)


def test_arrays_and_frames_become_the_same_log_as_the_file(machine, test_log):
    frame = test_log.to_frame()
    columns = {"t_s": test_log.time}
    units = {"rad": ("_rad", 1.0), "m": ("_m", 1.0), "Pa": ("_bar", 1e5), "kg": ("_kg", 1.0), "degC": ("_C", 1.0)}
    for name in test_log.signals:
        if name.startswith("u_"):
            columns[name] = test_log[name]
        elif test_log.unit(name) in units:
            ending, scale = units[test_log.unit(name)]
            columns[name + ending] = test_log[name] / scale
    from_arrays = sparflow.Log.from_arrays(columns, machine)
    import pandas
    from_frame = sparflow.Log.from_frame(pandas.DataFrame(columns), machine)
    assert set(from_arrays.signals) >= {"pA_boom", "q_boom", "u_boom", "p_main"}
    for log in (from_arrays, from_frame):
        for name in log.signals:
            # Division by 1e5 and its inverse round once each.
            np.testing.assert_allclose(log[name], test_log[name], rtol=1e-15, atol=1e-18)
    assert from_arrays.sha256 == from_frame.sha256 != test_log.sha256
    assert list(frame.columns) == test_log.signals and len(frame) == len(test_log)


def test_columns_of_a_frame_are_read_whatever_their_type(machine, test_log):
    import pandas
    endings = {"pA_boom": ("_bar", 1e5), "p_main": ("_bar", 1e5)}
    columns = {"t_s": test_log.time, "note": ["as built"] * len(test_log)}
    for name in ("q_boom", "q_jib", "u_boom", "pA_boom", "p_main"):
        ending, scale = endings.get(name, ("_rad" if name.startswith("q") else "", 1.0))
        columns[name + ending] = test_log[name] / scale
    columns["q_extension_m"] = test_log["q_extension"]
    frame = pandas.DataFrame(columns)
    # One missing value makes a column one of objects, or of pandas' own numbers.
    mixed = frame.astype({"pA_boom_bar": object, "p_main_bar": "Float64"})
    mixed.loc[5, "pA_boom_bar"] = None
    mixed.loc[7, "p_main_bar"] = pandas.NA
    with pytest.warns(UserWarning, match="note holds no numbers and is left out"):
        log = sparflow.Log.from_frame(mixed, machine)
    np.testing.assert_allclose(log["pA_boom"][10:], test_log["pA_boom"][10:], rtol=1e-15)
    assert "p_main" in log
    mixed.loc[9, "pA_boom_bar"] = "broken"
    with pytest.raises(sparflow.InputError, match="pA_boom_bar: expected numbers, found 'broken' at 9"):
        sparflow.Log.from_frame(mixed, machine)
    with pytest.raises(sparflow.InputError, match="two columns of the frame have this name"):
        sparflow.Log.from_frame(pandas.concat([frame, frame[["u_boom"]]], axis=1), machine)


def test_a_log_of_another_machine_is_refused(test_log):
    other = sparflow.Machine.load(DATA / "machines/excavator.yaml")
    for call in (lambda: sparflow.fit(other, test_log), lambda: sparflow.Signals(other, test_log)):
        with pytest.raises(sparflow.InputError, match="read for another machine"):
            call()


def test_signals_of_a_log_are_those_that_errors_are_judged_by(machine, test_log):
    signals = sparflow.Signals(machine, test_log)
    boom = signals.cylinders[machine.cylinders.index("boom")]
    assert signals.q.shape == (len(test_log), len(machine.joints))
    speed = np.gradient(boom.length, signals.time)
    moving = boom.moving
    # The smoothed derivative and the difference of the smoothed length differ by noise over the filter's window.
    assert moving.sum() > 1000 and np.median(np.abs(speed - boom.speed)[moving]) < 2e-3


def test_every_error_is_an_exception_with_the_programs_sentence(machine, program, tmp_path):
    broken = tmp_path / "broken.yaml"
    broken.write_text((DATA / "machines/loader_crane.yaml").read_text().replace("bore:", "boer:", 1))
    with pytest.raises(sparflow.InputError) as caught:
        sparflow.Machine.load(broken)
    told = run(program, "machine", broken)
    assert told.returncode == 3 and f"sparflow: {caught.value}\n" == told.stderr
    assert caught.value.file == str(broken) and caught.value.line > 0 and "boer" in str(caught.value)
    assert isinstance(caught.value, sparflow.Error) and isinstance(caught.value, ValueError)
    with pytest.raises(sparflow.InputError, match="t_s"):
        sparflow.Log.from_arrays({"q_boom_rad": np.zeros(3)}, machine)
    with pytest.raises(sparflow.InputError, match="2 values.*3"):
        sparflow.Log.from_arrays({"t_s": np.arange(3.0), "q_boom_rad": np.zeros(2)}, machine)
    with pytest.raises(sparflow.UsageError, match="as log and as test"):
        path = DATA / "logs/loader_crane_test.csv"
        sparflow.fit(machine, path, test=path)
    with pytest.raises(TypeError, match="one dimension"):
        sparflow.Log.from_arrays({"t_s": np.zeros((2, 2))}, machine)
    with pytest.raises(KeyError, match="pA_boom"):
        sparflow.Log.load(DATA / "logs/loader_crane_test.csv", machine)["pA_bom"]
    with pytest.raises(sparflow.InputError, match="no such file|cannot"):
        sparflow.Model.load(tmp_path / "none.json")


def test_nothing_learned_is_an_error(machine, test_log):
    columns = {"t_s": test_log.time}
    columns.update({f"q_{j}_{'m' if test_log.unit('q_' + j) == 'm' else 'rad'}": test_log["q_" + j] for j in machine.joints})
    with pytest.raises(sparflow.InputError, match="nothing was learned.*chamber pressures"):
        sparflow.fit(machine, sparflow.Log.from_arrays(columns, machine))


def test_results_show_themselves(fitted, tmp_path):
    assert str(fitted).splitlines() and fitted.headline in repr(fitted)
    html = fitted._repr_html_()
    assert "<script" not in html and "<table" in html and len(html) < 100_000
    fitted.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text().startswith("<!DOCTYPE html>")
    assert set(fitted.to_frame()["direction"]) == {"extend", "retract"}


def test_progress_is_called_in_this_thread_and_its_error_ends_the_call(machine, train):
    told = []
    sparflow.fit(machine, train, progress=lambda share, words: told.append((share, words, threading.get_ident())))
    shares = [t[0] for t in told]
    assert told and shares == sorted(shares) and {t[2] for t in told} == {threading.get_ident()}

    def refuse(share, words):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sparflow.fit(machine, train, progress=refuse)


def test_other_threads_run_during_a_long_call(machine, train):
    counted = [0]
    ended = threading.Event()

    def count():
        while not ended.wait(0.005):
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    result = sparflow.fit(machine, train, threads=1)
    during = counted[0]
    ended.set()
    thread.join()
    # At least a tenth of the turns that the thread has while nothing else runs.
    assert during > result.seconds / 0.005 / 10
