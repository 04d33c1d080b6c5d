#!/bin/bash
# Draws docs/arrows.txt: rooms with their folders, and an arrow from each room to those it builds on; an arrow that follows
# from two others is left out. `draw.sh` writes docs/images/architecture.svg, `draw.sh --check` says whether it is up to date.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
picture=docs/images/architecture.svg

draw() {
  awk '
    /^\[/ { section = $1; next }
    /^ *#/ || NF == 0 { next }
    {
      comment = ""
      if (match($0, / *# .*/)) { comment = substr($0, RSTART + 2, RLENGTH); sub(/^[ #]*/, "", comment); $0 = substr($0, 1, RSTART - 1) }
      colon = index($0, ":"); left = substr($0, 1, colon - 1); right = substr($0, colon + 1)
    }
    section == "[rooms]" {
      room[++rooms] = left; sub(/[;:].*/, "", comment); gsub(/->/, "\&#8594;", comment); about[left] = comment
      n = split(right, t, " ")
      for (i = 1; i <= n; i++) {
        # a part of a room stands for the room
        target = t[i]
        for (k = 1; k < rooms; k++) if (index(target "/", room[k] "/") == 1) target = room[k]
        uses[left, target] = 1
        if (depth[target] + 1 > depth[left]) depth[left] = depth[target] + 1
      }
    }
    section == "[folders]" {
      split(left, part, "/"); owner = part[1] == "apps" ? part[1] "/" part[2] : part[1]
      inner = substr(left, length(owner) + 2)
      if (inner ~ /\//) next  # folders of folders are too fine for a picture
      folders[owner] = folders[owner] (folders[owner] == "" ? "" : ", ") inner
    }
    function text(x, y, class, words) { printf "<text x=\"%d\" y=\"%d\" class=\"%s\">%s</text>\n", x, y, class, words }
    function wrapped(x, y, class, words, width,   n, w, i, line) {
      n = split(words, w, " "); line = ""
      for (i = 1; i <= n; i++) {
        if (line != "" && length(line) + length(w[i]) + 1 > width) { text(x, y, class, line); y += 15; line = w[i] }
        else line = line (line == "" ? "" : " ") w[i]
      }
      if (line != "") { text(x, y, class, line); y += 15 }
      return y
    }
    END {
      wide = 250; high = 130; gap = 50; across = 40
      for (k = 1; k <= rooms; k++) { d = depth[room[k]]; if (d > deepest) deepest = d; place[room[k]] = inlayer[d]++; if (inlayer[d] > most) most = inlayer[d] }
      W = most * (wide + across) + across; H = (deepest + 1) * (high + gap) + gap
      printf "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" font-family=\"sans-serif\">\n", W, H
      print "<style>.r{font-size:16px;font-weight:bold}.a{font-size:12px;fill:#444}.f{font-size:12px;fill:#0b5394}</style>"
      print "<defs><marker id=\"m\" viewBox=\"0 0 10 10\" refX=\"9\" refY=\"5\" markerWidth=\"8\" markerHeight=\"8\" orient=\"auto\"><path d=\"M0 0 10 5 0 10z\" fill=\"#777\"/></marker></defs>"
      printf "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n", W, H
      for (k = 1; k <= rooms; k++) {
        r = room[k]; n = inlayer[depth[r]]
        x[r] = (W - n * wide - (n - 1) * across) / 2 + place[r] * (wide + across); y[r] = gap + (deepest - depth[r]) * (high + gap)
      }
      for (k = 1; k <= rooms; k++) for (j = 1; j <= rooms; j++) {
        a = room[k]; b = room[j]
        if (!((a, b) in uses)) continue
        implied = 0
        for (i = 1; i <= rooms; i++) if (room[i] != a && room[i] != b && ((a, room[i]) in uses) && ((room[i], b) in uses)) implied = 1
        if (implied) continue
        printf "<path d=\"M%d %d C%d %d %d %d %d %d\" fill=\"none\" stroke=\"#777\" stroke-width=\"1.5\" marker-end=\"url(#m)\"/>\n", x[a] + wide / 2, y[a] + high, x[a] + wide / 2, y[a] + high + gap, x[b] + wide / 2, y[b] - gap, x[b] + wide / 2, y[b]
      }
      for (k = 1; k <= rooms; k++) {
        r = room[k]
        printf "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" rx=\"6\" fill=\"#f4f7fb\" stroke=\"#6c8ebf\"/>\n", x[r], y[r], wide, high
        text(x[r] + 12, y[r] + 24, "r", r "/")
        line = wrapped(x[r] + 12, y[r] + 44, "a", about[r], 38)
        wrapped(x[r] + 12, line + 4, "f", folders[r], 38)
      }
      print "</svg>"
    }' docs/arrows.txt
}

if [ "${1-}" = --check ]; then
  cmp -s <(draw) "$picture" || { echo "$picture is older than docs/arrows.txt: run tests/architecture/draw.sh" && exit 1; }
else
  draw >"$picture"
fi
