"""Reads language columns with LeRobot's own reader and resolver, offline: language_reads.py EXPORT DATASET

EXPORT is what `ntp dataset export DATASET --labels language` wrote.
"""
import os
import sys
from importlib.metadata import version
from pathlib import Path

os.environ["HF_HUB_OFFLINE"] = "1"

import pyarrow.parquet
from lerobot.datasets.language_render import active_at
from lerobot.datasets.lerobot_dataset import LeRobotDataset

export, root = Path(sys.argv[1]), Path(sys.argv[2])
dataset = LeRobotDataset("ntp/local", root=export)
files = sorted(root.glob("ntp/calls/*/*.parquet"))
calls = pyarrow.concat_tables([pyarrow.parquet.read_table(file) for file in files]).to_pylist()
skills = {}
for call in calls:
    if call["instruction"] is not None:
        skills.setdefault(call["episode_index"], []).append(call)
n_frames = 0
for index in range(len(dataset)):
    frame = dataset[index]
    episode, at = int(frame["episode_index"]), int(frame["frame_index"])
    # The dataset's last episodes say as much as the first ones.
    if episode >= 20:
        break
    running = [call for call in skills[episode] if call["frame_begin"] <= at < call["frame_end"] - 1]
    said = {
        style: active_at(float(frame["timestamp"]), persistent=frame["language_persistent"], style=style)
        for style in ["plan", "subtask", "motion"]
    }
    assert all(row is not None for row in said.values()), (episode, at, said)
    if running:
        assert said["subtask"]["content"] == running[0]["instruction"], (episode, at, said["subtask"], running[0])
        n_frames += 1
    assert not frame["language_events"]
assert n_frames > 0
print(f"language of lerobot {version('lerobot')}: opened, the sub-task of {n_frames} frames is that of their calls")
