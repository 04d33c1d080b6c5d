#!/bin/bash
# A Debian package tried as a new user would: a minimal Debian 12 (debootstrap, variant minbase), `apt install` of the
# package, and in it the smoke test below. `./run package` calls this.
#
#   package_check.sh PACKAGE.deb [--without-development] [--scratch FOLDER] [--mirror URL]
#
# Needs root, for chroot and mounts, as check.sh does. --without-development leaves out the foreign C++ project, for which
# the development packages that the package suggests are installed. Ends with 0 when every step did.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "$0")")/../.." && pwd)
results=$root/build/package

die() {
  printf 'package: %s\n' "$*" >&2
  exit 2
}

package= development=1 scratch_parent=${TMPDIR:-/var/tmp} mirror=http://deb.debian.org/debian
arguments=("$@")
while [ $# -gt 0 ]; do
  case $1 in
    --without-development) development=0 ;;
    --scratch) scratch_parent=${2:?--scratch needs a folder} && shift ;;
    --mirror) mirror=${2:?--mirror needs an address} && shift ;;
    -*) die "unknown option $1" ;;
    *) package=$1 ;;
  esac
  shift
done
[ -f "$package" ] || die "there is no package '$package'"
[ "$(id -u)" = 0 ] || die "a clean root needs chroot and mounts: run it as root (sudo ./run package)"
if [ "${SPARFLOW_BARE_INSIDE-}" != 1 ]; then
  SPARFLOW_BARE_INSIDE=1 exec unshare --mount --propagation private "$0" "${arguments[@]}"
fi

scratch=$(mktemp -d "$scratch_parent/sparflow-package-XXXXXX")
bare=$scratch/root
cleanup() {
  umount -l "$bare/proc" 2>/dev/null || true
  rm -rf --one-file-system "$scratch"
}
trap cleanup EXIT
mkdir -p "$results"

echo "== minimal Debian 12 in $bare" >&2
debootstrap --variant=minbase bookworm "$bare" "$mirror" >"$results/debootstrap.log" 2>&1 ||
  { tail -n 20 "$results/debootstrap.log" >&2 && die "debootstrap failed: $results/debootstrap.log"; }
cp /etc/resolv.conf "$bare/etc/resolv.conf"
mount -t proc proc "$bare/proc"
mkdir -p "$bare/try"
cp "$package" "$bare/try/sparflow.deb"
cp -r "$root/tests/install" "$bare/try/user"
inside() { # command, an environment of nothing but what a login gives
  env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb DEBIAN_FRONTEND=noninteractive \
    chroot "$bare" /bin/bash -ec "cd /try && $1" </dev/null
}

failed=0
try() { # title, command
  local started=$SECONDS
  if inside "$2" >"$results/step.log" 2>&1; then
    printf '%-46s %4d s  ok\n' "$1" $((SECONDS - started))
  else
    printf '%-46s %4d s  FAILED\n' "$1" $((SECONDS - started))
    tail -n 30 "$results/step.log" >&2
    failed=1
  fi
}

try "apt install ./sparflow.deb" "apt-get -q update && apt-get -q install -y --no-install-recommends ./sparflow.deb"
[ $failed = 0 ] || exit 1
data=/usr/share/sparflow
try "sparflow --version, every verb's help" \
  "sparflow --version && for v in \$(sparflow --help | sed -n '/^Subcommands:/,/^\$/s/^  \([a-z]*\) .*/\1/p'); do sparflow \$v --help >/dev/null; done"
try "fit, compare, diagnose on the bundled logs" \
  "sparflow fit -m $data/machines/loader_crane.yaml --log $data/logs/loader_crane_train.csv -o crane.json &&
   sparflow compare --model crane.json --log $data/logs/loader_crane_train.csv --report compare.html && test -s compare.html &&
   sparflow diagnose --model crane.json --log $data/logs/loader_crane_train.csv"
try "optimize" "sparflow optimize -p $data/reaches/loader_crane_lift.yaml --model crane.json --paths 1 --seconds 1 -o motion.csv && test -s motion.csv"
try "import sparflow in Python" \
  "python3 -c 'import sparflow; m = sparflow.Machine.load(\"$data/machines/loader_crane.yaml\"); print(m); help(sparflow.fit)'"
try "completion and manual pages are in place" \
  "bash -n /usr/share/bash-completion/completions/sparflow && test -s /usr/share/zsh/vendor-completions/_sparflow &&
   test -s /usr/share/fish/vendor_completions.d/sparflow.fish && zcat /usr/share/man/man1/sparflow-optimize.1.gz | grep -q paths &&
   zcat /usr/share/man/man1/sparflow.1.gz | grep -q sparflow-optimize"
try "licences are in place" "grep -q 'Leon Sorokin' /usr/share/doc/sparflow/copyright"
if [ $development = 1 ]; then
  suggested=$(dpkg-deb -f "$package" Suggests | tr ',' '\n' | sed 's/^ *//' | grep -v python3 | tr '\n' ' ')
  try "a C++ project by find_package(sparflow)" \
    "apt-get -q install -y --no-install-recommends $suggested make && cmake -S user -B built && cmake --build built -j2 &&
     ctest --test-dir built --output-on-failure --no-tests=error"
fi
try "apt remove leaves nothing" "apt-get -q remove -y sparflow && ! ls /usr/bin/sparflow /usr/share/sparflow /usr/lib/python3/dist-packages/sparflow 2>/dev/null"
exit $failed
