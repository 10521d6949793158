"""What tells a record of a robot's joints, without a planner."""

from ftqp.kernel.entry.planner_commands import LIMITS, PlannerCommands
from ftqp.kernel.entry.session import ArmSession, Session
from ftqp.model.robot import Robot


def commands_on(session: Session, robot: Robot, *, torque_limits: bool = True) -> PlannerCommands:
    """Orders on a record that has the arm's chain."""
    facts = {name: getattr(robot.limits, name) for name in LIMITS}
    arm = ArmSession(robot.chain.constants())
    return PlannerCommands(
        session, arm, {**facts, "coulomb": robot.coulomb, "torque_limits": int(torque_limits)}
    )
