"""Reads every table of a dataset with pyarrow, Polars and DuckDB; their counts must agree: dataset_reads.py DATASET"""
import json
import sys
from pathlib import Path

import duckdb
import polars
import pyarrow.parquet

TABLES = {
    "frames": "data/*/*.parquet",
    "episodes (LeRobot)": "meta/episodes/*/*.parquet",
    "tasks": "meta/tasks.parquet",
    "subtasks": "meta/subtasks.parquet",
    "episodes": "ntp/episodes.parquet",
    "calls": "ntp/calls/*/*.parquet",
    "scopes": "ntp/scopes/*/*.parquet",
}
READERS = {
    "pyarrow": (pyarrow, lambda files: sum(pyarrow.parquet.read_table(file).num_rows for file in files)),
    "Polars": (polars, lambda files: sum(polars.read_parquet(file).height for file in files)),
    "DuckDB": (duckdb, lambda files: duckdb.read_parquet([str(file) for file in files]).fetchnumpy().popitem()[1].size),
}

root = Path(sys.argv[1])
info, own = (json.loads((root / name).read_text()) for name in ["meta/info.json", "ntp/info.json"])
expected = {
    "frames": info["total_frames"],
    "episodes (LeRobot)": info["total_episodes"],
    "tasks": info["total_tasks"],
    "episodes": info["total_episodes"],
    "calls": own["total_calls"],
    "scopes": own["total_scopes"],
}
for reader, (module, count) in READERS.items():
    counts = {}
    for name, pattern in TABLES.items():
        files = sorted(root.glob(pattern))
        assert files, f"no file {pattern}"
        counts[name] = count(files)
    assert counts | expected == counts, (reader, counts, expected)
    told = ", ".join(f"{counts[name]} {name}" for name in ["episodes", "frames", "calls", "scopes", "tasks"])
    print(f"{reader} {module.__version__}: opened, {told}")
# What LeRobot does: the task's text is the pandas index, and its row is its number.
tasks = pyarrow.parquet.read_table(root / "meta/tasks.parquet").to_pandas()
assert tasks.iloc[0].name == tasks.index[0] and isinstance(tasks.index[0], str), tasks.head()
