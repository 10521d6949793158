"""Whether the numbers of a pose are one."""

from typing import Any

from ftqp.core.pose import ORTHONORMAL_TOLERANCE
from ftqp.kernel.jit import jit


@jit
def is_rotation(pose: Any) -> bool:
    """|R'R - I| <= ORTHONORMAL_TOLERANCE entry by entry and det R > 0, for the R of a packed pose, (12+,).

    det R is r0 . (r1 x r2) of its columns, which is 1 or -1 where R'R = I.
    """
    a0, a1, a2 = pose[0], pose[4], pose[8]
    b0, b1, b2 = pose[1], pose[5], pose[9]
    c0, c1, c2 = pose[2], pose[6], pose[10]
    off = max(
        max(abs(a0 * a0 + a1 * a1 + a2 * a2 - 1.0), abs(b0 * b0 + b1 * b1 + b2 * b2 - 1.0)),
        max(abs(c0 * c0 + c1 * c1 + c2 * c2 - 1.0), abs(a0 * b0 + a1 * b1 + a2 * b2)),
    )
    off = max(off, max(abs(a0 * c0 + a1 * c1 + a2 * c2), abs(b0 * c0 + b1 * c1 + b2 * c2)))
    volume = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    return bool(off <= ORTHONORMAL_TOLERANCE and volume > 0.0)


@jit
def has_last_row(a: float, b: float, c: float, d: float) -> bool:
    """Whether the last row of a pose is 0 0 0 1 to ORTHONORMAL_TOLERANCE.

    That of a transposed pose is its place, and its place is the base.
    """
    off = max(max(abs(a), abs(b)), max(abs(c), abs(d - 1.0)))
    return bool(off <= ORTHONORMAL_TOLERANCE)
