"""Reads SARM's labels with LeRobot's own code for SARM, offline: sarm_reads.py EXPORT

EXPORT is what `ntp dataset export DATASET --labels sarm` wrote. Needs: pip install "lerobot[dataset,sarm]==0.6.1"
The network that SARM looks at pictures with would be fetched from the hub; what reads labels is called without it.
"""
import os
import sys
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

os.environ["HF_HUB_OFFLINE"] = "1"

import pyarrow.parquet
from lerobot.data_processing.sarm_annotations.subtask_annotation import load_annotations_from_dataset
from lerobot.datasets.dataset_metadata import LeRobotDatasetMetadata
from lerobot.rewards.sarm.modeling_sarm import SARMRewardModel
from lerobot.rewards.sarm.processor_sarm import SARMEncodingProcessorStep
from lerobot.rewards.sarm.sarm_utils import find_stage_and_tau

root = Path(sys.argv[1])
meta = LeRobotDatasetMetadata("ntp/local", root=root)
episodes = meta.episodes.to_pandas()
model = SimpleNamespace()
levels = {}
for level in ["sparse", "dense"]:
    path = root / f"meta/temporal_proportions_{level}.json"
    names, shares = SARMRewardModel._load_proportions_from_json(model, path, level)
    assert abs(sum(shares) - 1) < 1e-6, (level, sum(shares))
    levels[level] = dict(zip(names, shares, strict=True))
    annotated = load_annotations_from_dataset(root, level)
    assert len(annotated) == meta.total_episodes, (level, len(annotated))

step = SARMEncodingProcessorStep.__new__(SARMEncodingProcessorStep)
step.dataset_meta = meta
step.sparse_subtask_names, step.dense_subtask_names = list(levels["sparse"]), list(levels["dense"])
step._validate_annotation_columns()

# Each row's own sub-task must be the stage that SARM finds for the frame.
texts = pyarrow.parquet.read_table(root / "meta/subtasks.parquet").to_pydict()["subtask"]
rows = [pyarrow.parquet.read_table(file, columns=["subtask_index"]) for file in sorted(root.glob("data/*/*.parquet"))]
subtasks = [texts[index] for table in rows for index in table["subtask_index"].to_pylist()]
n_labels = n_frames = 0
for episode, row in episodes.iterrows():
    begin, length = int(row["dataset_from_index"]), int(row["length"])
    for level, shares in levels.items():
        names, starts, ends = step._load_episode_annotations(episode, episodes, level, list(shares))
        n_labels += len(names)
        assert list(starts) == sorted(starts) and all(start <= end for start, end in zip(starts, ends, strict=True))
        for frame in range(length):
            stage, tau = find_stage_and_tau(frame, length, names, starts, ends, list(shares), shares)
            assert 0 <= tau <= 1 and 0 <= stage < len(shares)
            # The last frame is the root's: SARM counts it for the sub-task before.
            if level == "sparse" and frame + 1 < length:
                assert list(shares)[stage] == subtasks[begin + frame], (episode, frame)
        n_frames += length
told = f"{meta.total_episodes} episodes, {n_labels} labels, the stage of {n_frames // 2} frames"
print(f"SARM of lerobot {version('lerobot')}: opened, {told}")
