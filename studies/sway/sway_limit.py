#!/usr/bin/env python3
"""What a limit of the sway does on the dynamic plant.

    python3 studies/sway/sway_limit.py build/sparflow problems/scenarios/test --sway 4 --slack 2 --jobs 2

Runs `sparflow benchmark` with the tracked optimum twice, planned without and with the limit, in the same times, and prints by
machine: the share of scenarios in which the load stays within limit + slack over the whole run, and the energy that this costs, as
median of the pairs in which both runs are done. The slack is what tracking adds to the planned sway: valves follow late.
"""
import argparse
import json
import math
import pathlib
import statistics
import subprocess
import tempfile


def rows_of(program, scenarios, sway, jobs, folder):
    result = pathlib.Path(folder) / f"sway_{sway:g}.json"
    command = [program, "benchmark", *scenarios, "--controllers", "tracked_optimum", "--no-bound", "--jobs", str(jobs), "--json",
               str(result)]
    if sway > 0.0:
        command += ["--sway", f"{sway:g}"]
    subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    found = json.loads(result.read_text())
    predicted = {s["id"]: s.get("predicted_optimum_J") for s in found["scenarios"]}
    return {(r["scenario"], r["seed"]): r for r in found["rows"]}, predicted


def percent(pairs):
    return f"{100.0 * (statistics.median(pairs) - 1.0):+.1f} %" if pairs else "-"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("program")
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("--sway", type=float, default=4.0, help="limit for which motions are planned [deg]")
    parser.add_argument("--slack", type=float, default=2.0, help="what tracking may add [deg]")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", default="", help="folder for the two results; absent: they are deleted")
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = a.keep or temporary
        free, free_optimum = rows_of(a.program, a.scenarios, 0.0, a.jobs, folder)
        held, held_optimum = rows_of(a.program, a.scenarios, a.sway, a.jobs, folder)
    machines = sorted({key[0].split("_", 1)[1].rsplit("_", 1)[0] for key in free}) + [""]
    degrees = lambda row: math.degrees(row["sway_path_rad"])
    print(f"limit {a.sway:g} deg, within {a.sway + a.slack:g} deg on the plant")
    print("| machine | planned | driven | within, no limit | within, limit | sway, no limit | sway, limit | predicted energy | true energy |")
    print("|---|---|---|---|---|---|---|---|---|")
    for machine in machines:
        keys = [k for k in free if machine in k[0]]
        planned = [k for k in keys if held_optimum.get(k[0]) and free_optimum.get(k[0])]
        both = [k for k in planned if free[k]["status"] == "done" and held[k]["status"] == "done"]
        inside = lambda rows: sum(degrees(rows[k]) <= a.sway + a.slack for k in planned)
        if not planned:
            print(f"| {machine or 'all'} | 0 of {len(keys)} |")
            continue
        print(f"| {machine or 'all'} | {len(planned)} of {len(keys)} | {len(both)} | {inside(free)} | {inside(held)} | "
              f"{statistics.median(degrees(free[k]) for k in planned):.1f}° | "
              f"{statistics.median(degrees(held[k]) for k in planned):.1f}° | "
              f"{percent([held_optimum[k[0]] / free_optimum[k[0]] for k in planned])} | "
              f"{percent([held[k]['energy_J'] / free[k]['energy_J'] for k in both])} |")


if __name__ == "__main__":
    main()
