"""Torque that the motion implies beside the torque of the motors: what nobody asked for."""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, mimic, motion
from ftqp.kernel.detection.acceleration_banks import through
from ftqp.kernel.detection.carried import weigh
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, FAST
from ftqp.kernel.layout.enums import MOTOR_SLOW, TORQUE_SLOW
from ftqp.kernel.maths.elementary import larger, smaller
from ftqp.kernel.maths.side_by_side import WIDTH, put, several

UNSURE = 2.0
"""A joint slower than so many times the speed of sticking may have any friction up to that of its motion."""


@jit
def feel_arm(D: Any, K: Any, then: int) -> None:
    """M and h at the samples, with the speed v_r + w of the fast observer."""
    if D.has_dynamics:
        return
    for i in range(D.n):
        K.state.q[i] = D.seen[i]
        K.state.v[i] = D.past_v[then, i] + D.w[FAST, i]
    if K.chain.mimics:
        mimic(K.chain, K.state.v)
    forward_kinematics(K, K.state)
    motion(K, K.state)
    dynamics(K, K.state)
    D.has_dynamics = 1


@jit
def _unfiltered(D: Any, K: Any, then: int) -> None:
    """psi = M a_r + h + friction - tau, the Coulomb friction that is not known, and each joint's 1/M_ii.

    A joint faster than ``slip`` has the friction f_c sign(v) + f_v v; a slower one what the forces leave, up
    to f_c.
    """
    M, n = K.kinematics.M, D.n
    for at in range(0, D.n, WIDTH):
        total = several(K.kinematics.h, at) - several(D.motor_torque, at)
        for j in range(n):
            total = total + D.past_a[then, j] * several(M[j], at)
        speed = several(K.state.v, at)
        v = speed / D.slip
        coulomb = several(D.coulomb, at)
        side = larger(smaller(v, 1.0), -1.0)
        put(D.side, at, side)
        put(D.psi, at, total + coulomb * side + several(D.viscous, at) * speed)
        put(D.loose, at, coulomb * larger(smaller(UNSURE - abs(v), 1.0), 0.0))
    for i in range(n):
        D.light[i] = 1.0 / M[i, i]


@jit
def compare_torques(D: Any, K: Any, then: int) -> None:
    """r = M d + F[psi], and F[tau_measured - tau_asked], with the friction that is unsure.

    The observers see the mean of an acceleration and of the one before it, and so does F here.
    Source: docs/theory/detection.md, "Residuals".
    """
    for at in range(0, D.n, WIDTH):
        if D.from_command:
            put(D.motor_torque, at, several(D.past_effort[then], at))
        elif D.asked:
            put(D.motor_torque, at, several(D.effort, at))
        else:
            put(D.motor_torque, at, several(D.tau, at))
    feel_arm(D, K, then)
    weigh(D, K, then)
    _unfiltered(D, K, then)
    M = K.kinematics.M
    for b in range(BANKS):
        p = D.pole[b]
        for at in range(0, D.n, WIDTH):
            new = through(D.f[b], at, 0.5 * (several(D.psi, at) + several(D.psi_before, at)), p)
            band = through(D.band[b], at, 0.5 * (several(D.loose, at) + several(D.loose_before, at)), p)
            for j in range(D.n):
                new = new + D.d[b, j] * several(M[j], at)
            put(D.x[TORQUE_SLOW + b], at, new)
            put(D.excess[TORQUE_SLOW + b], at, band)
            if D.has_motor:
                gap = several(D.tau, at) - several(D.motor_torque, at)
                put(D.x[MOTOR_SLOW + b], at, through(D.motor[b], at, gap, p))
    for at in range(0, D.n, WIDTH):
        put(D.psi_before, at, several(D.psi, at))
        put(D.loose_before, at, several(D.loose, at))
