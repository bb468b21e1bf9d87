#!/usr/bin/env bash
# usage: tests/elsewhere/twice_test.sh TRACES FOLDER
# Checks that two runs of the program TRACES give equal results. Their files stay in FOLDER.
set -euo pipefail

for run in first second; do
  "$1" "$2/traces_of_$run.txt"
done
[[ -s $2/traces_of_first.txt ]] || { echo "elsewhere: no traces were written" >&2 && exit 1; }
diff "$2/traces_of_first.txt" "$2/traces_of_second.txt" >&2 || { echo "elsewhere: two runs differ" >&2 && exit 1; }
