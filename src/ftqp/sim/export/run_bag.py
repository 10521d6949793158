"""A run as a ROS 2 bag: what Foxglove, PlotJuggler, RViz and ``ros2 bag play`` show.

- ``/joint_states``, ``sensor_msgs/JointState``: what the joints really did; efforts are measured motor
  torques where the log has them.
- ``/joint_command``: positions and velocities that were sent, for the end of the step, and motor torques.
- ``/joint_measured``, ``/joint_reference``: what the planner was given, and its own state; where sensors or a
  drive make a difference.
- ``/target``, ``/tip``, ``geometry_msgs/PoseStamped``: in ``base``, or ``world`` where the base moves.
- ``/tf``: ``base``, a link behind each joint, the tip. ``/robot_description``, latched: the arm as a URDF.
- ``/ftqp/status``, ``std_msgs/String``: the status in words, where it changes.
- ``/ftqp/step``, ``ftqp_msgs/Step``, defined in the file: errors, slack, residual, iterations, step time,
  belief and truth of each joint, errors of soft tasks and distances of kept points by name.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, final

import numpy as np

from ftqp.control.planner.status import STATUSES
from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions
from ftqp.model.chain import Chain, ends_of
from ftqp.model.robot import Robot
from ftqp.model.urdf_text import BASE, link_names
from ftqp.sim.export.ros_bag import RosBag, Ticks
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.signals import CONDITIONS, PLANES, TASKS
from ftqp.sim.log.table_files import Told, silent, whole_folder

Values = Callable[[Ticks], FloatArray]
"""Numbers of a field for some ticks, (K, count)."""
Messages = Callable[[Ticks], Iterable[Any]]
"""The messages of a topic for some ticks, one each."""


def joint_poses(chain: Chain, i: int, q: FloatArray) -> FloatArray:
    """Pose of joint frame i in that of its parent, position and unit quaternion x, y, z, w, (K, 7) [m].

    (rotation_i, translation_i) Rz(q), or Tz(q) for a joint that slides.
    """
    result = np.empty((len(q), 7))
    result[:, :3] = chain.translation[i]
    x, y, z, w = quaternions(chain.rotation[i][None])[0]
    if chain.prismatic[i]:
        result[:, :3] += np.outer(q, chain.rotation[i][:, 2])
        result[:, 3:] = x, y, z, w
        return result
    s, c = np.sin(0.5 * q), np.cos(0.5 * q)
    result[:, 3], result[:, 4] = x * c + y * s, y * c - x * s
    result[:, 5], result[:, 6] = z * c + w * s, w * c - z * s
    return result


WORLD = "world"
"""The frame in which a base moves."""
STEP = "ftqp_msgs/msg/Step"
_REALS = (
    "position_error", "rotation_error", "slack", "scale", "qp_residual", "step_time", "sigma_min",
    "manipulability", "condition", "kappa", "off_path", "progress",
)  # fmt: skip
_WHOLES = ("status", "qp_status", "qp_iterations", "path_status")
_JOINTS = {"acceleration": "a", "torque": "tau", "brake_torque": "tau_brake", "lower": "lb", "upper": "ub"}
_CODES = ("belief", "truth")
_FURTHER = {TASKS: "task", PLANES: "kept"}
"""Groups of soft tasks and kept points, and the field of their names without ``_name``."""


def step_definition() -> str:
    """The definition of the message of a step: the numbers of a log, with the names of the codes."""
    lines = [f"int32 STATUS_{status.name}={code}" for code, status in enumerate(STATUSES)]
    lines += [f"int32 JOINT_{word.upper().replace('-', '_')}={code}" for code, word in CONDITIONS.items()]
    lines.append("std_msgs/Header header")
    lines += [f"float64 {name}" for name in _REALS]
    lines += [f"int32 {name}" for name in _WHOLES]
    lines.append("string[] name")
    lines += [f"float64[] {name}" for name in _JOINTS]
    lines += [f"int32[] {name}" for name in _CODES]
    for group, whose in _FURTHER.items():
        lines += [f"string[] {whose}_name", f"float64[] {group}"]
    return "\n".join(lines)


@final
class Topics:
    """The topics of a run with a message a tick, each with its number."""

    def __init__(self, bag: RosBag, ticks: Ticks, robot: Robot | None, dt: float, level: str) -> None:
        self._bag, self._make, self._ticks = bag, bag.message, ticks
        self.all: list[tuple[int, Messages]] = []
        measured = ("tau_measured",) if "tau_measured" in ticks else ()
        self._joints("/joint_states", *map(_signals, ("q", "v", *measured)))
        sent = _signals("q_command"), _signals("v_command")
        self._joints(
            "/joint_command", *(sent if "q_command" in ticks else _integrated(dt, level)), _signals("tau")
        )
        for topic, group in (("/joint_measured", "measured"), ("/joint_reference", "reference")):
            if f"q_{group}" in ticks:
                self._joints(topic, _signals(f"q_{group}"), _signals(f"v_{group}"))
        self._pose("/target", "target")
        self._pose("/tip", "tip")
        if robot is not None:
            self._frames(robot)
        self._add("/ftqp/step", STEP, self._steps)

    def _add(self, name: str, kind: str, messages: Messages) -> None:
        self.all.append((self._bag.topic(name, kind), messages))

    def _header(self, stamp: Any, frame: str = "") -> Any:
        time = self._make("builtin_interfaces/msg/Time", sec=int(stamp[0]), nanosec=int(stamp[1]))
        return self._make("std_msgs/msg/Header", stamp=time, frame_id=frame)

    def _joints(self, name: str, *values: Values) -> None:
        """Positions, velocities and, where they are given, efforts."""
        kind, joints, none = "sensor_msgs/msg/JointState", list(self._ticks.joints), np.empty(0)

        def messages(ticks: Ticks) -> Iterable[Any]:
            for stamp, q, v, *tau in zip(ticks.stamps, *(each(ticks) for each in values), strict=True):
                header, effort = self._header(stamp), tau[0] if tau else none
                yield self._make(kind, header=header, name=joints, position=q, velocity=v, effort=effort)

        self._add(name, kind, messages)

    def _turn(self, at: FloatArray) -> Any:
        return self._make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", at[3:].tolist(), strict=True)))

    def _place(self, kind: str, at: FloatArray) -> Any:
        return self._make(f"geometry_msgs/msg/{kind}", **dict(zip("xyz", at[:3].tolist(), strict=True)))

    def _pose(self, name: str, group: str) -> None:
        """A pose, in the inertial frame where the base moves."""
        kind, frame = "geometry_msgs/msg/PoseStamped", WORLD if "base" in self._ticks else BASE

        def messages(ticks: Ticks) -> Iterable[Any]:
            for stamp, at in zip(ticks.stamps, ticks[group], strict=True):
                pose = self._make(
                    "geometry_msgs/msg/Pose", position=self._place("Point", at), orientation=self._turn(at)
                )
                yield self._make(kind, header=self._header(stamp, frame), pose=pose)

        self._add(name, kind, messages)

    def _frames(self, robot: Robot) -> None:
        chain, links = robot.chain, link_names(robot.joints, robot.tips)
        frames: list[tuple[str, str, Values]] = []
        if "base" in self._ticks:
            frames.append((WORLD, BASE, _signals("base")))
        for i in range(robot.nv):
            frames.append((links[chain.parent[i] + 1], links[i + 1], _joint(chain, i)))
        for link, (body, *end) in zip(links[robot.nv + 1 :], ends_of(robot.model, robot.tips), strict=True):
            frames.append((links[body + 1], link, _fixed(*end)))

        def messages(ticks: Ticks) -> Iterable[Any]:
            for stamp, *every in zip(ticks.stamps, *(pose(ticks) for *_, pose in frames), strict=True):
                transforms = [
                    self._make(
                        "geometry_msgs/msg/TransformStamped",
                        header=self._header(stamp, parent),
                        child_frame_id=child,
                        transform=self._make(
                            "geometry_msgs/msg/Transform",
                            translation=self._place("Vector3", at),
                            rotation=self._turn(at),
                        ),
                    )
                    for (parent, child, _), at in zip(frames, every, strict=True)
                ]
                yield self._make("tf2_msgs/msg/TFMessage", transforms=transforms)

        self._add("/tf", "tf2_msgs/msg/TFMessage", messages)

    def _steps(self, ticks: Ticks) -> Iterable[Any]:
        """The numbers of a step; arrays of what a run does not have are empty."""
        shared: dict[str, Any] = {f"{whose}_name": ticks.names(group) for group, whose in _FURTHER.items()}
        shared["name"] = list(ticks.joints)
        groups = {name: name for name in (*_REALS, *_WHOLES, *_CODES, *_FURTHER)} | _JOINTS
        columns = {name: ticks[group] for name, group in groups.items() if group in ticks}
        columns |= {name: np.empty((len(ticks.block), 0)) for name in _FURTHER if name not in ticks}
        for k, stamp in enumerate(ticks.stamps):
            row = {name: column[k] for name, column in columns.items()}
            row |= {name: float(row[name][0]) for name in _REALS}
            row |= {name: int(row[name][0]) for name in _WHOLES}
            row |= {name: row[name].astype(np.int32) for name in _CODES}
            yield self._make(STEP, header=self._header(stamp), **shared, **row)


def _signals(group: str) -> Values:
    """All signals of a group."""
    return lambda ticks: ticks[group]


def _joint(chain: Chain, i: int) -> Values:
    """Poses of joint frame i in that of its parent."""
    return lambda ticks: joint_poses(chain, i, ticks["q"][:, i])


def _fixed(rotation: FloatArray, translation: FloatArray) -> Values:
    """The same pose at every tick: position and unit quaternion x, y, z, w [m]."""
    pose = np.concatenate([translation, quaternions(rotation[None])[0]])
    return lambda ticks: np.tile(pose, (len(ticks.block), 1))


def _integrated(dt: float, level: str) -> tuple[Values, Values]:
    """Positions and velocities for the end of the step: the command, held for dt.

    q + dt v + dt^2 a/2 and v + dt a; at the velocity level, q + dt (v + dt a).
    """
    half = 0.5 if level == "acceleration" else 1.0

    def velocities(ticks: Ticks) -> FloatArray:
        return ticks["v"] + dt * ticks["a"]

    def positions(ticks: Ticks) -> FloatArray:
        return ticks["q"] + dt * (ticks["v"] + half * dt * ticks["a"])

    return positions, velocities


TEXT = "std_msgs/msg/String"


def write_bag(rows: LogRows, folder: str | Path, robot: Robot | None = None, notify: Told = silent) -> int:
    """All ticks of a run in a new bag, a folder; how many messages it has. ``/tf`` needs the robot."""
    ticks, about, sent = Ticks(rows), rows.metadata, 0
    with whole_folder(folder) as part, RosBag(part, {STEP: step_definition()}) as bag:
        topics = Topics(bag, ticks, robot, float(about["dt"]), about["level"]).all
        description = None if robot is None else bag.topic("/robot_description", TEXT, latched=True)
        statuses = bag.topic("/ftqp/status", TEXT)
        done, last = 0, None
        for block in rows.blocks():
            now = ticks.of(block)
            times, codes = now.nanoseconds.tolist(), now["status"][:, 0].tolist()
            if description is not None and robot is not None:
                text = bag.message(TEXT, data=robot.to_urdf())
                bag.write(description, times[0], bag.serialised(text))
                description, sent = None, sent + 1
            messages = zip(*(make(now) for _, make in topics), strict=True)
            for time, code, every in zip(times, codes, messages, strict=True):
                if code != last:
                    text = bag.message(TEXT, data=_sentence(code))
                    bag.write(statuses, time, bag.serialised(text))
                    last, sent = code, sent + 1
                for (number, _), message in zip(topics, every, strict=True):
                    bag.write(number, time, bag.serialised(message))
            done += len(block)
            sent += len(block) * len(topics)
            notify(done / rows.count)
    return sent


def _sentence(code: float) -> str:
    """The status of a step in words."""
    known = code in range(len(STATUSES))
    return f"{STATUSES[int(code)].name}: {STATUSES[int(code)].value}" if known else f"status {code:g}"
