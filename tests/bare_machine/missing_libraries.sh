#!/bin/bash
# Configures the project where some of its libraries cannot be found, and looks whether CMake names each of them with
# the package to install instead of leaving it to the linker.   missing_libraries.sh CMAKE SOURCE_FOLDER
set -uo pipefail
cmake=$1 source=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

# name of the case, words that the message must have, then CMake's options
expect() {
  local name=$1 words=$2 word
  shift 2
  if "$cmake" -S "$source" -B "$scratch/$name" -G Ninja "$@" >"$scratch/$name.log" 2>&1; then
    echo "$name: CMake configured though a library is missing" >&2
    failed=1
  fi
  for word in $words; do
    if ! grep -qwF -e "$word" "$scratch/$name.log"; then
      echo "$name: CMake's message does not name $word:" >&2
      cat "$scratch/$name.log" >&2
      failed=1
    fi
  done
}

# fmt is a CMake package; spdlog's needs it. Both stand in one list.
expect package "libfmt-dev libspdlog-dev apt-get" -DCMAKE_DISABLE_FIND_PACKAGE_fmt=ON
# What Ipopt's pkg-config file asks for and its package does not bring: CMake is told not to look where it lies. There lie the
# libraries without a package file, too.
expect transitive "liblapack-dev libblas-dev Ipopt libsundials-dev liborocos-kdl-dev" -DCMAKE_IGNORE_PATH="/usr/lib/x86_64-linux-gnu;/lib/x86_64-linux-gnu;/usr/lib;/lib"
expect tests "libgtest-dev libgmock-dev" -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON
# A library that is there and does not link.
expect broken "matio libmatio-dev" -DMATIO_LIBRARY=/dev/null
exit $failed
