"""Loads every configuration of a published folder's card with Hugging Face's library: configs_read.py FOLDER"""
import json
import os
import sys
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import datasets

root = Path(sys.argv[1])
cache = root.with_name(f"{root.name}-cache")
info, own = (json.loads((root / name).read_text()) for name in ["meta/info.json", "ntp/info.json"])
rows = {
    "frames": info["total_frames"],
    "episodes": info["total_episodes"],
    "calls": own["total_calls"],
    "scopes": own["total_scopes"],
}
assert datasets.get_dataset_default_config_name(str(root)) == "frames"
assert set(datasets.get_dataset_config_names(str(root))) == set(rows)
for name, expected in rows.items():
    found = datasets.load_dataset(str(root), name, split="train", cache_dir=str(cache))
    assert found.num_rows == expected, (name, found.num_rows, expected)
    print(f"datasets: {name}: {found.num_rows} rows of {len(found.column_names)} columns")
