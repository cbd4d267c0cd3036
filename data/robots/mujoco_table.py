"""A robot at a table in MuJoCo, for `ntp act`: a world that is not ours, with contacts and friction of its own.

    pip install mujoco
    ntp act MODEL --demonstration RECORDINGS --robot "python data/robots/mujoco_table.py" --reset --trials 20

A gripper that flies, or with --robot sawyer the arm, position-controlled. Both grasp by friction alone. It goes to where
things were *seen*, not to where they are: --noise-mm says how far apart the two may be. With --record its runs become
an MCAP file in ROS 2 form.
"""

import atexit
import math

import mujoco
import numpy as np

import mujoco_scene as scenes
import sawyer
from ntp_robot import Failure, Refused, Robot

GRASP_M, CLEARANCE_M = 0.02, 0.02
REPORT_S, SETTLE_S, STILL_M_PER_S = 0.1, 3.0, 0.004
BASE_M = (-0.62, 0.0, 0.1)
#: The flying gripper is given the pace of a careful robot, the arm that of its tool.
SPEED_M_PER_S = {"gripper": 0.5, "sawyer": 0.4}
ACCELERATION = 4.0


class Flight:
    """A gripper that follows a mocap body."""

    n_arm = 0

    def add(self, world, root):
        scenes.ET.SubElement(world, "body", name="target", mocap="true", pos="0 0 0.3")
        hand = scenes.ET.SubElement(world, "body", name="hand", pos="0 0 0.3", gravcomp="1")
        scenes.ET.SubElement(hand, "freejoint", name="hand")
        scenes.ET.SubElement(hand, "inertial", pos="0 0 0", mass="0.5", diaginertia="0.002 0.002 0.002")
        scenes.add_gripper(hand, root)
        weld = scenes.ET.SubElement(scenes.ET.SubElement(root, "equality"), "weld", body1="target", body2="hand")
        weld.set("solref", "0.005 1")

    def start(self, model, data, position):
        self.mocap = model.body("target").mocapid[0]
        data.joint("hand").qpos = [*position, 1, 0, 0, 0]
        self.command(data, (position, 0.0))

    def command(self, data, setpoint):
        position, yaw = setpoint
        data.mocap_pos[self.mocap] = position
        data.mocap_quat[self.mocap] = [math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]

    def way(self, start, end, speed):
        """What is commanded on a straight way, by the share of it, and how long it takes."""
        (a, yaw_a), (b, yaw_b) = start, end
        return (lambda share: (a + share * (b - a), yaw_a + share * (yaw_b - yaw_a))), self.secs(start, end, speed)

    def secs(self, start, end, speed):
        """At minimum jerk the peak is 1.875 times the mean speed."""
        distance = max(np.linalg.norm(end[0] - start[0]), 0.1 * abs(end[1] - start[1]))
        return max(1.875 * distance / speed, math.sqrt(5.7735 * distance / ACCELERATION), 0.02)


class Arm(Flight):
    """Sawyer, upright: its postures come from the closed-form inverse, a way across is straight in joint space."""

    n_arm = 7

    def add(self, world, root):
        sawyer.add_arm(world, root, BASE_M, scenes.add_gripper)

    def start(self, model, data, position):
        self.posture = self.nearest(np.asarray(position), 0.0, sawyer.NEUTRAL)
        for index, angle in enumerate(self.posture):
            data.joint(f"j{index}").qpos = angle
        data.ctrl[:7] = self.posture

    def nearest(self, position, yaw, posture):
        found = sawyer.upright(position - np.array(BASE_M), yaw)
        if not found:
            raise Failure("no_path")
        return min(found, key=lambda other: np.max(np.abs(other - posture) / sawyer.SPEEDS))

    def command(self, data, setpoint):
        self.posture = setpoint
        data.ctrl[:7] = setpoint

    def way(self, start, end, speed):
        """Straight in space up and down, by postures close to one another; straight in joint space across."""
        is_across = abs(end[0][2] - start[0][2]) < 1e-6
        place, secs = super().way(start, end, speed)
        shares = np.linspace(0, 1, 2 if is_across else 2 + int(np.linalg.norm(end[0] - start[0]) / 0.02))
        postures = [self.posture]
        for share in shares[1:]:
            postures.append(self.nearest(*place(share), postures[-1]))
        table = np.array(postures)
        angles = np.sum(np.abs(np.diff(table, axis=0)), axis=0)
        secs = max(secs, 1.875 * float(np.max(angles / sawyer.SPEEDS)) / 0.9)
        return (lambda share: np.array([np.interp(share, shares, joint) for joint in table.T])), secs


