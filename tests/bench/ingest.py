"""`ntp ingest` beside `forge convert` on one MCAP file: ingest.py WORK_DIR NTP [MEGABYTES [jpeg | raw]]

ROS 2 messages as a robot records them: two cameras of 640x480 at 30 Hz, joint states at 100 Hz, commands at 30 Hz.
Pictures are JPEG, or raw: forge-robotics 0.2 finds no size in compressed ones and stops. Says CPU-seconds (user and
system), the greatest memory, and the ratio; of raw pictures stored as PNG, and encoded as H.264. Needs forge-robotics,
opencv-python-headless, av, mcap-ros2-support, pillow and numpy.
"""

import io
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys

import numpy as np

STAMP = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
JOINTS = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" + STAMP
IMAGE = {
    "jpeg": ("CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data" + STAMP, "/image/compressed"),
    "raw": (
        "Image",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
        "uint8[] data" + STAMP,
        "/image",
    ),
}
NAMES = [f"joint_{at}" for at in range(7)]
MAP = """
fps = 30
robot_type = "bench"
task = "put one thing on another"
[[feature]]
name = "observation.state"
from = [{ topic = "/joint_states", field = "position" }]
[[feature]]
name = "action"
from = [{ topic = "/command", field = "position" }]
[[feature]]
name = "observation.images.front"
from = [{ topic = "/frontIMAGE" }]
STORE
[[feature]]
name = "observation.images.wrist"
from = [{ topic = "/wristIMAGE" }]
STORE
"""


def pictures(form):
    """Sixty pictures of a moving pattern with grain, about 90 kB each as JPEG."""
    from PIL import Image

    dice, made = np.random.default_rng(0), []
    y, x = np.mgrid[0:480, 0:640]
    for frame in range(60):
        base = 127 + 80 * np.sin(x / 30 + frame / 5)[..., None] * np.cos(y / 40)[..., None] * np.array([1, 0.7, 0.4])
        pixels = np.clip(base + dice.normal(0, 14, (480, 640, 3)), 0, 255).astype(np.uint8)
        data = io.BytesIO()
        Image.fromarray(pixels).save(data, "JPEG", quality=85)
        made.append(data.getvalue() if form == "jpeg" else pixels.tobytes())
    return made


def shown(form, data):
    if form == "jpeg":
        return {"format": "jpeg", "data": data}
    return {"height": 480, "width": 640, "encoding": "rgb8", "is_bigendian": 0, "step": 1920, "data": data}


def write(path, megabytes, form):
    from mcap_ros2.writer import Writer

    made = pictures(form)
    name, definition, topic = IMAGE[form]
    with open(path, "wb") as file:
        writer = Writer(file)
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
        image = writer.register_msgdef(f"sensor_msgs/msg/{name}", definition)
        step, n_bytes = 0, 0
        while n_bytes < megabytes * 10**6:
            now = 10**9 + step * 10**9 // 300
            header = {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": ""}
            put = lambda topic, schema, of: writer.write_message(topic, schema, of, log_time=now, publish_time=now)
            values = np.sin(now / 1e9 + np.arange(7)).tolist()
            state = {"header": header, "name": NAMES, "position": values, "velocity": values, "effort": values}
            if step % 3 == 0:
                put("/joint_states", joints, state)
            if step % 10 == 0:
                put("/command", joints, state)
                for at, camera in enumerate(["front", "wrist"]):
                    picture = made[(step // 10 + 30 * at) % len(made)]
                    put(f"/{camera}{topic}", image, {"header": header, **shown(form, picture)})
                    n_bytes += len(picture)
            step += 1
        writer.finish()


def measured(name, command):
    """CPU-seconds and greatest memory of a command, by its own process."""
    code = (
        "import json,resource,subprocess,sys\n"
        "done=subprocess.run(sys.argv[1:],stdout=sys.stderr)\n"
        "used=resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(json.dumps([done.returncode,used.ru_utime+used.ru_stime,used.ru_maxrss/1024]))"
    )
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True)
    status, secs, megabytes = json.loads(done.stdout.strip().splitlines()[-1])
    print(f"{name}: {secs:.1f} CPU-s, at most {megabytes:.0f} MB, exit code {status}")
    if status:
        print(done.stderr[-2000:])
    return secs


def main():
    work, ntp = pathlib.Path(sys.argv[1]), sys.argv[2]
    megabytes = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    form = sys.argv[4] if len(sys.argv) > 4 else "jpeg"
    work.mkdir(parents=True, exist_ok=True)
    file, chart = work / f"bench-{form}-{megabytes}.mcap", work / "map.toml"
    if not file.exists():
        write(file, megabytes, form)
    print(f"{file.name}: {file.stat().st_size / 1e6:.0f} MB")
    shutil.rmtree(work / "theirs", ignore_errors=True)
    forge = pathlib.Path(sys.executable).parent / "forge"
    theirs = measured("forge convert", [str(forge), "convert", str(file), str(work / "theirs"), "--format", "lerobot-v3"])
    for store in ["as_is"] if form == "jpeg" else ["as_is", "h264"]:
        shutil.rmtree(work / "ours", ignore_errors=True)
        chart.write_text(MAP.replace("IMAGE", IMAGE[form][2]).replace("STORE", f'store = "{store}"'))
        name = f"ntp ingest, pictures {store}"
        ours = measured(name, [ntp, "ingest", str(file), "--map", str(chart), "--to", str(work / "ours")])
        print(f"forge takes {theirs / ours:.1f} times the CPU-seconds")


if __name__ == "__main__":
    main()
