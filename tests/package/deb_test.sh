#!/usr/bin/env bash
# Makes the Debian packages, checks their contents, installs them into a private root, upgrades and purges them.
# usage: deb_test.sh BUILD_DIRECTORY SCRATCH
set -euo pipefail
build=$1 scratch=$2
root=$scratch/root

fail() {
  echo "deb_test: $1" >&2
  exit 1
}

# quietly COMMAND...: shows the output only on failure.
quietly() {
  "$@" >"$scratch/log" 2>&1 || {
    cat "$scratch/log" >&2
    fail "failed: $*"
  }
}

rm -rf "$scratch"
mkdir -p "$scratch"
umask 077 # a strict umask must not affect the packages
quietly cpack --config "$build/CPackConfig.cmake" -B "$scratch"
umask 022
shopt -s nullglob
debs=("$scratch"/lk-emu_*.deb "$scratch"/lk-emu-dev_*.deb)
((${#debs[@]} == 2)) || fail "packages: ${debs[*]}"
deb=${debs[0]} dev=${debs[1]}
bodies=("$scratch"/lk-emu-body_*.deb) # only with MuJoCo

# Control fields.
for field in Depends Maintainer Section Description Installed-Size; do
  [[ -n $(dpkg-deb -f "$deb" "$field") ]] || fail "no $field"
done
[[ $(dpkg-deb -f "$deb" Depends) == *libc6*libstdc++6* ]] || fail "depends on: $(dpkg-deb -f "$deb" Depends)"
[[ $(dpkg-deb -f "$deb" Depends) != *asan* ]] || fail "depends on a sanitizer"
for library in jinja2 matplotlib numpy regex scipy; do
  [[ $(dpkg-deb -f "$deb" Recommends) == *python3-$library* ]] || fail "does not recommend python3-$library"
done
[[ $(dpkg-deb -f "$deb" Architecture) == "$(dpkg --print-architecture)" ]] || fail "architecture"

# Contents, readable by all users.
dpkg-deb -c "$deb" >"$scratch/files"
for file in usr/bin/lk-emu usr/lib/systemd/system/lk-emu@.service usr/share/man/man1/lk-emu.1.gz \
  usr/share/bash-completion/completions/lk-emu usr/share/zsh/vendor-completions/_lk-emu \
  usr/share/fish/vendor_completions.d/lk-emu.fish usr/share/lk-emu/motors/mf7015.toml \
  usr/share/lk-emu/buses/bench.toml usr/share/lk-emu/python/lkemu/__init__.py \
  usr/share/lk-emu/python/lkemu/campaign/templates/page.html.j2 usr/share/lk-emu/python/lkemu/style.css \
  usr/share/lk-emu/engines/slurm.sbatch usr/share/lk-emu/lk-motor.dbc usr/share/lk-emu/lk-motor-queries.dbc \
  usr/share/doc/lk-emu/copyright usr/share/doc/lk-emu/changelog.gz usr/share/doc/lk-emu/docs/start/install.md \
  usr/share/doc/lk-emu/lk-emu.spdx.json usr/share/doc/lk-emu/licenses/uPlot usr/share/doc/lk-emu/licenses/three.js usr/share/doc/lk-emu/licenses/Boost; do
  grep -q " \./$file\$" "$scratch/files" || fail "$file is not in the package"
done
! grep -v ' \./usr/\| \./$' "$scratch/files" || fail "these are outside /usr"
! grep -v 'root/root' "$scratch/files" || fail "these do not belong to root"
! grep -v '^-rw-r--r--\|^-rwxr-xr-x\|^drwxr-xr-x\|^lrwxrwxrwx' "$scratch/files" || fail "odd permissions"
! grep '\.hpp$\|\.a$\|__pycache__\|\.log$' "$scratch/files" || fail "these are in the wrong package"
dpkg-deb -c "$dev" >"$scratch/files"
grep -q 'usr/include/lk/emulator/core/bus/bus.hpp$' "$scratch/files" || fail "no headers"
grep -q 'liblk_core\.a$' "$scratch/files" || fail "no library"
grep -q 'usr/share/lk-emu/examples/robot/CMakeLists.txt$' "$scratch/files" || fail "no example"
grep -q 'usr/share/doc/lk-emu-dev/lk-emu-dev.spdx.json$' "$scratch/files" || fail "no list of what is inside"

# Installed by dpkg with a private database. The dependencies are on this machine, since the program runs here.
mkdir -p "$root/var/lib/dpkg/info" "$root/var/lib/dpkg/updates"
: >"$root/var/lib/dpkg/status"
in_root() {
  local run=()
  ((EUID == 0)) || run=(fakeroot)
  # Includes all files, even if an image excludes documents.
  quietly "${run[@]}" dpkg --root="$root" --log=/dev/null --force-script-chrootless,depends,not-root \
    --path-include='/*' "$@"
}
# installed PACKAGE: prints "ii VERSION".
installed() { dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${db:Status-Abbrev}${Version}' "$1"; }
in_root --install "$deb" "$dev"
[[ $(installed lk-emu) == "ii $(dpkg-deb -f "$deb" Version)" ]] || fail "not installed"

program=$root/usr/bin/lk-emu
[[ $("$program" --version) == "lk-emu $(dpkg-deb -f "$deb" Version)" ]] || fail "another version"
quietly python3 -B "$(dirname "$0")/hardening_test.py" "$program"
"$program" motors | grep mf7015 >/dev/null || fail "it does not find its motors"
quietly "$program" --config "$root/usr/share/lk-emu/buses/bench.toml" --check
quietly "$program" run --quiet "$root/usr/share/lk-emu/scenarios/jammed_joint.toml" --csv "$scratch/run.csv"
PATH=/usr/bin:/bin quietly "$program" plot "$scratch/run.csv"
"$root/usr/bin/with-vcan" --help >/dev/null || fail "with-vcan does not find its files"
for file in "$(dirname "$0")"/../../scripts/lib/*vcan*.py; do
  cmp -s "$file" "$root/usr/share/lk-emu/with-vcan/lib/${file##*/}" || fail "with-vcan lacks ${file##*/}"
done
zcat "$root/usr/share/man/man1/lk-emu.1.gz" | grep '^\.SH OPTIONS' >/dev/null || fail "the manual page has no options"
# Debian's Python finds the package, which finds its own program.
found=$(env -u LKEMU -u PYTHONPATH PYTHONDONTWRITEBYTECODE=1 python3 -S -c "
import sys; sys.path.insert(0, '$root/usr/lib/python3/dist-packages')
import lkemu.program; print(lkemu.program.find_program())") || fail "import does not find lkemu"
[[ $found == "$program" ]] || fail "lkemu finds another program: $found"
"$(dirname "$0")/../docs_test.py" --links "$root/usr/share/doc/lk-emu" || fail "its documents have links that lead nowhere"
# The dissector is in tshark's plugin directory, and loads from there.
plugin=$(tshark -G folders 2>/dev/null | sed -n 's/^Global Lua Plugins:[[:space:]]*//p')/lk-motor.lua
[[ -e $root$plugin ]] || fail "no dissector in $plugin"
mkdir -p "$scratch/home/.local/lib/wireshark/plugins"
cp "$root$plugin" "$scratch/home/.local/lib/wireshark/plugins"
HOME=$scratch/home tshark -G fields 2>&1 | grep -P '\tlk\.motor\.iq\t' >/dev/null || fail "tshark does not take the dissector"
unit=$root/usr/lib/systemd/system/lk-emu@.service

# The unit: no complaints, and a low exposure; docs/start/install.md has the figure.
mkdir -p "$root/etc/lk-emu"
cp "$root/usr/share/lk-emu/buses/bench.toml" "$root/etc/lk-emu/arm.toml"
for target in basic multi-user network shutdown sysinit; do # systemd's own targets are not in this root
  printf '[Unit]\nDescription=%s\n' "$target" >"$root/usr/lib/systemd/system/$target.target"
done
said=$(systemd-analyze verify --man=no --root="$root" lk-emu@arm.service 2>&1) || fail "unit: $said"
[[ -z $said ]] || fail "unit: $said"
quietly systemd-analyze security --no-pager --offline=true --threshold=15 "$unit"
rm -r "$root/etc/lk-emu" "$root"/usr/lib/systemd/system/*.target

for body in "${bodies[@]}"; do
  in_root --install "$body"
  "$(dirname "$0")/deb_body.sh" "$body" "$root" "$scratch"
  in_root --purge lk-emu-body
  [[ ! -e $root/usr/bin/lk-emu-body && -e $program ]] || fail "purging lk-emu-body took too little or too much"
done

# Removing the package stops running services if systemd runs (replaced by stubs here). An upgrade does not stop them.
dpkg-deb -e "$deb" "$scratch/control"
mkdir "$scratch/systemd"
for name in deb-systemd-invoke systemctl; do
  # shellcheck disable=SC2016 # the stub expands it
  printf '#!/bin/sh\necho "${0##*/} $*" >>"%s"\n' "$scratch/asked" >"$scratch/systemd/$name"
  chmod +x "$scratch/systemd/$name"
done
sed "s|/run/systemd/system|$scratch/systemd|; s|\$DPKG_ROOT/usr|$root/usr|" "$scratch/control/prerm" >"$scratch/prerm"
before_it_goes() { env -u DPKG_ROOT PATH="$scratch/systemd:$PATH" sh "$scratch/prerm" "$@"; }
before_it_goes upgrade 99
[[ ! -e $scratch/asked ]] || fail "an upgrade stops services"
before_it_goes remove
[[ -e $scratch/asked && $(<"$scratch/asked") == "deb-systemd-invoke stop lk-emu@*.service" ]] ||
  fail "services run on when it is removed"

# Upgrade and removal keep ROM and enabled services; purging removes all.
rom=$root/var/lib/private/lk-emu/arm/vcan0-1.toml
mkdir -p "${rom%/*}"
: >"$rom"
wants=$root/etc/systemd/system/multi-user.target.wants # as `systemctl enable` does
mkdir -p "$wants"
ln -s /usr/lib/systemd/system/lk-emu@.service "$wants/lk-emu@arm.service"
ln -s /usr/lib/systemd/system/other.service "$wants/other.service"
dpkg-deb -R "$deb" "$scratch/newer"
sed -i 's/^Version: .*/&+1/' "$scratch/newer/DEBIAN/control"
quietly dpkg-deb --root-owner-group -Zgzip -z1 --build "$scratch/newer" "$scratch/newer.deb"
in_root --install "$scratch/newer.deb"
[[ $(installed lk-emu) == "ii $(dpkg-deb -f "$deb" Version)+1" ]] || fail "not upgraded"
[[ -e $rom && -L $wants/lk-emu@arm.service ]] || fail "an upgrade takes away what is not the package's"
mkdir "$root/usr/share/lk-emu/python/lkemu/campaign/__pycache__" # left by a campaign of root
: >"$root/usr/share/lk-emu/python/lkemu/campaign/__pycache__/plan.cpython-311.pyc"
in_root --remove lk-emu-dev lk-emu
[[ -e $rom ]] || fail "ROM is gone before a purge"
[[ -L $wants/lk-emu@arm.service ]] || fail "an instance is disabled before a purge"
in_root --purge lk-emu-dev lk-emu
rm "$wants/other.service" || fail "another package's instance is disabled"
left=$(find "$root" -path "$root/var/lib/dpkg" -prune -o -type f -print -o -type l -print)
[[ -z $left ]] || fail "left behind: $left"
[[ ! -e $root/usr && ! -e $root/var/lib/private/lk-emu ]] || fail "directories are left behind"
rm -rf "$scratch"
