"""What other arms like a planner's own would begin with, as copies that change nothing of it."""

from typing import Any, final

import numpy as np

from ftqp.control.planner.collision_model import CollisionModel
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.task_list import TaskList
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.record import OF_ROOMS
from ftqp.model.robot import Robot


@final
class RolloutSetup:
    """A copy of what a planner knows, as after a reset, and what becomes of its beliefs.

    Every arm begins with ``session``, and goes back to its own start where ``return_to_start``.
    """

    def __init__(
        self, session: Session, commands: PlannerCommands, robot: Robot, given: Settings, tasks: TaskList,
        around: CollisionModel | None, samples: ReserveSamples | None, faults: dict[str, Fault],
    ) -> None:  # fmt: skip
        self.session = session = session.copy()
        self.robot, self.given, self.tasks, self.around = robot, given, tasks, around
        self.samples, self.reported = samples, tuple(faults.values())
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
