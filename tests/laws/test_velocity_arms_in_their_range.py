"""Velocity arms whose servos nobody described, sent fast to the end of a range: they come to rest inside."""

import numpy as np
import pytest
from tests.going import started
from tests.servo_arm import ServoArm

import ftqp

PANDA = ftqp.robots.load("panda")
DT, JOINT, HEAVIER = 2e-3, 3, 3.0


class IntegralServo(ServoArm):
    """Servos tau = M w (v_c - v + w/4 times its integral) of joints that are heavier than they suppose."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.way = np.zeros(len(self.q))

    def command(self, step):
        for _ in range(4):
            off = step.v - self.v
            self.way += off * self.dt / 4
            self.advance(self.wn / HEAVIER * (off + self.wn / 4 * self.way), self.dt / 4)
        self.past.append(self.q.copy())


@pytest.mark.parametrize("wn", [15.0, 30.0])
@pytest.mark.parametrize("servo", [ServoArm, IntegralServo])
def test_joint_that_is_sent_to_its_end_comes_to_rest_before_it(servo, wn):
    """What a servo lagged by carried it on: one of 15 rad/s went 0.12 rad beyond its range."""
    goal, start, rng = PANDA.neutral.copy(), PANDA.neutral.copy(), np.random.default_rng(1)
    goal[JOINT] = PANDA.limits.q_max[JOINT] - 0.002
    start[JOINT] = goal[JOINT] - 1.2
    arm, farthest = servo(start, DT, takes="velocity", wn=wn), -np.inf
    goto = ftqp.GoTo(started(PANDA, dt=DT, at=start, drive="velocity"), q=goal)
    for _ in range(2000):
        arm.command(goto.step(arm.q + 2e-5 * rng.standard_normal(7), None))
        farthest = max(farthest, arm.q[JOINT] - PANDA.limits.q_max[JOINT])
    assert farthest < 3e-3
    assert goto.status is ftqp.GoToStatus.REACHED, goto.sentence
