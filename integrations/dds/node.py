"""An arm on the network of ROS 2, without ROS: DDS with the names and types that ROS 2 gives its topics.

The node leads a simulated arm, which does what it is told, to poses that somebody publishes; put your own arm
in the place of two lines of ``turn``. Where ROS 2 runs on the same network, its tools see the topics:

    pip install cyclonedds
    python integrations/dds/node.py panda
    ros2 topic echo /ftqp/status
    ros2 topic pub --once /ftqp/fault diagnostic_msgs/msg/KeyValue "{key: panda_joint3, value: locked}"

It was tried on one machine, and its messages byte by byte against rosbags, which writes those
of ROS 2 by itself; no ROS 2 has listened to it yet. A process in Python is no hard real time: for that see
integrations/ros2_control.
"""

import argparse
import sys
import time
from dataclasses import dataclass, field

import numpy as np
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import byte, float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import ftqp

KINDS = {"locked": ftqp.Locked, "free_swinging": ftqp.FreeSwinging, "degraded": ftqp.Degraded}
QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
"""As ROS 2 has it where nothing is said."""
EVERY = 10
"""Steps between two messages of where the joints are."""
RARELY = 100
"""Steps between two messages of how the arm fares."""
MOST_TICKS = 5
"""So many periods at most are made up for after a delay."""
WARNS, FAILS = ("RELAXED", "SCALED", "LAGGING", "HELD"), ("FALLBACK", "STOPPING", "STOPPED", "INVALID_INPUT")


def named(package, name):
    """How ROS 2 calls the type of a message."""
    return f"{package}::msg::dds_::{name}_"


@dataclass
class Time(IdlStruct, typename=named("builtin_interfaces", "Time")):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename=named("std_msgs", "Header")):
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class String(IdlStruct, typename=named("std_msgs", "String")):
    data: str = ""


@dataclass
class Point(IdlStruct, typename=named("geometry_msgs", "Point")):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct, typename=named("geometry_msgs", "Quaternion")):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct, typename=named("geometry_msgs", "Pose")):
    position: Point = field(default_factory=Point)
    orientation: Quaternion = field(default_factory=Quaternion)


@dataclass
class PoseStamped(IdlStruct, typename=named("geometry_msgs", "PoseStamped")):
    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)


@dataclass
class JointState(IdlStruct, typename=named("sensor_msgs", "JointState")):
    header: Header = field(default_factory=Header)
    name: sequence[str] = field(default_factory=list)
    position: sequence[float64] = field(default_factory=list)
    velocity: sequence[float64] = field(default_factory=list)
    effort: sequence[float64] = field(default_factory=list)


@dataclass
class KeyValue(IdlStruct, typename=named("diagnostic_msgs", "KeyValue")):
    key: str = ""
    value: str = ""


@dataclass
class DiagnosticStatus(IdlStruct, typename=named("diagnostic_msgs", "DiagnosticStatus")):
    level: byte = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: sequence[KeyValue] = field(default_factory=list)


@dataclass
class Bool(IdlStruct, typename=named("std_msgs", "Bool")):
    data: bool = False


HEARD = {"target": PoseStamped, "fault": KeyValue, "withdraw": String, "stop": Bool}
SAID = {"status": DiagnosticStatus}


def fault_from(joint, words):
    """A fault from words such as ``locked`` or ``degraded velocity=0.5``.

    Raises:
        ValueError: They say none.
        ftqp.FtqpError: A number is out of its range.
    """
    kind, *settings = words.split()
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is no fault; expected one of {', '.join(KINDS)}")
    said = dict(setting.split("=", 1) for setting in settings)
    given = {key: value if key in ("mode", "reset") else float(value) for key, value in said.items()}
    return KINDS[kind](joint, **given)


def target_of(message):
    """The pose of a message.

    Raises:
        ValueError: It is none.
    """
    p, q = message.pose.position, message.pose.orientation
    x, y, z, w = np.array([q.x, q.y, q.z, q.w])
    size = np.sqrt(x * x + y * y + z * z + w * w)
    if not (np.isfinite([p.x, p.y, p.z]).all() and abs(size - 1.0) < 1e-2):
        raise ValueError("the target is no pose: numbers are finite and the quaternion is of length 1")
    x, y, z, w = x / size, y / size, z / size, w / size
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = p.x, p.y, p.z
    return ftqp.Target(pose=pose)


