#!/usr/bin/env bash
# Decodes a dataset's videos with PyAV and ffprobe: videos.sh DATASET
# Apart from run.sh, because it needs ffprobe (Debian's package ffmpeg).
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
dataset=$1
if ! command -v ffprobe > /dev/null; then
    echo "videos.sh: no ffprobe; on Debian it is in the package ffmpeg" >&2
    exit 1
fi
venv="${XDG_CACHE_HOME:-$HOME/.cache}/ntp/videos-venv"
if [ ! -x "$venv/bin/python" ]; then python3 -m venv "$venv"; fi
"$venv/bin/pip" install --quiet --disable-pip-version-check av numpy pillow pyarrow
"$venv/bin/python" "$here/video_reads.py" "$dataset"
