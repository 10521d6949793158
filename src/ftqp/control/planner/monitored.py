"""What a planner does about what the monitor of its servos has found."""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.learned_servos import UNITS
from ftqp.control.planner.arm_loop import ArmLoop, learned_servos
from ftqp.control.planner.stages import Stage
from ftqp.faults.diagnosis import Diagnosis, Finding
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.faults.sight import Sight
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.other_records import DOUBTED, LEFT_ALONE, SWINGS_NOW, WORKS_STILL
from ftqp.kernel.layout.thresholds import GEAR, MONITOR_POLES
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
STOPPED: Final = {
    LEFT_ALONE: "The arm is stopped.",
    DOUBTED: "Another joint has failed before, so the arm is stopped.",
}
"""What is said of a finding that nothing is made of but a stop."""
OTHERS, AT_REST = 0.3, 0.01
"""Of a joint that stands the model misses as much as of this share of the others' motion, and of such a speed
[rad/s or m/s], as ``ftqp.kernel.monitor.servos.residual`` has it."""


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
        late=MONITOR_POLES / float(M.w),
        deviation=np.sqrt(spread),
        shaken=OTHERS * M.missed[:n] * (n - 1) / n,
        is_known=known.is_known,
        units=tuple(UNITS[unit] for unit in known.units),
    )


@final
class MonitorResponse:
    """Believes what the monitor of the servos has found, and takes it back when the joint follows again."""

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

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(begin=lambda *_: self.findings.clear())

    def respond(self) -> None:
        """After a tick in which something was found or taken back: act upon it as the kernel says."""
        monitor = self._K.monitor
        monitor.news = 0
        for i, name in enumerate(self._robot.joints):
            if self._K.feedback.step_at[i] == self._K.state.ticks:
                self._note_jump(name)
            if monitor.found[i] == monitor.counted[i]:
                continue
            does = self._loop.respond(i)
            if does == WORKS_STILL:
                self._take_back(name)
                continue
            finding = self.diagnosis.isolated[name]
            self.findings.append(finding)
            if does in STOPPED:
                _LOG.warning("%s %s", finding.sentence, STOPPED[does])
                continue
            fault: Fault = FreeSwinging(name) if does == SWINGS_NOW else Locked(name)
            _LOG.warning(
                "%s From now on the planner counts on a joint that %s; if it works, "
                "planner.withdraw(%r) takes that back.",
                finding.sentence, fault.happens, name,
            )  # fmt: skip
            self._report(fault)

    def _take_back(self, name: str) -> None:
        """A joint goes where it is asked to: it is not locked."""
        _LOG.warning("%s follows again. The planner counts on it as healthy from now on.", name)
        self._end_findings(name)
        self._withdraw(name)

    def _note_jump(self, name: str) -> None:
        """A joint's encoder has jumped, and its joint works on; it may as well have jumped back."""
        self._end_findings(name)
        jump = self.diagnosis.jumped.get(name)
        if jump is None:
            _LOG.warning("The encoder of %s is right again.", name)
            return
        _LOG.warning("%s planner.reset(q) believes them again.", jump.sentence)
        self.findings.append(jump)

    def _end_findings(self, name: str) -> None:
        """What was found of a joint is the case no more."""
        at = float(self._K.state.ticks) * float(self._K.state.dt)
        self.findings[:] = [
            replace(one, withdrawn_at=at) if one.joint == name and one.withdrawn_at is None else one
            for one in self.findings
        ]

    def reported(self, fault: Fault) -> None:
        """A user has reported a fault: what becomes of it is the user's."""
        self._loop.forget_finding(self._leader(fault.joint))

    def forget(self, joint: str | int) -> None:
        """Look at a joint again that was believed to have failed."""
        i = self._leader(joint)
        self._loop.forget_finding(i)
        name = self._robot.joints[i]
        self.findings[:] = [finding for finding in self.findings if finding.joint != name]

    def _leader(self, joint: str | int) -> int:
        """The joint whose motor moves a joint."""
        return int(self._robot.chain.lead[self._robot.joint(joint)])
