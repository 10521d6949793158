"""A ROS 2 bag in the MCAP format: the one place where rosbags is imported."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self, final

from ftqp.core.errors import MissingPackage
from ftqp.core.extras import remedy_for_extra

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
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
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
