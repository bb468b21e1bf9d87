# shellcheck shell=bash
# Sourced by scripts/demo and scripts/test: how to call with-vcan on this machine.

# Sets the array `with_vcan`. Without user-mode Linux (Ubuntu has none) the running kernel's vcan may
# be root's alone: then, and only then, sudo is asked.
find_bus() {
  local status=0 script=$1/scripts/with-vcan
  with_vcan=("$script")
  "${with_vcan[@]}" true </dev/null 2>/dev/null || status=$?
  if ((status == 125 && EUID != 0)) && command -v sudo >/dev/null; then
    echo "the CAN interfaces of this kernel need root: calling with-vcan through sudo" >&2
    with_vcan=(sudo -E env "PATH=$PATH" "$script")
  fi
}
