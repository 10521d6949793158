"""A plan that leads a planner's null space, and what is left of it after a failure."""

from collections.abc import Callable, Mapping
from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.leading_plan import LeadingPlan, Remaining
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault, Locked
from ftqp.kernel.entry.session import PlanMemory, Session
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

EVEN: Final = 1e-6
"""Times of a plan are at equal distances within this share of a distance."""


@final
class PlanLeading:
    """Draws the null space to a plan: at every tick to the posture that it has where the tip is now.

    The tip says how far the plan has come, not the clock, so a path that waits or is stopped takes the plan
    with it. Where rows of the plan have the same tip, because the arm moves on the spot, the clock goes on.
    Rotations count where the task has all of them; else the plan's may be others than the arm's.

    Args:
        plan: The plan, of this arm.
        session: The planner's; its criterion needs a term that leads to a posture.
        robot: The arm.

    Raises:
        InputError: The plan is not of numbers, or at uneven times.

    Source: docs/theory/following-a-plan.md.
    """

    def __init__(self, plan: LeadingPlan, session: Session, robot: Robot) -> None:
        self.plan = plan
        self._rows = array("plan.q", plan.q, (len(plan.t), robot.nv), "(N + 1, nv)")
        self._q = np.array(self._rows, order="C")  # what leads: the plan, or what goes on after a failure
        steps = np.diff(plan.t)
        if not len(steps) or not steps[0] > 0.0 or not np.allclose(steps, steps[0], rtol=EVEN, atol=0.0):
            raise InputError("plan.t is at uneven times, expected two or more times at equal distances")
        poses = np.stack([robot.pose(row) for row in self._q])
        tips = np.concatenate([poses[:, :3, 3], poses[:, :3, :3].reshape(-1, 9)], axis=1)
        task = session.K.task
        turns = {COMPONENTS.index(name) for name in robot.default_rows if name.startswith("r")}
        length = float(task.length) if turns and turns <= set(task.rows[: task.m].tolist()) else 0.0
        self._memory = PlanMemory(self._q, tips, float(steps[0]), length)
        self._follow = self._memory.bind(session)
        plan.continuation(
            self._q[0], 0.0, (Locked(robot.joints[0]),)
        )  # so that the first failure finds it ready

    def begin(self, q: FloatArray, faults: Mapping[str, Fault]) -> None:
        """Begin at the row of the plan that is nearest to q, (nv,) [rad or m], its first one if several."""
        away = np.abs(self._rows - q).max(axis=1)
        self._memory.begin(int(np.argmin(away)))
        self.believe(q, faults)
        self._follow()

    @property
    def at(self) -> float:
        """The time of the plan at which the tip is [s]."""
        return self._memory.at * self._memory.spacing

    def watched(self, tick: Callable[..., int]) -> Callable[..., int]:
        """A tick before which the posture is set.

        Args:
            tick: From its inputs to a status or mistake.
        """
        follow = self._follow

        def watched(*inputs: Any) -> int:
            follow()
            return tick(*inputs)

        return watched

    def believe(self, q: FloatArray, faults: Mapping[str, Fault]) -> None:
        """Lead to the postures verified for these faults, from joints q, (nv,) [rad or m], else to the plan.

        With two or more joints to spare the null space has something left after a lock. This takes less than
        a millisecond for some hundred rows; without, nothing is looked at.
        """
        self._q[:] = self._rows
        found = self.plan.continuation(q, self.at, tuple(faults.values())) if faults else None
        if found is not None:
            first, rows = found
            self._q[first : first + len(rows)] = rows

    def options(self, q: FloatArray, faults: Mapping[str, Fault]) -> tuple[Remaining, ...]:
        """What can still be done from joints q, (nv,) [rad or m], with these faults, least lost first."""
        return self.plan.remaining(q, self.at, tuple(faults.values()))
