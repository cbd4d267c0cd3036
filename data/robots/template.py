"""A robot without motors, to begin with: things are where they are said to be. Put your own calls in their place.

ntp act oracle --demonstration RECORDINGS --robot "python data/robots/template.py" --reset
"""

from ntp_robot import Failure, Robot

HOLD_M, OPEN_M = 0.02, 0.07  # the gripper above the centre of what it holds; its fingers apart


class Template(Robot):
    def setup(self, family, scene):
        self.half_m = {body["name"]: body["shape"]["cuboid"]["half_extents_m"][2] for body in scene["bodies"]}
        self.at = {name: [0.1 * i - 0.35, 0.0, half] for i, (name, half) in enumerate(self.half_m.items())}
        self.gripper, self.holds = [0.0, 0.0, 0.3], None

    def reset(self, bodies, gripper):  # leave it out if a person sets the table
        self.at = {name: list(pose["position_m"]) for name, pose in bodies.items()}
        self.gripper, self.holds = list(gripper["position_m"]), None

    def observe(self):  # your camera
        return {
            "gripper": {"position_m": self.gripper, "opening_m": OPEN_M, "holds": self.holds},
            "bodies": {name: {"position_m": position} for name, position in self.at.items()},
        }

    def move_to(self, slot, body, position_m, hover_m):  # your planner
        x, y, z = position_m
        self.jump(x, y, z + hover_m)

    def grip(self):  # your gripper
        self.holds = self.below()
        if self.holds is None:
            raise Failure("missed_grasp")
        x, y, z = self.at[self.holds]
        self.jump(x, y, z + HOLD_M)

    def release(self):
        below, held, self.holds = self.below(), self.holds, None
        if held is not None:
            floor = 0.0 if below is None else self.at[below][2] + self.half_m[below]
            self.at[held] = [*self.gripper[:2], floor + self.half_m[held]]
            self.jump(*self.gripper[:2], floor + self.half_m[held] + HOLD_M)

    def stop(self):  # your motors
        pass

    def jump(self, x, y, z):
        self.gripper = [x, y, z]
        if self.holds is not None:
            self.at[self.holds] = [x, y, z - HOLD_M]

    def below(self):
        x, y, _ = self.gripper
        near = [n for n, at in self.at.items() if n != self.holds and abs(at[0] - x) < 0.02 and abs(at[1] - y) < 0.02]
        return max(near, key=lambda name: self.at[name][2], default=None)


if __name__ == "__main__":
    Template.main()
