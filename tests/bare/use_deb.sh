#!/usr/bin/env bash
# The Debian package beside this clone, installed by apt-get with what it depends on, and used.
set -euxo pipefail
cd /root
apt-get -q update
apt-get -q -y --no-install-recommends install ./lk-emu_*.deb
mv lk-emu checkout # only conformance.sh needs it
lk-emu --version
lk-emu run --quiet /usr/share/lk-emu/scenarios/jammed_joint.toml --csv run.csv
[[ $(lk-emu plot run.csv 2>&1) == *'apt install python3' ]]
apt-get -q -y --no-install-recommends install python3 systemd
[[ $(lk-emu plot run.csv 2>&1) == *"apt install python3-matplotlib, or pip install 'lk-emu[plot]'" ]]
apt-get -q -y --no-install-recommends install python3-matplotlib
lk-emu plot run.csv
[[ -s run.svg ]]
PYTHONPATH=/usr/share/lk-emu/python python3 -c 'import lkemu; print(lkemu.__file__)'
install -D -m 644 /usr/share/lk-emu/buses/bench.toml /etc/lk-emu/bench.toml
systemd-analyze verify --man=no lk-emu@bench.service
/root/checkout/tests/bare/conformance.sh /usr/bin/lk-emu
