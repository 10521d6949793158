"""The file of an arm: a planner's memory with a head that a library in C checks before it takes it."""

import struct
from collections.abc import Iterator
from functools import cache
from typing import Any, Final

import numpy as np

from ftqp.control.planner.assembly import Deployable
from ftqp.kernel.compiled.library import KERNEL, code_key
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.record import dtype, zeros_in_line

MAGIC: Final = b"FTQPARM\0"
FORMAT: Final = 5
"""Of the file; a library takes files of its own format only."""
HEAD: Final = struct.Struct("<8sII24sIIQQQQQQQQQ")
"""Magic, format, its own size, hash of the kernel's source, joints, samples, sizes of record, given, arm,
path and its table, how many runs follow, size of the file, fingerprint of the arm, checksum. What a
file does not have has 0 bytes."""
RUN: Final = struct.Struct("<QQ")
"""The part in the highest byte and the offset in the others, and how many bytes follow."""
PATH_PART: Final = 3
"""Number of the path among the parts of a file; its table is the next one."""
LINE: Final = 64
"""Bytes that are kept or left out together."""
SEED: Final = 0xCBF29CE484222325
PRIME: Final = 0x100000001B3
"""Of the checksum FNV-1a, 64 bits: it changes with every byte, and any processor computes it."""


@cache
def kernel_hash() -> str:
    """The hash of the kernel's source, which file and library must have in common, 24 hexadecimal digits."""
    return code_key(KERNEL)


def checksum(content: bytes, start: int = SEED) -> int:
    """FNV-1a of bytes, 64 bits."""
    found = start
    for byte in content:
        found = ((found ^ byte) * PRIME) & 0xFFFFFFFFFFFFFFFF
    return found


SMALL: Final = (8, 16, 32)
"""Most joints of an arm in small libraries: whole blocks of joints, as loops go through them."""


def small_capacity(joints: int) -> int:
    """The most joints of the smallest library for an arm of so many."""
    return next((capacity for capacity in SMALL if joints <= capacity), JOINTS)


def arm_file(
    memory: Deployable, joints: int, capacity: int = JOINTS, *, path: Memory | None = None,
    fingerprint: int = 0,
) -> bytes:  # fmt: skip
    """The bytes of ``arm.ftqp``."""
    kinds = [dtype("record", capacity), dtype("given", capacity), dtype("arm", capacity)]
    kept = [memory.record, memory.given, memory.arm]
    sizes = [int(kind.itemsize) for kind in kinds] + [0, 0]
    parts: dict[int, Any] = dict(enumerate(map(_fitted, kept, kinds)))
    if path is not None:
        table = np.dtype((np.void, path.table.nbytes))
        parts[PATH_PART] = _fitted(path.memory, dtype("path", capacity))
        parts[PATH_PART + 1] = np.frombuffer(path.table.tobytes(), table)
    for number, part in parts.items():
        sizes[number] = int(part.dtype.itemsize)
    runs = list(_runs(parts))
    states = np.ascontiguousarray(memory.states, dtype="<f8").tobytes()
    body = b"".join(runs) + states
    count = len(runs)
    fields = (
        MAGIC, FORMAT, HEAD.size, kernel_hash().encode(), joints, len(memory.states), *sizes, count,
        HEAD.size + len(body), fingerprint,
    )  # fmt: skip
    head = HEAD.pack(*fields, 0)
    found = checksum(body, checksum(head[: HEAD.size - 8]))
    return HEAD.pack(*fields, found) + body


def _fitted(memory: Any, dtype: np.dtype[Any]) -> Any:
    """The same in a type for fewer joints, (1,): of each array its begin, where what is of joints lies."""
    if memory.dtype == dtype:
        return memory
    fitted = zeros_in_line(dtype)
    _fit(memory[0], fitted[0])
    return fitted


def _fit(source: Any, into: Any) -> None:
    """Copy each field, the arrays from their begins on."""
    for name in into.dtype.names:
        value, place = source[name], into[name]
        if place.dtype.names:
            _fit(value, place)
        elif place.ndim == 0:
            into[name] = value
        else:
            place[...] = value[tuple(slice(0, length) for length in place.shape)]


def _runs(parts: dict[int, Any]) -> Iterator[bytes]:
    """Each stretch of lines that are not zero, with its place."""
    for number, part in parts.items():
        content = part.tobytes()
        content += bytes(-len(content) % LINE)
        used = np.frombuffer(content, np.uint64).reshape(-1, LINE // 8).any(axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], used.astype(np.int8), [0]])))
        for first, last in edges.reshape(-1, 2):
            begin, end = int(first) * LINE, min(int(last) * LINE, int(part.dtype.itemsize))
            yield RUN.pack(number << 56 | begin, end - begin) + content[begin:end]
