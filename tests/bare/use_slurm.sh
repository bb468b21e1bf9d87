#!/usr/bin/env bash
# A Slurm of one node, in a root and a network of its own, and a campaign as a job array: the program of one task is
# killed and another task requeued while they run, and what comes out is what one process gives.
# usage: unshare --net tests/bare/use_slurm.sh PROGRAM SBATCH_FILE PLAN
set -euo pipefail
program=$(realpath -- "$1") sbatch_file=$(realpath -- "$2") plan=$(realpath -- "$3")
export SHARDS=4

work=/var/tmp/campaign
mkdir -p "$work/bin"
ln -s "$program" "$work/bin/lk-emu"
cd "$work"
export PATH=$work/bin:$PATH

# Nothing here takes the machine's cgroups; the scheduler looks every second, and a task that was requeued waits for five
# instead of 120.
cat >/etc/slurm/slurm.conf <<END
ClusterName=bare
SlurmctldHost=$(hostname)
SlurmUser=root
AuthInfo=cred_expire=5
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
KillWait=1
StateSaveLocation=/var/spool/slurmctld
SlurmdSpoolDir=/var/spool/slurmd
SlurmctldLogFile=/var/log/slurmctld.log
SlurmdLogFile=/var/log/slurmd.log
NodeName=$(hostname) CPUs=2
PartitionName=all Nodes=ALL Default=YES
END
printf 'CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n' >/etc/slurm/cgroup.conf
mkdir -p /var/spool/slurmctld
install -d -o munge -g munge -m 755 /run/munge
ip link set lo up
ip address add 127.0.1.1/8 dev lo # of the host name; a machine that has 127.0.0.1 alone counts as one without IPv4
runuser -u munge -- munged
slurmctld
slurmd

# until_true COMMAND...: asked again and again, for two minutes at most.
until_true() {
  local end=$((SECONDS + 120))
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < end)) || {
      echo "in vain: $*"
      squeue -t all -r
      tail -n 20 /var/log/slurm*.log -- *.log
      exit 1
    }
    sleep 0.05
  done
}
node_is_idle() { [[ $(sinfo -h -o %T) == idle ]]; }
has_cases() { (($(lk-emu campaign export "shard-$1.db" | wc -l) > 1)); }
is_over() { [[ -z $(squeue -h -j "$1") ]]; }
# of_task TASK FIELD: a field of scontrol's.
of_task() { scontrol show job "${job}_$1" | grep -oP "\b$2=\K\S+"; }

until_true node_is_idle
job=$(sbatch --parsable --array=0-$((SHARDS - 1)) "$sbatch_file" "$plan")
merge=$(sbatch --parsable --output=merge.log --dependency="afterok:$job" --wrap 'lk-emu campaign merge -o campaign.db shard-*.db')

until_true has_cases 0
for pid in $(scontrol listpids "$(of_task 0 JobId)" | awk 'NR > 1 { print $1 }'); do
  [[ $(<"/proc/$pid/comm") != lk-emu ]] || kill -KILL "$pid"
done
until_true has_cases 1
scontrol requeue "${job}_1"
until_true is_over "$merge"

for task in $(seq 0 $((SHARDS - 1))); do
  echo "task $task: $(of_task "$task" JobState), restarted $(of_task "$task" Restarts) times"
done
[[ $(of_task 0 Restarts)$(of_task 1 Restarts)$(of_task 2 Restarts)$(of_task 3 Restarts) == 1100 ]]
lk-emu campaign "$plan" --jobs 1 --quiet -o one.db
cmp <(lk-emu campaign export campaign.db) <(lk-emu campaign export one.db)
echo "the same as of --jobs 1: $(lk-emu campaign export campaign.db | wc -l) lines, $(lk-emu campaign export campaign.db | sha256sum)"
