"""Figures of merit of a run, computed from its log alone."""

from typing import Any

from ftqp.core.checks import FloatArray
from ftqp.sim.log.limits_kept import Following, Motion
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.tally import STATUSES, STOP_CODES, Tally

__all__ = ["STATUSES", "STOP_CODES", "failed_joint_motion", "following_error", "is_sensed", "summary"]


def summary(log: Log) -> dict[str, Any]:
    """What happened in a run, ready for ``summary.json``; SI units, ``None`` where there is nothing to tell.

    A limit counts for a joint as long as it works: at its healthy value, from the announcement of a
    degradation on at what is left of it, and there not before the joint has been inside once. A locked
    joint's motion counts from the moment its velocity has become zero. Quantiles of the times of more than
    200,000 steps are within 0.1 % of themselves.
    """
    tally = Tally(log.metadata, sensed=is_sensed(log))
    tally.add(log)
    return tally.facts(log.metadata)


def is_sensed(log: Log) -> bool:
    """Whether the log keeps what was sent and what was measured beside what was true."""
    return f"q_command.{log.metadata['joints'][0]}" in log


def following_error(log: Log) -> FloatArray:
    """What was sent for a tick minus where the joint truly was then, (K, nv) [rad or m].

    It is 0 at the first tick, before anything was sent, and NaN for a joint that does not work.
    """
    return Following().add(log)


def failed_joint_motion(log: Log) -> dict[str, float]:
    """How far each locked joint has moved since it came to rest, each free one since it failed [rad or m]."""
    motion = Motion(log.metadata)
    motion.add(log)
    return motion.by_joint
