"""Arms of a batch that a planner steps itself: where Python has a part in what it does between ticks."""

from typing import Any, final

import numpy as np

from ftqp.control.batch.own_faults import OwnFaults
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Targets
from ftqp.control.planner.what_ifs import WhatIfs
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.quiet import quiet
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.enums import OK
from ftqp.model.posture import gravity_torques

WEIGHTLESS = 1e-6
"""A free joint with less gravity than this where the arm begins may have none anywhere [N m or N]. Some
million times the rounding of a heavy arm's torques."""


def needs_planner(own: OwnFaults, what_ifs: WhatIfs, starts: FloatArray) -> BoolArray:
    """Arms that compiled code would not drive as a planner does, (B,).

    A free joint without gravity lets the others follow the task, of which rows may then be given up; and a
    fault that is told while a joint swings freely has it decided anew what can be kept.

    Args:
        own: The faults of the arms.
        what_ifs: What they begin with.
        starts: Where they begin, (B, nv).
    """
    robot, result = what_ifs.robot, own.later.copy()
    finite = np.isfinite(starts).all(axis=1)
    free = np.flatnonzero(own.freed.any(axis=1) & finite & ~result)
    data = robot.model.createData() if len(free) else None
    for arm in free:
        torques = gravity_torques(robot.model, data, robot.configuration(starts[arm]))
        result[arm] = bool((np.abs(torques[own.freed[arm]]) < WEIGHTLESS).any())
    return result & finite


@final
class ByPlanner:
    """Arms of a batch, each stepped by a planner of its own that is like the one of the batch.

    Args:
        what_ifs: What the arms begin with.
        targets: Where the tip should be at each tick.
        every: After how many ticks q is kept; 0 keeps none.
    """

    def __init__(self, what_ifs: WhatIfs, targets: Targets, every: int) -> None:
        self._what_ifs, self._targets, self._every = what_ifs, targets, every

    def drive(self, result: Any, arm: int, told: list[tuple[Fault, int]]) -> None:
        """Drive an arm from its start in a ``Rollout`` to the end, without a word on the logger."""
        with quiet():
            planner = self._planner()
            q, v = result.q[arm].copy(), result.v[arm].copy()
            planner.reset(q, v)
            told = list(told)
            for k in range(len(self._targets)):
                while told and told[0][1] <= k:
                    planner.report(told.pop(0)[0])
                step = planner.step(q, v, self._targets.at(k))
                q, v, _ = (part.copy() for part in step.reference)
                result.counts[arm, step.code] += 1
                if step.code != OK and result.first_bad[arm] < 0:
                    result.first_bad[arm] = k
                result.position_error[arm] = max(result.position_error[arm], step.position_error)
                result.rotation_error[arm] = max(result.rotation_error[arm], step.rotation_error)
                result.clearance[arm] = min(result.clearance[arm], step.clearance)
                if self._every and (k + 1) % self._every == 0:
                    result.trace[arm, k // self._every] = q
            result.q[arm], result.v[arm] = q, v

    def _planner(self) -> Planner:
        given, around = self._what_ifs.given, self._what_ifs.around
        planner = Planner(
            self._what_ifs.robot, given.dt, level=given.level, scheme=given.scheme, task=given.task,
            bounds=given.bounds, posture=given.posture, torque_limits=given.limits_torque,
            emergency=given.emergency, drive=given.drive, noise=given.noise,
            scene=None if around is None else around.scene,
            clearance=None if around is None else around.clearance,
            tasks=[one.given for one in self._what_ifs.tasks.values()],
            constraints=self._what_ifs.constraints,
        )  # fmt: skip
        for name, one in self._what_ifs.tasks.items():
            planner.tasks[name].weight = one.weight
            if not isinstance(getattr(one.given, "towards", None), str):  # which is a frame, and no target
                planner.tasks[name].target = one.target
        for name, shapes in {} if around is None else around.attached.items():
            planner.attach(name, shapes)
        for fault in self._what_ifs.told:
            planner.report(fault)
        return planner
