"""From the JSON of `sparflow benchmark`: on how many scenarios a controller takes less true energy than every other one.

    python3 studies/controllers/least_energy.py RESULT.json [CONTROLLER]

Also its tip errors beside joint PI's, predicted against true energy, and both operators; docs/benchmark.md has the result.
"""
import json
import statistics
import sys


def mean_by_scenario(rows, key):
    """Means over the seeds by scenario and controller, of runs that were done."""
    sums = {}
    for row in rows:
        if row["status"] == "done" and row.get(key) is not None:
            sums.setdefault((row["scenario"], row["controller"]), []).append(row[key])
    return {pair: statistics.mean(values) for pair, values in sums.items()}


def shares(values):
    return f"{100 * statistics.median(values):+.1f} % (median of {len(values)}, {100 * min(values):+.1f} to {100 * max(values):+.1f} %)"


def main():
    result = json.load(open(sys.argv[1], encoding="utf-8"))
    mine = sys.argv[2] if len(sys.argv) > 2 else "tracked_optimum"
    rows = result["rows"]
    scenarios = sorted({row["scenario"] for row in rows})
    others = sorted({row["controller"] for row in rows} - {mine, "tracked_optimum", "replanned_optimum"})
    energy, end = mean_by_scenario(rows, "energy_J"), mean_by_scenario(rows, "tip_error_end_m")
    way = mean_by_scenario(rows, "tip_error_path_m")
    done = [s for s in scenarios if (s, mine) in energy]
    least = [s for s in done if all(energy[s, mine] <= energy.get((s, c), float("inf")) for c in others)]
    print(f"{mine}: done {len(done)} of {len(scenarios)}; less true energy than each of {', '.join(others)}: "
          f"{len(least)} of {len(scenarios)}")
    near = [s for s in done if all(energy[s, mine] <= 1.02 * energy.get((s, c), float("inf")) for c in others)]
    print(f"  within 2 % of the least of them: {len(near)} of {len(scenarios)}")
    for c in others:
        both = [s for s in done if (s, c) in energy]
        if both:
            print(f"  {c:<22} above it {shares([energy[s, c] / energy[s, mine] - 1 for s in both])}; "
                  f"dearer in {sum(energy[s, c] > energy[s, mine] for s in both)}")
    for name, errors in (("on the way", way), ("at the end", end)):
        both = [s for s in done if (s, "joint_pi") in errors and (s, mine) in errors]
        if both:
            worse = sum(errors[s, mine] > errors[s, "joint_pi"] for s in both)
            print(f"  tip error {name}: median {1e3 * statistics.median(errors[s, mine] for s in both):.0f} mm, joint PI "
                  f"{1e3 * statistics.median(errors[s, 'joint_pi'] for s in both):.0f} mm; larger in {worse} of {len(both)}")
    promised = {s["id"]: s.get("predicted_optimum_J") for s in result["scenarios"]}
    known = [s for s in done if promised.get(s)]
    if known:
        errors = [promised[s] / energy[s, mine] - 1 for s in known]
        print(f"  predicted less true energy: {shares(errors)}; without sign {100 * statistics.median(map(abs, errors)):.1f} %")
        true_above = [energy[s, mine] / promised[s] - 1 for s in known]
        print(f"  true above predicted: {shares(true_above)}; within 5 % in {sum(abs(e) <= 0.05 for e in true_above)}")
    for machine in sorted({s.rstrip("0123456789").rstrip("_") for s in known}):
        own = [s for s in known if s.startswith(machine)]
        saved = [1 - energy[s, mine] / energy[s, "joint_pi"] for s in own if (s, "joint_pi") in energy]
        print(f"  {machine}: true above predicted {shares([energy[s, mine] / promised[s] - 1 for s in own])}")
        if saved:
            print(f"    saved against joint PI {shares(saved)}")
    both = [s for s in scenarios if all((s, c) in energy for c in ("sequential_operator", "simultaneous_operator"))]
    if both:
        more = [energy[s, "sequential_operator"] / energy[s, "simultaneous_operator"] - 1 for s in both]
        print(f"  sequential above simultaneous operator: {shares(more)}; dearer in {sum(m > 0 for m in more)}")


if __name__ == "__main__":
    main()
