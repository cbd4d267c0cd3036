#!/usr/bin/env bash
# Opens a dataset with the real LeRobot and has lerobot-doctor look at it, one line each; also its language columns and
# SARM's labels, where these were exported: lerobot.sh DATASET [LANGUAGE SARM]
# Apart from run.sh, because it installs PyTorch (some 6 GB, several minutes). Needs Python 3.12 or later.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
dataset=$1
python=${PYTHON:-python3}
if [ ! -d "$(environment_folder lerobot-venv)" ] && ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 12))'; then
    echo "lerobot.sh: $python is older than 3.12; name another: PYTHON=python3.12 $0 DATASET" >&2
    exit 1
fi
environment lerobot-venv "lerobot[dataset,sarm]==0.6.1" lerobot-doctor==0.2.0 pyarrow

"$bin/python" "$here/lerobot_reads.py" "$dataset"
# It warns of what a dataset without cameras and with short episodes must be; a failure ends this script.
"$bin/python" "$here/doctor_reads.py" "$dataset" "$bin/lerobot-doctor"
if [ $# -eq 3 ]; then
    "$bin/python" "$here/language_reads.py" "$2" "$dataset"
    "$bin/python" "$here/sarm_reads.py" "$3"
fi
