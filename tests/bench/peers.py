"""Each figure beside its peer, by turns in one run: peers.py WORK_DIR [--only NAME,…] [--rounds N] [--python NAME=PATH,…]

Prints a Markdown table of medians with their ratio, and what the ratio is to be at least; exits with 1 where it is
less. Figures are a CPU-second's (user and system), but for the query, which counts wall time: both sides use all
cores there. Builds `cargo bench` and the program in release first. What a peer needs is said in its file of `peers/`;
--python names the Python for peers whose file begins so, such as lerobot=…/bin/python.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Figure, unit, the bench that measures ours, the peer's file, its arguments, the least ratio.
PAIRS = [
    ("MCAP to Parquet", "rows", "convert_rows", "pyarrow_rows", ["{run}/recordings", "{work}/rows_peer"], 20.0),
    ("dataset with pictures", "episodes", "convert_images_64", "lerobot_episodes", ["{work}/lerobot"], 200.0),
    ("64 pixels, colours, shadows, depths, segments", "pictures", "render_64", "mujoco_pictures", ["64", "all"], 10.0),
    ("64 pixels, its colours alone", "pictures", "render_64", "mujoco_pictures", ["64", "colours"], None),
    ("224 pixels, colours, shadows, depths, segments", "pictures", "render_224", "mujoco_pictures", ["224", "all"], None),
    ("224 pixels, its colours alone", "pictures", "render_224", "mujoco_pictures", ["224", "colours"], None),
    ("training", "decisions", "train_samples_paper", "pytorch_samples", [], 3.0),
    ("seven convolutions", "pictures", "train_convolutions_64", "pytorch_convolutions", [], 1.2),
    ("query of 10 million rows", "queries", None, "duckdb_query", ["{ntp}", "{run}/dataset", "{work}/query"], 0.85),
]


def built() -> tuple[Path, Path]:
    """The bench and the program."""
    command = ["cargo", "build", "--release", "--bench", "throughput", "--bin", "ntp", "--message-format", "json"]
    lines = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    found = (json.loads(line) for line in lines)
    files = {item["target"]["name"]: Path(item["executable"]) for item in found if item.get("executable")}
    return files["throughput"], files["ntp"]


def printed(command: list, **options) -> list[dict]:
    done = subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True, **options)
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def measure(pair: tuple, rounds: int, programs: dict, places: dict) -> tuple[list, list, dict]:
    """Values of ours and of the peer, and what the peer said last."""
    _, _, bench, peer, arguments, _ = pair
    arguments = [argument.format(**places) for argument in arguments]
    ours, theirs, said = [], [], {}
    for _ in range(rounds):
        if bench:
            ours += [line["value"] for line in printed([places["bench"], bench]) if line["name"] == bench]
        python = next((path for name, path in programs.items() if peer.startswith(name)), sys.executable)
        said = printed([python, HERE / "peers" / f"{peer}.py", *arguments])[-1]
        theirs.append(said["value"])
        if not bench:
            ours.append(said["ours"])
    return ours, theirs, said


def figure(value: float) -> str:
    return f"{value:,.0f}".replace(",", " ") if value >= 100 else f"{value:.3g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("work", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--python", default="")
    asked = parser.parse_args()
    wanted = [name for name in asked.only.split(",") if name]
    programs = dict(item.split("=", 1) for item in asked.python.split(",") if item)
    work = asked.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    bench, ntp = built()
    run = work / "run"
    pipeline = ROOT / "pipelines/quickstart.toml"
    subprocess.run([ntp, "run", pipeline, "--to", "convert", "--out", run], check=True, stdout=subprocess.DEVNULL)
    places = {"bench": bench, "ntp": ntp, "run": run, "work": work}
    print(f"{asked.rounds} rounds, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", file=sys.stderr)
    print("| what | ntp | peer | ratio | at least |")
    print("|---|---|---|---|---|")
    is_short = False
    for pair in PAIRS:
        name, unit, _, peer, _, bar = pair
        if wanted and not any(word in (name, peer) for word in wanted):
            continue
        ours, theirs, said = measure(pair, asked.rounds, programs, places)
        ratio = statistics.median(ours) / statistics.median(theirs)
        is_short |= bar is not None and ratio < bar
        second = "second" if unit == "queries" else "CPU-second"
        cells = [f"{name}, {unit} a {second}", figure(statistics.median(ours))]
        cells += [f"{figure(statistics.median(theirs))} ({said['peer']})", f"{ratio:.3g}x", f"{bar}x" if bar else "-"]
        print(f"| {' | '.join(cells)} |", flush=True)
    sys.exit(1 if is_short else 0)


if __name__ == "__main__":
    main()
