"""Opens a dataset with LeRobot's own reader, offline: lerobot_reads.py DATASET"""
import json
import os
import sys
from importlib.metadata import version
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import pyarrow.parquet
from lerobot.datasets.lerobot_dataset import LeRobotDataset

root = Path(sys.argv[1])
info = json.loads((root / "meta/info.json").read_text())
episodes = pyarrow.parquet.read_table(root / "ntp/episodes.parquet").to_pydict()
cameras = {name: feature for name, feature in info["features"].items() if feature["dtype"] in ("image", "video")}

dataset = LeRobotDataset("ntp/local", root=root)
assert dataset.num_episodes == info["total_episodes"] == len(episodes["n_frames"])
assert dataset.num_frames == len(dataset) == info["total_frames"] == sum(episodes["n_frames"])
assert set(dataset.meta.camera_keys) == set(cameras)
width = info["features"]["observation.state"]["shape"][0]
first_rows = [sum(episodes["n_frames"][:episode]) for episode in range(len(episodes["n_frames"]))]
n_pictures = 0
# The first frame of the first, a middle and the last episode: numbers, shapes, pictures, and the task's text.
for episode in {0, len(first_rows) // 2, len(first_rows) - 1}:
    frame = dataset[first_rows[episode]]
    assert (int(frame["episode_index"]), int(frame["frame_index"])) == (episode, 0), frame
    assert frame["observation.state"].shape == (width,) and frame["action"].shape == (4,)
    assert frame["task"] == episodes["task_text"][episode], frame["task"]
    for name, feature in cameras.items():
        height, breadth, channels = feature["shape"]
        assert frame[name].shape == (channels, height, breadth), (name, frame[name].shape)
        assert 0.0 <= float(frame[name].min()) < float(frame[name].max()) <= 1.0, name
        n_pictures += 1

# Windows in time over some episodes, as policies ask for them.
step = 1 / info["fps"]
windows = {"observation.state": [-step, 0.0], "action": [0.0, step, 2 * step]}
last = len(first_rows) - 1
chosen = LeRobotDataset("ntp/local", root=root, episodes=[0, last], delta_timestamps=windows)
assert len(chosen) == episodes["n_frames"][0] + episodes["n_frames"][last]
assert chosen[0]["observation.state"].shape == (2, width) and chosen[0]["action"].shape == (3, 4)
told = f"{dataset.num_episodes} episodes, {dataset.num_frames} frames, {len(dataset.meta.tasks)} tasks"
print(f"lerobot {version('lerobot')}: opened, {told}" + (f", {n_pictures} pictures" if cameras else ""))
