"""Where the tip should be at a progress along a path, from the path's table."""

from math import cos, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import TARGET_ACCELERATION, TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.layout.flat_arrays import BEGIN, ORIENTATION, POSITION, SPIN, STOP, TURN


@jit
def sample(row: Any, progress: float, target: Any) -> None:
    """Fill in pose, twist x' and acceleration x'' of the path at ``progress`` within one interval.

    The position is a polynomial; R = exp(turn) R_begin with Rodrigues' formula. ``target`` is packed.
    """
    t = progress - row[BEGIN]
    for r in range(3):
        p = POSITION + r
        c0, c1, c2, c3, c4, c5 = row[p], row[p + 3], row[p + 6], row[p + 9], row[p + 12], row[p + 15]
        target[4 * r + 3] = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        target[TARGET_TWIST + r] = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
        target[TARGET_ACCELERATION + r] = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
        s = SPIN + r
        d0, d1, d2, d3 = row[s], row[s + 3], row[s + 6], row[s + 9]
        target[TARGET_TWIST + 3 + r] = d0 + t * (d1 + t * (d2 + t * d3))
        target[TARGET_ACCELERATION + 3 + r] = d1 + t * (2.0 * d2 + t * 3.0 * d3)
    x = t * (row[TURN] + t * (row[TURN + 3] + t * row[TURN + 6]))
    y = t * (row[TURN + 1] + t * (row[TURN + 4] + t * row[TURN + 7]))
    z = t * (row[TURN + 2] + t * (row[TURN + 5] + t * row[TURN + 8]))
    square = x * x + y * y + z * z
    angle = sqrt(square)
    a = sin(angle) / angle if angle > 1e-6 else 1.0 - square / 6.0
    b = (1.0 - cos(angle)) / square if angle > 1e-4 else 0.5 - square / 24.0
    for c in range(3):
        r0, r1, r2 = row[ORIENTATION + c], row[ORIENTATION + 3 + c], row[ORIENTATION + 6 + c]
        u0, u1, u2 = y * r2 - z * r1, z * r0 - x * r2, x * r1 - y * r0
        target[c] = r0 + a * u0 + b * (y * u2 - z * u1)
        target[4 + c] = r1 + a * u1 + b * (z * u0 - x * u2)
        target[8 + c] = r2 + a * u2 + b * (x * u1 - y * u0)
    target[12] = target[13] = target[14] = 0.0
    target[15] = 1.0
    target[TARGET_HAS_ROTATION] = 1.0


@part_jit
def look_up(path: Any, table: Any, rows: int, target: Any) -> None:
    """The path's target at the progress that has been reached."""
    k = min(max(path.interval, 0), rows - 1)
    while k > 0 and table[k, BEGIN] > path.progress:
        k -= 1
    while k < rows - 1 and table[k + 1, BEGIN] <= path.progress:
        k += 1
    path.interval = k
    path.stop = table[k, STOP]
    path.end = table[rows - 1, BEGIN]
    sample(table[k], path.progress, target)