class Node:
    """The planner of an arm behind topics.

    Args:
        robot: The arm.
        name: Of the node; topics are ``/name/target`` and so on.
        domain: Of DDS, ``ROS_DOMAIN_ID``.
    """

    def __init__(self, robot, name="ftqp", domain=0):
        self.planner = ftqp.Planner(robot)
        self.q = robot.neutral.copy()
        self.planner.reset(self.q)
        self.follower = ftqp.TargetFollower(self.planner)
        self.target = ftqp.Target(pose=robot.pose(self.q))
        self.name, self.steps = name, 0
        network = DomainParticipant(domain)
        self.heard = {
            what: DataReader(network, Topic(network, f"rt/{name}/{what}", kind), qos=QOS)
            for what, kind in HEARD.items()
        }
        self.status = DataWriter(network, Topic(network, f"rt/{name}/status", DiagnosticStatus), qos=QOS)
        self.joints = DataWriter(network, Topic(network, "rt/joint_states", JointState), qos=QOS)

    def listen(self):
        """Do what messages ask for; what makes no sense is said on stderr."""
        for what, reader in self.heard.items():
            for message in reader.take(N=10):
                try:
                    getattr(self, f"_hear_{what}")(message)
                except (ValueError, TypeError, ftqp.FtqpError) as mistake:
                    sys.stderr.write(f"/{self.name}/{what}: {mistake}\n")

    def turn(self):
        """One period: listen, plan, send, and say how it is going from time to time."""
        self.listen()
        step = self.follower.step(self.q, None, self.target)
        self.q = step.q.copy()  # sent to the arm, and read from its encoders
        if self.steps % EVERY == 0:
            self.joints.write(
                JointState(
                    header=Header(stamp=now()), name=list(self.planner.robot.joints),
                    position=self.q.tolist(), velocity=step.v.tolist(),
                )
            )  # fmt: skip
        if self.steps % RARELY == 0:
            self._say(step)
        self.steps += 1

    def run(self, seconds):
        """Turn by the clock for so many seconds; after a delay at most MOST_TICKS periods are made up for."""
        dt, due = self.planner.dt, time.monotonic()
        for _ in range(round(seconds / dt)):
            self.turn()
            due = max(due + dt, time.monotonic() - MOST_TICKS * dt)
            time.sleep(max(due - time.monotonic(), 0.0))

    def _hear_target(self, message):
        self.target = target_of(message)

    def _hear_fault(self, message):
        self.planner.report(fault_from(message.key, message.value))

    def _hear_withdraw(self, message):
        self.planner.withdraw(message.data)

    def _hear_stop(self, message):
        if message.data:
            self.planner.stop()
        elif not self.planner.resume():
            raise ValueError("a lost sensor, or the arm's brake, forbids to go on")

    def _say(self, step):
        name, planner = step.status.name, self.planner
        found = {one.joint for one in planner.findings if one.withdrawn_at is None}
        values = [
            KeyValue("tip_error", f"{step.position_error:.6g}"),
            KeyValue("stopped_because", planner.stopped_because or ""),
            KeyValue("brakes", str(int(step.brakes.sum()))),
        ]
        values += [
            KeyValue(joint, f"found {fault.kind}" if joint in found else fault.kind)
            for joint, fault in planner.faults.items()
        ]
        level = 2 if name in FAILS else 1 if name in WARNS or planner.faults else 0
        self.status.write(DiagnosticStatus(level, self.name, step.status.value, "", values))


def now():
    """The time as ROS 2 has it."""
    seconds, rest = divmod(time.time_ns(), 1_000_000_000)
    return Time(seconds, rest)


def main():
    """Run a node."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot", help="of ftqp's catalog, such as panda")
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--domain", type=int, default=0, help="ROS_DOMAIN_ID")
    given = parser.parse_args()
    Node(ftqp.robots.load(given.robot), domain=given.domain).run(given.seconds)


if __name__ == "__main__":
    main()
