"""The least squares of what the joints say: rotor and friction of each, and one load, within their bounds."""

from math import sqrt
from typing import Any

from ftqp.kernel.feedback.doubt import bounded_limit
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.linear_systems import factor, solve_factored

LEAST_MISSED = 1e-3
"""Mean square of what the equations miss at least, in units of ``TORQUE_NOISE``."""
FRICTION_PACE = 0.006
"""Share of the torque limit by which an estimate of the friction may change without news: with 0.01 wrists
that an impact had thrown came back faster than their limits."""
ROTOR_PACE = 0.03
"""Inertia [kg m2 or kg] by which an estimate of a rotor may change without news ..."""
MASS_PACE = 0.3
"""... and mass [kg] of a load."""
BESIDE_TIP = 0.02
"""First moment [kg m] of a load that may change so, and that it is taken to have beside the tip, across the
last joint's axis, as long as nothing says more: a kilogram two centimetres off. An arm that hardly moves says
nothing of one along gravity, and beside the axis of a light wrist it would be most of its inertia."""
MOST_DOUBTS = 10.0
"""A rotor may be so many times what is said to be doubtful."""


@jit
def _own(learned: Any, limits: Any, i: int) -> tuple[float, float, float, float, float]:
    """Information of rotor and friction of joint i, with that of staying where they are: P (3) and r (2)."""
    information, moment = learned.information[i], learned.moment[i]
    pace = FRICTION_PACE * bounded_limit(limits, i)
    stay, stay_f = 1.0 / (ROTOR_PACE * ROTOR_PACE), 1.0 / (pace * pace)
    return (
        max(information[0, 0], 0.0) + stay,
        information[0, 1],
        information[1, 1] + stay_f,
        moment[0] + stay * learned.rotor[i],
        moment[1] + stay_f * learned.friction[i],
    )


@jit
def _bounds(learned: Any, i: int) -> tuple[float, float]:
    """The least and the largest inertia that a rotor may have beside the model."""
    return -learned.base_armature[i], MOST_DOUBTS * learned.doubt


@jit
def _held(learned: Any, i: int) -> tuple[float, float]:
    """Rotor and friction of joint i where they are held at a bound; 0 where they are not."""
    low, high = _bounds(learned, i)
    fixed = learned.fixed[i]
    return low if fixed & 1 else (high if fixed & 2 else 0.0), 0.0


@jit
def _inverse(learned: Any, i: int, p00: float, p01: float, p11: float) -> tuple[float, float, float]:
    """The inverse of P over what is not held."""
    fixed = learned.fixed[i]
    if fixed == 0:
        det = p00 * p11 - p01 * p01
        return p11 / det, -p01 / det, p00 / det
    return 0.0 if fixed & 3 else 1.0 / p00, 0.0, 0.0 if fixed & 4 else 1.0 / p11


@jit
def _bring_within_reach(learned: Any) -> None:
    """A load's centre is no farther than ``reach``, also where rotors and friction are made beside it.

    Else they would make up for a first moment that the arm is not taken to have.
    """
    load = learned.load
    most = learned.reach * load[0]
    away = sqrt(load[1] * load[1] + load[2] * load[2] + load[3] * load[3])
    if away > most:
        for k in range(1, 4):
            load[k] *= most / away


@jit
def _solve_load(K: Any) -> None:
    """The load, whatever rotors and friction are then: they are eliminated joint by joint."""
    learned, limits = K.learned, K.limits
    S, total = learned.S, learned.total
    firm = 1.0 / (BESIDE_TIP * BESIDE_TIP)
    for k in range(4):
        pace = MASS_PACE if k == 0 else BESIDE_TIP
        stay = 1.0 / (pace * pace)
        for l in range(4):
            S[k, l] = 0.0
        S[k, k] = stay
        total[k] = stay * learned.load[k]
    for k in range(2):  # across the last joint's axis, which is z
        t = K.chain.tip_translation[k]
        S[1 + k, 1 + k] += firm
        S[1 + k, 0] -= firm * t
        S[0, 0] += firm * t * t
    for i in range(K.chain.n):
        information, moment = learned.information[i], learned.moment[i]
        p00, p01, p11, r0, r1 = _own(learned, limits, i)
        x0, x1 = _held(learned, i)
        r0, r1 = r0 - p00 * x0 - p01 * x1, r1 - p01 * x0 - p11 * x1
        i00, i01, i11 = _inverse(learned, i, p00, p01, p11)
        for k in range(4):
            c0, c1 = information[0, 2 + k], information[1, 2 + k]
            g0, g1 = i00 * c0 + i01 * c1, i01 * c0 + i11 * c1
            total[k] += moment[2 + k] - c0 * x0 - c1 * x1 - g0 * r0 - g1 * r1
            for l in range(k + 1):
                S[k, l] += information[2 + k, 2 + l] - g0 * information[0, 2 + l] - g1 * information[1, 2 + l]
    if factor(S, 4):
        solve_factored(S, 4, total)
        for k in range(4):
            learned.load[k] = total[k] if total[0] > 0.0 else 0.0
        _bring_within_reach(learned)


@jit
def _solve_joint(K: Any, i: int, hold: bool) -> None:
    """Rotor and friction of joint i beside the load; what leaves its bounds is held there from now on."""
    learned = K.learned
    information = learned.information[i]
    p00, p01, p11, r0, r1 = _own(learned, K.limits, i)
    for k in range(4):
        r0 -= information[0, 2 + k] * learned.load[k]
        r1 -= information[1, 2 + k] * learned.load[k]
    x0, x1 = _held(learned, i)
    r0, r1 = r0 - p00 * x0 - p01 * x1, r1 - p01 * x0 - p11 * x1
    i00, i01, i11 = _inverse(learned, i, p00, p01, p11)
    rotor, friction = x0 + i00 * r0 + i01 * r1, x1 + i01 * r0 + i11 * r1
    low, high = _bounds(learned, i)
    if hold:
        if rotor < low:
            learned.fixed[i] |= 1
        elif rotor > high:
            learned.fixed[i] |= 2
        if friction < 0.0:
            learned.fixed[i] |= 4
        return
    learned.rotor[i], learned.friction[i] = min(max(rotor, low), high), max(friction, 0.0)
    known = 1.0 / (learned.doubt * learned.doubt)
    of_rotor = information[0, 0] - information[0, 1] * information[0, 1] / p11
    known += max(of_rotor, 0.0) / (learned.missed[i] + LEAST_MISSED)
    learned.sigma[i] = min(learned.sigma[i], 1.0 / sqrt(known))


@jit
def solve(K: Any) -> None:
    """Least squares over all joints, with bounds: what is outside after the first solution is held there."""
    learned, n = K.learned, K.chain.n
    for i in range(n):
        learned.fixed[i] = 0
    load0, load1, load2, load3 = learned.load[0], learned.load[1], learned.load[2], learned.load[3]
    _solve_load(K)
    held = False
    for i in range(n):
        _solve_joint(K, i, True)
        held = held or learned.fixed[i] != 0
    if held:
        learned.load[0], learned.load[1], learned.load[2], learned.load[3] = load0, load1, load2, load3
        _solve_load(K)
    for i in range(n):
        _solve_joint(K, i, False)
