"""What a robot needs to be acted on by `ntp act`: subclass Robot, fill in a few methods, call main().

The standard library alone; Python 3.8 or later. docs/robots.md leads from nothing to a robot of your own;
schemas/robot.md has every message. Positions are in metres in the table's frame: z up, the table's surface at z = 0,
its middle at the origin. Orientations are quaternions x, y, z, w.

Whatever happens, the robot is stopped: when `ntp` says stop, when it goes away, when a method raises.
"""

import argparse
import json
import queue
import socket
import sys
import threading
import time
import traceback

PROTOCOL = 1
MAX_LINE_BYTES = 1 << 20
#: What can go wrong in an action. Anything else that you raise ends the conversation.
CAUSES = (
    "missed_grasp",
    "knocked_tower",
    "object_off_table",
    "pushed_off_table",
    "dropped_object",
    "time_limit",
    "no_path",
    "collided",
    "not_seen",
)


class Failure(Exception):
    """An action that did not work; the policy may try again. `raise Failure("missed_grasp")`"""

    def __init__(self, cause):
        if cause not in CAUSES:
            raise ValueError(f"cause {cause!r}; allowed: {', '.join(CAUSES)}")
        super().__init__(cause)
        self.cause = cause


class Refused(Exception):
    """A request that this robot does not carry out."""


