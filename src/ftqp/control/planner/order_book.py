"""What a planner was made with, as far as what it is told later needs it: its orders."""

from ftqp.control.planner.free_joint import KEPT_OF
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.solver.qp_solver import Solver
from ftqp.control.task.task import ROW_SETS
from ftqp.kernel.entry.orders import LIMITS, Orders, sets_of
from ftqp.kernel.entry.session import ArmSession, Session

PATIENCE = 0.2
"""How long a task is RELAXED before rows of it are given up [s]. A guess that the campaigns have not
contradicted."""


def orders_of(session: Session, given: Settings, solver: Solver) -> Orders:
    """The orders of a planner.

    Args:
        session: The planner's, filled.
        given: What it was made with.
        solver: Who solves its QPs.
    """
    K, robot, kept = session.K, given.robot, given.task.kept_sets
    whole = int(K.task.m), int(K.task.tool_rows)
    less = [(len(ROW_SETS[name]), int(name == "position_axis")) for name in kept]
    facts = {
        **{name: getattr(robot.limits, name) for name in LIMITS},
        **sets_of(whole, [one for one in less if one[0] < whole[0]]),
        "coulomb": robot.coulomb,
        "torque_limits": int(given.limits_torque),
        "dynamic": int(given.dynamic),
        "on_demand": int(given.on_demand),
        "external": int(K.cascade.external),
        "rich": int(solver.rich),
        "gives_up": int(given.task.degrade is not None and solver.sizes_may_change),
        "may_swing": int(
            robot.has_inertia and robot.is_serial and not robot.chain.floating and solver.has_qp
        ),
        "allowed": sum(1 << KEPT_OF[name] for name in kept),
        "patience": round(PATIENCE / given.dt),
    }
    if given.posture is not None:
        facts |= {"has_posture": 1, "posture": given.posture}
    return Orders(session, ArmSession(robot.chain.constants()), facts)
