"""What a MuJoCo robot did, as an MCAP file in ROS 2 form: joint states, poses, and pictures where MuJoCo can draw.

    pip install mcap mcap-ros2-support

Topics: /joint_states (sensor_msgs/msg/JointState), /tf (tf2_msgs/msg/TFMessage; children of `world`), and
/camera/front/image (sensor_msgs/msg/Image, rgb8). Times are simulated.
"""

import mujoco
import numpy as np
from mcap_ros2.writer import Writer

HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
JOINT_STATE = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" + HEADER
IMAGE = (
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data"
    + HEADER
)
TF = (
    "geometry_msgs/TransformStamped[] transforms"
    """
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w""" + HEADER
)
PICTURE_PX = (240, 320)


class Recorder:
    """One file; episodes follow one another, a second apart."""

    def __init__(self, path, pictures=False):
        self.file = open(path, "wb")
        self.writer = Writer(self.file)
        register = self.writer.register_msgdef
        self.joint_state = register("sensor_msgs/msg/JointState", JOINT_STATE)
        self.tf = register("tf2_msgs/msg/TFMessage", TF)
        self.image = register("sensor_msgs/msg/Image", IMAGE)
        self.pictures, self.renderer, self.model = pictures, None, None
        self.began_ns, self.last_ns = 0, 0

    def frame(self, robot):
        """Everything at one instant."""
        model, data = robot.model, robot.data
        now = self.began_ns + round(data.time * 1e9)
        if now <= self.last_ns:
            self.began_ns = self.last_ns + 10**9
            now = self.began_ns + round(data.time * 1e9)
        self.last_ns = now
        header = {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": "world"}
        self.joints(header, now, model, data)
        names = ["gripper", *robot.shapes]
        transforms = [self.transform(header, name, data.body(name)) for name in names]
        self.write("/tf", self.tf, {"transforms": transforms}, now)
        if self.pictures:
            self.picture(header, now, model, data)

    def joints(self, header, now, model, data):
        one_number = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        turning = [j for j in range(model.njnt) if int(model.jnt_type[j]) in one_number]
        at, speed = model.jnt_qposadr[turning], model.jnt_dofadr[turning]
        message = {
            "header": header,
            "name": [model.joint(j).name for j in turning],
            "position": data.qpos[at].tolist(),
            "velocity": data.qvel[speed].tolist(),
            "effort": data.qfrc_actuator[speed].tolist(),
        }
        self.write("/joint_states", self.joint_state, message, now)

    @staticmethod
    def transform(header, name, body):
        (x, y, z), (qw, qx, qy, qz) = body.xpos.tolist(), body.xquat.tolist()
        pose = {"translation": {"x": x, "y": y, "z": z}, "rotation": {"x": qx, "y": qy, "z": qz, "w": qw}}
        return {"header": header, "child_frame_id": name, "transform": pose}

    def picture(self, header, now, model, data):
        height, width = PICTURE_PX
        if self.model is not model:
            self.model, self.renderer = model, mujoco.Renderer(model, height, width)
        self.renderer.update_scene(data, camera="front")
        pixels = np.ascontiguousarray(self.renderer.render())
        message = {"header": header, "height": height, "width": width, "encoding": "rgb8", "is_bigendian": 0}
        self.write("/camera/front/image", self.image, {**message, "step": 3 * width, "data": pixels.tobytes()}, now)

    def write(self, topic, schema, message, now):
        self.writer.write_message(topic, schema, message, log_time=now, publish_time=now)

    def close(self):
        self.writer.finish()
        self.file.close()
