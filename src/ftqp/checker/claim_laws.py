"""The laws of what is claimed: OK is true of the tip and of every joint, and what can be followed is."""

import numpy as np

from ftqp.checker.joint_health import health
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import BAND_SIGMAS
from ftqp.checker.tip_errors import errors
from ftqp.checker.trace import Strictness, Trace
from ftqp.core.checks import FloatArray

ERROR_BAND, BAND_TIME = 0.02, 0.1
"""A joint follows its command while it is as near as 0.02 rad or m, six sigma and what it moves in 0.1 s."""


def honesty(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance, as a share of it, while OK is claimed too long, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1])
    claimed = run.claims_ok
    return _lasting(np.where(claimed, share - 1.0, 0.0)[:, None], strict.grace, run.dt)


def tracking(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance although it can follow, as a share of the tolerance, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1]) - 1.0
    known = run.can_be_followed & (run.t < run.until - 0.5 * run.dt)
    return _lasting(np.where(known, share, 0.0)[:, None], strict.grace, run.dt)


def inside(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint that obeys is outside its range while OK is claimed, (K, nv) [rad or m]."""
    obeys, limits = health(arm, run)
    q = run.q[:-1]
    out = np.maximum(q - limits["q_max"], limits["q_min"] - q) - strict.position
    claimed = run.claims_ok[:, None]
    return _lasting(np.where(obeys & claimed, out, 0.0), strict.grace, run.dt)


def obedience(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint is outside its error band, while OK is claimed too long, (K, nv)."""
    band = ERROR_BAND + BAND_SIGMAS * strict.noise + BAND_TIME * np.abs(run.sent_v)
    away = np.abs(run.q[1:] - run.sent_q) - band
    claimed = run.claims_ok[:, None]
    known = np.zeros_like(away, dtype=np.bool_)
    t = run.t
    for failure in run.failures:
        known[t >= failure.told, failure.joint] = True
    return _lasting(np.where(claimed & ~known, away, 0.0), max(strict.grace, 0.05), run.dt)


def _lasting(values: FloatArray, time: float, dt: float) -> FloatArray:
    """Where ``values`` are positive for longer than ``time`` [s]; 0 elsewhere.

    A time in which they are not makes up for as long a one in which they are, so that an interruption now
    and then forgives nothing.
    """
    result = np.zeros_like(values)
    long = round(time / dt)
    if not (values > 0.0).any():
        return result
    for i in range(values.shape[1]):
        since = 0
        for k, value in enumerate(values[:, i] > 0.0):
            since = min(since + 1, long + 1) if value else max(since - 1, 0)
            if value and since > long:
                result[k, i] = values[k, i]
    return result
