#!/usr/bin/env bash
# The wheel beside this clone in a venv where there is nothing else, and no index to ask.
set -euxo pipefail
cd /root
mv lk-emu checkout # only conformance.sh needs it
apt-get -q update
apt-get -q -y --no-install-recommends install python3-venv
python3 -m venv '/opt/any where'
'/opt/any where/bin/python' -m pip install --no-index lk_emu-*.whl
[[ $('/opt/any where/bin/lk-emu' --version) == 'lk-emu '* ]]
'/opt/any where/bin/lk-emu' motors | grep mf7015
'/opt/any where/bin/lk-emu' campaign every_fault --dry-run | grep cases
[[ -e '/opt/any where/share/doc/lk-emu/licenses/glibc' ]]
# It runs the Python of its environment, which lacks matplotlib, or is too old on Debian 11.
said=$('/opt/any where/bin/lk-emu' plot run.csv 2>&1) || true
[[ $said == *"pip install 'lk-emu[plot]'" || $said == *'needs Python 3.11 or newer; /opt/any where/bin/python3 is 3.9' ]]

# It is not in PATH; the package finds it all the same. No vcan here, and python-can is not there.
'/opt/any where/bin/python' -c '
import socket, sys
import lkemu, lkemu.program
assert lkemu.program.find_program() == "/opt/any where/bin/lk-emu", lkemu.program.find_program()
with lkemu.Emulator(ids="1-4", bus="auto") as emu:
    host = socket.create_connection(("127.0.0.1", int(emu.bus.rpartition(":")[2])), 20)
    host.sendall(b"O\rt14189A00000000000000\r")
    said = b""
    while b"t14189A" not in said:
        said += host.recv(100)
    print(emu.bus, said)
'
/root/checkout/tests/bare/conformance.sh '/opt/any where/bin/lk-emu'
'/opt/any where/bin/python' -m pip uninstall -q -y lk-emu
[[ ! -e '/opt/any where/bin/lk-emu' ]]
