#!/usr/bin/env bash
# Compares the programs, packages and tarball of two builds. The first is of this clone, which may reuse build/. The second
# is of a fresh clone, by another user.
set -euxo pipefail

# make_all UMASK: builds the programs, packages and tarball; prints their SHA-256.
make_all() {
  cd "$(dirname -- "${BASH_SOURCE[0]}")/../.."
  umask "$1"
  shopt -s nullglob
  local preset
  for preset in release static; do
    cmake --preset $preset -DLKEMU_TESTS=OFF -DLKEMU_BENCH=OFF >&2
    cmake --build --preset $preset >&2
    rm -f build/$preset/lk-emu[-_]*.{deb,tar.gz}
    (cd build/$preset && cpack >&2 && sha256sum emulator/lk-emu lk-emu[-_]*.{deb,tar.gz})
  done
}
if (($#)); then
  make_all "$@"
  exit
fi

scripts/packages build package
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
other=/var/tmp/a-directory-of-another-length/lk-emu
useradd builder
git clone -q . $other
chown -R builder $other
first=$(tests/bare/build_twice.sh 022)
second=$(runuser -u builder -- $other/tests/bare/build_twice.sh 077)
[[ $(wc -l <<<"$first") == 5 ]]
diff <(echo "$first") <(echo "$second")
printf 'identical in both builds:\n%s\n' "$first"
