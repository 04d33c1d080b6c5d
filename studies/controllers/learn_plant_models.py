"""Learns models of the plant from several kinds of work on the same machine.

    python3 studies/controllers/learn_plant_models.py build FOLDER [MACHINE...]

First a model is learned from 400 s of a simulated operator. By it the optima of scenarios drawn from seed 3, which are neither tuning
nor test scenarios, are planned; these are tracked, and the same scenarios are driven by joint PI and both operators. The model is then
learned from the operator's log and all these, with the valves' dead bands. docs/benchmark.md tells what that changed; the bundled
models know the operator's log alone.
"""
import pathlib
import re
import subprocess
import sys

SCENARIOS = {"loader_crane": 8, "hmf_2020_k4_load_sensing": 5, "swing_crane": 8}
CONTROLLERS = ["tracked_optimum", "joint_pi", "simultaneous_operator", "sequential_operator"]
SEED = 3
ROOT = pathlib.Path(__file__).resolve().parents[2]


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{done.stderr[-500:]}")
    return done.stdout


def learn(program, machine, logs, test, output):
    """Fits pressures, margins and valve gains, and adds every cylinder's dead band."""
    fitted = output.with_suffix(".fit.json")
    file = ROOT / "problems" / "machines" / f"{machine}.yaml"
    run(program, "fit", "-m", file, "-l", *logs, "-t", test, "-o", fitted)
    cylinders = re.findall(r",u_(\w+)", logs[0].read_text()[:2000])
    bands = [f"valve_deadband:{name}" for name in cylinders]
    run(program, "extend", "--model", fitted, "-a", *bands, "-l", *logs, "-t", test, "-o", output)
    return output


def drawn(build, machine, folder):
    """Scenarios to learn from, whose names say so."""
    run(build / "bench" / "draw_scenarios", "--machine", machine, "--model", f"{machine}_plant", "--set", "train", "--count",
        SCENARIOS[machine], "--seed", SEED, "-o", folder)
    files = sorted(folder.glob(f"train_{machine}_*.yaml"))
    for file in files:
        file.write_text(re.sub("^set: .*$", "set: tuning", file.read_text(), flags=re.M))  # the only sets there are
    return files


def main():
    build, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for machine in sys.argv[3:] or SCENARIOS:
        program, file = build / "sparflow", ROOT / "problems" / "machines" / f"{machine}.yaml"
        work, other = folder / f"{machine}_op11.csv", folder / f"{machine}_op12.csv"
        run(program, "simulate", "-m", file, "--seconds", 400, "--seed", 11, "-o", work)
        run(program, "simulate", "-m", file, "--seconds", 200, "--seed", 12, "-o", other)
        first = learn(program, machine, [work], other, folder / f"{machine}_operator.json")
        scenarios = drawn(build, machine, folder)
        for controller in CONTROLLERS:
            run(build / "bench" / "prediction_study", *scenarios, "--model", first, "--plans", folder / "plans", "--controller", controller,
                "--logs", folder / controller, "--quiet")
        logs = sorted(log for c in CONTROLLERS for log in (folder / c).glob(f"train_{machine}_*.csv"))
        output = learn(program, machine, [work, *logs], other, folder / f"{machine}_plant.json")
        print(f"{machine}: {len(logs) + 1} logs, {output}", flush=True)


if __name__ == "__main__":
    main()
