"""The rival of a session's arm: damped resolved rates on an arm of their own, towards the same targets."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, frozen
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot
from ftqp.sim.rival.resolved_rates import ResolvedRates
from ftqp.sim.session.session_arms import SessionArm, SessionRival
from ftqp.sim.session.tick_facts import TwinFacts

LINEAR = ("x", "y", "z")


@final
class RivalArm:
    """It follows the path of an arm beside it, has the same failures, and is told what a person tells.

    What a detector finds it does not learn. While a hand leads the other arm, or that goes back to its path,
    there is no rival; it begins anew beside the arm when that begins its path.
    """

    def __init__(self, rival: SessionRival, beside: SessionArm) -> None:
        self._plant, self._sensors, self._beside = rival.plant, rival.sensors, beside
        robot: Robot = beside.planner.robot
        self._robot = robot
        self._rates = ResolvedRates(robot, beside.planner.dt, rows=rival.rows)
        self._error_rows = [LINEAR.index(row) for row in rival.rows if row in LINEAR]
        self._failed: dict[int, Fault] = {}
        self._told: set[int] = set()
        self._here = True

    def begin(self, q: FloatArray, v: FloatArray) -> None:
        """Tick 0: the healthy arm at (q, v), each (nv,)."""
        self._failed.clear()
        self._told.clear()
        self._start(q, v)

    def _start(self, q: FloatArray, v: FloatArray) -> None:
        """Put it at (q, v), each (nv,), with the failures that there are."""
        self._here = True
        self._plant.reset(q, v)
        if self._sensors is not None:
            self._sensors.reset()
        self._rates.reset(q, v)
        for i, fault in self._failed.items():
            self._plant.fail(fault)
            if i in self._told:
                self._rates.tell(i)

    def fail(self, fault: Fault) -> None:
        """Let a joint fail."""
        self._plant.fail(fault)
        self._failed[self._robot.joint(fault.joint)] = fault

    def tell(self, fault: Fault) -> None:
        """Tell it of a failure; of a joint that is only weaker it can make nothing."""
        if not fault.works:
            i = self._robot.joint(fault.joint)
            self._told.add(i)
            self._rates.tell(i)

    def repair(self, joint: str) -> None:
        """Let a joint work again; its drive is switched on where the joint is."""
        i = self._robot.joint(joint)
        self._plant.repair(joint)
        self._failed.pop(i, None)
        self._told.discard(i)
        self._rates.repair(i, float(self._plant.q[i]))

    @property
    def failure(self) -> str | None:
        """Why its simulation cannot go on, or None."""
        if self._plant.failure is not None:
            return self._plant.failure
        if np.isfinite(self._plant.q).all() and np.isfinite(self._plant.v).all():
            return None
        return "the position of a joint is not a number any more"

    def think(self) -> None:
        """Its command at this tick, after the other arm has thought."""
        leader, plant = self._beside.leader, self._beside.plant
        if leader.on_path and not self._here:
            self._start(plant.q, plant.v)
        self._here = leader.on_path
        if not self._here:
            return
        q = self._plant.q
        if self._sensors is not None:
            self._sensors.measure(q, self._plant.v)
            q = self._sensors.q
        target = leader.target
        self._rates.step(q, target.pose, np.asarray(target.twist))

    def move(self) -> None:
        """Let it move on."""
        if self._here:
            self._plant.advance(self._rates)

    def facts(self) -> TwinFacts | None:
        """What a picture needs of it; None while it is not there."""
        if not self._here:
            return None
        q = self._plant.q
        off = self._robot.pose(q)[:3, 3] - self._beside.leader.target.pose[:3, 3]
        return TwinFacts(
            q=frozen(q.copy()),
            position_error=float(np.linalg.norm(off[self._error_rows])),
            told=bool(self._failed) and self._told.issuperset(self._failed),
        )
