"""Which locks are survived: by every node of a plan, and along whole trajectories."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.planning.plan_settings import Told
from ftqp.analysis.planning.refusals import OUTSIDE
from ftqp.analysis.survival.continuing import continuation_study
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.layout.survival import SURVIVED

PORTION = 20_000
"""Continuations between two words on progress."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Survivals:
    """What trajectories survive.

    Attributes:
        coverage: Share of pairs of joint and instant, (P,).
        completed: Mean share of the rest of the path that is done after a lock, (P,).
        excess: How far the worst joint is outside its limits, (P,) [rad or m]; 0 inside.
        hurry: Largest |v| / v_max, (P,).
        energy: sum |dq|^2 / dt, (P,) [rad^2/s].
    """

    coverage: FloatArray
    completed: FloatArray
    excess: FloatArray
    hurry: FloatArray
    energy: FloatArray

    @property
    def legal(self) -> BoolArray:
        """Whether positions and speeds are within their limits, (P,)."""
        return np.asarray((self.excess <= OUTSIDE) & (self.hurry <= 1.0 + OUTSIDE))


def node_labels(task: TaskPath, stride: int, nodes: Sequence[FloatArray], told: Told) -> list[BoolArray]:
    """Whether each node survives a lock of each joint there, (M, nv) for each waypoint but the last.

    With one joint to spare the continuation is unique. With more, each sample takes the least motion that the
    bounded QP gives, so that the answer depends on node, waypoint and joint alone, too.
    Source: docs/theory/fault-tolerant-plans.md, "Labels".

    Args:
        task: On the grid on which continuations go.
        stride: Its samples between waypoints.
        nodes: Configurations of each waypoint, (M, nv) [rad or m].
        told: Hears of progress.
    """
    nv = task.robot.nv
    runs = continuation_study(task)
    sizes = [len(q) for q in nodes[:-1]]
    q = np.repeat(np.vstack(nodes[:-1]), nv, axis=0)
    samples = np.repeat(stride * np.arange(len(sizes)), np.array(sizes) * nv)
    failed = np.tile(np.arange(nv), sum(sizes))
    survived = np.empty(len(q), dtype=np.bool_)
    for first in range(0, len(q), PORTION):
        some = slice(first, first + PORTION)
        ends = runs.runs(q[some], samples[some], failed[some], bounded=task.redundancy > 1)
        survived[some] = ends.status == SURVIVED
        told(min(first + PORTION, len(q)), len(q), "locks")
    return np.split(survived.reshape(-1, nv), np.cumsum(sizes)[:-1])


def survivals(task: TaskPath, q: FloatArray, stride: int) -> Survivals:
    """What trajectories survive, each on its own.

    Args:
        task: The path.
        q: Trajectories on its samples, (P, N + 1, nv) [rad or m].
        stride: Instants are so many samples apart.
    """
    limits, nv = task.robot.limits, task.robot.nv
    at = np.arange(0, task.N, stride)
    starts = np.repeat(q[:, at].reshape(-1, nv), nv, axis=0)
    samples = np.tile(np.repeat(at, nv), len(q))
    failed = np.tile(np.arange(nv), len(q) * len(at))
    ends = continuation_study(task).runs(starts, samples, failed, bounded=task.redundancy > 1)
    beyond = np.maximum(limits.q_min - q, q - limits.q_max).max(axis=2)
    outside = np.repeat((beyond[:, at] > OUTSIDE).ravel(), nv)
    survived = (ends.status == SURVIVED) & ~outside
    done = np.where(survived, 1.0, (ends.sample - samples) / (task.N - samples))
    v = np.diff(q, axis=1) / task.dt
    return Survivals(
        coverage=survived.reshape(len(q), -1).mean(axis=1),
        completed=done.reshape(len(q), -1).mean(axis=1),
        excess=np.maximum(beyond.max(axis=1), 0.0),
        hurry=(np.abs(v) / limits.v_max).max(axis=(1, 2)),
        energy=(v * v).sum(axis=(1, 2)) * task.dt,
    )
