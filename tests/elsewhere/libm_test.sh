#!/bin/sh
# usage: libm_test.sh LIBRARY...
# The libraries must not call libm, whose rounding differs between systems.
libm=$(${CXX:-g++} -print-file-name=libm.so.6)
names=$(mktemp)
trap 'rm -f "$names"' EXIT
nm -D --defined-only "$libm" | sed -n 's/.* [TWi] \([a-z][a-z0-9_]*\)@.*/\1/p' >"$names"
grep -qx llround "$names" || { echo "no libm in $libm" && exit 1; }
called=$(for library in "$@"; do nm -A -u "$library"; done | sed 's/.*:\(.*\.o\): *U /\1 /' |
  awk 'NR == FNR { libm[$1] = 1; next } $2 in libm' "$names" -)
[ $# -gt 0 ] && [ -z "$called" ] && exit 0
echo "called of libm:" && echo "$called"
exit 1
