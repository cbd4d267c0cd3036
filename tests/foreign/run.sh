#!/usr/bin/env bash
# Opens a run directory's files with other programs' readers: run.sh RUN_DIR WORK_DIR
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
run=$1
work=$2
mkdir -p "$work"
venv="${XDG_CACHE_HOME:-$HOME/.cache}/ntp/foreign-venv"
if [ ! -x "$venv/bin/python" ]; then python3 -m venv "$venv"; fi
"$venv/bin/pip" install --quiet --disable-pip-version-check mcap mcap-protobuf-support pyarrow pandas polars duckdb mlcroissant==1.1.1 datasets rerun-sdk==0.36.3

for recording in "$run"/recordings/*.mcap; do
    "$venv/bin/python" "$here/mcap_reads.py" "$recording"
    break
done
"$venv/bin/python" "$here/dataset_reads.py" "$run/dataset"
cargo run --quiet --release -- replay "$run/recordings" --episode 0 --save "$work/episode.rrd"
"$venv/bin/rerun" rrd verify "$work/episode.rrd"
"$venv/bin/rerun" rrd stats "$work/episode.rrd" > "$work/stats.txt"
echo "rerun: accepts episode.rrd"
cargo run --quiet --release -- publish "$run/dataset" --to "$work/published" --license cc-by-4.0 --date 2026-01-01
(cd "$work/published" && sha256sum --quiet -c SHA256SUMS)
"$venv/bin/python" "$here/croissant_reads.py" "$work/published"
"$venv/bin/python" "$here/configs_read.py" "$work/published"
