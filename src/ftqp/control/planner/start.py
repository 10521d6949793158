"""What the log says of the posture where a planner begins, and of an arm that holds short of its target."""

import logging
from typing import Any, final

import numpy as np

from ftqp.control.planner.degrading import Degrading
from ftqp.control.planner.stages import Stage
from ftqp.control.planner.step import Step
from ftqp.control.planner.wanted import weight_sentence
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM
from ftqp.model.chain import frame_id
from ftqp.model.followers import coupled_columns, is_led
from ftqp.model.posture import NEAR_SINGULAR, least_singular_value, scaled_jacobian
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
FULL_TURN = 2.0 * np.pi
"""A start that is farther beyond a range [rad] was written in degrees. A convention."""


class StartWatch:
    """Says once of a start what is wrong with it, as one warning on the logger ``ftqp``.

    Args:
        K: The planner's rooms: its task, and what it believes of the joints.
    """

    def __init__(self, K: Any) -> None:
        self._K, self._said = K, ""

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda start, told: self.look(told.fitting.robot, start.q))

    def look(self, robot: Robot, q: FloatArray) -> None:
        """Warn of a start that is not what it seems; the warning of the start before is not repeated.

        Args:
            robot: The arm as it is fitted.
            q: Joint positions, (nv,) [rad or m].
        """
        sentence = "; ".join(_sentences(robot, self._K, q))
        if sentence and sentence != self._said:
            _LOG.warning("%s: %s", robot.name, sentence)
        self._said = sentence


def _sentences(robot: Robot, K: Any, q: FloatArray) -> list[str]:
    n, task = robot.nv, K.task
    rows = [COMPONENTS[c] for c in task.rows[: int(task.m)]]
    works = K.faults.code[:n] == HEALTHY
    axes = task.axis.reshape(3, 3) if task.tool_rows else None
    model = robot.model
    J = scaled_jacobian(
        model, model.createData(), frame_id(model, robot.tip), robot.configuration(q), rows, task.length, axes
    )
    share = least_singular_value(coupled_columns(robot.chain, J)[:, works]) / task.length
    found = _beyond(robot, q)
    if share < NEAR_SINGULAR:
        found.append(
            f"the start is near a singularity of the task (sigma_min is {share:.2g} of the characteristic "
            f"length, expected {NEAR_SINGULAR:g} or more), so directions of it may give way; start from "
            "another posture, such as robot.neutral"
        )
    if weight := weight_sentence(robot, q, K.limits.tau_max[:n]):
        found.append(weight)
    count = int(np.count_nonzero(works & ~is_led(robot.chain)))
    if count <= len(rows):
        found.append(
            f"{count} joints that work for {len(rows)} task rows leave no redundancy, so a joint that fails "
            "costs a direction; follow fewer rows, Task(rows=...), if the work allows it"
        )
    return found


def _beyond(robot: Robot, q: FloatArray) -> list[str]:
    limits = robot.limits
    away = np.maximum(limits.q_min - q, q - limits.q_max)
    far = [k for k in range(robot.nv) if away[k] > OUTSIDE_FROM]
    if not far:
        return []
    said = ", ".join(
        f"{robot.joints[k]} {q[k]:.4g} ({limits.q_min[k]:.4g} to {limits.q_max[k]:.4g})" for k in far
    )
    degrees = "; are these degrees?" if any(away[k] > FULL_TURN for k in far) else ""
    return [f"the start is beyond the range of {said}, which the arm is led back into first{degrees}"]


@final
class Rest:
    """Says when the arm begins and ends to hold, and when rows of its task go and come back, once each.

    Args:
        session: The planner's.
        degrading: Who says the latter.

    Attributes:
        held: Whether the arm held when this was last asked.
    """

    def __init__(self, session: Session, degrading: Degrading) -> None:
        self._degrading = degrading
        self._holding = session.field("calm", "holding")
        self.held = False

    def tell(self, step: Step) -> None:
        """Log a change.

        Args:
            step: The last step.
        """
        self._degrading.tell()
        held = bool(self._holding[0])
        if held == self.held:
            return
        self.held = held
        if held:
            turned = f" and {step.rotation_error:.3g} rad" if step.rotation_error > 0.0 else ""
            _LOG.info("holding, out of reach by %.3g mm%s", 1e3 * step.position_error, turned)
        else:
            _LOG.info("no longer holding: the target, the working joints or the place of the arm has changed")
