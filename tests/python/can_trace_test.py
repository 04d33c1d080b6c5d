"""The bundled log as CAN frames with a database: read through a mapping file, it gives the model that the CSV gives."""

import subprocess
import sys

import numpy as np
import pytest

import bus_log
import sparflow
from conftest import DATA, SOURCE


@pytest.fixture(scope="module", params=["candump", "mdf"])
def recorded(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    rows = bus_log.rows_of(DATA / "logs/loader_crane_train.csv")
    path = folder / "trace"
    path.write_bytes(bus_log.mdf(rows) if request.param == "mdf" else bus_log.candump(rows).encode())
    (folder / "crane.dbc").write_text(bus_log.database(bus_log.names_of(rows)))
    (folder / "map.yaml").write_text(bus_log.mapping(bus_log.names_of(rows), "crane.dbc"))
    return path, folder / "map.yaml", rows


def test_each_sample_is_what_was_sent(machine, recorded):
    path, mapping, rows = recorded
    log = sparflow.Log.load(path, machine, mapping=mapping)
    times = np.array([row["t_s"] for row in rows])
    assert np.allclose(log.time - log.time[0], times - times[0], atol=2e-6)  # a trace has microseconds
    # A position has half a step of its integer, a pressure in bar the 24 bits of its real.
    assert np.allclose(log["q_boom"], [row["q_boom_rad"] for row in rows], atol=bus_log.FACTOR)
    assert np.allclose(log["pA_boom"], [1e5 * row["pA_boom_bar"] for row in rows], rtol=1e-6, atol=1e5 * bus_log.FACTOR)


def test_the_model_is_that_of_the_csv(machine, train, test_log, recorded):
    path, mapping, _ = recorded
    log = sparflow.Log.load(path, machine, mapping=mapping)
    ours = sparflow.fit(machine, log, test=test_log).to_dict()["test"]
    theirs = sparflow.fit(machine, train, test=test_log).to_dict()["test"]
    compared = 0
    for stage in ("force", "flow"):
        for at, error in theirs["stages"][stage].items():
            # Values differ by a millionth; the sparse points that a pressure model chooses may still move errors a little.
            assert ours["stages"][stage][at]["rmse"] == pytest.approx(error["rmse"], rel=0.01)
            compared += 1
    assert compared >= 4


def test_without_its_database_a_trace_is_refused_with_the_identifiers_seen(machine, recorded):
    with pytest.raises(sparflow.InputError, match="identifiers seen: 100"):
        sparflow.Log.load(recorded[0], machine)


def test_from_a_bus_log_to_an_optimal_motion(tmp_path):
    for name in ("train", "test"):
        rows = bus_log.rows_of(DATA / f"logs/loader_crane_friction_{name}.csv")
        (tmp_path / f"{name}.mf4").write_bytes(bus_log.mdf(rows))
    (tmp_path / "crane.dbc").write_text(bus_log.database(bus_log.names_of(rows)))
    (tmp_path / "map.yaml").write_text(bus_log.mapping(bus_log.names_of(rows), "crane.dbc"))
    script = SOURCE / "examples/bus_log_to_motion.py"
    assert len(script.read_text().splitlines()) < 60
    done = subprocess.run([sys.executable, script, DATA / "machines/loader_crane.yaml", tmp_path / "train.mf4",
                           tmp_path / "test.mf4", tmp_path / "map.yaml", DATA / "reaches/loader_crane_lift.yaml", tmp_path],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "coulomb_friction:boom" in done.stdout  # the effect that is hidden in these logs
    assert (tmp_path / "motion.csv").read_text().startswith("t_s,")
    assert "kJ" in done.stdout
