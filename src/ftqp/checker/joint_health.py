"""Which joints of a run obey, what is left of their limits, and when a report comes or a stop strikes."""

import numpy as np

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Trace
from ftqp.core.checks import BoolArray, FloatArray

TELLING = 1e-9
"""Reports between two ticks count at the later one, to this [s]."""
IMPACT = 0.1
"""A joint that meets its end stop more slowly than this does not shake the others [rad/s or m/s]."""


def health(arm: ModelFile, run: Trace) -> tuple[BoolArray, dict[str, FloatArray]]:
    """Which joints obey, (K, nv), and limits left by name, (K, nv); a weak joint's from its report."""
    t = run.t
    obeys = np.ones((len(t), len(arm.names)), dtype=np.bool_)
    limits = {
        name: np.tile(getattr(arm, name), (len(t), 1))
        for name in ("q_min", "q_max", "v_max", "a_max", "tau_max")
    }
    for failure in run.failures:
        fails = (t >= failure.since - 0.5 * run.dt) & (t < failure.until - 0.5 * run.dt)
        if failure.kind == "degraded":
            knows = fails & (t >= failure.reported_at - TELLING)
            for name, share in failure.shares.items():
                limits[name][knows, failure.joint] *= share
            fails &= ~knows & (failure.reported_at > failure.since)
        obeys[fails, failure.joint] = False
    return obeys, limits


def jumps(arm: ModelFile, run: Trace, lasting: float) -> BoolArray:
    """Ticks in which a joint stops in no time, (K,), so that the others jump and are thrown for so long [s].

    One that locks so does, and one that swings freely into its end stop: outside its range it loses more than
    half of its speed in a tick. What that does to the others is mechanics, and no command's doing; in physics
    they swing for a while.
    """
    after = max(1, round(lasting / run.dt))
    spread = np.convolve(_blows(arm, run), np.ones(after + 1))[: len(run.status)] > 0.0
    return _locks(run) | spread


def _locks(run: Trace) -> BoolArray:
    """Ticks in which joints are stopped by an impulse, in the world or in what the planner believes, (K,)."""
    t = run.t
    result = np.zeros(len(t), dtype=np.bool_)
    for failure in run.failures:
        if failure.jumps:
            for moment in (failure.since, failure.reported_at):
                result |= np.abs(t - moment) < 1.5 * run.dt
    for begin, _ in run.holds:
        result |= np.abs(t - begin) < 1.5 * run.dt
    return result


def _blows(arm: ModelFile, run: Trace) -> BoolArray:
    """Ticks in which a freely swinging joint strikes its end stop, (K,)."""
    t = run.t
    result = np.zeros(len(t), dtype=np.bool_)
    for failure in run.failures:
        if failure.kind != "free":
            continue
        i = failure.joint
        q, v = run.q[:, i], run.v[:, i]
        outside = (q < arm.q_min[i]) | (q > arm.q_max[i])
        lost = (np.abs(v[:-1]) > IMPACT) & (v[1:] * np.sign(v[:-1]) < 0.5 * np.abs(v[:-1]))
        result |= (outside[:-1] | outside[1:]) & lost & (t >= failure.since)
    return result


def reported_anew(obeys: BoolArray, limits: dict[str, FloatArray]) -> BoolArray:
    """Ticks from which a joint has other limits than before, or obeys for the first time, (K, nv)."""
    result = np.zeros_like(obeys)
    result[0] = True
    result[1:] = ~obeys[:-1]
    for left in limits.values():
        result[1:] |= left[1:] != left[:-1]
    return result
