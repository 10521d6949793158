"""What a planner was made with, as far as what it is told later needs it: its orders."""

from ftqp.control.planner.degrading import allow
from ftqp.control.planner.free_joint import KEPT_OF
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.solver.qp_solver import Solver
from ftqp.kernel.entry.orders import LIMITS, Orders
from ftqp.kernel.entry.session import ArmSession, Session


def orders_of(session: Session, given: Settings, solver: Solver) -> Orders:
    """The orders of a planner."""
    K, robot, kept = session.K, given.robot, given.task.kept_sets
    fewer = kept if solver.sizes_may_change else ()
    allow(K, fewer, given.dt, asked=given.task.degrade is not None)
    facts = {
        **{name: getattr(robot.limits, name) for name in LIMITS},
        "coulomb": robot.coulomb,
        "torque_limits": int(given.limits_torque),
        "dynamic": int(given.dynamic),
        "on_demand": int(given.on_demand),
        "external": int(K.cascade.external),
        "rich": int(solver.rich),
        "may_swing": int(
            robot.has_inertia and robot.is_serial and not robot.chain.floating and solver.has_qp
        ),
        "allowed": sum(1 << KEPT_OF[name] for name in kept),
    }
    if given.posture is not None:
        facts |= {"has_posture": 1, "posture": given.posture}
    return Orders(session, ArmSession(robot.chain.constants()), facts)
