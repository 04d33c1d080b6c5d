"""What the tests of the Python module share: the bundled crane and its logs."""

import os
import pathlib
import signal
import threading
import time

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


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "lift.yaml"
    path.write_text("id: lift\nmachine: loader_crane\nstart: {q: {boom: 0.2, jib: -1.2, extension: 0.6}}\npayload_kg: 200\n"
                    "goals: [{q: {boom: 0.3, jib: -1.1, extension: 0.7}, duration_s: 8}]\ntolerance_m: 0.2\nseeds: [1, 2]\n")
    return path


TIMES = {"solve_s", "callbacks_s", "linear_solver_s", "stages", "bound_s", "step_median_s", "step_worst_s", "seconds"}


def without_times(values):
    """A result without what differs from run to run."""
    if isinstance(values, dict):
        return {k: without_times(v) for k, v in values.items() if k not in TIMES}
    return [without_times(v) for v in values] if isinstance(values, list) else values


def interrupted_soon(call, when=lambda share, words: share > 0, limit_s=0.5):
    """Presses Ctrl-C in a call as soon as its progress says so; the call must end within half a second, which is promised."""
    begun, pressed = threading.Event(), []

    def press():
        begun.wait(120)
        pressed.append(time.monotonic())
        signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    try:
        return call(lambda share, words: when(share, words) and begun.set())
    finally:
        ended = time.monotonic()
        begun.set()
        thread.join()
        assert pressed and ended - pressed[0] < limit_s
