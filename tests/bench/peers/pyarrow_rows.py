"""Recordings to Parquet as one writes it in Python: RECORDINGS OUT

The rows that `ntp convert` writes: a frame at each boundary, and every program call. Fewer columns, no scoping labels,
no checks and no statistics. Importing and starting cost nothing here.
Needs: pip install mcap mcap-protobuf-support pyarrow
"""

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

TOPICS = ["/ntp/episode/start", "/tf", "/ntp/observation", "/ntp/call", "/ntp/return"]


class Table:
    """Rows, written a group at a time."""

    def __init__(self, path: Path):
        self.path, self.rows, self.writer, self.n_rows = path, [], None, 0

    def add(self, row: dict) -> None:
        self.rows.append(row)

    def flush(self, at_least: int = 1) -> None:
        if len(self.rows) >= at_least:
            table = pa.Table.from_pylist(self.rows)
            self.writer = self.writer or pq.ParquetWriter(self.path, table.schema, compression="snappy")
            self.writer.write_table(table)
            self.n_rows += len(self.rows)
            self.rows = []

    def close(self) -> None:
        self.flush()
        self.writer.close()


def convert(recordings: Path, out: Path) -> int:
    frames, calls = Table(out / "frames.parquet"), Table(out / "calls.parquet")
    episode, transforms, returns = -1, None, {}
    factory = DecoderFactory()

    for path in sorted(recordings.glob("*.mcap")):
        decoders = {}

        def decoded(schema, message):
            if schema.id not in decoders:
                decoders[schema.id] = factory.decoder_for("protobuf", schema)
            return decoders[schema.id](message.data)

        with open(path, "rb") as file:
            for schema, channel, message in make_reader(file).iter_messages(topics=TOPICS, log_time_order=False):
                if channel.topic == "/tf":
                    # Decoded only where the frame becomes a row.
                    transforms = (schema, message)
                elif channel.topic == "/ntp/observation":
                    seen = decoded(schema, message)
                    if seen.boundary:
                        poses = decoded(*transforms).transforms
                        frames.add(
                            {
                                "episode_index": episode,
                                "frame_index": seen.frame,
                                "time_nanos": message.log_time,
                                "opening_m": seen.opening_m,
                                "slots": list(seen.slots),
                                "slot_positions_m": list(seen.slot_positions_m),
                                "positions_m": [value for pose in poses for value in position(pose.translation)],
                            }
                        )
                elif channel.topic == "/ntp/call":
                    call = decoded(schema, message)
                    row = {
                        "episode_index": episode,
                        "call_id": call.call,
                        "caller_id": call.caller if call.HasField("caller") else None,
                        "depth": call.depth,
                        "step": call.step,
                        "program": call.program,
                        "argument": call.argument if call.HasField("argument") else None,
                        "input_begin": call.input.begin,
                        "input_end": call.input.end,
                        "output_begin": call.output.begin if call.HasField("output") else None,
                        "output_end": call.output.end if call.HasField("output") else None,
                        "frame_begin": call.frame,
                        "frame_end": None,
                        "end_of_program": call.end_of_program,
                    }
                    calls.add(row)
                    returns[call.call] = row
                elif channel.topic == "/ntp/return":
                    returned = decoded(schema, message)
                    returns[returned.call]["frame_end"] = returned.frame
                else:
                    episode += 1
                    returns.clear()
                    frames.flush(at_least=20_000)
                    calls.flush(at_least=20_000)
    frames.close()
    calls.close()
    return frames.n_rows + calls.n_rows


def position(vector) -> list[float]:
    return [vector.x, vector.y, vector.z]


recordings, out = Path(sys.argv[1]), Path(sys.argv[2])
out.mkdir(parents=True, exist_ok=True)
begin = time.process_time()
n_rows = convert(recordings, out)
secs = time.process_time() - begin
peer = f"mcap {version('mcap')} and pyarrow {version('pyarrow')}"
print(json.dumps({"peer": peer, "value": n_rows / secs, "rows": n_rows}))
