"""Opens with LeRobot what was made of a dataset that LeRobot wrote, and holds every frame against the source's:
others_read.py NAME SOURCE MADE"""
import sys
from pathlib import Path

import numpy as np
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset

name, source, made = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
# Counted anew where rows come to lie elsewhere.
PLACES = {"index", "episode_index", "task_index", "subtask_index"}


def opened(root):
    return LeRobotDataset("me/" + root.name, root=root, video_backend="pyav")


def equal(a, b):
    if isinstance(a, torch.Tensor):
        # Pictures of a video are decoded from the same packets: to the bit the same.
        return a.shape == b.shape and torch.equal(torch.nan_to_num(a), torch.nan_to_num(b))
    return a == b


def hold(result, rows_of_source):
    assert len(result) == len(rows_of_source), (len(result), len(rows_of_source))
    for at, row in enumerate(rows_of_source):
        found, expected = result[at], theirs[row]
        assert found.keys() == expected.keys(), found.keys() ^ expected.keys()
        for key in found.keys() - PLACES:
            assert equal(found[key], expected[key]), (at, key)
        assert int(found["index"]) == at


theirs = opened(source)
lengths = [int(n) for n in theirs.meta.episodes["length"]]
begins = np.cumsum([0, *lengths])
chosen = [row for episode in (0, 2) for row in range(begins[episode], begins[episode + 1])]
everything = list(range(len(theirs)))
hold(opened(made / "filtered"), chosen)
hold(opened(made / "merged"), everything + chosen)
hold(opened(made / "same"), everything)
hold(opened(made / "published"), everything + chosen)
same = opened(made / "same")
for feature, statistics in theirs.meta.stats.items():
    for statistic in ("min", "max", "mean", "std"):
        found, expected = same.meta.stats[feature][statistic], statistics[statistic]
        assert found.shape == expected.shape and np.allclose(found, expected, rtol=1e-3, atol=1e-4), (feature, statistic, found, expected)
n_parts = sum(1 for part in (made / "parts").iterdir() if opened(part).num_frames > 0)
print(f"lerobot: {name}: {len(everything)} frames in {len(lengths)} episodes, filtered, merged, published and in {n_parts} parts the same to the bit")
