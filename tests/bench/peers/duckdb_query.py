"""Ten million frame rows, grouped by program, by `ntp query` and by DuckDB in one run: query.py NTP DATASET WORK_DIR

The rows are those of a dataset, its files of frames listed again and again until there are ten million, so both read
what `ntp convert` writes. Each is a process of its own, started three times; the best time counts.
Needs: pip install duckdb
"""
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROWS = 10_000_000
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


def best(name: str, command: list) -> str:
    runs = [measured(command) for _ in range(3)]
    wall, cpu, megabytes, printed = min(runs)
    print(f"{name}: {wall:.2f} s, {cpu:.2f} CPU-s, {megabytes:.0f} MB")
    return printed


ntp, dataset, work = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
root, rows = repeated(dataset, work)
print(f"{rows} rows in {len(list(root.glob('data/*/*.parquet')))} files")
ours = json.loads(best("ntp query", [ntp, "query", str(root), SQL.format("frames"), "--json"]))
files = f"read_parquet('{root}/data/*/*.parquet')"
theirs = json.loads(best("DuckDB", [sys.executable, "-c", DUCKDB, SQL.format(files)]))
columns = ["program", "frames", "longest"]
assert [[row[column] for column in columns] for row in ours] == theirs, (ours, theirs)
assert sum(row["frames"] for row in ours) == rows
print(f"the same {len(ours)} groups")
