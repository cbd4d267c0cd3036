#!/usr/bin/env bash
# Builds the wheel, installs it in a fresh Python environment and runs its command there: wheel.sh WORK_DIR
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
work=$(work_folder "$1")
cd "$here/../.."
environment maturin-venv maturin
rm -rf "$work/wheels" "$work/fresh"
"$bin/maturin" build --release --out "$work/wheels" > "$work/maturin.txt" 2>&1
"${PYTHON:-python3}" -m venv "$work/fresh"
"$work/fresh/bin/pip" install --quiet --disable-pip-version-check "$work"/wheels/*.whl
cd "$work"
"$work/fresh/bin/ntp" --help > "$work/help.txt"
"$work/fresh/bin/ntp" tasks "$here/../../pipelines/smoke.toml" --out "$work/run" > "$work/tasks.txt"
echo "wheel: $("$work/fresh/bin/ntp" --version), $(du -m "$work"/wheels/*.whl | cut -f1) MB, installed and run"
