"""Fault response: what a planner does about what its detector sees of the arm."""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.planner.arm_loop import ArmLoop
from ftqp.control.planner.response.active_verification import ActiveVerification
from ftqp.control.planner.response.probing import Probing
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.core.checks import FloatArray, sized
from ftqp.faults.detection.detector import Detector
from ftqp.faults.detection.diagnosis import Diagnosis, Finding
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import HEALTHY, HELD
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
SLOWEST: Final = 0.2
"""A suspicion slows a path down to this share of its speed ..."""
MOVING: Final = 0.1
"""... but not so far that the suspect would be slower than this [rad/s], which would hide what is wrong."""
DECIDED_IN: Final = 0.06
"""A suspicion gets so long to become a finding; then it slows down whatever the suspect does [s]."""
RECOVERY: Final = 1.0
"""How fast the path gets its speed back when the suspicion is gone [1/s]."""

STANDS: Final = 0.03
"""A joint slower than this on the mean of 50 ms stands [rad/s or m/s]."""
UNKNOWN_SHARE: Final = 0.3
"""Share of its torque that a joint is asked for at most of which it is known only that it gives less."""
SENSORS: Final = frozenset({"sensor_frozen", "sensor_biased", "sensor_dropped"})


@final
class FaultResponse:
    """Slows what leads the arm at a suspicion, believes what was isolated, stops an arm that lost a sensor.

    Attributes:
        detector: The detector at work.
        findings: What was found and acted upon, in order.
    """

    def __init__(
        self,
        detector: Detector,
        session: Session,
        robot: Robot,
        drive: Drive,
        noise: Noise,
        loop: ArmLoop,
        report: Callable[[Fault], None],
        withdraw: Callable[[str], None],
        probing: Probing | None = None,
    ) -> None:
        K, n = session.K, robot.nv
        self.detector = detector.for_arm(robot, float(K.state.dt), drive=drive, noise=noise)
        self.findings: list[Finding] = []
        self._K, self._robot, self._loop, self._report = K, robot, loop, report
        self._withdraw, self._probing = withdraw, probing
        self._verification = ActiveVerification(session, n)
        self._dt = float(K.state.dt)
        self._look = self.detector.beside(session)
        self._tau, self._felt = np.zeros(n), False
        self._tau_at = int(self._tau.ctypes.data)
        self._q = K.state.given_q[:n]
        self._reference = K.state.q_command[:n], K.state.v_command[:n], K.state.a_command[:n]
        self._turns = robot.nq != n
        self._harmless: set[str] = set()
        self._suspected, self._held = 0, False

    @property
    def diagnosis(self) -> Diagnosis:
        """What the detector holds for likely."""
        return self.detector.diagnosis

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(
            ticks=(CLOCK, FREE, *LED),
            after=self.look,
            mount=self.detector.fit,
            begin=lambda q, *_: self.reset(q),
        )

    def look(self, code: int, inputs: tuple[Any, ...]) -> None:
        """Let the detector look at the arm after a tick, and act upon what it sees.

        It looks away while the whole arm is held, and begins anew when that is let go.
        """
        if code < 0:
            return
        if code == HELD or self._held:
            self._held = code == HELD
            self.go_on()
            return
        if self._turns:
            self._q[:] = self._angles(inputs[0])
        seen = self._look(self._tau_at if self._felt else 0)
        self._felt = False
        if seen > 0 or self._loop.caution < 1.0:
            self._respond()
        if self._probing is not None:
            self._probing.look(self._suspect())
        if self._verification.active:
            self._reconsider()

    def _angles(self, q: Any) -> FloatArray:
        """Joint values, unwrapped to the turn of the command."""
        given = np.asarray(q, dtype=np.float64)
        if given.shape == self._q.shape:
            return given
        angles, command = np.full(len(self._q), np.nan), self._reference[0]
        at = 0
        for i, endless in enumerate(self._robot.continuous):
            if endless:
                angle = float(np.arctan2(given[at + 1], given[at]))
                angles[i] = command[i] + np.remainder(angle - command[i] + np.pi, 2.0 * np.pi) - np.pi
            else:
                angles[i] = given[at]
            at += 2 if endless else 1
        return angles

    def feel(self, tau: Any) -> None:
        """Take measured torques, (nv,) [N m or N], for the next tick alone; None where there are none."""
        self._felt = tau is not None
        if self._felt:
            self._tau[:] = sized("tau", tau, self._q.shape)

    def reset(self, q: FloatArray) -> None:
        """Begin anew at q, (nv,) [rad or m], with nothing found."""
        self.findings.clear()
        self._verification.forget()
        self.go_on(q)

    def go_on(self, q: FloatArray | None = None) -> None:
        """Look anew after a stop; what was found stays found."""
        self.detector.reset(q)
        self._harmless.clear()
        self._loop.caution = 1.0
        self._suspected = 0
        if self._probing is not None:
            self._probing.rest()

    def forget(self, joint: str | int) -> None:
        """Look at a joint again that was believed to have failed."""
        i = self._robot.joint(joint)
        name = self._robot.joints[i]
        self.detector.forget(name)
        self._verification.end(i)
        self.findings[:] = [finding for finding in self.findings if finding.joint != name]

    def believed(self, fault: Fault) -> None:
        """The planner believes what was found: the other joints are looked at."""
        self.detector.believe(fault)

    def told(self, fault: Fault) -> None:
        """A user has reported a fault: the others are looked at, and what becomes of it is the user's."""
        self.detector.believe(fault)
        self._verification.end(self._robot.joint(fault.joint))

    def _suspect(self) -> int | None:
        """The index of the joint under suspicion, if there is one."""
        suspect = self.diagnosis.suspect
        return None if suspect is None else self._robot.joint(suspect)

    def _respond(self) -> None:
        """Something was found, or is suspected, or was a moment ago.

        During a stop nothing more is believed: an arm that brakes hard looks odd. Nor is it while a joint
        that was taken for held begins to move.
        """
        odd = self._K.watch.latched or self._verification.stirs
        isolated = {} if odd else self.diagnosis.isolated
        for joint, finding in isolated.items():
            if all(known.joint != joint or known.withdrawn_at is not None for known in self.findings):
                self._believe(finding)
        if self.diagnosis.watching:
            self._suspected += 1
            self._loop.caution = max(min(self._loop.caution, self._slow()), SLOWEST)
        else:
            self._suspected = 0
        if not self.diagnosis.watching or self.diagnosis.suspicion <= 1.0:
            self._loop.caution = min(1.0, self._loop.caution + RECOVERY * self._dt)

    def _slow(self) -> float:
        """The share of its speed that a path keeps at this suspicion."""
        share = min(1.0, max(SLOWEST, 2.0 - self.diagnosis.suspicion))
        suspect = self.diagnosis.suspect
        if suspect is not None and self._suspected * self._dt < DECIDED_IN:
            speed = abs(float(self._reference[1][self._robot.joint(suspect)])) / self._loop.caution
            share = max(share, min(1.0, MOVING / max(speed, MOVING)))
        return share

    def _believe(self, finding: Finding) -> None:
        """Act upon a finding.

        What a joint that has failed does to its neighbours looks most like one that swings freely; to believe
        that wrongly throws the arm about. So of a second joint it is not believed: the arm is stopped.

        A joint that may just be weak harms nothing yet: it is told, and looked at further, but not believed,
        unless it stands and may be held.
        """
        seen = self.diagnosis.of(finding.joint)
        stands = seen.speed < STANDS
        if is_harmless(finding, stands=stands and seen.asked >= STANDS):
            if finding.joint not in self._harmless:
                _LOG.warning("%s That harms nothing yet, so the planner goes on.", finding.sentence)
                self._harmless.add(finding.joint)
            self.detector.doubt(finding.joint)
            return
        self.findings.append(finding)
        i = self._robot.joint(finding.joint)
        if finding.kinds <= SENSORS:
            _LOG.warning("%s The arm is stopped.", finding.sentence)
            self._loop.lose_sensor(i)
            return
        another = any(one.joint != finding.joint and one.withdrawn_at is None for one in self.findings)
        another = another or bool((self._K.faults.code != HEALTHY).any())
        if is_doubtful(finding, another=another, stands=stands):
            _LOG.warning("%s Another joint has failed before, so the arm is stopped.", finding.sentence)
            self._loop.doubt_free(i)
            return
        fault = fault_of(finding, may_swing=self._robot.has_inertia and self._robot.is_serial, stands=stands)
        _LOG.warning("%s The planner counts on it from now on: %s.", finding.sentence, fault.happens)
        if "runaway" in finding.kinds:
            self._loop.ask_for_brake(i)
        self._report(fault)
        if isinstance(fault, Locked) and "runaway" not in finding.kinds:
            self._verification.begin(i)

    def _reconsider(self) -> None:
        """Take the belief in a joint back that was found to be held and is not.

        Its command begins where it is and as fast as it is, within its limit.
        """
        i = self._verification.look()
        if i is None:
            return
        self._verification.end(i)
        name, K = self._robot.joints[i], self._K
        top = float(K.limits.v_max[i])
        K.gate.q[i] = K.feedback.q_now[i]
        K.gate.v[i] = min(max(float(K.feedback.v_now[i]), -top), top)
        K.state.a_command[i] = 0.0
        at = float(K.state.ticks) * self._dt
        _LOG.warning("%s moves, so that it is not locked. The planner counts on it as healthy again.", name)
        self.findings[:] = [
            replace(one, withdrawn_at=at) if one.joint == name and one.withdrawn_at is None else one
            for one in self.findings
        ]
        self._withdraw(name)
        self.detector.forget(name)


