"""Machine.from_log: open values of a machine file from logs."""

import pytest

import sparflow
from conftest import DATA


def sketch(tmp_path, *exchanges):
    text = (DATA / "machines/loader_crane.yaml").read_text()
    for known, blank in exchanges:
        assert known in text
        text = text.replace(known, blank)
    path = tmp_path / "sketch.yaml"
    path.write_text(text)
    return path


BLANK_MASS = ("mass: 560, cog: [1.25, 0, 0.05]", "mass: 560, cog: unknown")


def test_centre_of_a_known_mass_comes_from_the_log(tmp_path):
    machine = sparflow.Machine.from_log(sketch(tmp_path, BLANK_MASS), [DATA / "logs/loader_crane_train.csv"])
    assert machine.cylinders == ["boom", "jib", "extension"]
    assert "unknown" not in machine.to_yaml()


def test_what_the_log_does_not_tell_is_in_the_error(tmp_path):
    blank = ("bore: 0.180", "bore: unknown"), ("xyz: [0.40, 0, 0.50]", "xyz: unknown")
    with pytest.raises(sparflow.InputError, match=r"only the position.*x_boom_m|x_boom_m.*only the position"):
        sparflow.Machine.from_log(sketch(tmp_path, *blank), DATA / "logs/loader_crane_train.csv")


def test_open_values_are_refused_elsewhere(tmp_path):
    with pytest.raises(sparflow.InputError, match="left open"):
        sparflow.Machine.load(sketch(tmp_path, BLANK_MASS))
