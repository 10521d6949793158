"""How far the postures of a plan may be off along their self-motion before it survives less."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.planning.self_motion_speeds import null_vectors
from ftqp.analysis.survival.continuing import locks_survived
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor:
    """Postures beside a plan that survive at least what it survives.

    Attributes:
        samples: Of the plan, (K,).
        low: How far the posture may go against n, the null vector with det [n; J] > 0, (K,) [rad or m].
        high: How far it may go along n, (K,) [rad or m].
        q_low: The posture there, (K, nv) [rad or m].
        q_high: The posture at the other end, (K, nv) [rad or m].
    """

    samples: IntArray
    low: FloatArray
    high: FloatArray
    q_low: FloatArray
    q_high: FloatArray


def corridor_of(task: TaskPath, q: FloatArray, *, stride: int, widest: float, spacing: float) -> Corridor:
    """The postures on the self-motion through each sample that survive every lock that is survived there.

    From each sample the self-motion is followed both ways in steps, until a posture is outside the limits,
    loses a joint, or is as far as is looked. Source: docs/theory/fault-tolerant-plans.md, "The corridor".
    """
    samples = np.arange(0, task.N, stride)
    survived = locks_survived(task, q[samples], samples)
    ends = [_walk(task, q[samples], samples, survived, side, widest, spacing) for side in (-1.0, 1.0)]
    return Corridor(
        samples=frozen(samples),
        low=frozen(ends[0][0]),
        high=frozen(ends[1][0]),
        q_low=frozen(ends[0][1]),
        q_high=frozen(ends[1][1]),
    )


def _walk(
    task: TaskPath,
    q: FloatArray,
    samples: IntArray,
    survived: BoolArray,
    side: float,
    widest: float,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """How far one side goes, (K,), and the posture there, (K, nv)."""
    study, limits = planning_study(task, spacing), task.robot.limits
    reach, edge, going = np.zeros(len(q)), q.copy(), np.arange(len(q))
    for step in range(1, int(np.floor(widest / spacing + 1e-9)) + 1):
        ahead = edge[going] + side * spacing * null_vectors(study, edge[going])
        exact, left, _ = study.limited.solutions(ahead, goals=task.goals[samples[going]], near=True)
        inside = ((exact >= limits.q_min) & (exact <= limits.q_max)).all(axis=1)
        kept = np.flatnonzero((left <= study.tolerance) & inside)
        if not len(kept):
            break
        labels = locks_survived(task, exact[kept], samples[going[kept]])
        kept = kept[(labels | ~survived[going[kept]]).all(axis=1)]
        going, exact = going[kept], exact[kept]
        reach[going], edge[going] = step * spacing, exact
        if not len(going):
            break
    return reach, edge