class Robot:
    """A robot at a table. Fill in `observe`, `move_to`, `grip`, `release` and `stop`."""

    name = "robot"

    def setup(self, family, scene):
        """Called once, before anything else: what shall stand on the table. `scene` has `table_half_m`, `bodies`
        (`name`, `shape`, `fixed`) and `slots` (`name`, `bodies`). Return a scene with your own sizes, or None."""

    def observe(self):
        """Where everything is: {"gripper": {"position_m", "opening_m", "holds"}, "bodies": {NAME: {"position_m"}}}.
        `holds` is the name of a body or None. A body that is not seen now may be left out, but not the first time."""
        raise NotImplementedError

    def move_to(self, slot, body, position_m, hover_m):
        """Bring the gripper `hover_m` above `position_m`, where `body` was reported last, over everything between."""
        raise NotImplementedError

    def grip(self):
        """Go down onto what lies below, close the fingers, hold it. `raise Failure("missed_grasp")` if you do not."""
        raise NotImplementedError

    def release(self):
        """Set down what is held onto (or into) what lies below, and open the fingers."""
        raise NotImplementedError

    def stop(self):
        """Stop moving, now. Called from another thread than the action that is under way, and perhaps twice."""
        raise NotImplementedError

    def settle(self):
        """Wait until all is at rest; the goal is judged then. Do not move."""

    def clock_ns(self):
        """What observations are dated with, in nanoseconds; a simulator has a clock of its own."""
        return time.monotonic_ns()

    #: Optional: `reset(bodies, gripper)` puts everything where it shall start (simulators, or a very patient robot);
    #: `carry(body)` lifts that tray with all that is on it and carries it.
    reset = None
    carry = None

    def report(self):
        """Call it while you move, some ten times a second, if you want the motion in the recording."""
        self._send({"jsonrpc": "2.0", "method": "frame", "params": self._observation()})

    # From here on: the protocol.

    @classmethod
    def main(cls):
        """Serves one robot on stdin and stdout, or with --listen PORT on a port of this machine."""
        options = argparse.ArgumentParser(description=cls.__doc__)
        options.add_argument("--listen", metavar="[HOST:]PORT", help="listen there, in place of stdin and stdout")
        cls.options(options)
        arguments = options.parse_args()
        robot = cls()
        robot.configure(arguments)
        if arguments.listen is None:
            protocol_out, sys.stdout = sys.stdout.buffer, sys.stderr  # a print() of yours must not break a line
            robot.serve(sys.stdin.buffer, protocol_out)
            return
        host, _, port = arguments.listen.rpartition(":")
        with socket.create_server((host or "127.0.0.1", int(port))) as server:
            print(f"listening on tcp://{host or '127.0.0.1'}:{server.getsockname()[1]}", file=sys.stderr, flush=True)
            while True:
                client, _ = server.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with client, client.makefile("rb") as reader, client.makefile("wb") as writer:
                    robot.serve(reader, writer)

    @staticmethod
    def options(parser):
        """Add options of your own to the command line."""

    def configure(self, arguments):
        """Take what your options say."""

    @property
    def stopped(self):
        """Whether to stand still: a stop came, or the other side has gone. To be looked at in whatever takes long."""
        return self._stopped.is_set()

    def serve(self, reader, writer):
        """Answers line by line until the other side has gone; the robot is stopped then."""
        self._writer, self._writing = writer, threading.Lock()
        self._stopped, self._scene = threading.Event(), None
        self._last_ns, self._shift_ns = -1, 0
        lines = queue.Queue(maxsize=16)
        threading.Thread(target=self._read, args=(reader, lines), daemon=True).start()
        try:
            for request in iter(lines.get, None):
                self._answer(request)
        except OSError:
            pass  # the other side has gone
        finally:
            self.stop()

    def _read(self, reader, lines):
        """Hands requests on; a stop takes effect at once, while an action is under way."""
        try:
            for line in iter(lambda: reader.readline(MAX_LINE_BYTES + 1), b""):
                if not line.endswith(b"\n"):
                    break
                try:
                    request = json.loads(line)
                    method = request["method"]
                except (ValueError, TypeError, KeyError):
                    request, method = {}, None
                if method == "stop":
                    self._stopped.set()
                    self.stop()
                if method != "stop" or "id" in request:
                    lines.put(request)
        except OSError:
            pass  # the other side has gone
        self._stopped.set()
        self.stop()
        lines.put(None)

    def _answer(self, request):
        answer = {"jsonrpc": "2.0", "id": request.get("id")}
        try:
            answer["result"] = self._result(request.get("method"), request.get("params") or {})
        except Refused as error:
            answer["error"] = {"code": -32602, "message": str(error)}
        except Exception as error:  # whatever an action raises: the robot must not go on
            self._stopped.set()
            self.stop()
            traceback.print_exc()
            answer["error"] = {"code": -32000, "message": f"{type(error).__name__}: {error}"}
        if request.get("id") is not None or "error" in answer:
            self._send(answer)

    def _result(self, method, params):
        if method == "hello":
            return self._hello(params)
        if self._scene is None:
            raise Refused(f"{method} before hello")
        if method not in ("observe", "reset", "stop") and self._stopped.is_set():
            raise Refused(f"{method} after stop; allowed: observe, reset")
        actions = {
            "observe": lambda: None,
            "stop": lambda: None,
            "move_to": lambda: self._move_to(**params),
            "grip": self.grip,
            "release": self.release,
            "settle": self.settle,
        }
        if self.reset is not None:
            actions["reset"] = lambda: self._reset(params)
        if self.carry is not None:
            actions["carry"] = lambda: self.carry(params["body"])
        if method not in actions:
            raise Refused(f"method {method}; allowed: hello, {', '.join(actions)}")
        try:
            actions[method]()
        except Failure as failure:
            return {"cause": failure.cause, "observation": self._observation()}
        return {"observation": self._observation()}

    def _hello(self, params):
        if params["protocol"] != PROTOCOL:
            raise Refused(f"protocol {params['protocol']}; allowed: {PROTOCOL}")
        own = self.setup(params["family"], params["scene"])
        self._scene = own or params["scene"]
        self._stopped.clear()
        able = [name for name in ("reset", "carry") if getattr(self, name) is not None]
        welcome = {"protocol": PROTOCOL, "robot": self.name, "capabilities": able}
        return welcome if own is None else {**welcome, "scene": own}

    def _reset(self, params):
        self._stopped.clear()
        self.reset(params["bodies"], params["gripper"])

    def _move_to(self, slot, body, position_m, hover_m):
        """No target off the table, whoever asks for it."""
        limits = [*self._scene["table_half_m"], 1.0]
        if not all(abs(part) <= limit for part, limit in zip(position_m, limits)) or not 0 <= hover_m <= 1:
            raise Refused(f"target {position_m}, {hover_m} m above: not over the table")
        self.move_to(slot, body, position_m, hover_m)

    def _observation(self):
        now = self.clock_ns() + self._shift_ns
        if now <= self._last_ns:  # a simulator's clock begins anew with each reset
            self._shift_ns += self._last_ns + 1 - now
        self._last_ns = max(self._last_ns + 1, now)
        return {"time_ns": self._last_ns, **self.observe()}

    def _send(self, message):
        line = json.dumps(message, allow_nan=False).encode() + b"\n"
        with self._writing:
            self._writer.write(line)
            self._writer.flush()
