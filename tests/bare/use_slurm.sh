#!/usr/bin/env bash
# A Slurm of one node in a root of tests/bare, and a campaign as an array of tasks, of which one is killed and another
# requeued while they run: what comes out is what one process gives.
# usage: use_slurm.sh PROGRAM SBATCH_FILE PLAN
set -euxo pipefail
program=$(realpath -- "$1") sbatch_file=$(realpath -- "$2") plan=$(realpath -- "$3")
shards=4

apt-get -q update
DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends install slurm-wlm munge
work=/var/tmp/campaign
mkdir -p "$work/bin"
ln -s "$program" "$work/bin/lk-emu"
cd "$work"
export PATH=$work/bin:$PATH SHARDS=$shards

# Nothing here may take the machine's cgroups, and no task waits for a round of the scheduler.
cat >/etc/slurm/slurm.conf <<END
ClusterName=bare
SlurmctldHost=$(hostname)
AuthType=auth/munge
AuthInfo=cred_expire=5
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
KillWait=1
SlurmUser=root
StateSaveLocation=/var/spool/slurmctld
SlurmdSpoolDir=/var/spool/slurmd
SlurmctldPidFile=/run/slurmctld.pid
SlurmdPidFile=/run/slurmd.pid
SlurmctldLogFile=/var/log/slurm/slurmctld.log
SlurmdLogFile=/var/log/slurm/slurmd.log
NodeName=$(hostname) CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
END
printf 'CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n' >/etc/slurm/cgroup.conf
mkdir -p /var/spool/slurmctld /var/spool/slurmd /var/log/slurm
install -d -o munge -g munge -m 755 /run/munge
runuser -u munge -- munged
slurmctld
slurmd

# until_true COMMAND...: asked again and again, for two minutes at most.
until_true() {
  { set +x; } 2>/dev/null
  local end=$((SECONDS + 120))
  until "$@" >/dev/null 2>&1; do
    ((SECONDS < end)) || {
      echo "in vain: $*" && squeue -t all && tail -n 20 /var/log/slurm/*.log shard-*.log
      exit 1
    }
    sleep 0.05
  done
  set -x
}
# state_is TASK STATE
state_is() { [[ $(squeue -h -t all -r -j "${job}_$1" -o %T) == "$2" ]]; }
has_cases() { [[ -s shard-$1.db ]]; }
node_is_idle() { [[ $(sinfo -h -o %T) == idle ]]; }
until_true node_is_idle

job=$(sbatch --parsable --array=0-$((shards - 1)) "$sbatch_file" "$plan")
sbatch --dependency="afterok:$job" --wrap "true"
# The last ones first, so that tasks wait meanwhile.
until_true has_cases 0
scontrol listpids "$(squeue -h -j "${job}_0" -o %A)"
pid=$(scontrol listpids "$(squeue -h -j "${job}_0" -o %A)" | awk 'NR > 1 { pid = $1 } END { print pid }')
kill -KILL "$pid"
until_true state_is 0 FAILED
scontrol requeue "${job}_0"
until_true has_cases 1
scontrol requeue "${job}_1"
squeue -t all -r -o "%i %T %r %S %E %V"
(for i in 1 2 3 4 5 6; do squeue -t all -r -o "%i %T %r %S %E"; sleep 4; done; scontrol show job 1_0; tail -20 /var/log/slurm/slurmctld.log; tail -5 /var/log/slurm/slurmd.log; sinfo) &
sbatch --wait --dependency="afterok:$job" --wrap "lk-emu campaign merge -o campaign.db shard-*.db"
squeue -t all -r -o "%i %T %r %S %E"
scontrol show job "$job" | grep -E "JobState|Restarts|ArrayTaskId"

lk-emu campaign "$plan" --jobs 1 --quiet -o one.db
lk-emu campaign export campaign.db | sha256sum
cmp <(lk-emu campaign export campaign.db) <(lk-emu campaign export one.db)
