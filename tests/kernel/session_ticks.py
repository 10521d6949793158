"""A session driven tick by tick as a planner drives its own, every room of the record open to the test."""

from typing import Any

import numpy as np
from tests.commands_on import commands_on

from ftqp.control.planner.assembly import make_session
from ftqp.control.planner.mounted_robot import braking_reserve
from ftqp.control.task import bounds, schemes
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.task import Task
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import FREE, MEASURED
from ftqp.model.robot import Robot


class Ticks:
    """One arm and its record.

    Args:
        robot: The arm.
        dt: The sampling period [s].
        level: ``acceleration`` or ``velocity``.
        scheme: Of criteria.
        task: None is ``Task()``.
        posture: None is the start.
        torque_limits: Whether torque limits are rows.
        faults: What is believed of the joints.

    Attributes:
        K: The rooms of the record.
    """

    def __init__(
        self,
        robot: Robot,
        dt: float,
        *faults: Fault,
        level: str = "acceleration",
        scheme: Any = None,
        task: Task | None = None,
        posture: Any = None,
        torque_limits: bool = True,
    ) -> None:
        self.task = Task() if task is None else task
        chosen = schemes.by_name(scheme)
        assert not isinstance(chosen, Resolver)
        criterion = chosen.at(level)
        self.robot, self.posture = robot, posture
        self.session: Session = make_session(
            robot, self.task, criterion, bounds.by_name("viability"), None, level=level, dt=dt
        )
        self.K = K = self.session.K
        self.belief = Belief(robot)
        for fault in faults:
            self.belief = self.belief.reported(fault)
        self.belief.write(commands_on(self.session, robot, torque_limits=torque_limits))
        n, limits = robot.nv, K.limits
        limits.dynamic = torque_limits or criterion.needs_inertia or self.belief.needs_dynamics
        reserve = braking_reserve(robot) if torque_limits else None
        share = 1.0 if reserve is None else reserve.shares(limits.a_max[:n], limits.tau_max[:n])[0]
        limits.a_brake[:n] = share * limits.a_max[:n]
        self.step: Any = None

    def reset(self, q: Any, v: Any = None) -> None:
        """Begin at (q, v)."""
        K, n = self.K, self.robot.nv
        state = K.state
        K.gate.q[:n] = K.gate.sent[:n] = state.q_command[:n] = state.q[:n] = q
        K.gate.v[:n] = state.v_command[:n] = state.v[:n] = np.zeros(n) if v is None else v
        K.criteria.posture[:n] = q if self.posture is None else self.posture
        K.qp.warm, state.ticks, state.is_reset = 0, 0, 1
        K.feedback.fresh = 1
        K.faults.code[K.faults.code == MEASURED] = FREE  # as at every start, until a sample says otherwise

    def tick(self, q: Any, v: Any, target: Any) -> int:
        """One tick from (q, v): the status."""
        if self.step is None:
            self.step = self.session.bind("step")
        return int(self.step(q, v, target.packed, target.row))


def hessian(K: Any) -> Any:
    """H of the last tick, (n, n)."""
    n = int(K.chain.n)
    return K.qp.H[:n, :n].copy() if K.qp.dense else np.diag(K.qp.H_diagonal[:n])
