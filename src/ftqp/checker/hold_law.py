"""The law of holds: an arm that was held as a whole is let go without a leap, and nobody is blamed for it."""

import numpy as np

from ftqp.checker.joint_health import health
from ftqp.checker.model_file import ModelFile
from ftqp.checker.strictness import Strictness
from ftqp.checker.trace import Trace
from ftqp.core.checks import FloatArray

LEAP = 0.1
"""A joint may be faster by this share after a hold than its limit, or than it was before."""
BLAMED = 1.0
"""What a joint that works and is said to have failed is broken by, or an arm that was stopped."""


def held(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By what share joints that work leap after a hold of the whole arm, or 1 where they are blamed, (K, nv).

    Nobody has failed because all stand: none is said to have, and the arm is not stopped for it, unless a
    joint has really failed.
    """
    if not run.holds:
        return np.zeros((len(run.status), len(arm.names)))
    obeys, limits = health(arm, run)
    result = np.zeros(obeys.shape)
    t, v = run.dt * np.arange(len(result)), np.abs(run.v[1:])
    stopped = np.array([status == "STOPPED" for status in run.status])
    failing = min((failure.since for failure in run.failures), default=np.inf)
    for begin, end in run.holds:
        before, after = t < begin - 0.5 * run.dt, t > end - 0.5 * run.dt
        most = np.maximum(limits["v_max"], v[before].max(axis=0, initial=0.0))
        over = np.where(after[:, None] & obeys, v / ((1.0 + LEAP) * most) - 1.0, 0.0)
        blamed = (t > begin - 0.5 * run.dt)[:, None] & obeys & run.blamed
        blamed |= ((t > begin - 0.5 * run.dt) & (t < failing) & stopped)[:, None]
        result = np.maximum(result, np.where(blamed, BLAMED, over))
    return result
