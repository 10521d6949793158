"""Joints that were found to be held are looked at again: do they follow, and how often are they asked."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.response.active_verification import FAR, ActiveVerification
from ftqp.kernel.layout.enums import LOCKED

DT, SIGMA = 1e-3, 1e-4


class Arm:
    """Joint 2 of a Panda that counts as locked, and what it does of what it is asked for.

    Args:
        share: Of what it is asked for.
        late: Ticks.
        drive: What the arm takes.
    """

    def __init__(self, share: float, late: int = 0, *, drive: str = "position") -> None:
        self.planner = ftqp.Planner(ftqp.robots.load("panda"), DT, drive=drive, noise=ftqp.Noise(q=SIGMA))
        self.planner.reset(self.planner.robot.neutral)
        self.K = self.planner._session.K
        self.verification = ActiveVerification(self.planner._session, 7, asks=True)
        self.share, self.late = share, late
        self.random = np.random.default_rng(2)
        self.sent: list[float] = []
        self.K.faults.code[2] = LOCKED
        self.K.feedback.seen[2] = self.home = float(self.K.state.q_command[2])

    def run(self, seconds: float, drift: float = 0.0) -> float | None:
        """When the joint is said to follow again, or None."""
        for k in range(round(seconds / DT)):
            self.K.feedback.q_sent[2] = self.home
            at = self.sent[-1 - self.late] if len(self.sent) > self.late else self.home
            q = self.home + self.share * (at - self.home) + drift * k * DT
            self.K.feedback.seen[2] = q + SIGMA * self.random.standard_normal()
            if self.verification.look() == 2:
                return k * DT
            self.sent.append(float(self.K.feedback.q_sent[2]))
        return None


@pytest.mark.parametrize("late", [0, 5, 20])
def test_a_joint_that_follows_two_motions_is_said_to_follow(late: int) -> None:
    arm = Arm(1.0, late)
    arm.verification.begin(2)
    found = arm.run(4.0)
    assert found is not None and 1.0 < found < 1.5
    assert np.abs(np.array(arm.sent) - arm.home).max() == pytest.approx(FAR, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.0, 2.0])
def test_a_joint_that_does_not_follow_is_asked_ever_more_rarely(share: float) -> None:
    arm = Arm(share)
    arm.verification.begin(2)
    assert arm.run(18.0) is None
    asked = np.abs(np.array(arm.sent) - arm.home) > 0.5 * FAR
    begins = np.flatnonzero(np.diff(asked.astype(int)) == 1) * DT
    apart = np.diff(begins)[np.diff(begins) > 0.4]
    assert len(apart) == 4 and (np.diff(apart) > 0.8 * apart[:-1]).all()


def test_a_joint_that_moves_by_itself_is_not_held_and_one_that_creeps_is() -> None:
    moving, creeping = Arm(0.0, drive="torque"), Arm(0.0, drive="torque")
    for arm in (moving, creeping):
        arm.verification.begin(2)
    assert moving.run(2.0, drift=0.3) == pytest.approx(0.33, abs=0.03)
    assert creeping.run(2.0, drift=0.02) is None
    assert set(creeping.sent) == {creeping.home}
