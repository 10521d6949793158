"""A run as a ROS 2 bag: what Foxglove, PlotJuggler, RViz and ``ros2 bag play`` show.

- ``/joint_states``, ``sensor_msgs/JointState``: what the joints really did; efforts are measured motor
  torques where the log has them.
- ``/joint_command``: positions and velocities that were sent, for the end of the step, and motor torques.
- ``/joint_measured``, ``/joint_reference``: what the planner was given, and its own state; where sensors or a
  drive make a difference.
- ``/target``, ``/tip``, ``geometry_msgs/PoseStamped``: in the frame ``base``, or ``world`` where
  the base moves.
- ``/tf``: ``base``, a link behind each joint, the tip. ``/robot_description``, latched: the arm as a URDF.
- ``/ftqp/status``, ``std_msgs/String``: the status in words, where it changes.
- ``/ftqp/step``, ``ftqp_msgs/Step``, defined in the file: errors, slack, residual, iterations, step time,
  belief and truth of each joint, errors of soft tasks and distances of kept points by name.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ftqp.control.planner.status import STATUSES
from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError
from ftqp.core.pose import quaternions
from ftqp.model.chain import Chain, ends_of
from ftqp.model.robot import Robot
from ftqp.model.urdf_text import BASE, link_names
from ftqp.sim.export.ros_bag import RosBag, Ticks
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.signals import CONDITIONS, PLANES, TASKS
from ftqp.sim.log.table_files import Told, silent, whole_folder

Values = Callable[[Ticks], Any]
"""Numbers of a field for some ticks, (K, count)."""
REAL, WHOLE = 0x3FF000000000FFFF, 0x7F0000FF
"""Marks: the low two bytes, or the lowest and the highest, are fixed, and 16 bits above count."""
MOST = 0x7F00
"""Numbers that can be left open in a message."""


@final
class Form:
    """The open numbers of a message."""

    def __init__(self) -> None:
        self._open: list[tuple[bytes, str, Values]] = []
        self._count = 0

    def reals(self, count: int, values: Values) -> FloatArray:
        """An array of float64 for a message, left open, (count,)."""
        marks = np.array([REAL + (k << 16) for k in self._next(count)], dtype="<u8").view("<f8")
        self._open.append((marks.tobytes(), "<f8", values))
        return marks

    def wholes(self, count: int, values: Values) -> NDArray[np.int32]:
        """An array of int32 or uint32 for a message, left open, (count,)."""
        marks = np.array([WHOLE + (k << 8) for k in self._next(count)], dtype="<u4").view("<i4")
        self._open.append((marks.tobytes(), "<i4", values))
        return marks

    def real(self, values: Values) -> float:
        """A float64 for a message, left open."""
        return float(self.reals(1, values)[0])

    def whole(self, values: Values) -> int:
        """An int32 or uint32 for a message, left open."""
        return int(self.wholes(1, values)[0])

    def _next(self, count: int) -> range:
        self._count += count
        if self._count > MOST:
            raise FtqpError(f"a message has more than {MOST} numbers, which is more than an arm has")
        return range(self._count - count, self._count)

    def filled(self, data: bytes, ticks: Ticks) -> NDArray[np.uint8]:
        """The serialised messages of some ticks, (K, size)."""
        result = np.tile(np.frombuffer(data, dtype=np.uint8), (len(ticks.block), 1))
        for marks, kind, values in self._open:
            if data.count(marks) != 1:
                raise FtqpError("a number of a message was not serialised as it should be")
            numbers = np.asarray(values(ticks))
            at = data.index(marks)
            put = np.ascontiguousarray(numbers.astype(kind)).view(np.uint8)
            result[:, at : at + len(marks)] = put.reshape(len(result), -1)
        return result


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


def fixed_pose(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Position and unit quaternion x, y, z, w, (7,) [m], of a rotation (3, 3) and a translation (3,)."""
    return np.concatenate([translation, quaternions(rotation[None])[0]])


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
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Topic:
    """A topic with a message a tick."""

    number: int  # Of the bag
    form: Form  # The open numbers of its message
    data: bytes  # The message, serialised


