#!/bin/bash
# Kills runs of the verbs at random times and checks that no output is torn, lost or left in half.
#   tests/cli/kill_runs.sh [COUNT] [PROGRAM] [SEED] ["VERB..."]      exit code 1 where an output is broken
# An output is whole when it has the bytes from before, or those of a whole file: JSON that parses, a page that ends with
# </html>, a table whose last line ends. A temporary file is left only between naming and renaming; these are counted.
set -u
cd "$(dirname "$0")/../.."
count=${1:-300}
program=$(realpath "${2:-build/sparflow}")
RANDOM=${3:-1}
data=$PWD/problems
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
crane=$data/machines/loader_crane.yaml
log=$data/logs/loader_crane_test.csv
reach=$data/reaches/hmf_lift.yaml
model=$work/model.json
"$program" fit -m "$crane" -l "$log" -o "$model" >/dev/null 2>&1 || { echo "fit failed"; exit 1; }

motion=$work/motion.csv
"$program" plan -p "$reach" --paths 1 -o "$motion" >/dev/null 2>&1 || { echo "plan failed"; exit 1; }
read -r -a verbs <<<"${4:-fit compare diagnose selftest extend improve simulate machine plan optimize evaluate strategies pareto demo audit benchmark}"
arguments() {
  case $1 in
    fit) echo "fit -m $crane -l $log -o out.json --report out.html" ;;
    compare) echo "compare --model $model -l $log --json out.json --report out.html" ;;
    diagnose) echo "diagnose --model $model -l $log --json out.json --report out.html" ;;
    selftest) echo "selftest --model $model -l $log --json out.json --report out.html" ;;
    extend) echo "extend --model $model --add coulomb_friction:boom -l $log -o out.json --report out.html" ;;
    machine) echo "machine $crane --json out.json --report out.html" ;;
    evaluate) echo "evaluate $motion -p $reach -o out.csv --json out.json --report out.html" ;;
    audit) echo "audit $log --model $model --moves 2 --json out.json --report out.html" ;;
    benchmark) echo "benchmark $data/scenarios/tuning/tuning_loader_crane_01.yaml --controllers joint_pi --no-optimum --no-bound --csv out.csv --json out.json --report out.html" ;;
    demo) echo "demo --out demo" ;;
    improve) echo "improve --model $model -l $log -o out.json --report out.html" ;;
    simulate) echo "simulate -m $crane --seconds 5 -o out.csv --json out.json" ;;
    plan) echo "plan -p $reach -o out.csv --json out.json" ;;
    optimize) echo "optimize -p $reach -o out.csv --json out.json --report out.html" ;;
    strategies) echo "strategies -p $reach --orders 0 --paths 2 --intervals 40 --json out.json --report out.html" ;;
    pareto) echo "pareto -p $reach --points 4 --paths 2 --intervals 40 -o out.csv --json out.json --report out.html" ;;
  esac
}
whole() {  # FILE
  [ -e "$1" ] || return 1
  [ "$(head -c 6 "$1")" = before ] && { [ "$(stat -c %s "$1")" = 7 ]; return; }
  case $1 in
    *.json) python3 -m json.tool "$1" >/dev/null 2>&1 ;;
    *.html) tail -c 20 "$1" | grep -q '</html>' ;;
    *) [ -z "$(tail -c 1 "$1")" ] ;;
  esac
}
# Kills fall into the time that an undisturbed run of the verb takes, at most this one.
most=2500  # [ms]
declare -A takes
for verb in "${verbs[@]}"; do
  folder=$work/run
  rm -rf "$folder" && mkdir "$folder" && cd "$folder" || exit 1
  begin=$(date +%s%N)
  # shellcheck disable=SC2046
  timeout --foreground -s KILL "$most"e-3 nice "$program" $(arguments "$verb") >stdout 2>stderr
  takes[$verb]=$((($(date +%s%N) - begin) / 1000000 + 30))
done
declare -A killed ended replaced
broken=0 left=0 journals=0
for ((i = 0; i < count; ++i)); do
  verb=${verbs[i % ${#verbs[@]}]}
  signal=(KILL TERM INT)
  signal=${signal[(i / ${#verbs[@]}) % 3]}
  folder=$work/run
  rm -rf "$folder" && mkdir "$folder" && cd "$folder" || exit 1
  args=$(arguments "$verb")
  for file in json html csv; do [[ $args == *out.$file* ]] && echo before >out.$file; done
  # In the foreground, because children of a script in the background ignore SIGINT.
  # shellcheck disable=SC2086
  timeout --foreground -s "$signal" -k 20 "$((RANDOM % takes[$verb] + 5))e-3" nice "$program" $args >stdout 2>stderr
  code=$?
  [ $code = 124 ] || [ $code = 137 ] && killed[$signal]=$((${killed[$signal]:-0} + 1)) || ended[$verb]=$((${ended[$verb]:-0} + 1))
  for file in json html csv; do
    [[ $args == *out.$file* ]] || continue
    whole "out.$file" || { echo "BROKEN: $verb $signal out.$file (run $i, code $code)"; broken=$((broken + 1)); }
    cmp -s "out.$file" <(echo before) || replaced[$verb]=$((${replaced[$verb]:-0} + 1))
  done
  while IFS= read -r file; do
    whole "$file" || { echo "BROKEN: $verb $signal $file (run $i, code $code)"; broken=$((broken + 1)); }
  done < <(find demo -type f \( -name '*.json' -o -name '*.html' -o -name '*.csv' \) 2>/dev/null)
  # Of a journal all lines but the last are whole; --resume leaves out a torn last one with a warning.
  while IFS= read -r file; do
    journals=$((journals + 1))
    head -n -1 "$file" | python3 -c 'import json, sys; [json.loads(line) for line in sys.stdin]' 2>/dev/null ||
      { echo "BROKEN: $verb $signal $file (run $i, code $code)"; broken=$((broken + 1)); }
  done < <(find . -name '*.journal')
  remains=$(find . -name '.sparflow-*' | wc -l)
  left=$((left + remains))
done
echo "runs $count: killed by KILL ${killed[KILL]:-0}, TERM ${killed[TERM]:-0}, INT ${killed[INT]:-0}"
for verb in "${verbs[@]}"; do echo "  $verb: ended before ${ended[$verb]:-0}, outputs replaced ${replaced[$verb]:-0}"; done
echo "broken outputs $broken, temporary files left $left, journals left for --resume $journals"
[ "$broken" = 0 ]
