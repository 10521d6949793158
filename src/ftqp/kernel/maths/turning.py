"""A rotation that turns on."""

from math import cos, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.vectors import cross


@jit
def turn_by(R: Any, w0: float, w1: float, w2: float) -> None:
    """R <- exp(w) R, for nine numbers by rows and a rotation vector w along W [rad] (Rodrigues)."""
    angle = sqrt(w0 * w0 + w1 * w1 + w2 * w2)
    if angle == 0.0:
        return
    c, s = cos(angle), sin(angle)
    k0, k1, k2 = w0 / angle, w1 / angle, w2 / angle
    for j in range(3):
        x, y, z = R[j], R[3 + j], R[6 + j]
        u0, u1, u2 = cross(k0, k1, k2, x, y, z)
        along = (k0 * x + k1 * y + k2 * z) * (1.0 - c)
        R[j], R[3 + j] = c * x + s * u0 + along * k0, c * y + s * u1 + along * k1
        R[6 + j] = c * z + s * u2 + along * k2
