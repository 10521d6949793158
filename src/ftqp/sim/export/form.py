"""Messages of one topic, all of the same size: serialised once, then filled with the numbers of many ticks.

A number that changes is left open with a mark, a bit pattern that occurs in no text (UTF-8 has no byte 0xFF)
and nowhere else in the message. Where the marks lie in the serialised bytes is where the numbers go.
"""

from collections.abc import Callable
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError
from ftqp.sim.export.ticks import Ticks

Values = Callable[[Ticks], Any]
"""Numbers of a field for some ticks, (K, count)."""
REAL, WHOLE = 0x3FF000000000FFFF, 0x7F0000FF
"""Marks: the low two bytes, or the lowest and the highest, are fixed, and 16 bits above count."""
MOST = 0x7F00
"""Numbers that can be left open in a message."""
UNKNOWN = -1
"""A whole number that a log does not have."""


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
        """An array of int32 or uint32 for a message, left open, (count,).

        Args:
            count: Its length.
            values: What it will hold; what is not finite becomes -1.
        """
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
            if kind == "<i4":
                numbers = np.where(np.isfinite(numbers), numbers, UNKNOWN)
            at = data.index(marks)
            put = np.ascontiguousarray(numbers.astype(kind)).view(np.uint8)
            result[:, at : at + len(marks)] = put.reshape(len(result), -1)
        return result
