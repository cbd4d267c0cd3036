"""Reads every table of a dataset with pyarrow, Polars and DuckDB; their counts must agree: dataset_reads.py DATASET"""
import json
import sys
from pathlib import Path

import duckdb
import polars
import pyarrow.parquet

root = Path(sys.argv[1])
info = json.loads((root / "meta/info.json").read_text())
tables = {
    "frames": "data/*/*.parquet",
    "episodes (LeRobot)": "meta/episodes/*/*.parquet",
    "tasks": "meta/tasks.parquet",
    "subtasks": "meta/subtasks.parquet",
    "episodes": "ntp/episodes.parquet",
    "calls": "ntp/calls/*/*.parquet",
    "scopes": "ntp/scopes/*/*.parquet",
}
counts = {}
for name, pattern in tables.items():
    files = sorted(root.glob(pattern))
    assert files, f"no file {pattern}"
    by_arrow = sum(pyarrow.parquet.read_table(file).num_rows for file in files)
    by_polars = sum(polars.read_parquet(file).height for file in files)
    by_duckdb = duckdb.sql(f"select count(*) from read_parquet('{root / pattern}')").fetchall()[0][0]
    assert by_arrow == by_polars == by_duckdb, (name, by_arrow, by_polars, by_duckdb)
    counts[name] = by_arrow
    print(f"pyarrow, polars, duckdb: {name}: {by_arrow} rows")
assert counts["frames"] == info["total_frames"], (counts["frames"], info["total_frames"])
assert counts["episodes"] == counts["episodes (LeRobot)"] == info["total_episodes"]
# What LeRobot does: the task's text is the pandas index, and its row is its number.
tasks = pyarrow.parquet.read_table(root / "meta/tasks.parquet").to_pandas()
assert tasks.iloc[0].name == tasks.index[0] and isinstance(tasks.index[0], str), tasks.head()
print(f"pandas: {len(tasks)} task texts, the first is {tasks.index[0]!r}")