class MuJoCoTable(Robot):
    """Blocks, or sorting objects and bins, on a table in MuJoCo."""

    name = "mujoco"

    @staticmethod
    def options(parser):
        parser.add_argument("--robot", choices=["gripper", "sawyer"], default="gripper")
        parser.add_argument(
            "--noise-mm", type=float, default=0.0, help="standard deviation of seen positions in x and y"
        )
        parser.add_argument("--speed", type=float, help="of the gripper, in metres per second")
        parser.add_argument("--seed", type=int, default=0, help="of the noise")
        parser.add_argument("--record", metavar="FILE.mcap", help="record in ROS 2 form")
        parser.add_argument("--pictures", action="store_true", help="with --record: what a camera in front sees, too")

    def configure(self, arguments):
        self.kind, self.noise_m = arguments.robot, arguments.noise_mm / 1000
        self.speed = arguments.speed or SPEED_M_PER_S[self.kind]
        self.random = np.random.default_rng(arguments.seed)
        self.name = f"mujoco-{self.kind}"
        self.recorder = None
        if arguments.record:
            from ros2_recorder import Recorder

            self.recorder = Recorder(arguments.record, arguments.pictures)
            atexit.register(self.recorder.close)

    def setup(self, family, scene):
        self.halt = False
        self.shapes = {body["name"]: body["shape"] for body in scene["bodies"]}
        self.fixed = {body["name"] for body in scene["bodies"] if body.get("fixed")}
        try:
            self.body = Arm() if self.kind == "sawyer" else Flight()
            self.model = mujoco.MjModel.from_xml_string(scenes.build(scene, self.body.add))
        except ValueError as error:
            raise Refused(str(error)) from error
        self.data = mujoco.MjData(self.model)
        self.pads = [self.model.geom(name).id for name in ("left_pad", "right_pad")]
        self.mine = {self.model.geom(name).id for name in ("left_pad", "right_pad", "palm")}
        self.things = {self.model.body(name).id: name for name in self.shapes}
        self.movable = [name for name in self.shapes if name not in self.fixed]
        self.speeds = [self.model.joint(f"{name}/free").dofadr[0] for name in self.movable]
        # Until somebody says where things are, what moves stands in rows in front, and what is fixed in a row behind.
        places = {name: [0.09 * (i % 7) - 0.27, 0.09 * (i // 7) - 0.45, 0.03] for i, name in enumerate(self.movable)}
        places.update({name: [0.26 * i - 0.39, 0.34, 0.005] for i, name in enumerate(sorted(self.fixed))})
        self.reset({name: {"position_m": place} for name, place in places.items()}, {"position_m": [0.0, 0.0, 0.3]})

    def reset(self, bodies, gripper):
        self.halt = False
        mujoco.mj_resetData(self.model, self.data)
        for name, pose in bodies.items():
            x, y, z, w = pose.get("orientation_xyzw", (0, 0, 0, 1))
            if name in self.fixed:
                mocap = self.model.body(name).mocapid[0]
                self.data.mocap_pos[mocap], self.data.mocap_quat[mocap] = pose["position_m"], (w, x, y, z)
            else:
                self.data.joint(f"{name}/free").qpos = [*pose["position_m"], w, x, y, z]
        for finger in ("left", "right"):
            self.data.joint(finger).qpos = scenes.MAX_OPENING_M / 2
        start = np.array(gripper["position_m"], dtype=float)
        if self.kind == "sawyer":
            start = np.array([0.0, 0.0, 0.3])  # an arm is where it is
        self.body.start(self.model, self.data, start)
        self.at, self.yaw, self.opening = start, 0.0, scenes.MAX_OPENING_M
        self.next_report = math.inf
        self.holds, self.target = None, None
        self.fingers(scenes.MAX_OPENING_M)
        self.settle()
        self.look()
        self.next_report = self.data.time + REPORT_S

    # What it sees.

    def look(self):
        """Takes new positions of what it can see: what it does not hold."""
        offset = lambda: np.array([*self.random.normal(0, self.noise_m, 2), 0.0]) if self.noise_m else np.zeros(3)
        self.off = {name: np.zeros(3) if name == self.holds else offset() for name in self.shapes}

    def place(self, name):
        return self.data.body(name).xpos + self.off[name]

    def observe(self):
        bodies = {}
        for name in self.shapes:
            w, x, y, z = self.data.body(name).xquat
            bodies[name] = {"position_m": self.place(name).tolist(), "orientation_xyzw": [x, y, z, w]}
        tool = self.data.site("tool")
        opening = float(self.data.joint("left").qpos[0] + self.data.joint("right").qpos[0])
        position = tool.xpos.tolist()
        return {
            "gripper": {"position_m": position, "opening_m": max(0.0, opening), "holds": self.holds},
            "bodies": bodies,
        }

    def clock_ns(self):
        return round(self.data.time * 1e9)

    # What it does.

    def move_to(self, slot, body, position_m, hover_m):
        target = np.array(position_m)
        hangs = 0.0 if self.holds is None else scenes.half_height_m(self.shapes[self.holds]) + GRASP_M
        below = max(scenes.TIP_M, hangs)
        others = [name for name in self.shapes if name != self.holds]
        top = max(self.place(name)[2] + scenes.half_height_m(self.shapes[name]) for name in others)
        high = max(top + below + CLEARANCE_M, target[2] + hover_m, self.at[2])
        self.go(np.array([*self.at[:2], high]))
        self.go(np.array([*target[:2], high]), yaw=0.0)
        self.go(np.array([*target[:2], target[2] + hover_m]))
        self.target = body
        self.look()

    def grip(self):
        self.fingers(scenes.MAX_OPENING_M)
        below = self.below()
        if below is None or below in self.fixed:
            raise Failure("missed_grasp")
        seen = self.place(below)
        self.go(self.at, yaw=self.turn_for(below))
        self.go(np.array([*seen[:2], self.at[2]]))
        self.go(np.array([*seen[:2], max(seen[2] + GRASP_M, scenes.TIP_M + 0.001)]), speed=0.25)
        self.fingers(0.0)
        held = self.touched(self.pads[0]) & self.touched(self.pads[1])
        if not held:
            self.fingers(scenes.MAX_OPENING_M)
            self.look()
            raise Failure("missed_grasp")
        self.holds = min(held)
        self.look()

    def release(self):
        if self.holds is None:
            self.fingers(scenes.MAX_OPENING_M)
            return
        half = scenes.half_height_m(self.shapes[self.holds])
        below = self.below()
        floor, place = 0.0, self.at
        if below is not None:
            seen = self.place(below)
            is_bin = "open_box" in self.shapes[below]
            floor = seen[2] if is_bin else seen[2] + scenes.half_height_m(self.shapes[below])
            if is_bin:
                place = self.free_spot(below)
                self.go(np.array([*place[:2], self.at[2]]))
        self.lower(np.array([*place[:2], floor + half + GRASP_M - 0.004]))
        held, self.holds = self.holds, None
        self.fingers(scenes.MAX_OPENING_M)
        self.wait(0.2)
        self.go(self.at + (0, 0, 0.002 if held else 0.0))
        self.settle()
        self.look()

    def settle(self):
        """Until nothing moves any more."""
        end = self.data.time + SETTLE_S
        while self.data.time < end:
            self.wait(0.05)
            speeds = [np.linalg.norm(self.data.qvel[at : at + 3]) for at in self.speeds]
            if not speeds or max(speeds) < STILL_M_PER_S:
                return

    def stop(self):
        self.halt = True

    # How.

    def go(self, to, yaw=None, speed=None):
        """Along a way at minimum jerk."""
        start, end = (self.at, self.yaw), (np.array(to, dtype=float), self.yaw if yaw is None else yaw)
        way, secs = self.body.way(start, end, speed or self.speed)
        n_steps = max(1, round(secs / scenes.STEP_S))
        for step in range(1, n_steps + 1):
            share = step / n_steps
            self.body.command(self.data, way(share**3 * (10 - 15 * share + 6 * share**2)))
            self.step()
        self.at, self.yaw = end
        if self.body.n_arm:
            self.wait(0.1)

    def lower(self, to):
        """Down until what is held touches something: a guarded motion."""
        start = self.at
        way, _ = self.body.way((start, self.yaw), (to, self.yaw), self.speed)
        n_steps = max(1, round((start[2] - to[2]) / 0.15 / scenes.STEP_S))
        for step in range(1, n_steps + 1):
            self.body.command(self.data, way(step / n_steps))
            self.at = start + step / n_steps * (to - start)
            self.step()
            if step % 4 == 0 and self.is_supported():
                return

    def fingers(self, opening_m):
        if opening_m > 0:
            self.data.ctrl[-2:] = opening_m / 2
        else:
            self.data.ctrl[-2:] = -0.01
        self.wait(0.25)

    def wait(self, secs):
        for _ in range(round(secs / scenes.STEP_S)):
            self.step()

    def step(self):
        if self.halt:
            raise Failure("time_limit")
        mujoco.mj_step(self.model, self.data)
        if self.data.time >= self.next_report:
            self.next_report += REPORT_S
            self.report()
            if self.recorder:
                self.recorder.frame(self)

    def below(self):
        """The highest thing under the gripper, as seen; what it moved to last, if it is near enough."""

        def covers(name):
            x, y = np.abs(self.place(name)[:2] - self.at[:2])
            ((kind, size),) = self.shapes[name].items()
            half = size["inner_m"][:2] if kind == "open_box" else (0.025, 0.025)
            return name != self.holds and x <= half[0] and y <= half[1] and self.place(name)[2] < self.at[2]

        under = [name for name in self.shapes if covers(name)]
        if self.target in under and "open_box" in self.shapes[self.target]:
            return self.target
        return max(under, key=lambda name: self.place(name)[2], default=None)

    def free_spot(self, box):
        """The place in a box that is farthest from what lies in it; the gripper has room there."""
        middle = self.data.body(box).xpos
        lying = [self.place(name)[:2] for name in self.movable if name != self.holds]
        spots = [middle[:2] + (x, y) for x in (-0.043, 0.0, 0.043) for y in (-0.043, 0.0, 0.043)]
        gap = lambda spot: min((float(np.linalg.norm(spot - other)) for other in lying), default=1.0)
        return np.array([*max(spots, key=gap), 0.0])

    def turn_for(self, name):
        """The least turn with which the fingers close on a box's faces."""
        if "cuboid" not in self.shapes[name]:
            return 0.0
        w, x, y, z = self.data.body(name).xquat
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        half = self.shapes[name]["cuboid"]["half_extents_m"]
        turns = [yaw + quarter * math.pi / 2 for quarter in range(-4, 5) if 2 * half[1 - quarter % 2] < 0.062]
        return min(turns, key=abs, default=0.0)

    def touched(self, geom):
        """The movable things that touch a part of the gripper."""
        found = set()
        for contact in self.data.contact[: self.data.ncon]:
            if geom in (contact.geom1, contact.geom2):
                other = contact.geom2 if contact.geom1 == geom else contact.geom1
                name = self.things.get(int(self.model.geom_bodyid[other]))
                if name in self.movable:
                    found.add(name)
        return found

    def is_supported(self):
        """Whether what is held touches anything but the gripper."""
        held = self.model.body(self.holds).id
        for contact in self.data.contact[: self.data.ncon]:
            geoms = (int(contact.geom1), int(contact.geom2))
            bodies = [int(self.model.geom_bodyid[geom]) for geom in geoms]
            if held in bodies and geoms[1 - bodies.index(held)] not in self.mine:
                return True
        return False


if __name__ == "__main__":
    MuJoCoTable.main()
