"""What a call of the Python module costs over the command line and over the C++ loop. Prints a table of medians.

    PYTHONPATH=build/python /usr/bin/python3 bench/python_overhead.py [BUILD_FOLDER] [--json OUT.json]

fit and compare on the bundled log: wall time of the program from start to end, against loading the same files and the same call
in a Python that has imported the module. The exact law on 10 000 states: one array call, against build/bench/law_on_states, the
same states in a plain loop. Runs alternate, so that a busy machine burdens both alike; each figure is the median of the runs.
--processor-time takes processor time of all threads in place of wall time for fit and compare, where other programs run beside.
"""

import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import tempfile
import time

import numpy as np

import sparflow

SOURCE = pathlib.Path(__file__).resolve().parents[1]
DATA = SOURCE / "problems"
MACHINE = DATA / "machines/loader_crane.yaml"
MODEL = DATA / "models/loader_crane.json"
TRAIN, TEST = DATA / "logs/loader_crane_train.csv", DATA / "logs/loader_crane_test.csv"
STATES = 10_000


clock = time.perf_counter


def processor_time():
    """Of this process and of the programs that it has run [s]."""
    return sum(os.times()[:4])


def seconds(call):
    begin = clock()
    call()
    return clock() - begin


def alternating(first, second, runs):
    """Medians of two calls that take turns [s], after one turn that warms caches up, and the median of their ratios."""
    first(), second()
    a, b = zip(*((seconds(first), seconds(second)) for _ in range(runs)))
    return statistics.median(a), statistics.median(b), statistics.median(y / x for x, y in zip(a, b))


def verbs(program, folder, runs):
    """fit with its model saved, and compare, each with its JSON written, as the program does."""
    def run(*words):
        subprocess.run([program, *words], check=True, capture_output=True)

    def fit():
        machine = sparflow.Machine.load(MACHINE)
        fitted = sparflow.fit(machine, TRAIN, test=TEST)
        fitted.model.save(folder / "python.json")
        (folder / "python_fit.json").write_text(fitted.json())
        str(fitted)

    def compare():
        compared = sparflow.compare(sparflow.Model.load(MODEL), TEST)
        (folder / "python_compare.json").write_text(compared.json())
        str(compared)

    yield "fit", *alternating(lambda: run("fit", "-m", MACHINE, "-l", TRAIN, "-t", TEST, "-o", folder / "cli.json", "--json",
                                          folder / "cli_fit.json"), fit, runs)
    yield "compare", *alternating(lambda: run("compare", "--model", MODEL, "-l", TEST, "--json", folder / "cli_compare.json"),
                                  compare, runs)


def law(loop, folder, runs):
    """The array call against the C++ loop; both print or give the sum of the powers, which must agree."""
    generator = np.random.default_rng(1)
    q = np.array([0.4, -1.2, 1.2]) + generator.uniform(-0.3, 0.3, (STATES, 3))
    qd = generator.uniform(-0.08, 0.08, (STATES, 3))
    (folder / "states.bin").write_bytes(np.concatenate([q, qd]).tobytes())
    model = sparflow.Model.load(MODEL)
    ours, theirs, power = [], [], None
    for _ in range(runs + 1):
        told = subprocess.run([loop, MODEL, folder / "states.bin", str(STATES), "300", "5"], check=True, capture_output=True,
                              text=True).stdout.split()
        theirs.append(float(told[0]))
        takes = []
        for _ in range(5):
            begin = time.perf_counter()
            power = sparflow.evaluate(model, q, qd, payload_kg=300)["power"]
            takes.append(time.perf_counter() - begin)
        ours.append(statistics.median(takes))
        if not np.isclose(power.sum(), float(told[1]), rtol=1e-12):
            raise SystemExit(f"the array call and the loop disagree: {power.sum()} and {told[1]}")
    return statistics.median(theirs[1:]), statistics.median(ours[1:]), statistics.median(
        b / a for a, b in zip(theirs[1:], ours[1:]))


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("build", nargs="?", default=SOURCE / "build", type=pathlib.Path)
    arguments.add_argument("--runs", type=int, default=5)
    arguments.add_argument("--json", type=pathlib.Path)
    arguments.add_argument("--processor-time", action="store_true")
    a = arguments.parse_args()
    if a.processor_time:
        global clock
        clock = processor_time
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, *figures in verbs(a.build / "sparflow", folder, a.runs):
            rows[name] = figures
        if (a.build / "bench/law_on_states").exists():
            rows[f"law on {STATES} states"] = law(a.build / "bench/law_on_states", folder, a.runs)
    print(f"{'':<24} {'program, C++':>14} {'Python':>10} {'over it':>9}   medians of {a.runs}, {platform.machine()}")
    for name, (theirs, ours, ratio) in rows.items():
        print(f"{name:<24} {theirs:>12.4f} s {ours:>8.4f} s {100 * (ratio - 1):>+7.1f} %")
    if a.json:
        a.json.write_text(json.dumps({name: dict(zip(("reference_s", "python_s", "ratio"), row)) for name, row in rows.items()}))


if __name__ == "__main__":
    main()
