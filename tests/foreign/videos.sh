#!/usr/bin/env bash
# Decodes a dataset's videos with PyAV and ffprobe: videos.sh DATASET
# Apart from run.sh, because it needs ffprobe (Debian's package ffmpeg).
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
dataset=$1
if ! command -v ffprobe > /dev/null; then
    echo "videos.sh: no ffprobe; on Debian it is in the package ffmpeg" >&2
    exit 1
fi
environment videos-venv av numpy pillow pyarrow
"$bin/python" "$here/video_reads.py" "$dataset"
