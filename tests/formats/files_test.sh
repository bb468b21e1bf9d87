#!/usr/bin/env bash
# The generated files in configs/ are those that the generator writes.
# usage: files_test.sh GENERATOR SOURCE_DIRECTORY SCRATCH
set -euo pipefail
generator=$1 source=$2 scratch=$3

rm -rf "$scratch"
mkdir -p "$scratch"
"$generator" "$source/emulator/formats/dissector.lua" "$scratch"
status=0
while IFS= read -r file; do
  diff -q "$scratch/$file" "$source/configs/$file" || status=1
done < <(cd "$scratch" && find . -type f)
# And none that it writes no more.
while IFS= read -r file; do
  [[ -e $scratch/$file ]] || {
    echo "nothing writes configs/$file"
    status=1
  }
done < <(cd "$source/configs" && find . -name '*.dbc' -o -name '*.lua')
((status == 0)) || echo "files_test: write them anew: cmake --build build/release --target formats" >&2
exit $status
