#!/usr/bin/env bash
# Opens a run directory's files with other programs' readers, one line each: run.sh RUN_DIR WORK_DIR
# LEROBOT=1 asks for LeRobot and lerobot-doctor too, which install PyTorch (some 6 GB) and need Python 3.12.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
run=$(cd "$1" && pwd)
work=$(work_folder "$2")
cd "$here/../.."
environment foreign-venv mcap mcap-protobuf-support pyarrow pandas polars duckdb mlcroissant==1.1.1 datasets rerun-sdk==0.36.3

for recording in "$run"/recordings/*.mcap; do
    "$bin/python" "$here/mcap_reads.py" "$recording"
    break
done
"$bin/python" "$here/dataset_reads.py" "$run/dataset"
NTP_DATASET="$run/dataset" cargo test --quiet --release --test it reruns_reader_opens_the_dataset_that_is_named -- --nocapture | grep '^re_lerobot'
ntp replay "$run/recordings" --episode 0,1,2 --save "$work/episodes.rrd" --json > "$work/replay.json"
ntp replay "$run/dataset" --episode 0 --save "$work/dataset.rrd" > "$work/dataset.txt"
for file in episodes dataset; do
    "$bin/rerun" rrd verify "$work/$file.rrd" > "$work/verify.txt" 2>&1
    "$bin/rerun" rrd stats "$work/$file.rrd" > "$work/$file-stats.txt" 2>&1
done
"$bin/python" "$here/rrd_reads.py" "$work/episodes.rrd" "$work/replay.json"
rm -rf "$work/published"
ntp publish "$run/dataset" --to "$work/published" --license cc-by-4.0 --date 2026-01-01 > "$work/publish.txt" 2>&1
(cd "$work/published" && sha256sum --quiet -c SHA256SUMS)
"$bin/python" "$here/croissant_reads.py" "$work/published" 2> "$work/croissant.txt"
"$bin/python" "$here/configs_read.py" "$work/published" 2> "$work/configs.txt"
if [ "${LEROBOT:-0}" = 1 ]; then
    rm -rf "$work/language" "$work/sarm"
    ntp dataset export "$run/dataset" --labels language --to "$work/language" > "$work/language.txt"
    ntp dataset export "$run/dataset" --labels sarm --to "$work/sarm" > "$work/sarm.txt"
    "$here/lerobot.sh" "$run/dataset" "$work/language" "$work/sarm"
    "$here/lerobot.sh" "$work/published"
fi
