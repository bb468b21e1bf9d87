#!/usr/bin/env bash
# Runs a campaign as a job array on a Slurm cluster of one node, in its own root and network namespace. Kills the program of
# one running task and requeues another. The result must equal that of one process.
# usage: unshare --net tests/bare/use_slurm.sh PROGRAM SBATCH_FILE PLAN
# shellcheck source=tests/bare/campaign.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/campaign.sh" "$@"

# Uses no cgroups of the machine. The scheduler runs every second, and a requeued task waits for 5 s instead of 120 s.
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
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
NodeName=$(hostname) CPUs=2
PartitionName=all Nodes=ALL Default=YES
END
printf 'CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n' >/etc/slurm/cgroup.conf
mkdir -p /var/spool/slurmctld
install -d -o munge -g munge -m 755 /run/munge
ip link set lo up
ip address add 127.0.1.1/8 dev lo # the host name's address; a machine with only 127.0.0.1 counts as one without IPv4
runuser -u munge -- munged
slurmctld
slurmd

node_is_idle() { [[ $(sinfo -h -o %T) == idle ]]; }
is_over() { [[ -z $(squeue -h -j "$1") ]]; }
# of_task TASK FIELD: prints a field of `scontrol show job`.
of_task() { scontrol show job "${job}_$1" | grep -oP "\b$2=\K\S+"; }

until_true node_is_idle
job=$(SHARDS=$shards sbatch --parsable --array=0-$((shards - 1)) "$file" "$plan")
merge=$(sbatch --parsable --output=merge.log --dependency="afterok:$job" --wrap 'lk-emu campaign merge -o campaign.db shard-*.db')

until_true has_cases 0
kill_program 0
until_true has_cases 1
scontrol requeue "${job}_1"
until_true is_over "$merge"

restarts=''
for task in $(seq 0 $((shards - 1))); do
  restarts+=$(of_task "$task" Restarts)
  echo "task $task: $(of_task "$task" JobState), restarted $(of_task "$task" Restarts) times"
done
[[ $restarts == 1100 ]]
is_the_whole campaign.db
