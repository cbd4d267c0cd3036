"""A dataset with a 64-pixel picture a frame, written by LeRobot, beside `convert_images_64` of `cargo bench`: OUT

Boundary frames of demonstrations of four goals: 17 a demonstration. Pictures are drawn at random around a grey, and
made before the clock starts, as are positions. Importing and starting cost nothing here.
Needs: Python 3.12; pip install "lerobot[dataset]"
"""

import json
import os
import shutil
import sys
from importlib.metadata import version

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

EPISODES, FRAMES = 20, 17

out = sys.argv[1]
shutil.rmtree(out, ignore_errors=True)
features = {
    "observation.images.front": {"dtype": "image", "shape": (64, 64, 3), "names": ["height", "width", "channels"]},
    "observation.state": {"dtype": "float32", "shape": (27,), "names": None},
    "action": {"dtype": "float32", "shape": (4,), "names": None},
}
dataset = LeRobotDataset.create("bench/episodes", fps=10, features=features, root=out, use_videos=False)
rng = np.random.default_rng(0)
pictures = (128 + rng.integers(-8, 8, (FRAMES, 64, 64, 3))).astype(np.uint8)
states = rng.random((FRAMES, 27), dtype=np.float32)


def cpu_secs() -> float:
    """Of this process, its threads and the children that it waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


begin = cpu_secs()
for _ in range(EPISODES):
    for picture, state in zip(pictures, states):
        row = {"observation.images.front": picture, "observation.state": state, "action": state[:4], "task": "stack"}
        dataset.add_frame(row)
    dataset.save_episode()
if hasattr(dataset, "finalize"):
    dataset.finalize()
print(json.dumps({"peer": f"LeRobot {version('lerobot')}", "value": EPISODES / (cpu_secs() - begin)}))
