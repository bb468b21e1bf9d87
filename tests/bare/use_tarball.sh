#!/usr/bin/env bash
# Unpacks the tarball next to this clone on a bare machine, and uses it.
set -euxo pipefail
cd /root
mv lk-emu checkout # only conformance.sh needs it
mkdir '/opt/any where'
tar -xzf lk-emu-*.tar.gz -C '/opt/any where'
top=$(echo '/opt/any where'/lk-emu-*)
[[ $(ldd "$top/bin/lk-emu") == *'statically linked'* ]]
grep -q '^# lk-emu' "$top/README.md"
[[ -e $top/LICENSE && -e $top/share/doc/lk-emu/lk-emu.spdx.json && -e $top/share/doc/lk-emu/licenses/glibc ]]
PATH=$top/bin:$PATH
lk-emu --version
lk-emu motors | grep mf7015
lk-emu --bus vcan0 --ids 1 --check
lk-emu run --quiet "$top/share/lk-emu/scenarios/jammed_joint.toml"

# The program and with-vcan name missing packages in one line.
refuses() {
  local said status=0
  said=$(lk-emu campaign every_fault --dry-run 2>&1) || status=$?
  [[ $status == 2 && $said == "lk-emu: campaign: "*"$1"* && $said != *$'\n'* ]]
}
refuses 'apt install python3'
lacks() {
  local said status=0
  said=$(with-vcan true 2>&1) || status=$?
  [[ $status == 125 && $said == with-vcan:*"$1"* && $said != *$'\n'* ]]
}
lacks 'apt-get install python3'
apt-get -q update
apt-get -q -y --no-install-recommends install python3
refuses 'apt install python3-jinja2 python3-regex python3-scipy' || refuses 'needs Python 3.11 or newer; /usr/bin/python3 is 3.9'
WITH_VCAN=uml lacks 'apt-get install user-mode-linux'
apt-get -q -y --no-install-recommends install user-mode-linux iproute2

# On a bus: the Python package with the program next to it, and a host name that is resolved without NSS.
export PYTHONPATH="$top/share/lk-emu/python"
with-vcan --timeout 120 python3 -B -c '
import subprocess, urllib.request
import lkemu
with lkemu.Emulator(ids="1-2", clock="stepped") as emu:
    emu.clock.advance("1s")
    print(emu.drives[2].telemetry())
command = ["lk-emu", "--bus", "vcan0", "--ids", "1", "--http", "localhost:8474"]
with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
    print(program.stdout.readline())
    print(urllib.request.urlopen("http://localhost:8474/api/v1/drives").read(100))
    program.terminate()
'
/root/checkout/tests/bare/conformance.sh "$top/bin/lk-emu"
