"""`pip install` makes a package that works on its own, offline. The wheel is packed from the build folder of the tests; that CMake
builds it from nothing is what takes minutes and is done by hand (docs/python.md)."""

import os
import pathlib
import subprocess
import sys

import sparflow
from conftest import DATA, SOURCE

BUILT = os.environ["SPARFLOW_BINARY_DIR"]


def pip(*words):
    environment = dict(os.environ, SPARFLOW_BUILT_DIR=BUILT, PIP_DISABLE_PIP_VERSION_CHECK="1", PIP_NO_INPUT="1")
    return subprocess.run([sys.executable, "-m", "pip", *map(str, words)], capture_output=True, text=True, env=environment,
                          check=False)


def python(folder, code):
    environment = dict(os.environ, PYTHONPATH=str(folder))
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True).stdout


def test_pip_installs_the_package_offline(tmp_path):
    made = pip("install", "--no-build-isolation", "--no-index", "--target", tmp_path / "site", SOURCE)
    assert made.returncode == 0, made.stderr
    names = {p.name for p in (tmp_path / "site/sparflow").iterdir()}
    assert {"__init__.py", "__init__.pyi", "py.typed", "_verbs.py"} <= names
    told = python(tmp_path / "site", "import sparflow; print(sparflow.__file__); print(sparflow.__version__); "
                  f"print(sparflow.Machine.load({str(DATA / 'machines/loader_crane.yaml')!r}).joints)").splitlines()
    assert pathlib.Path(told[0]).parent == tmp_path / "site/sparflow"
    assert told[1] == sparflow.__version__ and "boom" in told[2]
    # pip has the version and the files that it could remove again.
    (info,) = (tmp_path / "site").glob("sparflow-*.dist-info")
    assert info.name == f"sparflow-{sparflow.__version__}.dist-info" and "sparflow/_verbs.py" in (info / "RECORD").read_text()


def test_an_isolated_build_needs_no_network(tmp_path):
    made = pip("wheel", "--no-index", "--no-deps", "--wheel-dir", tmp_path, SOURCE)
    assert made.returncode == 0, made.stderr
    (wheel,) = tmp_path.glob("sparflow-*.whl")
    again = pip("wheel", "--no-index", "--no-deps", "--wheel-dir", tmp_path / "again", SOURCE)
    assert again.returncode == 0 and wheel.read_bytes() == (tmp_path / "again" / wheel.name).read_bytes()
