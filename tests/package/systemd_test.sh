#!/usr/bin/env bash
# Runs the service under its own systemd: process 1 of a PID namespace in user-mode Linux, with a persistent root. Changes
# nothing on this machine. Status 77 without user-mode Linux: elsewhere cgroups are the machine's.
# usage: systemd_test.sh BUILD_DIRECTORY SCRATCH
set -euo pipefail
here=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")

outside() {
  local build=$1 scratch=$2
  command -v linux.uml >/dev/null || {
    echo "not run: no user-mode Linux here"
    exit 77
  }
  rm -rf "$scratch"
  umask 022 # the service runs as another user
  mkdir -p "$scratch/out"
  cmake --install "$build" --component program --prefix "$scratch/local" >/dev/null
  cp "$here/systemd_proof.sh" "$here/../../docs/start/install.md" "$here/../../packaging/debian/prerm" "$scratch/out"
  WITH_VCAN=uml "$here/../../scripts/with-vcan" --timeout 400 \
    unshare --mount --pid --fork --kill-child "$here/systemd_test.sh" --inside "$scratch" || true
  cat "$scratch/out/log"
  [[ -e $scratch/out/passed ]]
  rm -rf "$scratch"
}

# A root with this machine's /usr and little else; the program is in /usr/local.
inside() {
  local scratch=$1 root=/run/root name
  mkdir "$root"
  mount -t tmpfs tmpfs "$root"
  cd "$root"
  mkdir -p usr etc/lk-emu etc/systemd/system var/lib run tmp proc sys dev old out
  mount --bind /usr usr
  mount --bind "$scratch/local" usr/local
  mount --bind "$scratch/out" out
  # In a container image packages may not start or stop services (deb-systemd-invoke).
  [[ ! -e usr/sbin/policy-rc.d ]] || mount --bind /dev/null usr/sbin/policy-rc.d
  for name in bin sbin lib lib64; do
    [[ ! -L /$name ]] || ln -s "usr/$name" "$name"
  done
  cp -a /etc/passwd /etc/group /etc/nsswitch.conf /etc/ld.so.cache etc
  echo 0123456789abcdef0123456789abcdef >etc/machine-id
  cp usr/local/share/lk-emu/buses/bench.toml etc/lk-emu
  echo 'bus = "none"' >etc/lk-emu/bad.toml
  printf '%s\n' '[Service]' 'Type=oneshot' 'ExecStart=bash /out/systemd_proof.sh' 'StandardOutput=file:/out/log' \
    'StandardError=inherit' >etc/systemd/system/proof.service
  printf '%s\n' '[Unit]' 'Requires=basic.target proof.service' >etc/systemd/system/proof.target
  # The service needs none of these, and each takes time.
  for name in systemd-{tmpfiles-setup,tmpfiles-setup-dev,sysctl,update-utmp,binfmt,journal-flush,random-seed}.service \
    modprobe@{configfs,drm,efi_pstore,fuse,loop,dm_mod}.service dev-{hugepages,mqueue}.mount; do
    ln -s /dev/null "etc/systemd/system/$name"
  done
  mount -t proc proc proc
  mount -t sysfs sysfs sys
  mount -t devtmpfs devtmpfs dev
  mkdir -p dev/pts dev/shm
  mount -t devpts devpts dev/pts
  mount -t tmpfs tmpfs dev/shm
  mount -t cgroup2 cgroup2 sys/fs/cgroup
  pivot_root . old
  umount -l /old
  mount --make-rshared / # so that mounts for services propagate to the namespaces below
  exec env -i container=test /lib/systemd/systemd --unit=proof.target --show-status=0 --log-target=kmsg </dev/null >/out/systemd.log 2>&1
}

if [[ $1 == --inside ]]; then
  inside "$2"
else
  outside "$@"
fi