@final
class Topics:
    """The topics of a run with a message a tick."""

    def __init__(self, bag: RosBag, ticks: Ticks, robot: Robot | None, dt: float, level: str) -> None:
        self._bag, self._ticks = bag, ticks
        self.all: list[Topic] = []
        measured = ("tau_measured",) if "tau_measured" in ticks else ()
        self._joints("/joint_states", _signals("q"), _signals("v"), *map(_signals, measured))
        sent = _signals("q_command"), _signals("v_command")
        self._joints(
            "/joint_command",
            *(sent if "q_command" in ticks else _integrated(dt, level)),
            _signals("tau"),
        )
        for topic, group in (("/joint_measured", "measured"), ("/joint_reference", "reference")):
            if f"q_{group}" in ticks:
                self._joints(topic, _signals(f"q_{group}"), _signals(f"v_{group}"))
        self._pose("/target", "target")
        self._pose("/tip", "tip")
        if robot is not None:
            self._frames(robot)
        self._step()

    def _add(self, name: str, form: Form, message: Any) -> None:
        number = self._bag.topic(name, message.__msgtype__)
        self.all.append(Topic(number=number, form=form, data=self._bag.serialised(message)))

    def _header(self, form: Form, frame: str = "") -> Any:
        stamp = self._bag.message(
            "builtin_interfaces/msg/Time",
            sec=form.whole(lambda ticks: ticks.stamps[:, :1]),
            nanosec=form.whole(lambda ticks: ticks.stamps[:, 1:]),
        )
        return self._bag.message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _joints(self, name: str, position: Values, velocity: Values, effort: Values | None = None) -> None:
        form, n = Form(), len(self._ticks.joints)
        message = self._bag.message(
            "sensor_msgs/msg/JointState",
            header=self._header(form),
            name=list(self._ticks.joints),
            position=form.reals(n, position),
            velocity=form.reals(n, velocity),
            effort=np.empty(0) if effort is None else form.reals(n, effort),
        )
        self._add(name, form, message)

    def _pose(self, name: str, group: str) -> None:
        """A pose, in the inertial frame where the base moves."""
        form, make = Form(), self._bag.message
        at = [form.real(_signals(group, k)) for k in range(7)]
        pose = make(
            "geometry_msgs/msg/Pose",
            position=make("geometry_msgs/msg/Point", x=at[0], y=at[1], z=at[2]),
            orientation=make("geometry_msgs/msg/Quaternion", x=at[3], y=at[4], z=at[5], w=at[6]),
        )
        frame = WORLD if "base" in self._ticks else BASE
        header = self._header(form, frame)
        self._add(name, form, make("geometry_msgs/msg/PoseStamped", header=header, pose=pose))

    def _frames(self, robot: Robot) -> None:
        form, chain, links = Form(), robot.chain, link_names(robot.joints, robot.tips)
        frames = []
        if "base" in self._ticks:
            frames.append(self._frame(form, WORLD, BASE, lambda ticks: ticks["base"]))
        for i in range(robot.nv):
            frames.append(self._frame(form, links[chain.parent[i] + 1], links[i + 1], _joint(chain, i)))
        for link, (body, *end) in zip(links[robot.nv + 1 :], ends_of(robot.model, robot.tips), strict=True):
            frames.append(self._frame(form, links[body + 1], link, _fixed(*end)))
        self._add("/tf", form, self._bag.message("tf2_msgs/msg/TFMessage", transforms=frames))

    def _frame(self, form: Form, parent: str, child: str, pose: Values) -> Any:
        make = self._bag.message
        at = [form.real(_part(pose, k)) for k in range(7)]
        return make(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(form, parent),
            child_frame_id=child,
            transform=make(
                "geometry_msgs/msg/Transform",
                translation=make("geometry_msgs/msg/Vector3", x=at[0], y=at[1], z=at[2]),
                rotation=make("geometry_msgs/msg/Quaternion", x=at[3], y=at[4], z=at[5], w=at[6]),
            ),
        )

    def _step(self) -> None:
        form, n = Form(), len(self._ticks.joints)
        fields: dict[str, Any] = {name: form.real(_signals(name)) for name in _REALS}
        fields |= {name: form.whole(_signals(name)) for name in _WHOLES}
        fields |= {name: form.reals(n, _signals(group)) for name, group in _JOINTS.items()}
        fields |= {name: form.wholes(n, _signals(name)) for name in _CODES}
        for group, whose in _FURTHER.items():
            names = self._ticks.names(group)
            fields[f"{whose}_name"] = names
            fields[group] = form.reals(len(names), _signals(group)) if names else np.empty(0)
        fields |= {"header": self._header(form), "name": list(self._ticks.joints)}
        self._add("/ftqp/step", form, self._bag.message(STEP, **fields))


def _signals(group: str, k: int | None = None) -> Values:
    """All signals of a group, or one of them."""
    return lambda ticks: ticks[group] if k is None else ticks[group][:, k : k + 1]


def _joint(chain: Chain, i: int) -> Values:
    """Poses of joint frame i in that of its parent."""
    return lambda ticks: joint_poses(chain, i, ticks["q"][:, i])


def _fixed(rotation: FloatArray, translation: FloatArray) -> Values:
    """The same pose at every tick."""
    pose = fixed_pose(rotation, translation)
    return lambda ticks: np.tile(pose, (len(ticks.block), 1))


def _part(values: Values, k: int) -> Values:
    """One of several numbers."""
    return lambda ticks: values(ticks)[:, k : k + 1]


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
    """All ticks of a run in a new bag, a folder with ``metadata.yaml`` and an MCAP file.

    Topics are those of the list above; those of a robot are there where one is given.
    """
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
            messages = [(topic.number, topic.form.filled(topic.data, now)) for topic in topics]
            for k, (time, code) in enumerate(zip(times, codes, strict=True)):
                if code != last:
                    text = bag.message(TEXT, data=_sentence(code))
                    bag.write(statuses, time, bag.serialised(text))
                    last, sent = code, sent + 1
                for number, data in messages:
                    bag.write(number, time, data[k].tobytes())
            done += len(block)
            sent += len(block) * len(topics)
            notify(done / rows.count)
    return sent


def _sentence(code: float) -> str:
    """The status of a step in words."""
    known = code in range(len(STATUSES))
    return f"{STATUSES[int(code)].name}: {STATUSES[int(code)].value}" if known else f"status {code:g}"
