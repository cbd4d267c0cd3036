#!/usr/bin/env bash
# Opens a dataset with the real LeRobot and has lerobot-doctor look at it, one line each; also its language columns and
# SARM's labels, where these were exported: lerobot.sh DATASET [LANGUAGE SARM]
# Apart from run.sh, because it installs PyTorch (some 6 GB, several minutes). Needs Python 3.12 or later.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
dataset=$1
python=${PYTHON:-python3}
venv="${XDG_CACHE_HOME:-$HOME/.cache}/ntp/lerobot-venv"
if [ ! -x "$venv/bin/python" ]; then
    if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 12))'; then
        echo "lerobot.sh: $python is older than 3.12; name another: PYTHON=python3.12 $0 DATASET" >&2
        exit 1
    fi
    "$python" -m venv "$venv"
fi
"$venv/bin/pip" install --quiet --disable-pip-version-check "lerobot[dataset,sarm]==0.6.1" lerobot-doctor==0.2.0 pyarrow

"$venv/bin/python" "$here/lerobot_reads.py" "$dataset"
# It warns of what a dataset without cameras and with short episodes must be; a failure ends this script.
"$venv/bin/python" "$here/doctor_reads.py" "$dataset" "$venv/bin/lerobot-doctor"
if [ $# -eq 3 ]; then
    "$venv/bin/python" "$here/language_reads.py" "$2" "$dataset"
    "$venv/bin/python" "$here/sarm_reads.py" "$3"
fi
