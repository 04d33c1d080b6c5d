#!/bin/bash
# Plants functions that are too large in a small tree and looks whether function_size.sh names them, and nothing else.
#   [SOURCE_FOLDER]
set -euo pipefail
source=$(cd "${1:-$(dirname "$(readlink -f "$0")")/../..}" && pwd)
check=$source/tests/architecture/function_size.sh
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

fresh() {
  rm -rf "$scratch/tree" && mkdir -p "$scratch/tree/tests/architecture"
  (cd "$scratch/tree" && mkdir models identification diagnosis problems planners optimizer simulator apps bench studies examples)
}

expect() { # name of the case, sentence that must be printed
  local output
  if output=$("$check" "$scratch/tree" 2>&1); then
    echo "$1: the check ended with 0" >&2 && failed=1
  elif ! grep -qF -e "$2" <<<"$output"; then
    printf '%s: expected "%s", got:\n%s\n' "$1" "$2" "$output" >&2 && failed=1
  fi
}

accept() { # name of the case
  "$check" "$scratch/tree" || { echo "$1: was not accepted" >&2 && failed=1; }
}

plant() { # text of models/planted.h
  fresh
  printf '%s\n' "$1" >"$scratch/tree/models/planted.h"
}

lines() { # head, number of lines in the body
  echo "$1 {"
  for _ in $(seq $(($2 - 1))); do echo "  work();"; done
  echo "}"
}

plant 'double f(int a, const std::map<int, double>& b, int* c, double d, double e, bool g = false);'
expect "declaration" "models/planted.h:1: f has 6 parameters, more than 5"
plant 'int g(int a, std::function<void(int, int)> b, int c,
      int d, int e, int h) const {
  return a;
}'
expect "definition" "models/planted.h:1: g has 6 parameters"
plant 'struct S {
  S(int a, int b, int c, int d, int e, int h) : a_(a), b_{b} {}
};'
expect "constructor" "models/planted.h:2: S has 6 parameters"
plant 'const auto f = [&](int a, int b, int c, int d, int e, int h) { return a; };'
expect "lambda" "models/planted.h:1: lambda has 6 parameters"
plant 'virtual void f(int a, int b, int c, int d, int e, int h) const = 0;'
expect "pure virtual function" "models/planted.h:1: f has 6 parameters"
plant "$(lines 'int f(int a)' 81)"
expect "long function" "models/planted.h:1: f has 81 lines, more than 80"
plant "$(lines 'S::S(int a) : a_(a), b_{a}' 81)"
expect "long constructor" "models/planted.h:1: S::S has 81 lines"

plant 'double f(const std::map<int, double>& a, int b, std::function<void(int, int, int)> c, int d, int e);
// void in_a_comment(int a, int b, int c, int d, int e, int h);
const char* text = "void f(int a, int b, int c, int d, int e, int h);";
void g() {
  call(a, b * c, d < e, f->h(1, 2), {3, 4}, "six", x.y);
}'
accept "five parameters, a comment, a text and a call"
plant "$(lines 'int f(int a)' 80)"
accept "80 lines"
plant "// Over 80 lines because it is one table.
$(lines 'int f(int a)' 81)"
accept "a reason"

plant 'double f(int a, int b, int c, int d, int e, int h);'
echo 'parameters models/planted.h f' >"$scratch/tree/tests/architecture/function_size_left.txt"
accept "listed"
echo 'parameters models/planted.h gone' >>"$scratch/tree/tests/architecture/function_size_left.txt"
expect "listed and gone" '"parameters models/planted.h gone" is mended or gone: remove the line'

"$check" "$source" || { echo "the tree itself breaks the rule" >&2 && failed=1; }
exit $failed
