"""How much of the saving that `audit` promises is realised when the proposed motions are tracked on the dynamic plant.

    python3 studies/controllers/realised_savings.py build/sparflow problems [SEED [SECONDS [MACHINE...]]]

A simulated operator works for 200 s; each judged move's proposal is tracked with the move's payload. Promised: the audit's saving over
the model's energy of the recorded move. Realised: one less the tracked energy over the measured energy. docs/audit.md has the result.
"""
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

MACHINES = ["loader_crane", "hmf_2020_k4_load_sensing"]


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{done.stderr[-500:]}")


def moves_of(program, problems, machine, work, folder):
    """Yields (name, measured, tracked, promised) of each judged move; energies in J, promised as a share."""
    file = problems / "machines" / f"{machine}.yaml"
    log, result = folder / f"{machine}.csv", folder / f"{machine}.json"
    proposals = folder / machine
    run(program, "simulate", "-m", file, "--seed", work[0], "--seconds", work[1], "-o", log)
    run(program, "audit", log, "--model", problems / "models" / f"{machine}_plant.json", "--motions", proposals, "--json", result)
    for number, move in enumerate(json.loads(result.read_text())["moves"], 1):
        if not move["judged"]:
            continue
        tracked = folder / "tracked.json"
        run(program, "simulate", "-m", file, "--track", proposals / f"move_{number:02d}.csv",
            "--payload", move["payload_kg"], "-o", folder / "tracked.csv", "--json", tracked)
        energy = sum(p["energy_J"] for p in json.loads(tracked.read_text())["pumps"].values())
        yield f"{machine} {number}", move["measured_J"], energy, move["saving_J"] / move["model_J"]


def main():
    program, problems = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 31
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 200
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for machine in sys.argv[5:] or MACHINES:
            rows += moves_of(program, problems, machine, (seed, seconds), pathlib.Path(folder))
    print(f"{'move':<34} {'measured kJ':>11} {'tracked kJ':>11} {'promised %':>11} {'realised %':>11}")
    differences = []
    for name, measured, tracked, promised in rows:
        realised = 1.0 - tracked / measured
        differences.append(100.0 * (realised - promised))
        print(f"{name:<34} {measured / 1e3:11.1f} {tracked / 1e3:11.1f} {100 * promised:11.1f} {100 * realised:11.1f}")
    measured = sum(r[1] for r in rows)
    promised = sum(r[1] * r[3] for r in rows) / measured
    realised = 1.0 - sum(r[2] for r in rows) / measured
    near = sum(abs(d) <= 5.0 for d in differences)
    print(f"{len(rows)} moves, {measured / 1e3:.0f} kJ: promised {100 * promised:.1f} %, realised {100 * realised:.1f} %; "
          f"by move {statistics.median(differences):+.1f} points (median), {near} within 5 points")


if __name__ == "__main__":
    main()
