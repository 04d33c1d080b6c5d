"""Reliability of the probabilities that `diagnose` says: of effects named with 90 %, are 90 % right?

python3 studies/trust/reliability.py NAME=RESULT.json... [--svg FILE]

Reads the JSON files of blind_test and plant_verdicts (`said`: each named effect with its probability and whether it was hidden), prints a
table for each NAME (several files may have the same one) and for all together, and draws the diagram. Limits are Wilson's (1927).
Source of the diagram: M. H. DeGroot, S. E. Fienberg (1983), The Statistician 32, 12-22.
"""

import json
import math
import sys

EDGES = [0.5, 0.7, 0.9, 0.99, 1.0 + 1e-9]


def wilson(hits, runs):
    z, n, p = 1.959964, runs, hits / runs
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, centre - half), min(1.0, centre + half)


def said_of(file):
    with open(file, encoding="utf-8") as text:
        data = json.load(text)
    if "said" in data:
        return data["said"]
    return [s for run in data["runs"] if run["by"] == "ours" for s in run["said"]]


def bins_of(said, key, right):
    """[(count, mean probability, number of right ones)] of each range of probabilities that has any."""
    out = []
    for low, high in zip(EDGES, EDGES[1:]):
        inside = [s for s in said if low <= s[key] < high]
        if inside:
            out.append((len(inside), sum(s[key] for s in inside) / len(inside), sum(s[right] for s in inside)))
    return out


def table(name, said):
    print(f"{name}: {len(said)} effects named")
    for title, key, right in (("this one", "probability", "right"), ("this one or a rival", "set_probability", "set_right")):
        for count, mean, hits in bins_of(said, key, right):
            low, high = wilson(hits, count)
            print(f"  {title:20} said {100 * mean:5.1f} %   right {hits:4} of {count:4} = {100 * hits / count:5.1f} %"
                  f" ({100 * low:.0f} .. {100 * high:.0f})")
        sure = [s for s in said if s[key] >= 0.9]
        if sure:
            hits = sum(s[right] for s in sure)
            print(f"  {title:20} said with 90 % and more: right {hits} of {len(sure)} = {100 * hits / len(sure):.1f} %")


def drawing(groups):
    colours = ["#1f6f9f", "#c2571a", "#3b7d3b", "#7b4aa0"]
    x = lambda p: 60 + 400 * (p - 0.5) / 0.5
    y = lambda p: 430 - 400 * p
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 480" font-family="sans-serif" font-size="13">',
           '<rect width="640" height="480" fill="white"/>',
           f'<line x1="{x(0.5)}" y1="{y(0.5)}" x2="{x(1)}" y2="{y(1)}" stroke="#999" stroke-dasharray="4 4"/>']
    for p in (0.5, 0.6, 0.7, 0.8, 0.9, 1.0):
        out.append(f'<text x="{x(p)}" y="448" text-anchor="middle">{100 * p:.0f} %</text>')
    for p in (0.0, 0.25, 0.5, 0.75, 1.0):
        out.append(f'<line x1="60" x2="460" y1="{y(p)}" y2="{y(p)}" stroke="#eee"/>'
                   f'<text x="54" y="{y(p) + 4}" text-anchor="end">{100 * p:.0f} %</text>')
    out.append('<text x="260" y="470" text-anchor="middle">probability that is said (this effect or a rival)</text>')
    out.append('<text x="14" y="230" transform="rotate(-90 14 230)" text-anchor="middle">share that is right, with 95 % limits</text>')
    for i, (name, said) in enumerate(groups):
        colour = colours[i % len(colours)]
        for count, mean, hits in bins_of(said, "set_probability", "set_right"):
            low, high = wilson(hits, count)
            at = x(mean) + 5 * (i - (len(groups) - 1) / 2)
            out.append(f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{y(low):.1f}" y2="{y(high):.1f}" stroke="{colour}"/>')
            out.append(f'<circle cx="{at:.1f}" cy="{y(hits / count):.1f}" r="{3 + math.sqrt(count) / 2:.1f}" fill="{colour}"'
                       f' fill-opacity="0.7"><title>{name}: {hits} of {count}</title></circle>')
        out.append(f'<circle cx="484" cy="{60 + 22 * i}" r="5" fill="{colour}"/>'
                   f'<text x="496" y="{64 + 22 * i}">{name} ({len(said)})</text>')
    out.append("</svg>")
    return "\n".join(out) + "\n"


def main(arguments):
    svg, groups = None, {}
    while arguments:
        one = arguments.pop(0)
        if one == "--svg":
            svg = arguments.pop(0)
            continue
        name, _, file = one.partition("=")
        if not file:
            sys.exit(f"{one}: expected NAME=RESULT.json")
        groups.setdefault(name, []).extend(said_of(file))
    if not groups:
        sys.exit(__doc__)
    for name, said in groups.items():
        table(name, said)
    if len(groups) > 1:
        table("all together", [s for said in groups.values() for s in said])
    if svg:
        with open(svg, "w", encoding="utf-8") as out:
            out.write(drawing(list(groups.items())))


main(sys.argv[1:])
