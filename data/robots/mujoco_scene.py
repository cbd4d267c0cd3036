"""A table with things on it, and a parallel gripper, as MuJoCo reads them (MJCF). Metres; z up."""

import xml.etree.ElementTree as ET

STEP_S = 0.002
DENSITY = 500.0
FRICTION = "0.9 0.005 0.0005"
#: The gripper about its reference point, which is 2 cm above the centre of what it holds: fingers close along y.
TIP_M, PALM_M = 0.028, 0.015
FINGER_HALF_M, PALM_HALF_M = (0.009, 0.003, (TIP_M + PALM_M) / 2), (0.013, 0.044, 0.008)
MAX_OPENING_M = 0.07
GRIP_N = 20.0


def numbers(*values):
    return " ".join(f"{value:.9g}" for value in values)


def build(scene, robot):
    """The whole world: `robot(worldbody, root)` adds the robot, with `add_gripper` at its end."""
    root = ET.Element("mujoco", model="ntp")
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", timestep=str(STEP_S), cone="elliptic", impratio="10", integrator="implicitfast")
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "global", offwidth="640", offheight="480")
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 -0.5 2", dir="0 0.2 -1")
    ET.SubElement(world, "camera", name="front", pos="0 -0.95 0.95", xyaxes="1 0 0 0 0.707 0.707")
    x, y = scene["table_half_m"]
    table = ET.SubElement(world, "geom", name="table", type="box", friction=FRICTION)
    table.set("size", numbers(x, y, 0.02))
    table.set("pos", "0 0 -0.02")
    table.set("rgba", "0.85 0.83 0.8 1")
    ET.SubElement(world, "geom", name="ground", type="plane", size="5 5 0.1", pos="0 0 -0.4", rgba="0.4 0.4 0.4 1")
    for thing in scene["bodies"]:
        add_thing(world, thing)
    robot(world, root)
    return ET.tostring(root, encoding="unicode")


def add_thing(world, thing):
    """What is fixed is moved by `reset` alone (mocap), the rest is free."""
    body = ET.SubElement(world, "body", name=thing["name"])
    if thing.get("fixed"):
        body.set("mocap", "true")
    else:
        ET.SubElement(body, "freejoint", name=f"{thing['name']}/free")
    color = numbers(*[part / 255 for part in thing.get("color", [128, 128, 128])], 1)
    for kind, size, pos in parts(thing["shape"]):
        ET.SubElement(
            body,
            "geom",
            type=kind,
            size=numbers(*size),
            pos=numbers(*pos),
            rgba=color,
            density=str(DENSITY),
            friction="0.9 0.02 0.01" if kind == "sphere" else FRICTION,
            condim="6" if kind == "sphere" else "4",
        )


def parts(shape):
    """Boxes, cylinders and balls that make a shape, about its centre."""
    ((kind, size),) = shape.items()
    if kind == "cuboid":
        return [("box", size["half_extents_m"], (0, 0, 0))]
    if kind == "cylinder":
        return [("cylinder", (size["radius_m"], size["half_height_m"]), (0, 0, 0))]
    if kind == "ball":
        return [("sphere", (size["radius_m"],), (0, 0, 0))]
    if kind == "open_box":
        (x, y, height), wall = size["inner_m"], size["wall_m"]
        half = wall / 2
        return [
            ("box", (x + wall, y + wall, half), (0, 0, -half)),
            *[("box", (half, y + wall, height / 2), (side * (x + half), 0, height / 2)) for side in (1, -1)],
            *[("box", (x + wall, half, height / 2), (0, side * (y + half), height / 2)) for side in (1, -1)],
        ]
    raise ValueError(f"shape {kind!r}; allowed here: cuboid, cylinder, ball, open_box")


def half_height_m(shape):
    """From a thing's centre up to its top."""
    ((kind, size),) = shape.items()
    return {
        "cuboid": lambda: size["half_extents_m"][2],
        "cylinder": lambda: size["half_height_m"],
        "ball": lambda: size["radius_m"],
        "open_box": lambda: size["inner_m"][2],
    }[kind]()


def add_gripper(hand, root, at=(0, 0, 0), quat=(1, 0, 0, 0)):
    """Palm and two fingers that position actuators move by friction grasp; `hand` is the body that carries them."""
    mount = ET.SubElement(hand, "body", name="gripper", pos=numbers(*at), quat=numbers(*quat), gravcomp="1")
    ET.SubElement(mount, "site", name="tool", pos="0 0 0", size="0.001")
    palm = (0, 0, PALM_M + PALM_HALF_M[2])
    ET.SubElement(mount, "geom", name="palm", type="box", size=numbers(*PALM_HALF_M), pos=numbers(*palm), mass="0.4")
    actuators = root.find("actuator")
    if actuators is None:
        actuators = ET.SubElement(root, "actuator")
    for name, side in (("left", 1), ("right", -1)):
        finger = ET.SubElement(mount, "body", name=name, gravcomp="1")
        finger.set("pos", numbers(0, side * FINGER_HALF_M[1], (PALM_M - TIP_M) / 2))
        ET.SubElement(
            finger,
            "joint",
            name=name,
            type="slide",
            axis=numbers(0, side, 0),
            damping="20",
            armature="0.05",
            range=numbers(0, MAX_OPENING_M / 2),
        )
        ET.SubElement(
            finger,
            "geom",
            name=f"{name}_pad",
            type="box",
            size=numbers(*FINGER_HALF_M),
            mass="0.05",
            condim="4",
            friction="1.2 0.05 0.001",
            solref="0.004 1",
            priority="1",
        )
        ET.SubElement(
            actuators,
            "position",
            name=name,
            joint=name,
            kp="2000",
            ctrlrange=numbers(-0.01, MAX_OPENING_M / 2),
            forcerange=numbers(-GRIP_N, GRIP_N),
        )
    return mount
