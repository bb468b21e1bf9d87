#!/usr/bin/env bash
# Runs tests of the build on an installed program: the frozen hashes, hosts on slcan, socketcand, multicast and RS-485, and
# the commands in Python. Does nothing except on Debian 12, because the tests need its Python.
# usage: conformance.sh PROGRAM
set -euxo pipefail
# shellcheck source=/dev/null
[[ $(. /etc/os-release && echo "$VERSION_CODENAME") == bookworm ]] || exit 0
tests=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/..
apt-get -q update
apt-get -q -y --no-install-recommends install python3 python3-can python3-jinja2 python3-matplotlib python3-regex python3-scipy python3-serial
cd "$(mktemp -d)"
"$1" run joint_moves --quiet --csv run.csv --candump run.log
"$1" plot run.csv -o run.png
"$1" identify run.log --motor mg4010 --report motor.html
"$1" campaign "$tests/engines/plan.toml" --quiet -o plan.db --html plan.html
grep -q 'data-theme="light"' plan.html # part of the dashboard's style sheet
"$1" campaign "$tests/../configs/campaigns/controller.toml" --case 1 # with a host program
/usr/bin/python3 -B "$tests/golden/freeze" "$1"
for hosts in python_can_hosts pyserial_hosts rs485_tcp_hosts bad_clients; do
  /usr/bin/python3 -B "$tests/buses/$hosts.py" "$1"
done
