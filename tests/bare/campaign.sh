# shellcheck shell=bash
# Sourced by use_slurm.sh and use_snakemake.sh with their arguments PROGRAM FILE PLAN. Creates a working directory, puts the
# program into PATH as lk-emu, and sets file and plan to the absolute paths of FILE and PLAN.
set -euo pipefail
# shellcheck disable=SC2034 # used by the scripts that source this file
program=$(realpath -- "$1") file=$(realpath -- "$2") plan=$(realpath -- "$3")
# shellcheck disable=SC2034
shards=4
work=/var/tmp/campaign
mkdir -p "$work/bin"
ln -s "$program" "$work/bin/lk-emu"
cd "$work"
export PATH=$work/bin:$PATH

# until_true COMMAND...: polls until the command succeeds; time-out: two minutes.
until_true() {
  local end=$((SECONDS + 120))
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < end)) || {
      echo "time-out: $*"
      tail -n 20 -- *.log
      exit 1
    }
    sleep 0.05
  done
}

# has_cases SHARD: succeeds if the shard's file contains results.
has_cases() {
  python3 -c '
import sqlite3, sys
sys.exit(not sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True).execute("SELECT count(*) FROM cases").fetchone()[0])' "shard-$1.db"
}

# kill_program SHARD: kills the process that computes the shard. Only this process has the shard's file as an argument.
kill_program() {
  local directory
  for directory in /proc/[0-9]*; do
    if grep -qz "^shard-$1.db\$" "$directory/cmdline"; then
      kill -KILL "${directory#/proc/}"
      return
    fi
  done 2>/dev/null
  echo "no process computes shard $1" >&2
  exit 1
}

# is_the_whole STORE: succeeds if the store equals the result of one process.
is_the_whole() {
  lk-emu campaign "$plan" --jobs 1 --quiet -o one.db
  cmp <(lk-emu campaign export "$1") <(lk-emu campaign export one.db)
  echo "equals the result of --jobs 1: $(lk-emu campaign export "$1" | wc -l) lines, $(lk-emu campaign export "$1" | sha256sum)"
}
