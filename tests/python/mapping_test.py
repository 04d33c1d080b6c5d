"""propose_mapping gives what `sparflow log` gives; the proposal, saved, reads the log with other column names."""

import json
import subprocess

import numpy as np
import pytest

import sparflow
from conftest import DATA

NAMES = {"q_boom_rad": "Boom Angle", "q_jib_rad": "Jib Angle",
         "pA_boom_bar": "Boom Cyl Bore Pressure", "pB_boom_bar": "Boom Cyl Rod Pressure"}


@pytest.fixture(scope="module")
def renamed(tmp_path_factory):
    """The first minute of the bundled log under a logger's names."""
    header, *rows = (DATA / "logs/loader_crane_train.csv").read_text().splitlines()
    path = tmp_path_factory.mktemp("bus") / "bus.csv"
    path.write_text("\n".join([",".join(NAMES.get(n, n) for n in header.split(",")), *rows[:3000]]) + "\n")
    return path


def test_the_proposal_is_the_programs_and_reads_the_log(renamed, machine, program, tmp_path):
    told = []
    proposal = sparflow.propose_mapping(renamed, machine, progress=lambda share, words: told.append(words))
    assert told
    subprocess.run([program, "log", renamed, "-m", DATA / "machines/loader_crane.yaml", "--json", tmp_path / "log.json",
                    "--write-mapping", tmp_path / "program.yaml"], check=True, capture_output=True)
    assert proposal.to_dict() == json.loads((tmp_path / "log.json").read_text())
    proposal.save(tmp_path / "mapping.yaml")
    assert (tmp_path / "mapping.yaml").read_text() == (tmp_path / "program.yaml").read_text() == proposal.yaml
    frame = proposal.to_frame().set_index("column")
    assert all(frame.channel[column] == name for column, name in NAMES.items())
    assert frame.confidence["pA_boom_bar"] > 0.7
    assert list(proposal.channels().name) == [c["name"] for c in proposal.to_dict()["channels"]]
    assert "Boom Angle" in str(proposal) and "Boom Angle" in proposal._repr_html_() + proposal.yaml

    mapped = sparflow.Log.load(renamed, machine, mapping=tmp_path / "mapping.yaml")
    plain = sparflow.Log.load(DATA / "logs/loader_crane_train.csv", machine)
    assert np.array_equal(mapped["pA_boom"], plain["pA_boom"][:3000])


def test_what_cannot_be_read_is_an_exception(machine, tmp_path):
    with pytest.raises(sparflow.InputError, match="none.csv"):
        sparflow.propose_mapping(tmp_path / "none.csv", machine)
    with pytest.raises(sparflow.UsageError, match="propose_mapping: expected a Machine"):
        sparflow.propose_mapping(tmp_path / "none.csv", 3)
