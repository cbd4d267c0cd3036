"""Reads recordings in ROS 2 form with a reader of ROS 2 messages: robots_recorded.py FILE…"""

import collections
import sys

from mcap_ros2.reader import read_ros2_messages

for path in sys.argv[1:]:
    counts, last = collections.Counter(), {}
    for message in read_ros2_messages(path):
        topic = message.channel.topic
        counts[topic] += 1
        assert message.log_time_ns > last.get(topic, -1), f"{path}: {topic}: time goes back"
        last[topic] = message.log_time_ns
        if topic == "/joint_states":
            joints = message.ros_msg
            assert len(joints.name) == len(joints.position) == len(joints.velocity) == len(joints.effort) > 1
        else:
            transforms = message.ros_msg.transforms
            turns = [t.transform.rotation for t in transforms]
            assert all(abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1) < 1e-6 for q in turns)
    assert counts["/joint_states"] == counts["/tf"] > 100
    print(f"{path}: {dict(counts)}, joints {list(joints.name)}, frames {[t.child_frame_id for t in transforms]}")
