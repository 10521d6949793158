"""What other arms like a planner's own would begin with, as copies that change nothing of it."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from ftqp.control.planner.collision_model import CollisionModel
from ftqp.control.planner.mounted_robot import BrakingReserve
from ftqp.control.planner.qp_solver import Solver
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.task_list import TaskList
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.record import OF_ROOMS
from ftqp.model.robot import Robot


@final
class RolloutSetup:
    """A copy of what a planner knows, as after a reset, and what becomes of its beliefs.

    Attributes:
        session: What every arm begins with.
        commands: The compiled calls that configure it.
        robot: The arm.
        given: What the planner was made with.
        reported: The faults that it counts on.
        samples: What its braking reserve is known by; None where torque is not limited.
        around: What it keeps clear of; None is nothing.
        tasks: Its further tasks, by name.
        constraints: Its constraints, as they were given.
        return_to_start: Whether the scheme draws each arm to a posture, and that is its own start.
    """

    def __init__(
        self,
        session: Session,
        commands: PlannerCommands,
        robot: Robot,
        given: Settings,
        solver: Solver,
        reserve: BrakingReserve | None,
        faults: dict[str, Fault],
        around: CollisionModel | None,
        tasks: TaskList,
        constraints: Sequence[Any],
    ) -> None:
        _refuse_foreign(given, solver)
        session = session.copy()
        self.session, self.robot, self.given = session, robot, given
        self.reported, self.around = tuple(faults.values()), around
        self.samples = None if reserve is None else reserve.samples
        self.tasks, self.constraints = tasks, tuple(constraints)
        K, self.commands = session.K, commands.on(session)  # its own: others may ask it from another thread
        self.commands.start(np.zeros(robot.nv), np.zeros(robot.nv))
        self.return_to_start = given.posture is None and float(K.criteria.norm_q) != 0.0
        K.cascade.external = 0
        K.free.joint, K.free.allowed = -1, commands.given.allowed
        K.free.contact[:], K.free.tau_stop[:] = 0, 0.0
        K.monitor.names = 0  # nobody responds there

    def believing(self, faults: tuple[Fault, ...]) -> dict[str, Any]:
        """The rooms of limits and faults, by name, of a planner to which these were reported, in turn."""
        session = self.session.copy()
        commands, K = self.commands.on(session), session.K
        belief = Belief(self.robot)
        for fault in (*self.reported, *faults):
            belief = belief.reported(fault)
        belief.write(commands)
        commands.believed()
        commands.count_on(self.samples)
        return {room: K[room].copy() for room in OF_ROOMS["belief"]}


def _refuse_foreign(given: Settings, solver: Solver) -> None:
    """Refuse a planner whose ticks are not compiled as a whole."""
    if not solver.sizes_may_change:
        raise InputError(
            f"this planner is solved by {given.backend!r}, expected the backend 'active_set' and a scheme "
            "with a QP: a batch is compiled as a whole; make a planner with backend='active_set'"
        )
    if given.plan is not None:
        raise InputError("this planner follows a plan, which a batch does not; make one without plan=")
