"""The bundled log as a CAN trace with a database: read through a mapping file, it gives the model that the CSV gives."""

import csv
import struct

import numpy as np
import pytest

import sparflow
from conftest import DATA

# One message a pair of columns: the first an integer with a factor and Motorola's byte order, the second a real of 32 bits.
FACTOR = 2.0**-20


def trace_of(rows, names, stamps):
    """Frames as `candump -l` writes them, and the text of the database, both from the formats' definitions."""
    pairs = [names[i : i + 2] for i in range(0, len(names), 2)]
    database = ['VERSION "1"', "BU_: ECU"]
    reals = []
    for k, pair in enumerate(pairs):
        database.append(f"BO_ {0x100 + k} M{k}: 8 ECU")
        # The start bit of a big-endian signal is its most significant one: bit 7 of the first byte.
        database.append(f' SG_ s{2 * k} : 7|32@0- ({FACTOR!r},0) [0|0] "" ECU')
        if len(pair) > 1:
            database.append(f' SG_ s{2 * k + 1} : 32|32@1- (1,0) [0|0] "" ECU')
            reals.append(f"SIG_VALTYPE_ {0x100 + k} s{2 * k + 1} : 1;")
    lines = []
    for stamp, row in zip(stamps, rows):
        for k, pair in enumerate(pairs):
            data = struct.pack(">i", round(row[pair[0]] / FACTOR))
            data += struct.pack("<f", row[pair[1]]) if len(pair) > 1 else bytes(4)
            lines.append(f"({stamp:.6f}) can0 {0x100 + k:03X}#{data.hex().upper()}\n")
    return "".join(lines), "\n".join(database + reals) + "\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("can")
    with open(DATA / "logs/loader_crane_train.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    names = [name for name in rows[0] if name != "t_s"]
    trace, database = trace_of(rows, names, [1000.0 + row["t_s"] for row in rows])
    (folder / "trace.log").write_text(trace)
    (folder / "crane.dbc").write_text(database)
    columns = "".join(f'  {name}: "s{i}"\n' for i, name in enumerate(names))
    (folder / "map.yaml").write_text("dbc: crane.dbc\ncolumns:\n" + columns)
    return folder, rows, names


def test_each_sample_is_what_was_sent(machine, recorded):
    folder, rows, _ = recorded
    log = sparflow.Log.load(folder / "trace.log", machine, mapping=folder / "map.yaml")
    times = np.array([row["t_s"] for row in rows])
    assert np.allclose(log.time - log.time[0], times - times[0], atol=2e-6)  # the trace has microseconds
    # A position has half a step of its integer, a pressure in bar the 24 bits of its real.
    assert np.allclose(log["q_boom"], [row["q_boom_rad"] for row in rows], atol=FACTOR)
    assert np.allclose(log["pA_boom"], [1e5 * row["pA_boom_bar"] for row in rows], rtol=1e-6, atol=1e5 * FACTOR)


def test_the_model_is_that_of_the_csv(machine, train, test_log, recorded):
    folder, _, _ = recorded
    log = sparflow.Log.load(folder / "trace.log", machine, mapping=folder / "map.yaml")
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
    folder, _, _ = recorded
    with pytest.raises(sparflow.InputError, match="identifiers seen: 100"):
        sparflow.Log.load(folder / "trace.log", machine)
