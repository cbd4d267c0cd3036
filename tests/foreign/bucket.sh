#!/usr/bin/env bash
# Publishes a dataset to a server on this machine that speaks S3, and checks it there: bucket.sh DATASET WORK_DIR
# Builds the program with the feature `cloud`. The server is moto's, from PyPI.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
dataset=$(cd "$1" && pwd)
work=$(work_folder "$2")
cd "$here/../.."
environment bucket-venv "moto[server,s3]==5.*" boto3
cargo build --quiet --release --features cloud
ntp=${CARGO_TARGET_DIR:-target}/release/ntp

export AWS_ACCESS_KEY_ID=test AWS_SECRET_ACCESS_KEY=test AWS_REGION=us-east-1 AWS_ALLOW_HTTP=true
rm -f "$work/port"
"$bin/python" "$here/s3_server.py" "$work/port" > "$work/server.txt" 2>&1 &
server=$!
trap 'kill "$server"' EXIT
for _ in $(seq 100); do [ -s "$work/port" ] && break; sleep 0.1; done
AWS_ENDPOINT="http://127.0.0.1:$(cat "$work/port")"
export AWS_ENDPOINT
"$bin/python" "$here/s3_check.py" "$ntp" "$dataset" "$work"
