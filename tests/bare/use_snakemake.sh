#!/usr/bin/env bash
# A campaign in shards by Snakemake: the program of one shard is killed, then all of it, and what comes out is what one
# process gives.
# usage: tests/bare/use_snakemake.sh PROGRAM SNAKEFILE PLAN
# shellcheck source=tests/bare/campaign.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/campaign.sh" "$@"
snakemake=(snakemake --snakefile "$file" --cores 2 --config "plan=$plan" "shards=$shards")
computes() { grep -qsz "^shard-$1.db\$" /proc/[0-9]*/cmdline; }

"${snakemake[@]}" >first.log 2>&1 &
first=$!
until_true has_cases 0
kill_program 0
until_true computes 0 # again
# As where the machine goes off: Snakemake, and what it has started.
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
