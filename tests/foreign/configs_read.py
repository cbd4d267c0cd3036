"""Loads every configuration of a published folder's card with Hugging Face's library: configs_read.py FOLDER"""
import json
import os
import sys
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import datasets

datasets.disable_progress_bars()
root = Path(sys.argv[1])
cache = root.with_name(f"{root.name}-cache")
info, own = (json.loads((root / name).read_text()) for name in ["meta/info.json", "ntp/info.json"])
rows = {
    "episodes": info["total_episodes"],
    "frames": info["total_frames"],
    "calls": own["total_calls"],
    "scopes": own["total_scopes"],
}
assert datasets.get_dataset_default_config_name(str(root)) == "frames"
assert set(datasets.get_dataset_config_names(str(root))) == set(rows)
for name, expected in rows.items():
    found = datasets.load_dataset(str(root), name, split="train", cache_dir=str(cache))
    assert found.num_rows == expected, (name, found.num_rows, expected)
print(f"datasets {datasets.__version__}: opened, " + ", ".join(f"{count} {name}" for name, count in rows.items()))
