#!/usr/bin/env bash
# Runs a pipeline or a study on three Slurm nodes, all of them plain processes of this machine, with nodes and controller killed at
# random and an item that fails for good; then submits again. Every file must be that of one process.
# Usage: slurm.sh NTP PIPELINE.toml|STUDY.toml WORK_DIR [KILLS]
# Needs Debian's slurmctld, slurmd, slurm-client and munge, which are installed if apt-get is allowed to; nothing listens
# outside of this machine, and nothing of a Slurm that is set up here is touched.
set -euo pipefail
ntp=$(realpath "$1")
pipeline=$(realpath "$2")
mkdir -p "$3"
work=$(realpath "$3")
kills=${4:-3}
rm -rf "$work"/*
say() { printf '%4ss  %s\n' "$SECONDS" "$*"; }

command -v slurmctld > /dev/null && command -v munged > /dev/null ||
  apt-get install -qq -y --no-install-recommends slurmctld slurmd slurm-client munge > "$work/apt.log"

# --- a cluster of three nodes ---
state=$work/state
mkdir -p "$state/ctld" "$state/spool" "$state/munge"
chmod 700 "$state/munge"
head -c 1024 /dev/urandom > "$state/munge/key"
chmod 400 "$state/munge/key"
host=$(uname -n | cut -d. -f1)
port=$((20000 + $$ % 20000))
cat > "$state/slurm.conf" << CONF
ClusterName=ntp
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$state/munge/socket
CredType=cred/munge
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
StateSaveLocation=$state/ctld
SlurmdSpoolDir=$state/spool/%n
SlurmctldPidFile=$state/slurmctld.pid
SlurmdPidFile=$state/slurmd-%n.pid
SlurmctldLogFile=$state/slurmctld.log
SlurmdLogFile=$state/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$state/jobs.txt
SelectType=select/cons_tres
SlurmdParameters=config_overrides
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
ReturnToService=2
SlurmdTimeout=10
MinJobAge=3600
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1
NodeName=n3 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 3)) CPUs=1
PartitionName=all Nodes=n1,n2,n3 Default=YES State=UP
CONF
export SLURM_CONF=$state/slurm.conf

ctld() { slurmctld -f "$SLURM_CONF"; }
node() { slurmd -N "$1"; }
stop() {
  local file
  for file in "$state"/slurmd-n?.pid "$state"/slurmctld.pid "$state"/munge/pid; do
    [ -s "$file" ] && kill -9 "$(cat "$file")" 2> /dev/null || true
  done
}
trap stop EXIT
munged --force --key-file="$state/munge/key" --socket="$state/munge/socket" --pid-file="$state/munge/pid" \
  --seed-file="$state/munge/seed" --log-file="$state/munge/log"
ctld
for name in n1 n2 n3; do node "$name"; done
for _ in $(seq 100); do
  [ "$(timeout 5 sinfo -h -o %T -N | sort -u)" = idle ] && break
  sleep 0.1
done
say "three nodes: $(timeout 5 sinfo -h -o '%N %T')"

# --- one process ---
"$ntp" run "$pipeline" --out "$work/whole" > "$work/whole.log" 2>&1
say "one process is done"

# --- the cluster ---
run=$work/run
# What stages made, of each experiment of a study.
parts=$(cd "$work/whole" && find . -type d \( -name tasks -o -name recordings -o -name dataset -o -name models -o -name rollouts \) -prune | sort)
# An item that fails for good: something has taken the name of its recording.
first=$(grep -m 1 'recordings$' <<< "$parts")
poison=$run/$first/$(ls "$work/whole/$first" | grep mcap | sed -n 2p)
mkdir -p "$poison/taken"
submit() { "$ntp" submit "$pipeline" --out "$run" --engine slurm --per-task 1 >> "$work/submit.log" 2>&1; }
queue() { timeout 10 squeue -h -r -o '%i %T' 2> /dev/null || true; }

# What is held back after a failure of a node would wait two minutes. A controller that was killed while a job began may
# hand it out twice; the node then refuses it and is drained ("Duplicate jobid"), and the job is held, until a person
# looks at it.
hurry() {
  local job name
  for name in $(timeout 10 sinfo -h -N -t drain,drained -o '%N' 2> /dev/null); do
    timeout 5 scontrol update "NodeName=$name" State=RESUME > /dev/null 2>&1 || true
  done
  for job in $(timeout 10 squeue -h -r -o '%i %r' -t PENDING 2> /dev/null | sed -n 's/ .*held.*//p'); do
    timeout 5 scontrol release "$job" > /dev/null 2>&1 || true
  done
  for job in $(timeout 10 squeue -h -o '%A' -t PENDING 2> /dev/null); do
    timeout 5 scontrol update "JobId=$job" StartTime=now > /dev/null 2>&1 || true
  done
}

# The processes of jobs on a node of this cluster.
running_on() {
  local file
  for file in $(grep -lzx "SLURMD_NODENAME=$1" /proc/[0-9]*/environ 2> /dev/null); do
    if grep -qzx "SLURM_CONF=$SLURM_CONF" "$file" 2> /dev/null; then echo "$file" | cut -d/ -f3; fi
  done
}

# A node dies with all that runs on it, and comes back.
kill_node() {
  local name=$1 jobs
  jobs=$(running_on "$name")
  # shellcheck disable=SC2086
  kill -9 "$(cat "$state/slurmd-$name.pid")" $jobs 2> /dev/null || true
  timeout 5 scontrol update "NodeName=$name" State=DOWN Reason=killed || true
  sleep 1
  node "$name"
  timeout 5 scontrol update "NodeName=$name" State=RESUME > /dev/null 2>&1 || true
  say "node $name was killed with $(echo $jobs | wc -w) processes, and is back"
}

kill_controller() {
  kill -9 "$(cat "$state/slurmctld.pid")" || true
  sleep 1
  ctld
  say "the controller was killed and is back"
}

# Waits until nothing is queued, and kills on the way.
wait_for_jobs() {
  local left=$1 next=$((SECONDS + 2))
  while [ -n "$(queue)" ]; do
    hurry
    if [ "$left" -gt 0 ] && [ "$SECONDS" -ge "$next" ]; then
      case $((RANDOM % 4)) in
        0) kill_controller ;;
        *) kill_node "n$((RANDOM % 3 + 1))" ;;
      esac
      left=$((left - 1))
      next=$((SECONDS + 1 + RANDOM % 3))
    fi
    sleep 0.5
  done
}

submit
wait_for_jobs 0
"$ntp" status "$run" > "$work/status.txt" && { cat "$work/status.txt"; echo "the poisoned item was done"; exit 1; }
grep -q "item 1 of generate failed" "$work/status.txt" || { cat "$work/status.txt"; echo "the poisoned item is not named"; exit 1; }
say "the poisoned item is named: $(grep 'item 1 of generate' "$work/status.txt")"
rm -r "$poison"
for attempt in 1 2 3 4 5; do
  submit
  wait_for_jobs "$([ "$attempt" = 1 ] && echo "$kills" || echo 0)"
  "$ntp" status "$run" > "$work/status.txt" && break
  say "submitted $attempt times, left: $(grep -v ' 0 left' "$work/status.txt" | tr '\n' ';')"
done
"$ntp" status "$run" || { echo "something is left"; exit 1; }
say "the cluster is done"

# --- every file is that of one process, but for what tells of time and place ---
for part in $parts; do
  diff -r "$work/whole/$part" "$run/$part"
done
say "all $(cd "$work/whole" && find $parts -type f | wc -l) files are identical"
