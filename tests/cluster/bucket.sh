#!/usr/bin/env bash
# Runs a pipeline on three machines that share a bucket and no folder, all of them folders of this machine: every item
# twice, processes killed at random. Every file must be that of one process. A store that passes over conditions is
# refused, and one that is slow is waited for.
# Usage: bucket.sh NTP PIPELINE.toml WORK_DIR [KILLS]; NTP is built with the feature `cloud`.
# The server is moto's, from PyPI; it listens on this machine alone.
set -euo pipefail
foreign=$(cd "$(dirname "$0")/../foreign" && pwd)
source "$foreign/common.sh"
ntp=$(realpath "$1")
pipeline=$(realpath "$2")
work=$(work_folder "$3")
kills=${4:-6}
rm -rf "${work:?}"/*
say() { printf '%4ss  %s\n' "$SECONDS" "$*"; }
fail() { echo "$*"; exit 1; }

# --- a server ---
environment bucket-venv "moto[server,s3]==5.*" boto3
"$bin/python" "$foreign/s3_server.py" "$work/port" > "$work/server.txt" 2>&1 &
server=$!
trap 'kill "$server"' EXIT
for _ in $(seq 300); do [ -s "$work/port" ] && break; sleep 0.1; done
AWS_ENDPOINT="http://127.0.0.1:$(cat "$work/port")"
export AWS_ENDPOINT AWS_ACCESS_KEY_ID=test AWS_SECRET_ACCESS_KEY=test AWS_REGION=us-east-1 AWS_ALLOW_HTTP=true
for bucket in runs careless slow; do
  "$bin/python" - "$bucket" << 'PYTHON'
import os, sys, boto3
boto3.client("s3", endpoint_url=os.environ["AWS_ENDPOINT"], region_name="us-east-1").create_bucket(Bucket=sys.argv[1])
PYTHON
done
say "a server is there"

# --- one process ---
"$ntp" run "$pipeline" --out "$work/whole" > "$work/whole.log" 2>&1 || [ $? -eq 3 ]
say "one process is done"

# --- a store that passes over conditions ---
for command in "tasks" "generate --begin" "run"; do
  # shellcheck disable=SC2086
  "$ntp" $command "$pipeline" --store s3://careless/run --out "$work/careless" 2> "$work/careless.txt" &&
    fail "$command was not refused by a store that passes over conditions"
  grep -q "s3://careless/run: its store does not keep to conditional writes" "$work/careless.txt" ||
    fail "$(cat "$work/careless.txt")"
done
[ -z "$("$bin/python" "$foreign/s3_names.py" careless)" ] || fail "something was written into the careless store"
say "refused: $(cat "$work/careless.txt")"

# --- a store that is slow ---
"$ntp" run "$pipeline" --store s3://slow/run --out "$work/slow" --to generate > "$work/slow.log" 2>&1 ||
  fail "$(cat "$work/slow.log")"
slowed=$(grep -c '" 503 ' "$work/server.txt")
[ "$slowed" -gt 0 ] || fail "the slow store was not slow"
diff -r "$work/whole/recordings" "$work/slow/recordings"
say "$slowed times told to slow down, and done"

# --- three machines ---
url=s3://runs/experiments/one
on() { "$ntp" "$2" "$pipeline" --store "$url" --out "$work/$1" "${@:3}" >> "$work/$1.log" 2>&1; }
start() { (exec "$ntp" "$2" "$pipeline" --store "$url" --out "$work/$1" "${@:3}" >> "$work/$1.log" 2>&1) & pids+=($!); }
left() { "$ntp" items "$pipeline" --store "$url" --stage "$1" --left --array; }

# Each machine does its part and that of the next, so that every item is done twice at a time.
stage() {
  local machine round=0 pids pid
  while [ -n "$(left "$1")" ]; do
    round=$((round + 1))
    [ "$round" -le 20 ] || fail "left of $1: $(left "$1")"
    pids=()
    for machine in 0 1 2; do
      start "n$machine" "$1" --jobs 1 --part "$machine/3"
      start "n$machine" "$1" --jobs 1 --part "$(((machine + 1) % 3))/3"
    done
    if [ "$kills" -gt 0 ]; then
      for pid in $(printf '%s\n' "${pids[@]}" | shuf -n 3); do
        sleep "0.$((RANDOM % 6))"
        if kill -9 "$pid" 2> /dev/null; then killed=$((killed + 1)) kills=$((kills - 1)); fi
      done
    fi
    for pid in "${pids[@]}"; do wait "$pid" || true; done
  done
  on n0 "$1" --commit
}
killed=0
on n1 tasks
on n2 generate --begin
stage generate 2>> "$work/killed.txt"
[ "$(ls "$work"/n?/recordings/*.mcap | wc -l)" -gt 0 ] || fail "nothing was recorded"
on n2 convert --items 0
stage train 2>> "$work/killed.txt"
stage rollout 2>> "$work/killed.txt"
on n1 report --items 0
say "three machines are done; $killed processes were killed"

# --- every file is that of one process, but for what tells of time and place ---
on reader run --fetch
for part in tasks recordings dataset models rollouts; do
  diff -r "$work/whole/$part" "$work/reader/$part"
done
"$ntp" validate "$work/reader" > "$work/validate.txt" || [ $? -eq 3 ]
"$bin/python" "$foreign/s3_names.py" runs > "$work/names.txt"
say "all $(find "$work/whole"/{tasks,recordings,dataset,models,rollouts} -type f | wc -l) files are identical; the bucket has $(wc -l < "$work/names.txt") objects"