def is_harmless(finding: Finding, *, stands: bool) -> bool:
    """Whether a finding says no more than that a joint may be weak, which small loads hide."""
    kinds = finding.kinds
    if "degraded" not in kinds or "locked" in kinds or (stands and len(kinds) > 1):
        return False
    return len(kinds) > 1


def is_doubtful(finding: Finding, *, another: bool, stands: bool) -> bool:
    """Whether a joint seems to swing freely that need not, as what another one does looks like it."""
    return another and not stands and finding.kinds == {"free_swinging"}


def fault_of(finding: Finding, *, may_swing: bool = True, stands: bool = False) -> Fault:
    """The fault that a planner believes after a finding; of several kinds the one that does least harm.

    A joint that does not move is locked, whatever holds it: a brake, or friction where it has no torque. One
    that runs away has to be braked, and counts as locked.
    """
    kinds, joint = finding.kinds, finding.joint
    held = stands and "free_swinging" in kinds
    if kinds & {"locked", "runaway"} or held or not may_swing:
        return Locked(joint)
    if kinds == {"free_swinging"}:
        return FreeSwinging(joint)
    known = finding.share is not None and np.isfinite(finding.share)
    share = float(finding.share) if known and finding.share is not None else UNKNOWN_SHARE
    return Degraded(joint, torque=min(1.0, max(0.05, share)))
