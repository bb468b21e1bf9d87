#!/usr/bin/env bash
# Types the commands of README's first sections. Runs in a clone on a bare machine.
set -euo pipefail

# block SECTION NUMBER [LANGUAGE]: prints a code block of a section of the README; default language: sh.
block() {
  awk -v section="## $1" -v number="$2" -v fence="\`\`\`${3:-sh}" '
    /^## / { inside = $0 == section }
    inside && $0 == fence { ++count; taking = count == number; next }
    /^```$/ { taking = 0 }
    taking { print; found = 1 }
    END { exit !found }' README.md || {
    echo "bare: README has no block $2 in \"$1\"" >&2
    return 1
  }
}

# Prints the number of sockets that receive frames of vcan0.
count_listeners() { cat /proc/net/can/rcvlist_* | grep -c vcan0; }

# Runs the conversation on a CAN interface. Deletes vcan0 first, because the README creates it. Pre: CAN in the kernel.
talk() {
  local start conversation expected listeners line frame lines=0 frames=()
  ip link del vcan0
  bash -exc "$(block 'Install and run' 2)"
  eval "$(block 'Install and run' 1 | grep '^export ')" # the same terminal
  start=$(block 'Install and run' 3)
  exec 3< <(eval "exec $start")
  read -r line <&3
  [[ $line == "lk-emu ready vcan0:1-4" ]] || { echo "bare: unexpected ready line: $line" >&2 && return 1; }
  conversation=$(block 'A first conversation' 1)
  expected=$(grep -c '^cansend' <<<"$conversation")
  # shellcheck disable=SC2034 # the trap reads it
  listeners=$(count_listeners)
  # Waits until candump has started, as a person does.
  exec 4< <(
    trap '[[ $BASH_COMMAND != cansend* ]] || until (($(count_listeners) > listeners)); do sleep 0.1; done' DEBUG
    eval "$conversation"
  )
  # Each query must have a reply with its interface, identifier, length and command byte.
  for ((; lines < 2 * expected; ++lines)); do
    read -t 30 -r frame <&4 || { echo "bare: time-out after $lines frames" >&2 && return 1; }
    echo "$frame"
    frames+=("$(awk '{ print $1, $2, $3, $4 }' <<<"$frame")")
  done
  [[ -z $(printf '%s\n' "${frames[@]}" | sort | uniq -c | awk '$1 != 2') ]] ||
    { echo "bare: a query without its reply" >&2 && return 1; }
}

# Runs the conversation on a machine without vcan.
talk_without_vcan() {
  local start answer
  # shellcheck disable=SC2016 # README's backquotes
  start=$(grep -o '`lk-emu --bus slcan-tcp:[^`]*`' README.md | tr -d '`')
  exec 5< <(eval "exec $start")
  read -r line <&5
  [[ $line == "lk-emu ready slcan-tcp:29536:1-4" ]] || { echo "bare: unexpected ready line: $line" >&2 && return 1; }
  answer=$(/usr/bin/python3 -c "$(block 'A first conversation' 1 python)")
  echo "$answer"
  [[ $answer == *'ID: 0141 '*'DL:  8    9a '* ]] || { echo "bare: not a reply to the query: $answer" >&2 && return 1; }
}

if [[ ${1:-} == --talk ]]; then
  talk
  talk_without_vcan
else
  ! block 'Install and run' 1 | grep -w sudo || { echo "bare: commands of README for root use sudo" >&2 && exit 1; }
  bash -exc "$(block 'Install and run' 1)"
  scripts/with-vcan --timeout 120 bash tests/bare/follow_readme.sh --talk
fi
