#!/bin/bash
# Makes docs/thresholds.md from the sources: every field or constant with a line `@threshold [UNIT] LO..HI; KIND: reason` in
# the comment above it. `thresholds.sh` writes the page, `thresholds.sh --check` says whether it is up to date; both refuse a
# line of another form. `thresholds.sh [--check] TREE` does so in another tree.
# In the rooms of `complete` both also refuse a number that decides and has no such line: a constant (constexpr) with a
# literal value, a field of a struct ...Options with one, and a literal in a comparison. Numbers that structure gives are free
# there: whole numbers to 4, 0.5 and 2.0; any other that is no threshold (a unit, exact mathematics, a layout) has a comment
# "no threshold: what it is" in its line or directly above the constants in a row.
set -euo pipefail
check=
if [ "${1-}" = --check ]; then check=1 && shift; fi
cd "${1:-$(dirname "$(readlink -f "$0")")/../..}"
page=docs/thresholds.md
rooms="models identification diagnosis problems planners optimizer simulator"
complete="models planners optimizer"

sources() { # in the order of the rooms
  local room
  for room in $rooms; do
    if [ -d "$room" ]; then find "$room" \( -name '*.h' -o -name '*.cpp' \) -type f | LC_ALL=C sort; fi
  done
}

table() {
  # shellcheck disable=SC2046  # one word a file
  awk -v complete=" $complete " '
    function fault(line, text) { printf "%s:%d: %s\n", FILENAME, line, text >"/dev/stderr"; bad = 1 }
    function trim(text) { gsub(/^[ \t]+|[ \t]+$/, "", text); return text }
    function cell(text) { gsub(/\|/, "\\|", text); return text }
    # paths of pages become links
    function linked(text,   out, path) {
      while (match(text, /docs\/[a-z_\/]+\.md/)) {
        path = substr(text, RSTART + 5, RLENGTH - 5)
        out = out substr(text, 1, RSTART - 1) "[" path "](" path ")"
        text = substr(text, RSTART + RLENGTH)
      }
      return out text
    }
    # numbers of the present line that decide without a word on them
    function bare(   text, number, room) {
      room = FILENAME; sub(/\/.*/, "", room)
      if (index(complete, " " room " ") == 0 || spec != "") return
      if (code ~ /(^|[ \t])constexpr (unsigned|double|int|long|float|std::[a-z0-9_]+|Eigen::Index) k[A-Za-z0-9]+(\[[^\]]*\])? = *\{?-?[0-9]/ ||
          code ~ /(^|[ \t])constexpr (unsigned|double|int|long|float|std::[a-z0-9_]+|Eigen::Index) k[A-Za-z0-9]+ =[ \t]*$/)
        { if (!free) fault(FNR, "a constant that decides has no line @threshold (or \"no threshold: what it is\")"); return }
      if (free) { if (code !~ /constexpr / && code ~ /[;{}][ \t]*$/) free = 0; return }
      if (depth > 0 && name[depth] ~ /Options$/ && code ~ /^[ \t]*(unsigned|double|int|long|float|std::[a-z0-9_]+|Eigen::Index) [a-z_0-9]+ *(= *\{?-?[0-9]|=[ \t]*$)/ && code !~ /= *(0|0\.0|1\.0);/) {
        fault(FNR, "a field of options that decides has no line @threshold"); return
      }
      text = code
      while (match(text, /[ \t][<>]=? +-?[0-9][0-9.]*(e-?[0-9]+)?/)) {
        number = substr(text, RSTART, RLENGTH); text = substr(text, RSTART + RLENGTH)
        sub(/^[ \t][<>]=? +-?/, "", number)
        if (number !~ /^([0-4]|0\.0|0\.5|1\.0|2\.0)$/)
          fault(FNR, "the number " number " decides: let it be a field of options or a constant with a line @threshold")
      }
    }
    # the structs around the present line
    function around(   k, names) {
      for (k = 1; k <= depth; k++) if (name[k] != "") names = names name[k] "::"
      return names
    }
    function finish(   unit, range, kind, reason, rest, value, option, folder, names) {
      rest = trim(substr(spec, length("@threshold") + 1))
      if (!match(rest, /^\[[^\]]+\]/)) { fault(at, "@threshold without a unit in brackets"); return }
      unit = substr(rest, 2, RLENGTH - 2); rest = trim(substr(rest, RLENGTH + 1))
      if (!match(rest, /^[^; ]*\.\.[^; ]*;/)) { fault(at, "@threshold without a range LO..HI; after its unit"); return }
      range = substr(rest, 1, RLENGTH - 1); rest = trim(substr(rest, RLENGTH + 1))
      match(rest, /^[a-z]*/); kind = substr(rest, 1, RLENGTH)
      reason = substr(rest, RLENGTH + 1); sub(/^:/, "", reason); reason = trim(reason); sub(/\.$/, "", reason)
      if (!(kind in of_kind)) { fault(at, "\"" kind "\" is no kind of threshold: derived, cited, tuned, numerical, chosen"); return }
      if (reason == "") { fault(at, "@threshold without a reason"); return }
      if (trim(sentence) == "") { fault(at, "@threshold without a sentence above it that says what it decides"); return }
      sub(/;.*$/, "", field)
      if (match(field, /=|\{/)) {
        value = substr(field, RSTART); sub(/^=/, "", value); field = trim(substr(field, 1, RSTART - 1))
      }
      value = trim(value); gsub(/[ \t]+/, " ", value)
      if (value == "" || field !~ / / || field ~ /[()]/) { fault(at, "@threshold above something that is no field with a value"); return }
      if (value ~ /, [A-Za-z_0-9]+ = /) { fault(at, "@threshold above two fields: one line declares one field"); return }
      option = field; sub(/\[[^\]]*\]$/, "", option); sub(/^.*[ \t&*]/, "", option)
      folder = FILENAME; sub(/\/[^\/]*$/, "", folder)
      if (field ~ /constexpr /) { # a constant stands in a file, a field in a struct
        names = FILENAME; sub(/^.*\//, "", names); option = names " " option
      } else option = around() option
      if (!(folder in rows)) folders[++count] = folder
      rows[folder] = rows[folder] sprintf("| `%s` | %s | %s | %s | %s | %s | %s |\n", option, cell(value), cell(unit), cell(range), kind, linked(cell(trim(sentence))), linked(cell(reason)))
      of_kind[kind]++; all++
    }
    BEGIN {
      kinds = split("derived cited tuned numerical chosen", kind_at, " ")
      for (k = 1; k <= kinds; k++) of_kind[kind_at[k]] = 0
      means["derived"] = "from statistics or from the data"; means["cited"] = "by an author"; means["tuned"] = "on the data that the reason names"
      means["numerical"] = "guards rounding or ends an iteration"; means["chosen"] = "by engineering, without a study"
    }
    FNR == 1 { depth = 0; pending = ""; spec = ""; sentence = ""; field = ""; in_comment = 0; free = 0 }
    /\/\/.*no threshold: ./ { free = 1 }
    /^[ \t]*\/\/\/($|[^<])/ {
      if (spec != "" && !in_comment) { fault(at, "@threshold without a field below it"); spec = "" }
      if (!in_comment) { sentence = ""; spec = "" }
      in_comment = 1
      text = $0; sub(/^[ \t]*\/\/\//, "", text); text = trim(text)
      if (text ~ /^@threshold/) {
        if (spec != "") fault(FNR, "two lines @threshold above one field")
        spec = text; at = FNR
      } else if (spec != "") spec = spec " " text
      else sentence = sentence " " text
      next
    }
    {
      if (length($0) > 0 && /@threshold/) fault(FNR, "@threshold outside a comment of its own (///)")
      in_comment = 0
      code = $0
      gsub(/"([^"\\]|\\.)*"/, "\"\"", code); sub(/\/\/.*/, "", code)
      if (trim(code) != "") bare(); else if (trim($0) == "") free = 0
      if (spec != "") {
        field = field " " trim(code)
        if (field ~ /;/) { finish(); spec = ""; sentence = ""; field = "" }
        else if (trim(code) == "" || code ~ /^[ \t]*(struct|class|enum|namespace|using|[}])/) { fault(at, "@threshold without a field below it"); spec = ""; field = "" }
      }
      if (code !~ /enum/ && match(code, /(^|[ \t])(struct|class) +[A-Za-z_0-9:]+/)) {
        pending = substr(code, RSTART, RLENGTH); sub(/^.*[ \t]/, "", pending)
      }
      n = length(code)
      for (k = 1; k <= n; k++) {
        c = substr(code, k, 1)
        if (c == "{") { name[++depth] = pending; pending = "" }
        else if (c == "}") depth--
        else if (c == ";") pending = ""
      }
    }
    END {
      if (bad) exit 1
      print "# Thresholds\n"
      print "Every number that decides something (which effect is named, which data is bad, which branch holds, which candidate is kept, when a"
      print "search ends) is a field of an options struct or, where nobody should set it, a constant in its file, and what is said of it here stands"
      print "above it. `tests/architecture/thresholds.sh` makes this page from the sources, and `./run lint` says when it is older than they are. In"
      print "models/, planners/ and optimizer/ it also finds constants, fields of options and literals in comparisons without such words; literals"
      print "elsewhere in an expression (a clamp, a factor) it does not see.\n"
      print "| kind | the value comes | thresholds |\n|---|---|---|"
      for (k = 1; k <= kinds; k++) printf "| %s | %s | %d |\n", kind_at[k], means[kind_at[k]], of_kind[kind_at[k]]
      printf "| all | | %d |\n", all
      for (k = 1; k <= count; k++) {
        printf "\n## %s\n\n| option or constant | value | unit | range | kind | what it decides | reason |\n|---|---|---|---|---|---|---|\n", folders[k]
        printf "%s", rows[folders[k]]
      }
    }' $(sources)
}

text=$(table) || exit 1
if [ -z "$check" ]; then
  printf '%s\n' "$text" >"$page"
elif [ "$text" != "$(cat "$page" 2>/dev/null)" ]; then
  echo "$page is older than the thresholds in the sources: run tests/architecture/thresholds.sh" && exit 1
fi
