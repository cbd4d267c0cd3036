"""Reads recordings with Rerun's own reader; frames and calls must be those that were told: rrd_reads.py FILE.rrd REPLAY.json"""
import json
import sys
from importlib.metadata import version

import rerun.experimental

told = json.load(open(sys.argv[2]))["episodes"]
reader = rerun.experimental.RrdReader(sys.argv[1])
frames = calls = 0
for entry in reader.recordings():
    for chunk in reader.stream(store=entry):
        batch = chunk.to_record_batch()
        if chunk.entity_path == "/camera/front" and not chunk.is_static:
            frames += batch.num_rows
        if chunk.entity_path == "/calls" and not chunk.is_static:
            # The last line is the outcome.
            calls += batch.num_rows - 1
assert len(reader.recordings()) == len(told), (len(reader.recordings()), told)
assert frames == sum(episode["frames"] for episode in told), (frames, told)
assert calls == sum(episode["calls"] for episode in told), (calls, told)
assert len(reader.blueprints()) == 1
print(f"rerun {version('rerun-sdk')}: opened, {len(told)} recordings, {frames} frames, {calls} calls")
