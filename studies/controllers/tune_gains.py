#!/usr/bin/env python3
"""Tunes the gains of controllers on the tuning scenarios, all by the same procedure:

    python3 studies/controllers/tune_gains.py build/sparflow problems/scenarios/tuning [CONTROLLER NAME=VALUE...]

A coordinate search: each gain in turn is multiplied and divided by a factor (2 in the first round, then 1.4), and the value with
the least cost is kept. It takes two rounds, and more until one lowers the cost by less than 5 %. With a controller and gains it
begins there and does one round for that controller's group alone. The cost is the mean over scenarios of the energy over that of the first gains, the relative distance of
the time from the scenario's, tip errors over 0.1 m, the levers' rate over 1/s, and 3 for a run that failed. Controllers that share a law share their gains: joint PI stands
for the tracked optima, the plain tip control for the energy-weighted one, and both operators are tuned together."""
import json
import math
import subprocess
import sys

PROGRAM, SCENARIOS = sys.argv[1], sys.argv[2]
ONLY = sys.argv[3] if len(sys.argv) > 3 else ""
MOST_ROUNDS = 6
GROUPS = {
    ("joint_pi",): {"proportional": 2.0, "integral": 0.5, "lead": 0.1},
    ("tip_rate",): {"proportional": 1.5, "integral": 0.3, "lead": 0.1},
    ("sequential_operator", "simultaneous_operator"): {"approach": 1.0, "hurry": 0.85},
}
BOUNDS = {"proportional": (0.1, 10.0), "integral": (0.01, 5.0), "lead": (0.01, 0.5), "approach": (0.2, 5.0), "hurry": (0.5, 1.0)}


def rows(controllers, gains):
    command = [PROGRAM, "benchmark", SCENARIOS, "--no-optimum", "--controllers", ",".join(controllers), "--json", "-"]
    for controller in controllers:
        for name, value in gains.items():
            command += ["--gain", f"{controller}.{name}={value:.6g}"]
    out = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False).stdout
    result = json.loads(out)
    durations = {s["id"]: s["duration_s"] for s in result["scenarios"]}
    for row in result["rows"]:
        row["duration_s"] = durations[row["scenario"]]
    return {(r["controller"], r["scenario"], r["seed"]): r for r in result["rows"]}


def cost(found, first):
    total = 0.0
    for key, row in found.items():
        start = first[key]
        if row["status"] != "done":
            total += 3.0
            continue
        total += row["energy_J"] / start["energy_J"] if start["energy_J"] else 1.0
        total += abs(row["time_s"] / row["duration_s"] - 1.0)
        total += ((row["tip_error_path_m"] or 0.0) + row["tip_error_end_m"]) / 0.1 + row["roughness_1_s"]
    return total / len(found)


for controllers, gains in GROUPS.items():
    if ONLY and ONLY not in controllers:
        continue
    first = rows(controllers, gains)
    best = cost(first, first)
    if ONLY:
        gains = {name: float(value) for name, value in (a.split("=") for a in sys.argv[4:])}
        best = cost(rows(controllers, gains), first)
    print(f"{'+'.join(controllers)}: cost {best:.4f} at {gains}", flush=True)
    for number in range(MOST_ROUNDS):
        before, factor = best, 2.0 if number == 0 and not ONLY else 1.4
        for name in gains:
            for change in (factor, 1.0 / factor):
                low, high = BOUNDS[name]
                tried = dict(gains, **{name: min(high, max(low, gains[name] * change))})
                if math.isclose(tried[name], gains[name]):
                    continue
                value = cost(rows(controllers, tried), first)
                if value < best - 1e-4:
                    best, gains = value, tried
        print(f"  factor {factor}: cost {best:.4f} at " + ", ".join(f"{k} {v:.3g}" for k, v in gains.items()), flush=True)
        if ONLY or (number > 0 and best > 0.95 * before):
            break
