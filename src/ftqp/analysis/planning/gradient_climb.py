"""A plan that climbs: the self-motion follows the slope of a local measure of fault tolerance."""

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.plan_case import PlanCase
from ftqp.analysis.planning.self_motion_speeds import SpeedPlan, null_vectors
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError

FLOOR = 1e-4
"""Added to n_j^2 so that the measure is finite at a singularity."""
BARRIER = 0.01
"""Weight of the distances from limits, each as a share of half the joint's range."""
EPSILON = 1e-4
"""Step of the slope [rad or m]."""


def gradient_plan(case: PlanCase, start: FloatArray) -> SpeedPlan:
    """The plan with theta = clip(gain dH/ds, fastest), s the way along the self-motion.

    H = sum_j w_j log(n_j^2 + 1e-4) + 0.01 sum_j log(1 - r_j^2), r_j = -1 and 1 at the limits of joint j, w_j
    its weight. It looks at each instant alone. Source: docs/theory/fault-tolerant-plans.md, "A gradient".

    Args:
        case: What is planned for.
        start: Where the arm starts, (nv,) [rad or m].
    """
    study, task, settings = case.study, case.task, case.settings
    q, speeds = np.empty((task.N + 1, study.robot.nv)), np.empty(task.N)
    q[0] = start
    for k in range(task.N):
        n = null_vectors(study, q[k][None])[0]
        either = measure(study, np.stack([q[k] - EPSILON * n, q[k] + EPSILON * n]), case.weights)
        slope = (either[1] - either[0]) / (2.0 * EPSILON)
        speeds[k] = np.clip(settings.gain * slope, -settings.fastest, settings.fastest)
        ahead = q[k] + task.dt * speeds[k] * n
        exact, left, _ = study.limited.solutions(ahead[None], goals=task.goals[k + 1][None], near=True)
        if left[0] > study.tolerance:
            raise InputError(
                f"{study.robot.name} does not follow the path beyond sample {k} (t = {task.t[k]:g} s) with "
                "the method 'gradient'; take 'dp', or start elsewhere"
            )
        q[k + 1] = exact[0]
        case.told(k + 1, task.N, "samples")
    return SpeedPlan(q=q, speeds=speeds)


def measure(study: GoalStudy, q: FloatArray, weights: FloatArray) -> FloatArray:
    """H of ``gradient_plan``, (k,).

    Args:
        study: Of the arm and the task rows.
        q: Configurations, (k, nv) [rad or m].
        weights: Of the joints, (nv,), with the mean 1.
    """
    limits = study.robot.limits
    n = null_vectors(study, q)
    value = (weights * np.log(n * n + FLOOR)).sum(axis=1)
    both = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = limits.q_min[both], limits.q_max[both]
    r = (2.0 * q[:, both] - low - high) / (high - low)
    return np.asarray(value + BARRIER * np.log(np.maximum(1.0 - r * r, FLOOR)).sum(axis=1))
