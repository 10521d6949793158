"""Bags of ROS: messages in an MCAP file, and the motion of a run as one for a joint trajectory controller."""

import csv
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.table_files import Told, silent, whole_folder

try:
    from rosbags.interfaces import (
        Connection,
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )
    from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer
    from rosbags.rosbag2.enums import CompressionFormat
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as error:
    raise MissingPackage("a ROS 2 bag", "rosbags", remedy_for_extra("ros")) from error

FOREVER = QosTime(2147483647, 4294967295)
"""No deadline, as ROS 2 writes it."""
VERSION: Final = 9
"""Of the bag's metadata, that of ROS 2 Jazzy."""


@final
class RosBag:
    """A new bag, a folder with one compressed MCAP file and ``metadata.yaml``, with the messages of Jazzy."""

    def __init__(self, folder: Path, types: dict[str, str]) -> None:
        self._store = get_typestore(Stores.ROS2_JAZZY)
        for name, text in types.items():
            self._store.register(get_types_from_msg(text, name))
        self._writer = Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._connections: list[Connection] = []
        self._open = ExitStack()

    def __enter__(self) -> Self:
        self._open.enter_context(self._writer)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)

    def message(self, name: str, /, **fields: Any) -> Any:
        """A message of the type ``name``, for example ``sensor_msgs/msg/JointState``."""
        return self._store.types[name](**fields)

    def serialised(self, message: Any) -> bytes:
        """The bytes of a message, little-endian CDR."""
        return bytes(self._store.serialize_cdr(message, message.__msgtype__))

    def topic(self, name: str, kind: str, *, latched: bool = False) -> int:
        """A new topic's number, for ``write``."""
        profiles: Sequence[Qos] = [_quality(latched)]
        self._connections.append(
            self._writer.add_connection(name, kind, typestore=self._store, offered_qos_profiles=profiles)
        )
        return len(self._connections) - 1

    def write(self, topic: int, nanoseconds: int, data: bytes) -> None:
        """Put a message into the bag."""
        self._writer.write(self._connections[topic], nanoseconds, data)


def _quality(latched: bool) -> Qos:
    """Reliable; kept for those who come later where it is latched."""
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1 if latched else 10,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=FOREVER,
        lifespan=FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=FOREVER,
        avoid_ros_namespace_conventions=False,
    )


NANOSECONDS = 1_000_000_000


@final
class Ticks:
    """Rows of a log, to be asked for groups of signals."""

    def __init__(self, rows: LogRows) -> None:
        self._rows = rows
        self._groups = rows.groups()
        if not rows.count:
            raise InputError(f"{rows.title} has no rows yet; expected a run of at least one tick")
        self.joints = tuple(self.names("q"))
        self.block = np.empty((0, len(rows.columns)))

    def of(self, block: FloatArray) -> Self:
        """The same, of other rows."""
        self.block = block
        return self

    def __contains__(self, group: str) -> bool:
        return group in self._groups

    def __getitem__(self, group: str) -> FloatArray:
        """Signals of a group, (K, count)."""
        chosen: FloatArray = np.ascontiguousarray(self.block[:, self._groups[group]])
        return chosen

    def names(self, group: str) -> list[str]:
        """What the signals of a group are of, in their order; none where there is no such group."""
        return [self._rows.columns[k].name.split(".", 1)[1] for k in self._groups.get(group, [])]

    @property
    def nanoseconds(self) -> NDArray[np.int64]:
        """Times since the start of the run, (K,) [ns]."""
        return np.rint(self["t"][:, 0] * NANOSECONDS).astype(np.int64)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Seconds and nanoseconds, (K, 2)."""
        return np.stack(np.divmod(self.nanoseconds, NANOSECONDS), axis=1)


TOPIC = "/joint_trajectory_controller/joint_trajectory"
"""Where the controller listens under its usual name."""
KIND = "trajectory_msgs/msg/JointTrajectory"
CSV_FILE = "trajectory.csv"
MOST_POINTS = 1_000_000
"""Points of a trajectory: one message holds all of them."""
AT_REST = 1e-6
"""A joint slower than this stands [rad/s or m/s]."""


def write_trajectory(rows: LogRows, folder: str | Path, notify: Told = silent) -> float:
    """The motion of a run in a new bag with one message, and beside it as ``trajectory.csv``: t, q, v, a."""
    ticks = Ticks(rows)
    if rows.count > MOST_POINTS:
        raise InputError(
            f"{rows.title} has {rows.count} ticks, expected at most {MOST_POINTS} for a trajectory, which is "
            "one message; write CSV"
        )
    times, points = [], []
    for block in rows.blocks():
        now = ticks.of(block)
        times.append(now.nanoseconds)
        points.append(np.ascontiguousarray(np.stack([now["q"], now["v"], now["a"]], axis=1)))
    moments, motion = np.concatenate(times), np.concatenate(points)
    if not np.isfinite(motion).all():
        first = int(np.argmin(np.isfinite(motion).all(axis=(1, 2))))
        raise InputError(
            f"{rows.title} has a position, velocity or acceleration that is not finite at tick {first}; no "
            "controller takes that"
        )
    with whole_folder(folder) as part:
        with RosBag(part, {}) as bag:
            make = bag.message
            after = [
                make("builtin_interfaces/msg/Duration", sec=int(s), nanosec=int(ns))
                for s, ns in zip(*np.divmod(moments - moments[0], NANOSECONDS), strict=True)
            ]
            message = make(
                KIND,
                header=make(
                    "std_msgs/msg/Header",
                    stamp=make("builtin_interfaces/msg/Time", sec=0, nanosec=0),
                    frame_id="",
                ),
                joint_names=list(ticks.joints),
                points=[
                    make(
                        "trajectory_msgs/msg/JointTrajectoryPoint",
                        positions=q,
                        velocities=v,
                        accelerations=a,
                        effort=np.empty(0),
                        time_from_start=time,
                    )
                    for time, (q, v, a) in zip(after, motion, strict=True)
                ],
            )
            bag.write(bag.topic(TOPIC, KIND), 0, bag.serialised(message))
        notify(0.5)
        with (part / CSV_FILE).open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["t", *(f"{group}.{joint}" for group in "qva" for joint in ticks.joints)])
            seconds = ((moments - moments[0]) / NANOSECONDS).tolist()
            writer.writerows(
                [t, *row] for t, row in zip(seconds, motion.reshape(len(motion), -1).tolist(), strict=True)
            )
        notify(1.0)
    return float(np.abs(motion[-1, 1]).max())
