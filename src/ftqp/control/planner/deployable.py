"""What a planner is without Python: its memory, and what of it a program in C does without."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.control.planner.filled_rows import refuse_asking
from ftqp.control.planner.settings import Settings
from ftqp.control.planner.solver.qp_solver import Solver
from ftqp.control.planner.task_list import TaskList
from ftqp.control.planner.wanted import Wanted
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.entry.session import Session


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deployable:
    """The memory of a planner that has not begun.

    Attributes:
        record: The record, (1,).
        given: What it was made with, (1,).
        arm: The arm by itself, (1,).
        detector: The record of its detector, (1,), which has seen nothing; None without one.
        states: Of the samples of its braking reserve, q and v, (samples, 2 nv).
        left_out: What of the planner a program in C does without, a sentence each.
    """

    record: Any
    given: Any
    arm: Any
    detector: Any
    states: FloatArray
    left_out: tuple[str, ...]


def deployable(
    session: Session, orders: Orders, given: Settings, solver: Solver, wanted: Wanted, tasks: TaskList, *,
    asking: Sequence[str], detector: Any, has_scene: bool,
) -> Deployable:  # fmt: skip
    """The memory of a planner for programs in C."""
    if not solver.sizes_may_change:
        raise InputError(
            f"this planner is solved by {given.backend!r}, expected the backend 'active_set' and a scheme "
            "with a QP: a library in C has no other solver"
        )
    if given.plan is not None:
        raise InputError("this planner follows a plan, which a library in C does not; leave the plan out")
    refuse_asking(asking, "a library in C", "leave {them} out")
    if len(tasks):
        raise InputError(
            f"the planner has further tasks ({', '.join(tasks)}), which no library in C has; leave them out"
        )
    if wanted.belief.faults:
        raise InputError(
            "this planner already believes in faults; build a healthy one, and report them to it"
        )
    left_out = []
    if has_scene:
        left_out.append("changes of the scene, which stays as it was when the library was built")
    copy = session.copy()
    copy.K.state.is_reset = 0
    memory = orders.on(copy).memory
    rows = None if wanted.reserve is None else wanted.reserve.samples.rows
    n = given.robot.nv
    memory["samples"] = 0 if rows is None else len(rows)
    states = np.zeros((0, 2 * n)) if rows is None else rows[:, : 2 * n].copy()
    return Deployable(
        record=copy.memory,
        given=memory,
        arm=orders.arm,
        detector=detector,
        states=states,
        left_out=tuple(left_out),
    )
