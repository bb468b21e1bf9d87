#!/usr/bin/env bash
# Checks the package lk-emu-body and runs its program in a root with lk-emu installed. Called by deb_test.sh.
# Usage: deb_body.sh DEB ROOT SCRATCH, where DEB is installed in ROOT.
set -euo pipefail
deb=$1 root=$2 scratch=$3

fail() {
  echo "deb_body: $1" >&2
  exit 1
}

depends=$(dpkg-deb -f "$deb" Depends)
version=$(dpkg-deb -f "$deb" Version)
[[ $depends == *"lk-emu (= $version)"* ]] || fail "depends on: $depends"
[[ $depends == *libmujoco* && $depends == *libstdc++6* ]] || fail "depends on: $depends"
[[ $(dpkg-deb -f "$deb" Recommends) == *python3-can* ]] || fail "no host for its demo"
for field in Maintainer Section Description Installed-Size; do
  [[ -n $(dpkg-deb -f "$deb" "$field") ]] || fail "no $field"
done

dpkg-deb -c "$deb" >"$scratch/files"
for file in usr/bin/lk-emu-body usr/share/man/man1/lk-emu-body.1.gz usr/share/bash-completion/completions/lk-emu-body \
  usr/share/fish/vendor_completions.d/lk-emu-body.fish usr/share/doc/lk-emu-body/copyright \
  usr/share/doc/lk-emu-body/changelog.gz usr/share/doc/lk-emu-body/lk-emu-body.spdx.json usr/share/doc/lk-emu-body/licenses/three.js; do
  grep -q " \./$file\( -> .*\)\?\$" "$scratch/files" || fail "$file is not in the package"
done
# Files of lk-emu belong to that package only.
! grep ' \./usr/share/lk-emu/' "$scratch/files" || fail "these belong to lk-emu"
! grep -v ' \./usr/\| \./$' "$scratch/files" || fail "these are outside /usr"
! grep -v 'root/root' "$scratch/files" || fail "these do not belong to root"
! grep -v '^-rw-r--r--\|^-rwxr-xr-x\|^drwxr-xr-x\|^lrwxrwxrwx' "$scratch/files" || fail "odd permissions"

# Finds all files if lk-emu is installed.
program=$root/usr/bin/lk-emu-body
[[ $("$program" --version) == "lk-emu $version" ]] || fail "another version"
python3 -B "$(dirname "$0")/hardening_test.py" "$program" 2>"$scratch/log" || fail "$(<"$scratch/log")"
"$program" --config six_joint_arm --check >/dev/null || fail "it does not find robot and body"
[[ $(zcat "$root/usr/share/man/man1/lk-emu-body.1.gz") == ".so man1/lk-emu.1" && -e $root/usr/share/man/man1/lk-emu.1.gz ]] ||
  fail "its manual page is none"
bash -c "source '$root/usr/share/bash-completion/completions/lk-emu-body'; complete -p lk-emu-body" >/dev/null ||
  fail "bash does not complete it"
grep -q '^#compdef .*\blk-emu-body\b' "$root/usr/share/zsh/vendor-completions/_lk-emu" || fail "zsh does not complete it"

# The demo, started by lk-emu, with a host of the package.
mkfifo "$scratch/said"
PATH=/usr/bin:$PATH "$root/usr/bin/lk-emu" demo arm --no-browser >"$scratch/said" 2>&1 &
exec 3<"$scratch/said"
read -r said <&3 || fail "the demo says nothing"
[[ $said == *http://127.0.0.1:*/* ]] || fail "the demo says: $said"
kill $! # SIGTERM, because background processes of a script ignore SIGINT
wait $! || fail "the demo ended with status $?"
