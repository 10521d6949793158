"""How much deceleration the motors certainly have: what viability may count on under torque limits."""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.told.believed import look_again, swings

MARGIN = 1.3
"""Bias and inertia beyond what was sampled that ``guard`` allows for."""
LEAST_SHARE = 0.05
"""Share of a_max that braking counts on at least, so that it counts on something where gravity leaves
nothing."""


@jit
def sample(K: Any, rows: Any) -> None:
    """|h| and |M| of an arm at states: each row has q and v, (n,), and gets |h|, (n,), and |M|, (n, n).

    Args:
        K: the rooms of an arm.
        rows: (samples, 3 n + n^2).
    """
    state, kinematics, n = K.state, K.kinematics, K.chain.n
    for s in range(len(rows)):
        row = rows[s]
        for i in range(n):
            state.q[i], state.v[i] = row[i], row[n + i]
        forward_kinematics(K, state)
        motion(K, state)
        dynamics(K, state)
        for i in range(n):
            row[2 * n + i] = abs(kinematics.h[i])
            for j in range(n):
                row[3 * n + i * n + j] = abs(kinematics.M[i, j])


@jit
def _kappa(rows: Any, n: int, a_max: Any, tau_max: Any, margin: float) -> float:
    """The largest kappa with |h_i| + kappa sum_j |M_ij| a_max_j <= tau_max_i in all samples."""
    least = inf
    for s in range(len(rows)):
        row = rows[s]
        for i in range(n):
            left = tau_max[i] - margin * row[2 * n + i]
            if left < inf:
                needed = 0.0
                for j in range(n):
                    needed += row[3 * n + i * n + j] * a_max[j]
                least = min(least, left / (margin * needed))
    return least


@jit
def reserve(rows: Any, n: int, a_max: Any, tau_max: Any, out: Any) -> None:
    """The shares of a_max with which every joint can brake at once, and up to which torque limits hold."""
    out.share = min(max(_kappa(rows, n, a_max, tau_max, 1.0), LEAST_SHARE), 1.0)
    out.guard = min(max(_kappa(rows, n, a_max, tau_max, MARGIN), 0.0), 1.0)


@jit
def count_on(K: Any, given: Any, rows: Any, out: Any) -> None:
    """The deceleration that viability counts on, and when torque limits are looked at."""
    limits, n, limited = K.limits, K.chain.n, len(rows) > 0
    look_again(K.scene)
    on_demand = limited and given.on_demand != 0 and not swings(K.faults, K.chain)
    out.share = 1.0
    out.guard = 0.0
    if limited:
        reserve(rows, n, limits.a_max, limits.tau_max, out)
    for i in range(n):
        limits.a_brake[i] = out.share * limits.a_max[i]
    limits.on_demand = 1 if on_demand else 0
    limits.guard = out.guard if on_demand and K.state.level == VELOCITY else 0.0
