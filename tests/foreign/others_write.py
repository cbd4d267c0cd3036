"""Writes small datasets with LeRobot's own writer: others_write.py FOLDER

Two tasks, 15 frames a second, two cameras of different sizes; AV1, H.264, HEVC and PNG, features of every kind,
`subtask_index`, and, where LeRobot knows them, language columns."""
import json
import sys
from pathlib import Path

import lerobot
import numpy as np

try:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset
except ImportError:
    from lerobot.datasets import LeRobotDataset

folder = Path(sys.argv[1])
folder.mkdir(parents=True)
try:
    from lerobot.configs.video import RGBEncoderConfig
except ImportError:
    RGBEncoderConfig = None
FPS, LENGTHS = 15, (24, 18, 30)
TASKS = ["pick the cube", "open the drawer"]
TWO = {"front": (48, 64), "wrist": (64, 96)}


def picture(height, width, episode, frame):
    y, x = np.mgrid[0:height, 0:width]
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[..., 0] = (x * 3 + frame * 5) % 256
    pixels[..., 1] = (y * 3 + episode * 40) % 256
    pixels[(frame * 2) % height :, (frame * 3) % width :, 2] = 255
    return pixels


def write(name, cameras, videos=True, codec=None, further=None, of_frame=None):
    features = {
        "observation.state": {"dtype": "float32", "shape": (4,), "names": ["a", "b", "c", "d"]},
        "action": {"dtype": "float32", "shape": (2,), "names": ["x", "y"]},
        **(further or {}),
    }
    for camera, (height, width) in cameras.items():
        names = ["height", "width", "channels"]
        features[f"observation.images.{camera}"] = {"dtype": "video" if videos else "image", "shape": (height, width, 3), "names": names}
    settings = {}
    if codec:
        settings = {"rgb_encoder": RGBEncoderConfig(vcodec=codec)} if RGBEncoderConfig else {"vcodec": codec}
    dataset = LeRobotDataset.create("me/" + name, FPS, features, root=folder / name, robot_type="so101", use_videos=videos, **settings)
    numbers = np.random.default_rng(0)
    for episode, length in enumerate(LENGTHS):
        for frame in range(length):
            row = {"observation.state": numbers.normal(size=4).astype(np.float32), "action": np.array([np.sin(frame / 5), episode], np.float32), "task": TASKS[episode % 2]}
            row |= {f"observation.images.{camera}": picture(*size, episode, frame) for camera, size in cameras.items()}
            row |= of_frame(episode, frame, length) if of_frame else {}
            dataset.add_frame(row)
        dataset.save_episode()
    dataset.finalize()


def one(dtype, shape=(1,)):
    return {"dtype": dtype, "shape": shape, "names": None}


def language(name):
    """LeRobot's writer leaves language columns to annotation tools; as these do, they are added to what it wrote."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    text = pa.string()
    entry = pa.struct([("role", text), ("content", text), ("style", text), ("timestamp", pa.float32()), ("camera", text), ("tool_calls", pa.list_(text))])
    path = folder / name / "data/chunk-000/file-000.parquet"
    table = pq.read_table(path)
    episodes, rows = table["episode_index"].to_pylist(), []
    for episode in episodes:
        starts = [("reach", "subtask", 0.0), ("lift", "subtask", np.float32(LENGTHS[episode] // 2 / FPS))]
        rows.append([{"role": "assistant", "content": text, "style": style, "timestamp": float(secs), "camera": None, "tool_calls": None} for text, style, secs in starts])
    column = pa.array(rows, pa.list_(entry))
    pq.write_table(table.append_column("language_persistent", column), path)
    info = json.loads((folder / name / "meta/info.json").read_text())
    info["features"]["language_persistent"] = {"dtype": "language", "shape": [1], "names": None}
    (folder / name / "meta/info.json").write_text(json.dumps(info))


write("av1", TWO)
write("h264", TWO, codec="h264")
write("hevc", {"front": (48, 64)}, codec="hevc")
write("png", TWO, videos=False)
kinds = {"next.reward": one("float32"), "next.done": one("bool"), "cmd": one("int64", (3,)), "mat": one("float32", (2, 3)), "note": one("string")}
write("kinds", {}, further=kinds, of_frame=lambda episode, frame, length: {
    "next.reward": np.array([frame / length], np.float32), "next.done": np.array([frame == length - 1]),
    "cmd": np.array([frame, episode, 1], np.int64), "mat": np.full((2, 3), frame, np.float32), "note": f"n{frame}"})
write("subtask", TWO, further={"subtask_index": one("int64")}, of_frame=lambda episode, frame, length: {"subtask_index": np.array([frame * 3 // length], np.int64)})
if RGBEncoderConfig:
    write("language", {"front": (48, 64)})
    language("language")
print("lerobot", lerobot.__version__ if hasattr(lerobot, "__version__") else "")
