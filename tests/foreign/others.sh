#!/usr/bin/env bash
# Datasets written by LeRobot itself, of two versions: each is checked, asked, shown, edited and published here, and what
# comes of it is opened by LeRobot again: others.sh WORK_DIR. Needs Python 3.12; installs PyTorch (some 6 GB).
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
mkdir -p "$1"
work=$(work_folder "$1")
cd "$here/../.."
environment lerobot-venv "lerobot[dataset,sarm]==0.6.1" "torch<2.8" lerobot-doctor==0.2.0 pyarrow accelerate
older="$work/lerobot-0.4.4"
[ -d "$older" ] || "$bin/pip" install --quiet --no-deps --target "$older" lerobot==0.4.4
export HF_HUB_OFFLINE=1

[ -d "$work/0.6.1" ] || "$bin/python" "$here/others_write.py" "$work/0.6.1" > "$work/written-0.6.1.txt" 2>&1
[ -d "$work/0.4.4" ] || PYTHONPATH="$older" "$bin/python" "$here/others_write.py" "$work/0.4.4" > "$work/written-0.4.4.txt" 2>&1
for version in 0.6.1 0.4.4; do
    for dataset in "$work/$version"/*; do
        name="$version/$(basename "$dataset")"
        made="$work/made/$name"
        rm -rf "$made"
        mkdir -p "$made"
        ntp inspect "$dataset" > "$made/inspect.txt"
        ntp validate "$dataset" > "$made/validate.txt" || { [ $? = 3 ] || { cat "$made/validate.txt"; exit 1; }; }
        ntp query "$dataset" "SELECT episode_index, COUNT(*) AS n FROM frames GROUP BY episode_index ORDER BY episode_index" --csv > "$made/query.csv"
        ntp replay "$dataset" --episode 1 --save "$made/episode.rrd" > "$made/replay.txt"
        ntp dataset filter "$dataset" --episodes 0,2 --to "$made/filtered" > "$made/filter.txt"
        ntp dataset merge "$dataset" "$made/filtered" --to "$made/merged" > "$made/merge.txt"
        ntp dataset split "$dataset" --by task --to "$made/parts" > "$made/split.txt"
        ntp dataset merge "$dataset" --to "$made/same" > "$made/same.txt"
        ntp dataset diff "$dataset" "$made/same" > "$made/diff.txt"
        ntp publish "$made/merged" --to "$made/published" --license mit --date 2026-01-01 > "$made/publish.txt" 2>&1 || [ $? = 3 ]
        ntp verify "$made/published" > "$made/verify.txt"
        "$bin/python" "$here/others_read.py" "$name" "$dataset" "$made" 2> "$made/read.txt"
        "$bin/python" "$here/doctor_reads.py" "$made/merged" "$bin/lerobot-doctor"
    done
done
