"""Decodes a dataset's videos with PyAV and has ffprobe count them: video_reads.py DATASET

Every picture must lie where LeRobot's format says: that of an episode's frame i at from_timestamp + i / fps. Where the
dataset has the same camera twice, as images in NAME and as a video in NAME_video, pictures are compared too.
"""
import glob
import io
import json
import subprocess
import sys
from pathlib import Path

import av
import numpy
import pyarrow.parquet
from PIL import Image

# What H.264 may lose: mean difference of a picture's bytes.
MOST_LOST = 6.0

root = Path(sys.argv[1])
info = json.loads((root / "meta/info.json").read_text())
fps = info["fps"]
videos = [name for name, feature in info["features"].items() if feature["dtype"] == "video"]
assert videos, "there is no video in this dataset"
files = sorted(glob.glob(str(root / "meta/episodes/*/*.parquet")))
episodes = [row for file in files for row in pyarrow.parquet.read_table(file).to_pylist()]


def decoded(path):
    """All pictures of a file, and when each is shown."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264" and not stream.codec_context.has_b_frames
        frames = list(container.decode(stream))
        return [frame.to_ndarray(format="rgb24") for frame in frames], [frame.time for frame in frames]


def sought(path, seconds):
    """The picture at a time, found as LeRobot does: back to a key frame, then forward."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        container.seek(round(seconds / stream.time_base), stream=stream)
        for frame in container.decode(stream):
            if abs(frame.time - seconds) < 1e-4:
                return frame.to_ndarray(format="rgb24")
    raise AssertionError(f"{path}: no picture at {seconds} s")


def probed(path):
    """What ffprobe finds: the number of pictures it decodes, and their rate."""
    command = ["ffprobe", "-v", "error", "-select_streams", "v:0", "-count_frames", "-show_entries",
               "stream=nb_read_frames,r_frame_rate,codec_name,has_b_frames", "-of", "json", str(path)]
    output = subprocess.run(command, check=True, capture_output=True, text=True)
    assert not output.stderr, output.stderr
    return json.loads(output.stdout)["streams"][0]


def images(feature):
    """The pictures of an image feature, row by row."""
    for file in sorted(glob.glob(str(root / "data/*/*.parquet"))):
        for row in pyarrow.parquet.read_table(file, columns=[feature]).column(0).to_pylist():
            yield numpy.asarray(Image.open(io.BytesIO(row["bytes"])))


for feature in videos:
    height, width, _ = info["features"][feature]["shape"]
    pictures, worst, n_files = [], 0.0, 0
    open_path = None
    for episode in episodes:
        chunk, number, begin, end = (
            episode[f"videos/{feature}/{name}"] for name in ("chunk_index", "file_index", "from_timestamp", "to_timestamp")
        )
        path = root / info["video_path"].format(video_key=feature, chunk_index=chunk, file_index=number)
        if path != open_path:
            open_path, n_files = path, n_files + 1
            frames, times = decoded(path)
            assert all(abs(time - at / fps) < 1e-9 for at, time in enumerate(times)), f"{path}: not {fps} a second"
            found = probed(path)
            assert found["codec_name"] == "h264" and found["has_b_frames"] == 0, found
            assert int(found["nb_read_frames"]) == len(frames) and found["r_frame_rate"] == f"{fps}/1", found
        first = round(begin * fps)
        own = frames[first : first + episode["length"]]
        assert len(own) == episode["length"] and abs(end - begin - len(own) / fps) < 1e-9
        assert all(picture.shape == (height, width, 3) for picture in own)
        for at in {0, len(own) // 2, len(own) - 1}:
            assert (sought(path, begin + at / fps) == own[at]).all(), f"{path}: another picture after seeking"
        pictures.extend(own)
    assert len(pictures) == info["total_frames"]
    same = feature.removesuffix("_video")
    if same != feature and info["features"].get(same, {}).get("dtype") == "image":
        differences = [numpy.abs(a.astype(int) - b).mean() for a, b in zip(pictures, images(same), strict=True)]
        worst = max(differences)
        assert worst < MOST_LOST, f"{feature}: picture {differences.index(worst)} is off by {worst:.1f}"
    compared = f", at most {worst:.2f} of 255 from {same}" if worst else ""
    print(f"{feature}: {len(pictures)} pictures in {n_files} files, by PyAV and ffprobe frame by frame{compared}")
