#!/bin/bash
# Breaks each rule of the tree once, in a copy, and looks whether check_includes.sh says so and why.   [SOURCE_FOLDER]
set -euo pipefail
source=$(cd "${1:-$(dirname "$(readlink -f "$0")")/../..}" && pwd)
check=$source/tests/architecture/check_includes.sh
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

fresh() {
  rm -rf "$scratch/tree" && mkdir -p "$scratch/tree/docs"
  cp "$source/docs/arrows.txt" "$scratch/tree/docs/"
  (cd "$source" && cp -r models identification diagnosis problems planners optimizer simulator apps bench studies examples "$scratch/tree/")
}

expect() { # name of the case, sentence that must be printed; the tree is broken already
  local output
  if output=$("$check" "$scratch/tree" 2>&1); then
    echo "$1: the check ended with 0" >&2 && failed=1
  elif ! grep -qF -e "$2" <<<"$output"; then
    printf '%s: expected "%s", got:\n%s\n' "$1" "$2" "$output" >&2 && failed=1
  fi
}

fresh
"$check" "$scratch/tree" || { echo "the tree itself breaks a rule" >&2 && failed=1; }

include() { # file, header: as its first line
  fresh
  sed -i "1i #include $2" "$scratch/tree/$1"
}
include optimizer/solve/optimize.cpp '"planners/seed_paths.h"'
expect "room that is not allowed" 'optimizer/solve/optimize.cpp:1: includes "planners/seed_paths.h", but optimizer/solve may include only'
include models/chain/crane_model.h '"identification/log/log.h"'
expect "upwards" 'models/chain/crane_model.h:1: includes "identification/log/log.h", but models/chain may include only'
include simulator/hidden_effects/plant.cpp '"models/chain/crane_model.h"'
expect "opponent that shares a law" "it is the model's opponent"
include models/effects/registry.cpp '"models/effects/formula/law.h"'
expect "folder of the same room" 'models/effects may include only'
include diagnosis/verdict/diagnose.cpp '"identification/log/log_number.h"'
expect "internal header" 'which is internal to identification'
include models/chain/crane_model.h '"models/effects/builtin.h"'
expect "public header that needs an internal one" 'is a public header and includes "models/effects/builtin.h"'
include optimizer/solve/optimize.cpp '<IpTNLP.hpp>'
expect "library outside its folder" 'includes <IpTNLP.hpp>, which only optimizer/nlp may (Ipopt stays exchangeable)'
include apps/cli/main.cpp '<ompl/util/Console.h>'
expect "library in the command line" 'which only planners may'

fresh && sed -i 's/^models\/math: */models\/math: models\/chain /' "$scratch/tree/docs/arrows.txt"
expect "cycle in the table" 'arrows must not close a cycle'
fresh && for i in $(seq 26); do touch "$scratch/tree/models/yaml/extra_$i.cpp"; done
expect "crowded folder" 'models/yaml: holds 30 sources and headers'
fresh && rm "$scratch/tree/models/yaml/README.md"
expect "folder without a README" 'models/yaml: has no README.md'
fresh && sed -i 's/^chain\/crane_model.h$/chain\/gone.h/; s,^models/chain/crane_model.h$,models/chain/gone.h,' "$scratch/tree/models/public_headers.txt"
expect "list that names a header that is gone" 'there is no models/chain/gone.h'
exit $failed
