#!/bin/bash
# The README's promise, tried as a new user would: a minimal Debian 12 (debootstrap, variant minbase), a clone of this
# checkout in it, and there `./run demo` and `./run test fast` with nothing else from outside. `./run bare` calls this.
#
#   check.sh [--keep] [--scratch FOLDER] [--mirror URL] [--as-is] [COMMAND]...
#
# COMMAND: what is run inside, "./run demo" and "./run test fast" unless given. --as-is takes uncommitted changes along
# (they are left out otherwise, with a warning). Needs root, for chroot and mounts; the mounts live in a namespace of
# this process and end with it. Ends with 0 when every command did, with 1 when one failed, with 2 on wrong usage.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "$0")")/../.." && pwd)
results=$root/build/bare

die() {
  printf 'bare: %s\n' "$*" >&2
  exit 2
}

keep=0 as_is=0 scratch_parent=${TMPDIR:-/var/tmp} mirror=http://deb.debian.org/debian commands=()
arguments=("$@")
while [ $# -gt 0 ]; do
  case $1 in
    --keep) keep=1 ;;
    --as-is) as_is=1 ;;
    --scratch) scratch_parent=${2:?--scratch needs a folder} && shift ;;
    --mirror) mirror=${2:?--mirror needs an address} && shift ;;
    -h | --help) sed -n '2,9{s/^# \{0,1\}//;p}' "$0" && exit 0 ;;
    -*) die "unknown option $1 (see --help)" ;;
    *) commands+=("$1") ;;
  esac
  shift
done
if [ ${#commands[@]} = 0 ]; then commands=("./run demo" "./run test fast"); fi

[ "$(id -u)" = 0 ] || die "a minimal root needs chroot and mounts: run it as root (sudo ./run bare)"
for tool in debootstrap unshare chroot git tar; do
  command -v $tool >/dev/null || die "$tool is not installed (./run bare installs what packages.txt lists for it)"
done
# Everything is mounted in a namespace of its own: what removes the folder afterwards cannot reach the machine's /dev.
if [ "${SPARFLOW_BARE_INSIDE-}" != 1 ]; then
  SPARFLOW_BARE_INSIDE=1 exec unshare --mount --propagation private "$0" "${arguments[@]}"
fi

scratch=$(mktemp -d "$scratch_parent/sparflow-bare-XXXXXX")
bare=$scratch/root
cleanup() {
  local point
  # deepest first; a lazy unmount also lets go of what a killed program still holds
  for point in dev/shm dev/pts proc; do umount -l "$bare/$point" 2>/dev/null || true; done
  if [ $keep = 1 ]; then echo "bare: the root is kept in $bare" >&2; else rm -rf --one-file-system "$scratch"; fi
}
trap cleanup EXIT
mkdir -p "$results"

echo "== minimal Debian 12 in $bare" >&2
started=$SECONDS
debootstrap --variant=minbase bookworm "$bare" "$mirror" >"$results/debootstrap.log" 2>&1 ||
  { tail -n 20 "$results/debootstrap.log" >&2 && die "debootstrap failed: $results/debootstrap.log"; }
cp /etc/resolv.conf "$bare/etc/resolv.conf"
mount -t proc proc "$bare/proc"
mkdir -p "$bare/dev/pts" "$bare/dev/shm"
mount -t devpts devpts "$bare/dev/pts" -o newinstance,ptmxmode=0666 2>/dev/null || true # apt's log of the terminal only
mount -t tmpfs tmpfs "$bare/dev/shm" 2>/dev/null || true
packages_before=$(chroot "$bare" dpkg-query -W -f='${Package}\n' | wc -l)
echo "== minimal Debian 12: $packages_before packages, $((SECONDS - started)) s" >&2

if [ $as_is = 1 ]; then
  mkdir "$bare/sparflow"
  (cd "$root" && git ls-files -z --cached --others --exclude-standard |
    tar --null --ignore-failed-read -T - -cf - 2>/dev/null) | tar -C "$bare/sparflow" -xf -
else
  if [ -n "$(git -C "$root" status --porcelain)" ]; then
    echo "bare: uncommitted changes are left out (--as-is takes them along)" >&2
  fi
  git clone -q --no-hardlinks "$root" "$bare/sparflow"
fi

status=0
{
  echo "machine   $(sed -n '/^model name[^:]*: /{s///p;q}' /proc/cpuinfo), $(nproc) cores"
  echo "system    Debian $(cat "$bare/etc/debian_version") minbase, $packages_before packages"
  echo "commit    $(git -C "$root" rev-parse --short=12 HEAD)$([ $as_is = 0 ] || echo ' + uncommitted changes')"
} | tee "$results/results.txt"
for number in "${!commands[@]}"; do
  command=${commands[$number]} log=$results/$((number + 1)).log outcome="ended with 0" started=$SECONDS
  echo "== in the minimal root: $command (log: $log)" >&2
  # an environment of nothing but what a login gives
  env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb \
    chroot "$bare" /bin/sh -c "cd /sparflow && exec $command" </dev/null >"$log" 2>&1 || { outcome="FAILED with $?" && status=1; }
  printf '%-16s %5d s  %s\n' "$command" $((SECONDS - started)) "$outcome" | tee -a "$results/results.txt"
  sed -n 's/^== \(.*: .*[0-9] s\)$/    \1/p' "$log" | tee -a "$results/results.txt"
  if [ $status != 0 ]; then tail -n 40 "$log" >&2 && break; fi
done
echo "bare: $results/results.txt" >&2
exit $status
