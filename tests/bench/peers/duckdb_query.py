"""Ten million frame rows, grouped by program, by `ntp query` and by DuckDB by turns: NTP DATASET WORK_DIR

The rows are those of a dataset, its files of frames listed again and again until there are ten million, so both read
what `ntp convert` writes. Each is a process of its own, started five times; the median counts. Prints queries a
second of both, and their CPU-seconds and memory.
Needs: pip install duckdb
"""
import json
import os
import shutil
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

ROWS, RUNS = 10_000_000, 5
SQL = 'SELECT "ntp.program" AS program, COUNT(*) AS frames, MAX("ntp.time_secs") AS longest FROM {} GROUP BY 1 ORDER BY 2 DESC, 1'
DUCKDB = "import duckdb, json, sys; print(json.dumps(duckdb.sql(sys.argv[1]).fetchall()))"


def repeated(dataset: Path, work: Path) -> tuple[Path, int]:
    """A dataset whose files of frames are links to those of another."""
    root = work / "rows"
    shutil.rmtree(root, ignore_errors=True)
    for part in ["meta", "ntp"]:
        shutil.copytree(dataset / part, root / part)
    info = json.loads((dataset / "meta/info.json").read_text())
    times = -(-ROWS // info["total_frames"])
    files = sorted(dataset.glob("data/*/*.parquet"))
    for at in range(times * len(files)):
        link = root / f"data/chunk-{at // 1000:03d}/file-{at % 1000:03d}.parquet"
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(files[at % len(files)].resolve())
    info["total_frames"] *= times
    (root / "meta/info.json").write_text(json.dumps(info))
    return root, info["total_frames"]


def measured(command: list) -> tuple[float, float, float, str]:
    """Wall seconds, CPU seconds, megabytes at most, and what was printed."""
    began = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    printed = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, command
    return time.monotonic() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, printed


def median(runs: list) -> tuple:
    return sorted(runs)[len(runs) // 2]


ntp, dataset, work = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
root, rows = repeated(dataset, work)
files = f"read_parquet('{root}/data/*/*.parquet')"
commands = [
    [ntp, "query", str(root), SQL.format("frames"), "--json"],
    [sys.executable, "-c", DUCKDB, SQL.format(files)],
]
runs = [[measured(command) for command in commands] for _ in range(RUNS)]
(ours, theirs) = (median([run[side] for run in runs]) for side in range(2))
found, expected = json.loads(ours[3]), json.loads(theirs[3])
columns = ["program", "frames", "longest"]
assert [[row[column] for column in columns] for row in found] == expected, (found, expected)
assert sum(row["frames"] for row in found) == rows
for name, (wall, cpu, megabytes, _) in [("ntp query", ours), ("DuckDB", theirs)]:
    print(f"{name}: {wall:.2f} s, {cpu:.2f} CPU-s, {megabytes:.0f} MB", file=sys.stderr)
value = {"ours": 1 / ours[0], "peer": f"DuckDB {version('duckdb')}", "value": 1 / theirs[0]}
print(json.dumps({**value, "cpu_secs": [ours[1], theirs[1]], "megabytes": [ours[2], theirs[2]]}))
