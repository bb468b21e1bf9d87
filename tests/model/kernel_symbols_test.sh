#!/bin/sh
# usage: kernel_symbols_test.sh LIBRARY
# A kernel for AVX2 or AVX-512 must not define symbols that the rest of the program may use. The linker keeps one of several
# definitions, and processors without these instructions could not run it.
shared=$(nm -A -C "$1" | grep 'lane_kernel_avx' | grep -E ' [WV] ' |
  grep -vE 'isa_avx|DW\.ref\.|_VecBltnBtmsk<64>|_VecBuiltin<32>')
[ -z "$shared" ] && exit 0
echo "these would be shared:" && echo "$shared" | cut -c 1-200 | head -n 20
exit 1
