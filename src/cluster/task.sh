#!/usr/bin/env bash
# One task: the items of a line of submit/items/FOLDER/STAGE. Run in the run directory by submit.sh.
# Usage: task.sh FOLDER PIPELINE STAGE STORE LINE; STORE is empty where the run is in the run directory.
set -uo pipefail
folder=$1 pipeline=$2 stage=$3 store=$4 line=$5
# How often a task that was told to end is queued again; a time limit tells it.
most_restarts=20

items=$(sed -n "$((line + 1))p" "submit/items/$folder/$stage")
logs="submit/logs/$folder"
mkdir -p "$logs"
exec >> "$logs/$stage-${items%%[-,]*}.log" 2>&1
echo "== $stage $items on $(uname -n), attempt $((${SLURM_RESTART_COUNT:-0} + 1))"

place=(--out "$folder")
if [ -n "$store" ]; then
  # What this machine needs of the run.
  place=(--store "$store" --out "${TMPDIR:-/tmp}/ntp-$(printf '%s' "$store" | cksum | cut -d ' ' -f 1)")
fi

# The program is told to end when this script is: it keeps what is done, and exits with 130.
submit/ntp "$stage" "$pipeline" "${place[@]}" --jobs "${SLURM_CPUS_PER_TASK:-1}" --items "$items" &
ntp=$!
told=""
trap 'told=yes; kill -TERM "$ntp" 2> /dev/null' TERM INT
wait "$ntp"
code=$?
if [ -n "$told" ]; then
  wait "$ntp"
  last=$?
  [ "$last" = 127 ] || code=$last
fi

if [ "$code" = 130 ] && [ -n "${SLURM_JOB_ID:-}" ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "$most_restarts" ] &&
  scontrol show job "$SLURM_JOB_ID" | grep -q JobState=RUNNING; then
  scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
