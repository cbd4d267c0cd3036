"""Rethink Robotics' Sawyer: its numbers, forward kinematics, and the closed-form inverse for an upright gripper.

Numbers are facts taken from Rethink's `sawyer_robot` (`sawyer_base.urdf.xacro`, Apache-2.0, (c) 2013-2018 Rethink
Robotics); capsules are those of `mujoco_menagerie` (Apache-2.0). Metres, radians, z up; joints turn about their z.

With the third and the fifth joint at 0 and the gripper upright the arm is a planar arm of three joints on a turntable.
"""

import math
import xml.etree.ElementTree as ET

import numpy as np

from mujoco_scene import numbers

#: origin in the parent, roll pitch yaw, least and greatest angle, rad/s, Nm, mass of the link, its centre
JOINTS = [
    ((0, 0, 0.08), (0, 0, 0), (-3.0503, 3.0503), 1.74, 80, 5.3213, (0.0244, 0.0110, 0.1436)),
    (
        (0.081, 0.05, 0.237),
        (-math.pi / 2, math.pi / 2, 0),
        (-3.8095, 2.2736),
        1.328,
        80,
        4.505,
        (-0.0031, -0.0268, 0.0925),
    ),
    ((0, -0.14, 0.1425), (math.pi / 2, 0, 0), (-3.0426, 3.0426), 1.957, 40, 1.745, (-0.0002, -0.0150, 0.1358)),
    ((0, -0.042, 0.26), (-math.pi / 2, 0, 0), (-3.0439, 3.0439), 1.957, 40, 2.5097, (-0.0048, -0.0281, -0.0842)),
    ((0, -0.125, -0.1265), (math.pi / 2, 0, 0), (-2.9761, 2.9761), 3.485, 9, 1.1136, (-0.0019, 0.0069, 0.1341)),
    ((0, 0.031, 0.275), (-math.pi / 2, 0, 0), (-2.9761, 2.9761), 3.485, 9, 1.5625, (0.0061, -0.0237, 0.0764)),
    ((0, -0.11, 0.1053), (-math.pi / 2, -0.17453, math.pi), (-4.7124, 4.7124), 4.545, 9, 0.3292, (0, 0.0086, -0.0050)),
]
HAND = ((0, 0, 0.0245), (0, 0, math.pi / 2))
#: Below the hand: the reference point, with the tips 0.1356 below.
TOOL_M = 0.1076
NEUTRAL = np.array([0, -1.18, 0, 2.18, 0, 0.57, 3.3161])
CAPSULES = [
    [
        ((0, 0, -0.005), (0, 0, 0.25), 0.07),
        ((0, 0, 0.23), (0.08, 0, 0.23), 0.07),
        ((-0.005, 0, 0.3165), (-0.005, 0, 0.5015), 0.04),
        ((0.025, -0.07, 0.3965), (0.025, 0.07, 0.3965), 0.075),
    ],
    [((0, 0, -0.06), (0, 0, 0.13), 0.068)],
    [((0, 0, -0.15), (0, 0, 0.26), 0.055)],
    [((0, 0, -0.115), (0, 0, 0.03), 0.055)],
    [((0, 0, -0.13), (0, 0, 0.27), 0.045)],
    [((0, 0, -0.02), (0, 0, 0.1), 0.045), ((0, 0, 0.105), (0, -0.082, 0.105), 0.045)],
    [((0, 0, 0), (0, 0, 0.02), 0.045)],
]
BASE_CAPSULE = ((0, 0, 0), (0, 0, 0.16), 0.08)
LIMITS = np.array([joint[2] for joint in JOINTS])
SPEEDS = np.array([joint[3] for joint in JOINTS])


def turn(roll, pitch, yaw):
    """The rotation of fixed-axis roll, pitch, yaw."""
    (cr, cp, cy), (sr, sp, sy) = (np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw]))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def frames(joints):
    """Position and rotation of each link and of the tool, in the base."""
    position, rotation, found = np.zeros(3), np.eye(3), []
    for (origin, rpy, *_), angle in zip(JOINTS, joints):
        position = position + rotation @ origin
        rotation = rotation @ turn(*rpy) @ turn(0, 0, angle)
        found.append((position, rotation))
    (origin, rpy) = HAND
    position, rotation = position + rotation @ origin, rotation @ turn(*rpy)
    found.append((position + rotation @ (0, 0, TOOL_M), rotation))
    return found


def tool(joints):
    """Where the gripper's reference point is, and its turn about the vertical (0: fingers close along y)."""
    position, rotation = frames(joints)[-1]
    return position, math.atan2(rotation[1, 0], rotation[0, 0])


def _plane():
    """The planar arm within: points of the axes 1, 3, 5 and of the tool in the plane of radius and height, turned so
    that all three angles are 0, and how far the tool stands beside that plane."""
    at = frames(np.zeros(7))
    axis = at[1][1][:, 2]
    across = np.array([-axis[1], axis[0], 0.0])  # level, in the plane
    across = across if across @ (at[-1][0] - at[1][0]) > 0 else -across
    point = lambda position: np.array([across @ position, position[2]])
    points = [point(at[1][0]), point(at[3][0]), point(at[5][0]), point(at[-1][0])]
    signs = [round(float(axis @ at[link][1][:, 2])) for link in (1, 3, 5)]
    side = np.cross([0, 0, 1], across)
    # A positive turn about `axis` moves the plane's first axis to its second, or the other way round.
    sense = round(float(np.cross(across, [0, 0, 1]) @ axis))
    return points, [sense * sign for sign in signs], float(side @ at[-1][0]), math.atan2(across[1], across[0])


