#!/bin/bash
# Holds the tree against docs/arrows.txt and the lists of public headers, and says which file breaks which rule and why:
# includes that no arrow allows, headers that are internal to another room, libraries outside their folder, arrows that
# would close a cycle, folders with more than 25 sources or without a README of at most five lines.
#   check_includes.sh [TREE]      ends with 0 when nothing is found, with 1 otherwise
set -euo pipefail
tree=$(cd "${1:-$(dirname "$(readlink -f "$0")")/../..}" && pwd)
cd "$tree"
rooms=$(sed -n '/^\[rooms\]/,/^\[folders\]/s/^\([a-z/_]*\):.*/\1/p' docs/arrows.txt)
# shellcheck disable=SC2086  # one word a room
sources=$(find $rooms \( -name '*.h' -o -name '*.cpp' \) -type f | sort)
found=0

# shellcheck disable=SC2086
awk '
  function report(place, text) { printf "%s: %s\n", place, text; bad = 1 }
  # the longest name in `names` that is the folder or one above it
  function holder(path, names,   folder) {
    folder = path
    while (sub(/\/[^\/]*$/, "", folder)) if (folder in names) return folder
    return ""
  }
  function below(path, folder) { return path == folder || index(path, folder "/") == 1 }

  FILENAME == "docs/arrows.txt" {
    comment = ""
    if (match($0, / *# .*/)) { comment = substr($0, RSTART, RLENGTH); sub(/^ *# /, "", comment); $0 = substr($0, 1, RSTART - 1) }
    if ($0 ~ /^\[/ || $0 ~ /^ *#/ || NF == 0) { if ($0 ~ /^\[/) section = $1; next }
    colon = index($0, ":")
    left = substr($0, 1, colon - 1); right = substr($0, colon + 1)
    if (section == "[libraries]") {
      sub(/^only /, "", left); libraries++
      only[libraries] = left; headers[libraries] = right; reason[libraries] = comment
      next
    }
    if (left in allowed) report("docs/arrows.txt:" FNR, left " stands twice")
    n = split(right, targets, " ")
    for (i = 1; i <= n; i++) {
      # a line names only what stands above it, so that no cycle can be written down
      known = targets[i] in allowed
      for (r in is_room) if (below(targets[i], r) && !below(left, r)) known = 1
      if (!known) report("docs/arrows.txt:" FNR, left " names " targets[i] ", which no line above it defines: arrows must not close a cycle")
    }
    allowed[left] = right; why[left] = comment
    if (section == "[rooms]") is_room[left] = 1
    next
  }
  FILENAME ~ /public_headers.txt$/ {
    room = FILENAME; sub(/\/public_headers.txt$/, "", room)
    if ($0 !~ /^#/ && NF) { public[$1] = room; if ((getline line < $1) < 0) report(FILENAME ":" FNR, "there is no " $1); close($1) }
    next
  }
  /^#include </ {
    name = $2; gsub(/[<>]/, "", name)
    for (k = 1; k <= libraries; k++) {
      n = split(headers[k], list, " ")
      for (i = 1; i <= n; i++) {
        if (index(name, list[i]) != 1) continue
        m = split(only[k], homes, " "); home = 0
        for (j = 1; j <= m; j++) if (below(FILENAME, homes[j])) home = 1
        # benchmarks compare with libraries themselves
        if (!home && FILENAME !~ /^bench\//) report(FILENAME ":" FNR, "includes <" name ">, which only " only[k] " may (" reason[k] ")")
      }
    }
  }
  /^#include "/ {
    split($0, quoted, "\""); name = quoted[2]
    user = holder(FILENAME, allowed); owner = holder(name, allowed)
    if (user == "" || owner == "") { report(FILENAME ":" FNR, "includes \"" name "\", of which docs/arrows.txt knows nothing"); next }
    folder = FILENAME; sub(/\/[^\/]*$/, "", folder); other = name; sub(/\/[^\/]*$/, "", other)
    if (folder != other) {
      ok = owner == user && !(user in is_room)
      n = split(allowed[user], targets, " ")
      for (i = 1; i <= n; i++) if (below(name, targets[i])) ok = 1
      if (owner == user && user in is_room) ok = 1
      if (!ok) report(FILENAME ":" FNR, "includes \"" name "\", but " user " may include only" (n ? " " allowed[user] : " itself") " (" (why[user] == "" ? why[holder(FILENAME, is_room)] : why[user]) ")")
    }
    user_room = holder(FILENAME, is_room); owner_room = holder(name, is_room)
    listed = name in public
    if (user_room != owner_room && has_list[owner_room] != "no" && !listed)
      report(FILENAME ":" FNR, "includes \"" name "\", which is internal to " owner_room ": " owner_room "/public_headers.txt does not list it")
    if (user_room == owner_room && FILENAME in public && !listed)
      report(FILENAME ":" FNR, "is a public header and includes \"" name "\", which is internal and not installed")
  }
  BEGIN { has_list["bench"] = "no"; has_list["studies"] = "no"; has_list["apps/cli"] = "no"; has_list["examples"] = "no" }
  END { exit bad }
' docs/arrows.txt $(find $rooms -maxdepth 1 -name public_headers.txt | sort) $sources || found=1

for folder in $(dirname $sources | sort -u); do
  count=$(printf '%s\n' $sources | grep -c "^$folder/[^/]*$")
  if [ "$count" -gt 25 ]; then echo "$folder: holds $count sources and headers; 25 are enough for one concept" && found=1; fi
done
for folder in $(printf '%s\n' $rooms $(dirname $sources) | sed 's,^apps/[a-z]*$,&\napps,' | sort -u); do
  if [ ! -f "$folder/README.md" ]; then
    echo "$folder: has no README.md that says in at most five lines what belongs there" && found=1
  elif [ "$(wc -l <"$folder/README.md")" -gt 5 ]; then
    echo "$folder/README.md: longer than five lines" && found=1
  fi
done
exit $found
