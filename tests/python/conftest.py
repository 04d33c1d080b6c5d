"""What the tests of the Python module share: the bundled crane and its logs."""

import os
import pathlib

import pytest

import sparflow

SOURCE = pathlib.Path(os.environ["SPARFLOW_SOURCE_DIR"])
DATA = SOURCE / "problems"


@pytest.fixture(scope="session")
def machine():
    return sparflow.Machine.load(DATA / "machines/loader_crane.yaml")


@pytest.fixture(scope="session")
def train(machine):
    return sparflow.Log.load(DATA / "logs/loader_crane_train.csv", machine)


@pytest.fixture(scope="session")
def test_log(machine):
    return sparflow.Log.load(DATA / "logs/loader_crane_test.csv", machine)


@pytest.fixture(scope="session")
def fitted(machine, train, test_log):
    return sparflow.fit(machine, train, test=test_log)


@pytest.fixture(scope="session")
def program():
    return pathlib.Path(os.environ["SPARFLOW_BINARY_DIR"]) / "sparflow"
