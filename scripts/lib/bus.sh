# shellcheck shell=bash
# Sourced by scripts/demo.

# may_use_bus ROOT COMMAND...: runs a command that calls with-vcan. Uses sudo only if needed: without user-mode Linux
# (Ubuntu has none) and if only root may use the kernel's vcan.
may_use_bus() {
  local status=0 root=$1
  shift
  "$root/scripts/with-vcan" true </dev/null 2>/dev/null || status=$?
  if ((status == 125 && EUID != 0)) && command -v sudo >/dev/null; then
    echo "the CAN interfaces of this kernel need root: continuing with sudo" >&2
    sudo -E env "PATH=$PATH" "$@" </dev/null
  else
    "$@" </dev/null
  fi
}
