#!/usr/bin/env bash
# A campaign in shards by GNU parallel, on this machine or on several that share the directory.
# usage: parallel.sh PLAN SHARDS [OPTION OF PARALLEL...]
#   parallel.sh plan.toml 16 --jobs 8
#   parallel.sh plan.toml 64 --sshloginfile nodes --workdir .
# A shard that is killed is begun again, thrice at most; the same command again goes on with those that are not done.
# docs/campaigns-engines.md tells more.
set -euo pipefail
plan=${1:?usage: parallel.sh PLAN SHARDS [OPTION OF PARALLEL...]}
shards=${2:?usage: parallel.sh PLAN SHARDS [OPTION OF PARALLEL...]}
shift 2

seq 0 $((shards - 1)) |
  parallel --quote --retries 3 --joblog campaign.joblog --resume-failed "$@" \
    lk-emu campaign "$plan" --shard "{}/$shards" --jobs 1 --quiet -o 'shard-{}.db' --resume
mapfile -t stores < <(seq -f 'shard-%.0f.db' 0 $((shards - 1)))
lk-emu campaign merge -o campaign.db "${stores[@]}"
