#!/usr/bin/env bash
# Tests all simulators of examples/shafts without skips. Pre: mujoco.tgz is next to the clone.
set -euxo pipefail
scripts/packages build body test release
apt-get -q -y --no-install-recommends install nodejs
sha512sum --check <<<'58f51889dbb8171f3eb8ce2142ff3448e03489fa561abb0d260b8ab3c24157c4824f18ca436febaac87cf349d41f4fd5c1af2fb9e7e086f090924a1e7776e452  ../mujoco.tgz'
tar -C .. -xf ../mujoco.tgz package/mujoco.js package/mujoco.wasm package/package.json
cmake --preset release -DLKEMU_BENCH=OFF
cmake --build --preset release --target lk-emu lk-emu-body simbody_arm
MUJOCO_WASM=$(realpath ../package/mujoco.js)
export MUJOCO_WASM
ctest --preset release --no-tests=error -R '^shafts\.(mujoco_wasm|simbody)$' -V | tee ../simulators.log
[[ $(grep -c ' Passed ' ../simulators.log) == 2 ]]
