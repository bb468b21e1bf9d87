#!/usr/bin/env bash
# Run by the systemd of systemd_test.sh: starts the service and checks its behaviour.
set -uo pipefail
service=lk-emu@bench
socket=/run/lk-emu/bench/control.sock

finish() {
  systemctl --no-block exit 0
}
trap finish EXIT

fail() {
  echo "systemd_proof: $1" >&2
  dmesg | tail -n 20 >&2
  journalctl --no-pager -n 20 -u 'lk-emu@*' >&2
  exit 1
}

property() { systemctl show -p "$1" --value "$2"; }

# ask HEX…: prints the answer of drive 2.
ask() {
  python3 - "$@" <<'P'
import socket, struct, sys
with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
    bus.bind(("vcan0",))
    bus.settimeout(60)
    for query in sys.argv[1:]:
        bus.send(struct.pack("=IB3x8s", 0x142, 8, bytes.fromhex(query)))
        print(bus.recv(16)[8:].hex())
P
}

# The service counts as started when it answers.
systemctl start $service || fail "does not start"
[[ $(property StatusText $service) == "ready vcan0:1-5" ]] || fail "status: $(property StatusText $service)"
[[ $(ask 9A00000000000000) == 9a* ]] || fail "no answer"

# It runs as an unprivileged user without capabilities.
status=/proc/$(property MainPID $service)/status
grep -q $'^Uid:\t[1-9]' "$status" || fail "it is root"
! grep '^Cap[A-Za-z]*:.*[1-9a-f]' "$status" || fail "it has capabilities"
grep -q $'^NoNewPrivs:\t1' "$status" || fail "it may get privileges"
grep -q $'^Seccomp:\t2' "$status" || fail "it may call what it likes"

# ROM is kept through a kill, after which the service restarts.
[[ $(ask 9100000000003412) == 91* ]] || fail "no acknowledgement"
grep -q '^encoder_offset = 4660$' /var/lib/private/lk-emu/bench/vcan0-2.toml || fail "ROM is not kept"
systemctl kill -s KILL $service
until [[ $(property NRestarts $service) == 1 && $(property ActiveState $service) == active ]]; do
  [[ $(property ActiveState $service) != failed ]] || fail "is not started again"
  sleep 0.2
done
[[ $(ask 9000000000000000) == 90*3412 ]] || fail "another encoder offset after the kill"
lk-emu ctl --socket $socket record /var/lib/lk-emu/bench/run >/dev/null || fail "no recording"

# Over TCP and recorded, as in docs/start/install.md: needs its token, and each run is separate.
echo 0123456789abcdef0123 >/etc/lk-emu/token
chmod 600 /etc/lk-emu/token
mkdir -p /run/systemd/system/$service.service.d
# shellcheck disable=SC2016 # a backquote ends the example
sed -n '/^\[Service\]/,/^`/{/^`/!p}' /out/install.md >/run/systemd/system/$service.service.d/http.conf
for what in http-token --record RestartPreventExitStatus=; do
  grep -q -e $what /run/systemd/system/$service.service.d/http.conf || fail "docs/start/install.md has no example of $what"
done
systemctl daemon-reload
for run in 1 2; do
  systemctl restart $service || fail "does not start with --http and --record"
  runs=(/var/lib/private/lk-emu/bench/runs/*/recording.json)
  [[ -e ${runs[0]} && ${#runs[@]} == "$run" ]] || fail "run $run is not recorded"
done
python3 - <<'P' || fail "not as docs/start/install.md has it"
import urllib.error, urllib.request
url = "http://127.0.0.1:8474/api/v1/status"
try:
    urllib.request.urlopen(url, timeout=60)
    raise SystemExit("let in without a token")
except urllib.error.HTTPError as error:
    assert error.code == 401, error
request = urllib.request.Request(url, headers={"Authorization": "Bearer 0123456789abcdef0123"})
assert b'"vcan0"' in urllib.request.urlopen(request, timeout=60).read()
P

# An upgrade keeps it running; removing the package stops it cleanly.
sh /out/prerm upgrade 99
[[ $(property ActiveState $service) == active ]] || fail "an upgrade stops it"
sh /out/prerm remove
[[ $(property ActiveState $service) == inactive ]] || fail "it runs on when the package is removed"
[[ $(property Result $service) == success ]] || fail "stopped: $(property Result $service)"
[[ ! -e $socket ]] || fail "the socket is left behind"

# Invalid configurations are not retried.
! systemctl start lk-emu@bad 2>/dev/null || fail "starts with a mistake"
[[ $(property ExecMainStatus lk-emu@bad) == 2 && $(property NRestarts lk-emu@bad) == 0 ]] || fail "a mistake is tried again"
! systemctl start lk-emu@none 2>/dev/null || fail "starts without a file"
echo "systemd: good"
touch /out/passed
