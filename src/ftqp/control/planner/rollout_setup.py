"""What other arms like a planner's own would begin with, as copies that change nothing of it."""

from typing import final

import numpy as np

from ftqp.faults.belief import Belief
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import Session
from ftqp.model.robot import Robot


@final
class RolloutSetup:
    """A copy of what a planner knows, as after a reset, with which every arm begins, and what it believes."""

    def __init__(
        self, session: Session, commands: PlannerCommands, robot: Robot, samples: ReserveSamples | None,
        belief: Belief,
    ) -> None:  # fmt: skip
        self.session = session = session.copy()
        self.robot, self.samples, self.belief = robot, samples, belief
        K, self.commands = session.K, commands.on(session)  # its own: others may ask it from another thread
        self.commands.start(np.zeros(robot.nv), np.zeros(robot.nv))
        K.cascade.external = 0
        K.free.joint, K.free.allowed = -1, commands.given.allowed
        K.free.contact[:], K.free.tau_stop[:] = 0, 0.0
        self.finds, K.monitor.names = bool(K.monitor.names), 0  # nobody responds there
