# shellcheck shell=bash
# Installs missing packages of packages.txt from the distribution.
# Sourced by scripts/packages, scripts/demo and scripts/test.

packages_list=$(dirname -- "${BASH_SOURCE[0]}")/packages.txt

# Prints the packages of one group, one a line.
packages_in() { awk -v group="$1" '$1 == group { print $2 }' "$packages_list"; }

# Prints the given packages that are not installed, one a line.
packages_missing() {
  local name
  for name in "$@"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null) == installed ]] || echo "$name"
  done
}

packages_fail() {
  echo "packages: $1" >&2
  return 1
}

# Runs one command as root; asks for the password only when needed.
packages_as_root() {
  if ((EUID == 0)); then
    "$@"
  else
    sudo -- "$@"
  fi
}

# Installs the given packages that are missing. Prints nothing if there are none; prints apt-get's output only on failure.
packages_install() {
  local missing log
  mapfile -t missing < <(packages_missing "$@")
  ((${#missing[@]})) || return 0
  command -v apt-get >/dev/null ||
    packages_fail "apt-get is missing; install by other means: ${missing[*]}" || return
  if ((EUID != 0)) && ! command -v sudo >/dev/null; then
    packages_fail "sudo is missing; run scripts/packages as root to install: ${missing[*]}"
    return
  fi
  echo "packages: installing ${missing[*]}" >&2
  log=$(mktemp)
  if packages_as_root sh -c 'apt-get -q update && DEBIAN_FRONTEND=noninteractive exec apt-get -q -y \
      -o DPkg::Lock::Timeout=600 --no-install-recommends install "$@"' sh "${missing[@]}" \
    >"$log" 2>&1 </dev/null; then
    rm -f "$log"
  else
    tail -n 20 "$log" >&2
    rm -f "$log"
    packages_fail "installation failed: ${missing[*]}"
  fi
}

packages_exists() { apt-cache show "$1" >/dev/null 2>&1; }

# Provides a CAN bus: the running kernel's, else user-mode Linux, else (Ubuntu, which lacks that package) the kernel's extra
# modules.
packages_install_bus() {
  local with_vcan extra
  with_vcan=$(dirname -- "${BASH_SOURCE[0]}")/../with-vcan
  [[ -z $(packages_missing user-mode-linux) ]] && return
  WITH_VCAN=kernel "$with_vcan" true >/dev/null 2>&1 </dev/null && return
  if packages_exists user-mode-linux; then
    packages_install user-mode-linux
    return
  fi
  extra=linux-modules-extra-$(uname -r)
  if packages_exists "$extra"; then
    packages_install "$extra" && packages_as_root modprobe -a can-raw vcan vxcan && return
  fi
  echo "packages: no vcan in this kernel or in a package; tests of a CAN bus will be skipped" >&2
}

# Browser for the dashboard tests. Ubuntu has no such package; the tests are skipped there and report it.
packages_install_browser() {
  if [[ -z $(packages_missing chromium) ]] || packages_exists chromium-driver; then
    packages_install chromium chromium-driver python3-selenium python3-pil
  fi
}

# Simulator of robot bodies. Ubuntu has no such package; lk-emu-body and its tests are left out there.
packages_install_body() {
  local names
  mapfile -t names < <(packages_in body)
  if [[ -z $(packages_missing "${names[@]}") ]] || packages_exists "${names[0]}"; then
    packages_install "${names[@]}"
  fi
}

# packages_setup GROUP...: installs the groups of packages.txt.
packages_setup() {
  local group names=()
  for group in "$@"; do
    [[ -n $(packages_in "$group") ]] ||
      packages_fail "unknown group \"$group\"; known: $(awk '/^[a-z]/ { print $1 }' "$packages_list" | uniq | xargs)" || return
    [[ $group == body ]] || mapfile -t -O "${#names[@]}" names < <(packages_in "$group")
  done
  packages_install "${names[@]}" || return
  for group in "$@"; do
    case $group in
    run) packages_install_bus || return ;;
    release) packages_install_browser || return ;;
    body) packages_install_body || return ;;
    esac
  done
}