_POINTS, _SIGNS, _BESIDE, _HEADING = _plane()


def _rotated(angle, vector):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def _upright_total():
    """The sum of the three planar angles at which the tool points down."""
    best = None
    for total in np.arange(4) * math.pi / 2:
        joints = np.zeros(7)
        joints[1] = _SIGNS[0] * total
        down = frames(joints)[-1][1][2, 2]
        best = max(best, (-down, total)) if best else (-down, total)
    return best[1]


_TOTAL = _upright_total()


def _wrap(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def _turning():
    """How the gripper's turn depends on the first and the last joint, while it is upright: its turn where both are 0,
    and the sign of the last."""
    joints = np.zeros(7)
    joints[1] = _SIGNS[0] * _TOTAL
    at_zero = tool(joints)[1]
    joints[6] = 0.1
    return at_zero, math.copysign(1, _wrap(tool(joints)[1] - at_zero))


_TURN, _LAST = _turning()


def upright(position, yaw):
    """All postures with the elbow up and the third and the fifth joint at 0 that hold the gripper upright at a place of
    the base's frame, turned about the vertical by `yaw` or by half turns more: the fingers are alike."""
    x, y, z = position
    reach = x * x + y * y - _BESIDE**2
    if reach <= 0:
        return []
    radius = math.sqrt(reach)
    a, b, c = (_POINTS[i + 1] - _POINTS[i] for i in range(3))
    wrist = np.array([radius, z]) - _POINTS[0] - _rotated(_TOTAL, c)
    long_a, long_b, far = np.hypot(*a), np.hypot(*b), np.hypot(*wrist)
    cosine = (far**2 - long_a**2 - long_b**2) / (2 * long_a * long_b)
    if abs(cosine) > 1:
        return []
    # Two ways to bend; the elbow is up where the second part turns down.
    inner = -math.acos(cosine)
    first = math.atan2(wrist[1], wrist[0]) - math.atan2(long_b * math.sin(inner), long_a + long_b * math.cos(inner))
    one = first - math.atan2(a[1], a[0])
    three = inner - (math.atan2(b[1], b[0]) - math.atan2(a[1], a[0]))
    five = _TOTAL - one - three
    joints = np.zeros(7)
    joints[0] = _wrap(math.atan2(y, x) - math.atan2(_BESIDE, radius) - _HEADING)
    joints[1], joints[3], joints[5] = (_wrap(sign * angle) for sign, angle in zip(_SIGNS, (one, three, five)))
    last = _LAST * _wrap(yaw - _TURN - joints[0])
    found = []
    for half_turns in range(-2, 3):
        joints[6] = last + half_turns * math.pi
        if np.all(joints > LIMITS[:, 0]) and np.all(joints < LIMITS[:, 1]):
            found.append(joints.copy())
    return found


def add_arm(world, root, base_m, add_gripper):
    """The arm in MJCF, with position actuators and gravity compensated, as the real one's controller does."""
    body = ET.SubElement(world, "body", name="sawyer", pos=numbers(*base_m))
    add_capsule(body, BASE_CAPSULE)
    actuators = ET.SubElement(root, "actuator")
    for index, ((origin, rpy, limits, _, torque, mass, com), capsules) in enumerate(zip(JOINTS, CAPSULES)):
        body = ET.SubElement(
            body, "body", name=f"l{index}", pos=numbers(*origin), quat=numbers(*quat(turn(*rpy))), gravcomp="1"
        )
        ET.SubElement(body, "inertial", pos=numbers(*com), mass=str(mass), diaginertia=numbers(*[mass * 0.006] * 3))
        ET.SubElement(
            body, "joint", name=f"j{index}", axis="0 0 1", range=numbers(*limits), damping="10", armature="0.5"
        )
        for capsule in capsules:
            add_capsule(body, capsule)
        stiff = [20000, 20000, 12000, 12000, 4000, 4000, 4000][index]
        ET.SubElement(
            actuators,
            "position",
            name=f"j{index}",
            joint=f"j{index}",
            kp=str(stiff),
            dampratio="1",
            ctrlrange=numbers(*limits),
            forcerange=numbers(-4 * torque, 4 * torque),
        )
    (origin, rpy) = HAND
    hand = ET.SubElement(body, "body", name="hand", pos=numbers(*origin), quat=numbers(*quat(turn(*rpy))))
    # The gripper's own z points up, the hand's down.
    add_gripper(hand, root, at=(0, 0, TOOL_M), quat=(0, 1, 0, 0))


def add_capsule(body, capsule):
    (start, end, radius) = capsule
    ET.SubElement(
        body,
        "geom",
        type="capsule",
        fromto=numbers(*start, *end),
        size=numbers(radius),
        mass="0",
        contype="0",
        conaffinity="1",
        rgba="0.35 0.12 0.12 1",
    )


def quat(rotation):
    """w, x, y, z of a rotation."""
    w = math.sqrt(max(0.0, 1 + np.trace(rotation))) / 2
    if w > 1e-6:
        v = np.array(
            [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
        )
        return (w, *(v / (4 * w)))
    axis = np.sqrt(np.maximum(0, (np.diag(rotation) + 1) / 2))
    lead = int(np.argmax(axis))
    axis *= np.where(np.arange(3) == lead, 1, np.sign(rotation[lead]))
    return (0.0, *axis)
