# shellcheck shell=bash
# Sourced by use_slurm.sh and use_snakemake.sh with their arguments PROGRAM FILE PLAN: a directory to work in, with the program
# in PATH as lk-emu, and FILE and PLAN whole in file and plan.
set -euo pipefail
# shellcheck disable=SC2034 # for those who source this
program=$(realpath -- "$1") file=$(realpath -- "$2") plan=$(realpath -- "$3")
# shellcheck disable=SC2034
shards=4
work=/var/tmp/campaign
mkdir -p "$work/bin"
ln -s "$program" "$work/bin/lk-emu"
cd "$work"
export PATH=$work/bin:$PATH

# until_true COMMAND...: asked again and again, for two minutes at most.
until_true() {
  local end=$((SECONDS + 120))
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < end)) || {
      echo "in vain: $*"
      tail -n 20 -- *.log
      exit 1
    }
    sleep 0.05
  done
}

# grows SHARD: its store is longer than when it was first looked at: there are cases in it. Only who writes it may read it.
declare -A first_lengths
grows() {
  local length
  length=$(stat -c %s "shard-$1.db") || return
  first_lengths[$1]=${first_lengths[$1]:-$length}
  ((length > first_lengths[$1]))
}

# kill_program SHARD: the process that works at it.
kill_program() {
  local directory
  for directory in /proc/[0-9]*; do
    if [[ $(<"$directory/comm") == lk-emu ]] && grep -qz "^shard-$1.db\$" "$directory/cmdline"; then
      kill -KILL "${directory#/proc/}"
      return
    fi
  done 2>/dev/null
  echo "no process works at shard $1" >&2
  exit 1
}

# is_the_whole STORE: it has what one process gives.
is_the_whole() {
  lk-emu campaign "$plan" --jobs 1 --quiet -o one.db
  cmp <(lk-emu campaign export "$1") <(lk-emu campaign export one.db)
  echo "the same as of --jobs 1: $(lk-emu campaign export "$1" | wc -l) lines, $(lk-emu campaign export "$1" | sha256sum)"
}
