#!/usr/bin/env bash
# Installs the wheel next to this clone in an empty venv without a package index. The commands' libraries come from the
# distribution.
set -euxo pipefail
cd /root
mv lk-emu checkout # only conformance.sh needs it
apt-get -q update
apt-get -q -y --no-install-recommends install python3-venv
python3 -m venv --system-site-packages '/opt/any where'
'/opt/any where/bin/python' -m pip install --no-index lk_emu-*.whl
[[ $('/opt/any where/bin/lk-emu' --version) == 'lk-emu '* ]]
'/opt/any where/bin/lk-emu' motors | grep mf7015
[[ -e '/opt/any where/share/doc/lk-emu/licenses/glibc' ]]
# The program runs the Python of its environment, which lacks the libraries, or is too old on Debian 11.
for command in 'plot run.csv' 'campaign every_fault'; do
  status=0
  # shellcheck disable=SC2086 # words
  said=$('/opt/any where/bin/lk-emu' $command 2>&1) || status=$?
  [[ $status == 2 && $said == *"/opt/any where/bin/python3"* && $said != *$'\n'* ]]
  [[ $said == *"pip install 'lk-emu[${command%% *}]'" || $said == *'needs Python 3.11 or newer; '*' is 3.9' ]]
done

# The package finds the program although it is not in PATH. This machine has no vcan and no python-can.
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
