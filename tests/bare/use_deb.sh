#!/usr/bin/env bash
# Installs the Debian package next to this clone with its dependencies by apt-get, and uses it.
set -euxo pipefail
cd /root
apt-get -q update
apt-get -q -y --no-install-recommends install ./lk-emu_*.deb
mv lk-emu checkout # only conformance.sh needs it
lk-emu --version
lk-emu run --quiet /usr/share/lk-emu/scenarios/jammed_joint.toml --csv run.csv

# One line names the missing packages; installing the recommended packages is enough.
refuses() {
  local said status=0
  said=$(lk-emu "${@:2}" 2>&1) || status=$?
  [[ $status == 2 && $said == "lk-emu: $2: "*"$1" && $said != *$'\n'* ]]
}
plan=/root/checkout/tests/engines/plan.toml
refuses 'apt install python3' plot run.csv
apt-get -q -y --no-install-recommends install python3 systemd
refuses "apt install python3-matplotlib, or pip install 'lk-emu[plot]'" plot run.csv
refuses "apt install python3-jinja2 python3-regex python3-scipy, or pip install 'lk-emu[campaign]'" campaign $plan
IFS=', ' read -ra recommended < <(dpkg-query -W -f '${Recommends}\n' lk-emu)
apt-get -q -y --no-install-recommends install "${recommended[@]}"
lk-emu plot run.csv
lk-emu campaign $plan --quiet -o plan.db --html plan.html
[[ -s run.svg && -s plan.html ]]
python3 -c '
import socket
import lkemu
with lkemu.Emulator(ids="1", bus="auto", arguments=["--record", "run"]) as emu:
    host = socket.create_connection(("127.0.0.1", int(emu.bus.rpartition(":")[2])), 20)
    host.sendall(b"O\rt14189A00000000000000\r")
    said = b""
    while b"t14189A" not in said:
        said += host.recv(100)
'
python3 -m lkemu.mcap run
[[ -s run.mcap ]]
install -D -m 644 /usr/share/lk-emu/buses/bench.toml /etc/lk-emu/bench.toml
systemd-analyze verify --man=no lk-emu@bench.service
/root/checkout/tests/bare/conformance.sh /usr/bin/lk-emu
