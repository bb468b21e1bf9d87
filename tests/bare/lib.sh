# shellcheck shell=bash
# Sourced by the steps.
set -euo pipefail

# root RELEASE [OPTION...] COMMAND...: runs the command in a new root, with the build/ kept for this release. CMake searches
# for dependencies again; compiled files are kept.
root() {
  local release=$1
  shift
  mkdir -p "$BARE_BUILDS/$release"
  rm -rf "$BARE_BUILDS/$release"/*/CMakeCache.txt "$BARE_BUILDS/$release"/*/CMakeFiles/[0-9]*
  "$BARE/root" --release "$release" --build "$BARE_BUILDS/$release" "$@"
}

# make_deb RELEASE: makes the Debian packages in build/release, as in docs/start/install.md.
make_deb() {
  root "$1" bash -exc '
    scripts/packages build package
    cmake --preset release -DLKEMU_TESTS=OFF -DLKEMU_BENCH=OFF
    cmake --build --preset release
    cd build/release
    cpack'
}

# install_deb RELEASE: installs the packages on a bare machine.
install_deb() {
  local debs=("$BARE_BUILDS/$1"/release/lk-emu_*.deb)
  "$BARE/root" --release "$1" --file "${debs[0]}" tests/bare/use_deb.sh
}

# `run_campaign ENGINE PACKAGES WRAPPER FILE`: runs tests/engines/plan.toml, with more cases, by an engine from these
# packages. The programs and the engine's FILE come from the Debian package.
run_campaign() {
  make_deb bookworm
  local debs=("$BARE_BUILDS"/bookworm/release/lk-emu_*.deb)
  "$BARE/root" --file "${debs[0]}" bash -exc "
    apt-get -q update
    DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends install ../lk-emu_*.deb python3-jinja2 python3-regex python3-scipy $2
    sed 's/^cases = .*/cases = 8000/' tests/engines/plan.toml >../plan.toml
    $3 tests/bare/use_$1.sh /usr/bin/lk-emu /usr/share/lk-emu/engines/$4 ../plan.toml"
}
