"""Reads a recording with Foxglove's own Python reader: every message of every topic is decoded by its schema.

Usage: python tests/foreign/mcap_reads.py FILE.mcap
Needs: pip install mcap mcap-protobuf-support
Prints one line; exits with an error when a message cannot be decoded or an episode is not whole.
"""

import collections
import sys
from importlib.metadata import version

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def main(path: str) -> None:
    counts = collections.Counter()
    last_time = 0
    episodes = []
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        metadata = sorted(record.name for record in reader.iter_metadata())
        attachments = {record.name: len(record.data) for record in reader.iter_attachments()}
        statistics = reader.get_summary().statistics
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert message.log_time >= last_time, f"time goes back on {channel.topic}"
            last_time = message.log_time
            counts[channel.topic] += 1
            check(channel.topic, decoded, episodes)
    assert sum(counts.values()) == statistics.message_count
    assert metadata and attachments, "a recording says what it is"
    frames, calls = (sum(episode[name] for episode in episodes) for name in ["frames", "calls"])
    told = f"{len(episodes)} episodes, {frames} frames, {calls} calls, {sum(counts.values())} messages"
    print(f"mcap {version('mcap')}: opened, {told} of {len(counts)} topics, {last_time / 1e9:.0f} s")


def check(topic: str, message, episodes: list) -> None:
    """Counts what an episode holds and compares it with what its end says."""
    if topic == "/ntp/episode/start":
        names = {body.name for body in message.scene.bodies} | {"gripper"}
        episodes.append({"names": names, "frames": 0, "calls": 0})
    elif topic == "/ntp/observation":
        episodes[-1]["frames"] += 1
    elif topic == "/ntp/call":
        episodes[-1]["calls"] += 1
    elif topic == "/tf" and episodes[-1]["frames"] == 0:
        found = {transform.child_frame_id for transform in message.transforms}
        assert found == episodes[-1]["names"], "the first frame places every body"
    elif topic == "/ntp/episode/end":
        assert (message.frames, message.calls) == (episodes[-1]["frames"], episodes[-1]["calls"])


if __name__ == "__main__":
    main(*sys.argv[1:])
