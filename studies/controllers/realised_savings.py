"""How much of the saving that `audit` promises is realised when the proposed motions are tracked on the dynamic plant.

    python3 studies/controllers/realised_savings.py build/sparflow problems [SEED,... [SECONDS [MACHINE...]]]

A simulated operator works for SECONDS (100) with each SEED (31). The recorded motion and the proposal of each judged move are tracked
with the move's payload. Promised: the audit's saving over the model's energy of the recorded move. Realised: one less the energy of the
tracked proposal over that of the tracked recording, both the pumps' pressure times flow, so that what tracking and the begin from a plant
at rest cost is in both. Against the log: over the measured energy of the log, by the rods' speeds, in which neither is. Also told: in how
many moves the realised saving lies within two of the standard deviations that audit states. docs/audit.md has the result.
"""
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

MACHINES = ["loader_crane", "hmf_2020_k4_load_sensing", "swing_crane"]


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{done.stderr[-500:]}")


def write_recorded(log, span, file):
    """Writes the joint positions of a log between two instants, ten a second, each the mean over a fifth of a second."""
    lines = [line for line in log.read_text().splitlines() if not line.startswith("#")]
    names = lines[0].split(",")
    columns = [k for k, name in enumerate(names) if name.startswith("q_")]
    rows = [line.split(",") for line in lines[1:] if span[0] - 1e-9 <= float(line.split(",")[0]) <= span[1] + 1e-9]
    values = [[float(row[k] or "nan") for k in columns] for row in rows]
    out = ["t_s," + ",".join(names[k] for k in columns)]
    for k in sorted({*range(0, len(rows), 5), len(rows) - 1}):
        half = min(5, k, len(rows) - 1 - k)
        around = values[k - half:k + half + 1]
        means = [statistics.mean(x for x in column if x == x) for column in zip(*around)]
        out.append(f"{float(rows[k][0]) - span[0]:.4f}," + ",".join(f"{x:.6f}" for x in means))
    file.write_text("\n".join(out) + "\n")


def tracked_energy(program, machine, motion, payload, folder):
    """The pumps' energy [J] of tracking a motion on the plant."""
    result = folder / "tracked.json"
    run(program, "simulate", "-m", machine, "--track", motion, "--payload", payload, "-o", folder / "tracked.csv", "--json", result)
    return sum(p["energy_J"] for p in json.loads(result.read_text())["pumps"].values())


def moves_of(program, problems, machine, work, folder):
    """Yields the judged moves: the audit's values and the plant's energies of tracking recording and proposal."""
    file = problems / "machines" / f"{machine}.yaml"
    log, result = folder / "log.csv", folder / "audit.json"
    proposals = folder / f"{machine}_{work[0]}"
    run(program, "simulate", "-m", file, "--seed", work[0], "--seconds", work[1], "-o", log)
    run(program, "audit", log, "--model", problems / "models" / f"{machine}_plant.json", "--no-bound", "--motions", proposals,
        "--json", result)
    for number, move in enumerate(json.loads(result.read_text())["moves"], 1):
        if not move["judged"]:
            continue
        write_recorded(log, move["t_s"], folder / "recorded.csv")
        energies = [tracked_energy(program, file, motion, move["payload_kg"], folder)
                    for motion in (folder / "recorded.csv", proposals / f"move_{number:02d}.csv")]
        yield dict(move, name=f"{machine} {work[0]}.{number}", recorded_J=energies[0], tracked_J=energies[1])


def promised(move):
    return 100 * move["saving_J"] / move["model_J"]


def realised(move):
    return 100 * (1 - move["tracked_J"] / move["recorded_J"])


def against_log(move):
    return 100 * (1 - move["tracked_J"] / move["measured_J"])


def uncertainty(move):
    return 100 * move["saving_std_J"] / move["model_J"]


def tell(name, moves):
    total = {key: sum(m[key] for m in moves) for key in ("measured_J", "model_J", "saving_J", "recorded_J", "tracked_J")}
    print(f"{name}: {len(moves)} moves, {total['measured_J'] / 1e3:.0f} kJ: promised {promised(total):.1f} %, realised "
          f"{realised(total):.1f} %, against the log {against_log(total):.1f} %")
    for words, of in (("realised", realised), ("against the log", against_log)):
        off = sorted(of(m) - promised(m) for m in moves)
        held = sum(abs(of(m) - promised(m)) <= 2 * uncertainty(m) for m in moves)
        print(f"  {words} less promised, by move: {statistics.median(off):+.1f} points (median; {off[0]:+.1f} to {off[-1]:+.1f}), "
              f"{sum(abs(d) <= 5.0 for d in off)} within 5 points, {held} within two standard deviations")


def main():
    program, problems = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    seeds = sys.argv[3].split(",") if len(sys.argv) > 3 else ["31"]
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 100
    print(f"{'move':<34}{'measured kJ':>12}{'model':>8}{'optimum':>8} | tracked:{'recording':>10}{'proposal':>9} |{'promised %':>11}"
          f"{'±':>5}{'realised':>9}{'against the log':>16}")
    machines, all_moves = {}, []
    with tempfile.TemporaryDirectory() as folder:
        for machine in sys.argv[5:] or MACHINES:
            for seed in seeds:
                for m in moves_of(program, problems, machine, (seed, seconds), pathlib.Path(folder)):
                    print(f"{m['name']:<34}{m['measured_J'] / 1e3:12.1f}{m['model_J'] / 1e3:8.1f}{m['optimum_J'] / 1e3:8.1f} | "
                          f"{m['recorded_J'] / 1e3:18.1f}{m['tracked_J'] / 1e3:9.1f} |{promised(m):11.1f}{uncertainty(m):5.1f}"
                          f"{realised(m):9.1f}{against_log(m):16.1f}", flush=True)
                    machines.setdefault(machine, []).append(m)
                    all_moves.append(m)
    for machine, moves in machines.items():
        tell(machine, moves)
    if len(machines) > 1:
        tell("all", all_moves)


if __name__ == "__main__":
    main()
