"""The law of torque: a limit gives way where nothing inside the other limits keeps it, never under OK."""

from typing import Any

import numpy as np
from scipy.optimize import linprog

from ftqp.checker.joint_health import health, jumps
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import missing_way
from ftqp.checker.trace import Strictness, Trace
from ftqp.core.checks import BoolArray, FloatArray

SPARE = 0.02
"""A way to keep all torque limits counts if it leaves this share of them, and of the limits of motion: the
planner's own room is a little smaller than what a judge can know of it."""
IN_A_STOP = ("STOPPING", "STOPPED")
"""Statuses under which a planner may have brakes closed."""
LOOKED_AT = 300
"""At most so many ticks of a run are looked at, evenly spread, for each takes a linear program of 2 ms."""
HALVINGS = 30
"""Ends of the room that a joint's acceleration has are found to 2^-30 of its limit."""


def torque(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much joints carry more than their limit without need, as a share of it, (K, nv).

    Under OK there is never a need. Under any other status there is one where no acceleration of the working
    joints, inside their limits of acceleration, speed and range, keeps all torque limits,

        |M a + h| <= tau_max,   lower <= a <= upper,

    a linear program, with what the failed joints do taken as it is. Kept points come before torque limits
    and are not part of it, so beside them only OK is judged, and nothing where the planner minds no torques.
    The limit is the motor's: dry friction may carry what it can, a joint beyond its range may lie on its end
    stop, and in a stop of an arm with brakes what slows or holds a joint may be its brake, as may be what
    holds all joints at once.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    if not arm.has_masses:
        return result
    obeys, limits = health(arm, run)
    a = np.diff(run.v, axis=0) / run.dt
    tau = arm.torques(run.q[:-1], run.v[:-1], a)
    over = (np.abs(tau) - arm.dry_friction) / limits["tau_max"] - 1.0 - strict.torque
    held = np.zeros(len(run.t), dtype=np.bool_)
    for begin, end in run.holds:
        held |= (run.t > begin - 1.5 * run.dt) & (run.t < end + 0.5 * run.dt)
    over = np.where(obeys & ~(held | jumps(arm, run, strict.grace))[:, None], over, 0.0)
    claimed = run.claims_ok
    result[claimed] = over[claimed]
    if run.planes or not run.minds_torques:
        return result
    over = np.where(_carried(run, strict, limits, tau), 0.0, over)
    ticks = np.flatnonzero((over > 0.0).any(axis=1) & ~claimed)
    if len(ticks) > LOOKED_AT:
        ticks = ticks[np.linspace(0, len(ticks) - 1, LOOKED_AT).astype(int)]
    for k in ticks:
        left = {name: value[k : k + 1] for name, value in limits.items()}
        if _can_be_kept(arm, run, int(k), obeys[k], left, a[k], tau[k]):
            result[k] = over[k]
    return result


def _carried(run: Trace, strict: Strictness, limits: dict[str, FloatArray], tau: FloatArray) -> BoolArray:
    """Where something else than the motor may carry a joint, (K, nv)."""
    q, v = run.q[:-1], run.v[:-1]
    beyond = (np.maximum(q, run.q[1:]) > limits["q_max"]) | (np.minimum(q, run.q[1:]) < limits["q_min"])
    if not run.brakes:
        return beyond
    stops = np.array([status in IN_A_STOP for status in run.status])
    slows = (np.abs(v) <= strict.standing) | (tau * v < 0.0) | (v * run.v[1:] <= 0.0)
    return np.asarray(beyond | (stops[:, None] & slows))


def _can_be_kept(
    arm: ModelFile,
    run: Trace,
    k: int,
    obeys: BoolArray,
    limits: dict[str, FloatArray],
    a: FloatArray,
    tau: FloatArray,
) -> bool:
    """Whether some acceleration of the joints that obey keeps all torque limits in a tick."""
    M, h = arm.dynamics(run.q[k], run.v[k])
    low, high = accelerations(run, k, limits)
    low, high = np.where(obeys, low, a), np.where(obeys, high, a)
    rows, most = [], []
    free = {failure.joint for failure in run.failures if failure.kind == "free"}
    for i in range(len(a)):
        if i in free and not obeys[i]:  # whatever it does, its motor gives nothing else than it gave
            low[i], high[i] = -np.inf, np.inf
            rows += [M[i], -M[i]]
            most += [tau[i] - h[i], h[i] - tau[i]]
        elif obeys[i] and np.isfinite(limit := (1.0 - SPARE) * limits["tau_max"][0, i]):
            rows += [M[i], -M[i]]
            most += [limit - h[i], limit + h[i]]
    if not rows:
        return True
    ends = list(zip(low.tolist(), high.tolist(), strict=True))
    found = linprog(np.zeros(len(a)), A_ub=np.array(rows), b_ub=np.array(most), bounds=ends)
    return bool(found.status == 0)


def accelerations(run: Trace, k: int, limits: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """What each joint may accelerate and still brake, (nv,) each [rad/s2 or m/s2]; else it brakes."""
    high = _highest(run, run.q[k], run.v[k], limits)
    mirrored = {**limits, "q_min": -limits["q_max"], "q_max": -limits["q_min"]}
    low = -_highest(run, -run.q[k], -run.v[k], mirrored)
    crossed = low > high
    middle = 0.5 * (low + high)
    return np.where(crossed, middle, low), np.where(crossed, middle, high)


def _highest(run: Trace, q: FloatArray, v: FloatArray, limits: dict[str, FloatArray]) -> FloatArray:
    """The largest acceleration, by halving: whether a joint can still brake only gets worse with it."""
    a_max = np.where(np.isfinite(limits["a_max"][0]), limits["a_max"][0], 1.0 / run.dt**2)
    held: dict[str, Any] = {**limits, "a_max": (1.0 - SPARE) * limits["a_max"]}
    half = 0.5 if run.level == "acceleration" else 1.0
    low, high = -a_max, (1.0 - SPARE) * a_max
    for _ in range(HALVINGS):
        a = 0.5 * (low + high)
        after = v + run.dt * a
        place = q + run.dt * (v + half * run.dt * a)
        way = missing_way(place[None], np.maximum(after, 1e-300)[None], held, run)[0]
        good = (after <= (1.0 - SPARE) * limits["v_max"][0]) & (way <= 0.0)
        low, high = np.where(good, a, low), np.where(good, high, a)
    return low
