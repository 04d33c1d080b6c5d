"""PEP 517 build backend: CMake builds the module, this packs it into a wheel. It needs nothing but Python's own library.

Configuration settings (pip install --config-settings KEY=VALUE): `build-dir`, the folder that CMake builds in, build/wheel by
default; `cmake-args`, further arguments of CMake's configuration. The environment variable SPARFLOW_BUILT_DIR names a build
folder that has the module already; then nothing is compiled.
"""

import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[3]


def _project():
    return tomllib.loads((SOURCE / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def _version():
    found = re.search(r"^project\(sparflow VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8"), re.M)
    if found is None:
        raise RuntimeError("CMakeLists.txt has no line \"project(sparflow VERSION ...\"")
    return found[1]


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _metadata():
    project = _project()
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {_version()}", f"Summary: {project['description']}",
             f"Requires-Python: {project['requires-python']}"]
    for extra, needed in project["optional-dependencies"].items():
        lines.append(f"Provides-Extra: {extra}")
        lines += [f"Requires-Dist: {package}; extra == '{extra}'" for package in needed]
    lines += ["Description-Content-Type: text/markdown", "", (SOURCE / project["readme"]).read_text(encoding="utf-8")]
    return "\n".join(lines)


def _build(settings):
    """Builds the package; returns its folder."""
    built = os.environ.get("SPARFLOW_BUILT_DIR")
    if built:
        return pathlib.Path(built) / "python/sparflow"
    folder = pathlib.Path(settings.get("build-dir", SOURCE / "build/wheel")).resolve()
    # An isolated build hides Debian's packages from every Python by this variable, and CMake asks Python for NumPy.
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    subprocess.run(["cmake", "-S", SOURCE, "-B", folder, *generator, "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON",
                    "-DCMAKE_UNITY_BUILD_BATCH_SIZE=14", "-DSPARFLOW_TESTS=OFF", "-DSPARFLOW_BENCH=OFF", "-DSPARFLOW_PYTHON=ON",
                    f"-DPython_EXECUTABLE={os.path.realpath(sys.executable)}",
                    *shlex.split(settings.get("cmake-args", ""))], check=True, env=environment)
    subprocess.run(["cmake", "--build", folder, "--target", "sparflow_python", "--parallel"], check=True, env=environment)
    return folder / "python/sparflow"


def _files(package):
    """The package's files by their names in the wheel."""
    files = {f"sparflow/{p.name}": p for p in sorted(package.iterdir()) if p.suffix in (".py", ".pyi", ".so") or p.name == "py.typed"}
    if not any(name.endswith(".so") for name in files):
        raise RuntimeError(f"{package} has no module _sparflow; build the target sparflow_python first")
    return files


def _recorded(name, content):
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Called by pip. Returns the wheel's file name."""
    package = _build(config_settings or {})
    info = f"sparflow-{_version()}.dist-info"
    name = f"sparflow-{_version()}-{_tag()}.whl"
    contents = {at: path.read_bytes() for at, path in _files(package).items()}
    contents[f"{info}/METADATA"] = _metadata().encode()
    contents[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: sparflow_build\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode()
    record = "".join(_recorded(at, content) for at, content in contents.items()) + f"{info}/RECORD,,\n"
    contents[f"{info}/RECORD"] = record.encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for at, content in contents.items():
            entry = zipfile.ZipInfo(at, date_time=(1980, 1, 1, 0, 0, 0))  # the same bytes whenever it is built
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if at.endswith(".so") else 0o644) << 16
            wheel.writestr(entry, content)
    return name


def build_sdist(sdist_directory, config_settings=None):
    """Called by build tools for an archive of the sources: the files that Git knows."""
    stem = f"sparflow-{_version()}"
    archive = pathlib.Path(sdist_directory) / f"{stem}.tar.gz"
    subprocess.run(["git", "-C", SOURCE, "archive", "--format=tar.gz", f"--prefix={stem}/", "-o", archive.resolve(), "HEAD"],
                   check=True)
    return archive.name
