"""Which locks are survived: by every node of a plan, and along whole trajectories."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.plan_case import PlanCase, in_parts
from ftqp.analysis.survival.continuing import continuation_study, locks_survived
from ftqp.analysis.survival.coverage import FOLLOWED
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.analysis.survival.way_round import nearest_bodies
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import SURVIVED

OUTSIDE = 1e-9
"""A configuration farther outside a limit counts as outside [rad or m]."""
STARTS = 512
"""Starts from which the sample is tried without limits."""


def unreached(study: GoalStudy, task: TaskPath, k: int) -> InputError:
    """The error of a sample at which no configuration within the limits is found."""
    robot, limits = study.robot, study.robot.limits
    study.limited.aim(task.goals[k])
    q, left, _ = study.limited.solutions(study.starts(STARTS))
    where = f"sample {k} of the path (t = {task.t[k]:g} s)"
    reached = q[left <= study.tolerance]
    inside = reached[(reached >= limits.q_min).all(axis=1) & (reached <= limits.q_max).all(axis=1)]
    if len(inside) and not task.clear(inside).any():
        far = task.clearances(inside)
        return InputError(
            f"{robot.name} comes too near to something at {where}: {1e3 * far.max():.3g} mm at most "
            f"({nearest_bodies(task, inside[far.argmax()])}), expected {1e3 * _keep(task):g} mm; move the "
            "path or what stands there"
        )
    if not len(reached):
        return InputError(
            f"{robot.name} does not reach {where}, being {left.min():.3g} m off at least; expected a path "
            "inside the workspace"
        )
    beyond = np.maximum(limits.q_min - reached, reached - limits.q_max)
    best = beyond[np.argmin(beyond.max(axis=1))]
    i = int(np.argmax(best))
    return InputError(
        f"{robot.name} reaches {where} outside its limits only, {robot.joints[i]!r} being "
        f"{max(best[i], 0.0):.3g} rad or m beyond at least; expected a path within the limits"
    )


def refuse_near(task: TaskPath, q: FloatArray, which: str) -> None:
    """Refuses postures in which the arm is nearer to something than it is to keep."""
    far = task.clearances(q)
    k = int(far.argmin())
    if task.around is not None and far[k] < _keep(task) - OUTSIDE:
        at = "" if len(q) == 1 else f" at sample {k}"
        raise InputError(
            f"{which} comes too near to something{at}: {1e3 * far[k]:.3g} mm "
            f"({nearest_bodies(task, q[k])}), expected at least {1e3 * _keep(task):g} mm; start elsewhere, "
            "move the path, or ask for less, "
            "ftqp.Clearance(keep=...)"
        )


def _keep(task: TaskPath) -> float:
    return 0.0 if task.around is None else task.around.clearance.keep


def refuse_illegal(task: TaskPath, q: FloatArray, method: str) -> None:
    """Refuses a trajectory with a joint beyond its limits of position or speed."""
    robot, limits = task.robot, task.robot.limits
    beyond = np.maximum(limits.q_min - q, q - limits.q_max)
    hurry = np.abs(np.diff(q, axis=0)) / (task.dt * limits.v_max)
    for excess, least, said in (
        (beyond, OUTSIDE, "{:.3g} rad or m outside its position limits"),
        (hurry, 1.0 + OUTSIDE, "at {:.3g} times its speed limit"),
    ):
        if excess.max() > least:
            k, i = np.unravel_index(int(excess.argmax()), excess.shape)
            other = "" if method == "dp" else "take 'dp', "
            raise InputError(
                f"with the method {method!r} no plan keeps all limits: {robot.joints[i]!r} would be "
                f"{said.format(excess[k, i])} at sample {k} (t = {task.t[k]:g} s); {other}start "
                "elsewhere or give the path more time"
            )
    if not np.all(task.clearances(q) >= _keep(task) - FOLLOWED[0]):
        refuse_near(task, q, f"the plan by the method {method!r}")


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Survivals:
    """What trajectories survive."""

    coverage: FloatArray  # Share of pairs of joint and instant, each with the weight of its joint, (P,)
    # Mean share of the rest of the path that is done after a lock, weighted alike, (P,)
    completed: FloatArray
    excess: FloatArray  # How far the worst joint is outside its limits, (P,) [rad or m]; 0 inside
    hurry: FloatArray  # Largest |v| / v_max, (P,)
    # By how much the arm comes nearer to something than it is to keep, (P,) [m]; 0 if it does not
    short: FloatArray

    @property
    def legal(self) -> BoolArray:
        """Whether positions and speeds are within their limits, and the arm clear of everything, (P,)."""
        inside = (self.excess <= OUTSIDE) & (self.hurry <= 1.0 + OUTSIDE)
        return np.asarray(inside & (self.short <= FOLLOWED[0]))


def node_labels(case: PlanCase, task: TaskPath, stride: int, nodes: Sequence[FloatArray]) -> list[BoolArray]:
    """Whether each node survives a lock of each joint there, (M, nv) for each waypoint but the last.

    With one joint to spare the continuation is unique. With more, each sample takes the least motion that the
    bounded QP gives, so that the answer depends on node, waypoint and joint alone, too.
    Source: docs/theory/fault-tolerant-plans.md, "Labels".
    """
    last, found = len(nodes) - 1, []

    def labels_at(items: Sequence[int]) -> list[BoolArray]:
        counts = [len(nodes[k]) for k in items]
        samples = np.repeat(stride * np.array(items), counts)
        labels = locks_survived(task, np.vstack([nodes[k] for k in items]), samples)
        return np.split(labels, np.cumsum(counts)[:-1])

    for k, labels in enumerate(in_parts(labels_at, last)):
        found.append(labels)
        case.notify(k + 1, last, "locks")
    return found


def survivals(task: TaskPath, q: FloatArray, stride: int, weights: FloatArray | None = None) -> Survivals:
    """What trajectories survive, each on its own."""
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
    speed = np.abs(np.diff(q, axis=1)) / task.dt
    counts = np.ones(len(failed)) if weights is None else weights[failed]
    return Survivals(
        coverage=(counts * survived).reshape(len(q), -1).mean(axis=1),
        completed=(counts * done).reshape(len(q), -1).mean(axis=1),
        excess=np.maximum(beyond.max(axis=1), 0.0),
        hurry=(speed / limits.v_max).max(axis=(1, 2)),
        short=_short(task, q),
    )


def _short(task: TaskPath, q: FloatArray) -> FloatArray:
    if task.around is None:
        return np.zeros(len(q))
    far = task.clearances(q.reshape(-1, q.shape[2])).reshape(q.shape[:2]).min(axis=1)
    return np.asarray(np.maximum(task.around.clearance.keep - far, 0.0))
