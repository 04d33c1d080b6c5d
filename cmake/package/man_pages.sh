#!/bin/sh
# Manual pages from the program's own help, by help2man: sparflow(1) and one page a verb, sparflow-VERB(1).
# man_pages.sh PROGRAM VERSION FOLDER
set -eu
program=$1 version=$2 out=$3
mkdir -p "$out"
for verb in "" $("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z]*\) .*/\1/p'); do
  scratch=$(mktemp -d)
  # help2man takes the name on the page from the file's name
  name=sparflow${verb:+-$verb}
  printf '#!/bin/sh\nif [ "$1" = --version ]; then echo "%s %s"; else exec "%s" %s "$@"; fi\n' \
    "$name" "$version" "$program" "$verb" >"$scratch/$name"
  chmod +x "$scratch/$name"
  what="hydraulic machines: models from logs, missing effects, energy-optimal motions"
  if [ -n "$verb" ]; then what=$("$program" "$verb" --help | head -n 1); fi
  {
    printf '[see also]\n'
    if [ -n "$verb" ]; then printf '.BR sparflow (1)\n'; else
      "$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z]*\) .*/.BR sparflow-\1 (1)/p'
    fi
    printf '.PP\nThe guides lie in /usr/share/doc/sparflow.\n'
  } >"$scratch/include"
  help2man --no-info --section 1 --manual "Sparflow" --source "sparflow $version" --name "$what" \
    --include "$scratch/include" "$scratch/$name" | gzip -9n >"$out/$name.1.gz"
  rm -r "$scratch"
done
