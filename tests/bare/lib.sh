# shellcheck shell=bash
# Sourced by the steps.
set -euo pipefail

# root RELEASE [OPTION...] COMMAND...: in a new root with the build/ that its release keeps. What was found on an earlier
# machine is looked for again; what was compiled stays.
root() {
  local release=$1
  shift
  mkdir -p "$BARE_BUILDS/$release"
  rm -rf "$BARE_BUILDS/$release"/*/CMakeCache.txt "$BARE_BUILDS/$release"/*/CMakeFiles/[0-9]*
  "$BARE/root" --release "$release" --build "$BARE_BUILDS/$release" "$@"
}

# make_deb RELEASE: into build/release, as docs/packages.md has it.
make_deb() {
  root "$1" bash -exc '
    scripts/packages build package
    cmake --preset release -DLKEMU_TESTS=OFF -DLKEMU_BENCH=OFF
    cmake --build --preset release
    cd build/release
    cpack'
}

# install_deb RELEASE: where there is nothing else.
install_deb() {
  local debs=("$BARE_BUILDS/$1"/release/lk-emu_*.deb)
  "$BARE/root" --release "$1" --file "${debs[0]}" tests/bare/use_deb.sh
}
