#!/bin/bash
# Plants thresholds without what they need in a small tree and looks whether thresholds.sh names them, and nothing else.
#   [SOURCE_FOLDER]
set -euo pipefail
source=$(cd "${1:-$(dirname "$(readlink -f "$0")")/../..}" && pwd)
check=$source/tests/architecture/thresholds.sh
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

plant() { # text of optimizer/planted.cpp, or of the file in the second argument
  rm -rf "$scratch/tree" && mkdir -p "$scratch/tree/docs" "$scratch/tree/optimizer" "$scratch/tree/simulator"
  printf '%s\n' "$1" >"$scratch/tree/${2:-optimizer/planted.cpp}"
}

expect() { # name of the case, sentence that must be printed
  local output
  if output=$("$check" "$scratch/tree" 2>&1); then
    echo "$1: the page was made" >&2 && failed=1
  elif ! grep -qF -e "$2" <<<"$output"; then
    printf '%s: expected "%s", got:\n%s\n' "$1" "$2" "$output" >&2 && failed=1
  fi
}

accept() { # name of the case, text that the page must contain
  local output
  if ! output=$("$check" "$scratch/tree" 2>&1); then
    printf '%s: was not accepted:\n%s\n' "$1" "$output" >&2 && failed=1
  elif ! grep -qF -e "$2" "$scratch/tree/docs/thresholds.md"; then
    printf '%s: the page lacks "%s"\n' "$1" "$2" >&2 && failed=1
  fi
}

constant='/// Boxes after which the search ends.
/// @threshold [boxes] 1..1e6; chosen: some seconds
constexpr long kMostBoxes = 400000;'

# numbers that decide without a word on them
plant 'constexpr long kMostBoxes = 400000;'
expect "bare constant" "optimizer/planted.cpp:1: a constant that decides has no line @threshold"
plant 'void f() {
  constexpr std::size_t kMost =
      60;
}'
expect "bare constant inside a function, broken" "optimizer/planted.cpp:2: a constant that decides"
plant 'constexpr double kShares[] = {0.1, 0.2};'
expect "bare list" "optimizer/planted.cpp:1: a constant that decides"
plant 'struct GridOptions {
  int nodes = 40000;
};'
expect "bare field of options" "optimizer/planted.cpp:2: a field of options that decides"
plant 'bool f(double x) { return x < 1e-9; }'
expect "bare number in a comparison" "optimizer/planted.cpp:1: the number 1e-9 decides"
plant 'void f() {
  for (int i = 0; i < 60; ++i) g();
}'
expect "bare number of iterations" "optimizer/planted.cpp:2: the number 60 decides"
plant '// no threshold: a unit
constexpr double kBar = 1e5;

constexpr double kBare = 2e5;'
expect "a reason covers its row only" "optimizer/planted.cpp:4: a constant that decides"

# lines of another form
plant "${constant/chosen/guessed}"
expect "unknown kind" '"guessed" is no kind of threshold'
plant "${constant/; chosen: some seconds/; some seconds}"
expect "no kind" '"some" is no kind of threshold'
plant "${constant/: some seconds/}"
expect "no reason" "@threshold without a reason"
plant "${constant/\[boxes\] /}"
expect "no unit" "@threshold without a unit"
plant "${constant/1..1e6; /}"
expect "no range" "@threshold without a range"
plant "${constant#*$'\n'}"
expect "no sentence" "@threshold without a sentence"
plant "${constant%$'\n'*}
void f();"
expect "no field" "@threshold above something that is no field"
plant "${constant/400000;/400000, kOther = 5;}"
expect "two constants" "@threshold above two fields"

# what is allowed
plant "$constant"
accept "constant" '| `planted.cpp kMostBoxes` | 400000 | boxes | 1..1e6 | chosen | Boxes after which the search ends. | some seconds |'
plant 'struct GridOptions {
  /// Number of nodes.
  /// @threshold [nodes] 1..1e6; derived: as many
  int nodes = 40000;
  bool fine = true;
  double weight = 0.0;
};'
accept "field" '| `GridOptions::nodes` | 40000 | nodes | 1..1e6 | derived | Number of nodes. | as many |'
plant '// no threshold: units
constexpr double kBar = 1e5;
constexpr double kDegree = 0.0174;
constexpr double kTwoBar = 2 * kBar;  // x < 1e-9
const char* kText = "x < 1e-9";
void f(double x) {
  for (int axis = 0; axis < 3; ++axis) g<12>(axis, 1u << 5);
  if (x > 0.0 && x < 0.5) h(1e-9);
}'
accept "units, structure, comments, texts and templates" '| all | | 0 |'
plant 'bool f(double x) { return x < 1e-9; }' simulator/planted.cpp
accept "a room that is not complete yet" '| all | | 0 |'

# the page
plant "$constant"
"$check" "$scratch/tree"
"$check" --check "$scratch/tree" || { echo "a page as made was refused" >&2 && failed=1; }
sed -i 's/400000/500000/' "$scratch/tree/optimizer/planted.cpp"
if "$check" --check "$scratch/tree" >"$scratch/output" 2>&1; then
  echo "a stale page was accepted" >&2 && failed=1
elif ! grep -qF "is older than the thresholds" "$scratch/output"; then
  echo "a stale page has another message: $(cat "$scratch/output")" >&2 && failed=1
fi

"$check" --check "$source" || { echo "the tree itself breaks the rule" >&2 && failed=1; }
exit $failed
