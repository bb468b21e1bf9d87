#!/usr/bin/env bash
# Runs a campaign in shards by Snakemake. Kills the program of one shard, then Snakemake with all its processes. The result
# must equal that of one process.
# usage: tests/bare/use_snakemake.sh PROGRAM SNAKEFILE PLAN
# shellcheck source=tests/bare/campaign.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/campaign.sh" "$@"
snakemake=(snakemake --snakefile "$file" --cores 2 --config "plan=$plan" "shards=$shards")
computes() { grep -qsz "^shard-$1.db\$" /proc/[0-9]*/cmdline; }

"${snakemake[@]}" >first.log 2>&1 &
first=$!
until_true has_cases 0
kill_program 0
until_true computes 0 # after the restart
# Like a power failure: kills Snakemake and all processes that it has started.
kill -KILL "$first"
for shard in $(seq 0 $((shards - 1))); do
  (kill_program "$shard" 2>/dev/null) || true
done
wait "$first" || true
[[ ! -e campaign.db ]]

"${snakemake[@]}" --unlock
"${snakemake[@]}" --rerun-incomplete >second.log 2>&1
"${snakemake[@]}" --dry-run | grep 'Nothing to be done'
is_the_whole campaign.db
