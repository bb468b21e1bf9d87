#!/bin/sh
# usage: analysis_absent_test.sh LK_EMU
# A program built without LKEMU_ANALYSIS refuses both commands and says which option brings them.
for word in campaign identify; do
  message=$("$1" "$word" --help 2>&1)
  status=$?
  [ "$status" = 2 ] && [ "$message" = "lk-emu: built without campaign and identify: configure with -DLKEMU_ANALYSIS=ON" ] && continue
  echo "$word: status $status: $message"
  exit 1
done
