#!/usr/bin/env bash
# Tests an installed program as the built one is tested: the frozen hashes, and hosts on slcan, socketcand, multicast and
# RS-485. On Debian 12, whose Python the tests are written for; elsewhere it does nothing.
# usage: conformance.sh PROGRAM
set -euxo pipefail
# shellcheck source=/dev/null
[[ $(. /etc/os-release && echo "$VERSION_CODENAME") == bookworm ]] || exit 0
tests=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/..
apt-get -q update
apt-get -q -y --no-install-recommends install python3 python3-can python3-serial
/usr/bin/python3 -B "$tests/golden/freeze" "$1"
for hosts in python_can_hosts pyserial_hosts rs485_tcp_hosts bad_clients; do
  /usr/bin/python3 -B "$tests/buses/$hosts.py" "$1"
done
