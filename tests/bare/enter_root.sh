#!/usr/bin/env bash
# Process 1 in the namespaces of tests/bare/root.
# usage: enter_root.sh all|few SCRATCH BASE_TAR BUILD_DIRECTORY_OR_NOTHING [FILE...] -- COMMAND [ARGUMENT...]
set -euo pipefail
privileges=$1 scratch=$2 base=$3 build=$4
shift 4

root=$scratch/root
mkdir "$root"
mount --bind "$root" "$root"
tar -xf "$base" --exclude='./dev/*' -C "$root"
mv "$scratch/apt.conf" "$root/etc/apt/apt.conf.d/90machine"
mv "$scratch/lk-emu" "$root/root/lk-emu"
chown -R 0:0 "$root/root/lk-emu"
while [[ $1 != -- ]]; do
  cp "$1" "$root/root/"
  shift
done
shift
if [[ -n $build ]]; then
  mkdir "$root/root/lk-emu/build"
  mount --bind "$build" "$root/root/lk-emu/build"
fi
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
mount --rbind /dev "$root/dev"
mount --make-rslave "$root/dev"
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
printf '127.0.0.1 localhost\n127.0.1.1 %s\n' "$(hostname)" >"$root/etc/hosts"
enter=(chroot)
if [[ $privileges == few ]]; then
  # Docker's default capabilities of a container. A process in a chroot cannot create user namespaces.
  enter=(setpriv --no-new-privs --bounding-set "-all,+chown,+dac_override,+fowner,+fsetid,+kill,+setgid,+setuid,+setpcap,\
+net_bind_service,+net_raw,+sys_chroot,+mknod,+audit_write,+setfcap" chroot)
else
  # Not a plain chroot: nested roots need namespaces, which tests/bare creates.
  cd "$root"
  pivot_root . .
  umount --lazy .
  root=/
fi
# shellcheck disable=SC2016 # the inner shell expands it
exec "${enter[@]}" "$root" /usr/bin/env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb LANG=C.UTF-8 \
  bash -c 'cd /root/lk-emu && exec "$@"' bash "$@" </dev/null
