#!/bin/sh
# usage: analysis_absent_test.sh LK_EMU
# A program built without LKEMU_ANALYSIS refuses the command and says which option brings it.
message=$("$1" campaign --help 2>&1)
status=$?
[ "$status" = 2 ] && [ "$message" = "lk-emu: built without campaign: configure with -DLKEMU_ANALYSIS=ON" ] && exit 0
echo "status $status: $message"
exit 1
