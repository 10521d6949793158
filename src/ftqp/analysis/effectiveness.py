"""What each joint makes of its commands, learned from how the tip is seen to move."""

from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, array, non_negative, positive
from ftqp.core.errors import InputError

DOUBT = 0.5
"""Standard deviation of an effectiveness before anything was seen; a failed joint has 0, a healthy one 1."""
MOST_DOUBT = 1.0
"""Standard deviation of an effectiveness of which nothing was seen for long."""
DRIFT = 0.03
"""How far an effectiveness may have moved after a second, as a standard deviation [1/sqrt(s)]."""
ACCURACY = 1e-3
"""Share of a motion of the tip by which J dq may be wrong, since a sample is no infinitesimal time."""
LEAST = 1e-9
"""Motions of the tip below this are rounding [m]."""


@final
class Effectiveness:
    """The share of its commanded motion that each joint carries out: 1 healthy, 0 locked.

    The tip moves by dx = J diag(theta) dq while dq is commanded, so a motion tells of those joints that were
    commanded to move the tip. theta is estimated by a Kalman filter with a random walk; it is not bounded
    within the filter, and ``theta`` bounds what it returns.
    Source: docs/theory/learned-jacobian.md.

    Args:
        joints: The number of joints.
        dt: The sampling period [s].
        noise: Standard deviation of a measured position of the tip [m]. A larger one learns more slowly.
        drift: How far an effectiveness may move after a second, as a standard deviation. A larger one forgets
            sooner, and a fault is seen sooner after a long healthy motion.

    Raises:
        InputError: A parameter is out of its range.
    """

    def __init__(self, joints: int, dt: float, *, noise: float = 0.0, drift: float = DRIFT) -> None:
        if isinstance(joints, bool) or not isinstance(joints, int) or joints < 1:
            raise InputError(f"joints is {joints!r}, expected the number of joints, 1 or more")
        self._dt = positive("dt", dt, "s")
        self._step = positive("drift", drift, "1/sqrt(s)") ** 2 * self._dt
        self._noise = 2.0 * non_negative("noise", noise, "m") ** 2 + LEAST**2
        self._theta = np.ones(joints)
        self._P = DOUBT**2 * np.eye(joints)

    @property
    def theta(self) -> FloatArray:
        """The share of its command that each joint carries out, (nv,), each in [0, 1]; a copy."""
        return np.clip(self._theta, 0.0, 1.0)

    @property
    def deviation(self) -> FloatArray:
        """How uncertain each of them is, as a standard deviation, (nv,)."""
        return np.sqrt(np.diag(self._P))

    def learn(self, J: Any, dq: Any, dx: Any) -> None:
        """Take a motion into account.

        Args:
            J: The Jacobian on the way, (m, nv) [m/rad].
            dq: What the joints were commanded to move by, (nv,) [rad].
            dx: What the tip was seen to move by, (m,) [m].

        Raises:
            InputError: A shape is another one, or a number is NaN or infinite.
        """
        n = len(self._theta)
        moved = array("dq", dq, (n,), "(nv,)")
        seen = np.asarray(dx, dtype=np.float64)
        column = array("J", J, (seen.size, n), "(m, nv)") * moved
        seen = array("dx", dx, (len(column),), "(m,)")
        size = float(np.abs(column).sum())
        R = (self._noise + (ACCURACY * size) ** 2) * np.eye(len(column))
        PC = self._P @ column.T
        gain = np.linalg.solve(column @ PC + R, PC.T).T
        self._theta = self._theta + gain @ (seen - column @ self._theta)
        kept = np.eye(n) - gain @ column
        self._P = kept @ self._P @ kept.T + gain @ R @ gain.T + self._step * np.eye(n)
        least = np.minimum(1.0, MOST_DOUBT / self.deviation)
        self._P *= np.outer(least, least)
