"""What a planner does about what the monitor of its servos has found."""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.learned_servos import UNITS
from ftqp.control.planner.arm_loop import ArmLoop, learned_servos
from ftqp.control.planner.stages import Stage
from ftqp.faults.detection.diagnosis import Diagnosis, Finding
from ftqp.faults.detection.sight import Sight
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import HEALTHY, IS_FREE
from ftqp.kernel.layout.thresholds import GEAR
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
SENSORS: Final = frozenset({"sensor_frozen", "sensor_biased", "sensor_dropped"})
OTHERS, AT_REST = 0.3, 0.01
"""Of a joint that stands the model misses as much as of this share of the others' motion, and of such a speed
[rad/s or m/s], as ``ftqp.kernel.monitor.servos.residual`` has it."""
POLES = 3.0
"""Time constants by which three poles in a row are late."""


def sight_of(K: Any, robot: Robot) -> Sight | None:
    """What a record's monitor can notice of joints that stand behind servos; None where it sees none."""
    M, n = K.monitor, robot.nv
    if not M.sees or not M.on:
        return None
    known = learned_servos(K, robot)
    missed = M.missed[:n] * (OTHERS * (M.act[:n].sum() - M.act[:n]) / n + AT_REST)
    spread = 4.0 * known.noise**2 * M.w * K.state.dt + (0.5 * GEAR) ** 2 + missed**2
    spread += known.friction**2 + known.friction_error**2 + known.droop_error**2
    return Sight(
        level=float(M.level),
        kappa=float(M.kappa),
        block=float(M.every) * float(K.state.dt),
        late=POLES / float(M.w),
        deviation=np.sqrt(spread),
        shaken=OTHERS * M.missed[:n] * (n - 1) / n,
        is_known=known.is_known,
        units=tuple(UNITS[unit] for unit in known.units),
    )


@final
class MonitorResponse:
    """Believes what the monitor of the servos has found, and takes it back when the joint follows again.

    Attributes:
        findings: What was found and acted upon, in order.
        diagnosis: What is held for likely.
    """

    def __init__(
        self,
        session: Session,
        robot: Robot,
        loop: ArmLoop,
        report: Callable[[Fault], None],
        withdraw: Callable[[str], None],
    ) -> None:
        self.findings: list[Finding] = []
        self._K, self._robot, self._loop = session.K, robot, loop
        self._report, self._withdraw = report, withdraw
        self.diagnosis = Diagnosis(robot.joints, session.K, lambda: sight_of(self._K, robot))
        self._said = np.zeros(robot.nv, dtype=int)

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda *_: self._begin())

    def _begin(self) -> None:
        """After a reset: nothing was found yet, and a joint that is held is looked at further."""
        self.findings.clear()
        self._said[:] = self._K.monitor.found[: len(self._said)]

    def respond(self) -> None:
        """After a tick in which something was found or taken back: act upon it."""
        found, K = self._K.monitor.found, self._K
        K.monitor.news = 0
        for i, name in enumerate(self._robot.joints):
            if self._said[i] == found[i]:
                continue
            self._said[i] = found[i]
            if found[i] == 0:
                self._take_back(i, name)
                continue
            finding = self.diagnosis.isolated[name]
            self.findings.append(finding)
            if finding.kinds <= SENSORS and K.watch.latched:
                _LOG.warning("%s The arm is stopped.", finding.sentence)
                continue
            free = found[i] == IS_FREE
            if free and (K.faults.code[: self._robot.nv] != HEALTHY).any():
                _LOG.warning("%s Another joint has failed before, so the arm is stopped.", finding.sentence)
                self._loop.doubt_free(i)
                continue
            swings = free and self._robot.has_inertia and self._robot.is_serial
            fault: Fault = FreeSwinging(name) if swings else Locked(name)
            _LOG.warning("%s The planner counts on it from now on: %s.", finding.sentence, fault.happens)
            self._report(fault)

    def _take_back(self, i: int, name: str) -> None:
        """Joint i goes where it is asked to: it is not locked."""
        at = float(self._K.state.ticks) * float(self._K.state.dt)
        _LOG.warning("%s follows again. The planner counts on it as healthy from now on.", name)
        self.findings[:] = [
            replace(one, withdrawn_at=at) if one.joint == name and one.withdrawn_at is None else one
            for one in self.findings
        ]
        self._withdraw(name)

    def told(self, fault: Fault) -> None:
        """A user has reported a fault: what becomes of it is the user's."""
        self._forget(self._robot.joint(fault.joint))

    def forget(self, joint: str | int) -> None:
        """Look at a joint again that was believed to have failed."""
        i = self._robot.joint(joint)
        self._forget(i)
        name = self._robot.joints[i]
        self.findings[:] = [finding for finding in self.findings if finding.joint != name]

    def _forget(self, i: int) -> None:
        M = self._K.monitor
        M.found[i] = self._said[i] = 0
        self._K.feedback.lost[i], self._K.feedback.spent[i] = 0, 0.0
        M.G[i] = M.G_lock[i] = M.G_free[i] = 0.0
