"""A certificate reads as a sentence about the robot."""

import dataclasses

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.certificate import Certificate, Obstacle, Outside, Unreached

Z = Unreached(direction="z", amount=-0.25)
RX = Unreached(direction="rx", amount=1e-3)
ELBOW = Obstacle(joint="elbow", limit="upper position", weight=1.0)
WRIST = Obstacle(joint="wrist", limit="locked", weight=0.5)


@pytest.mark.parametrize(
    ("unreached", "obstacles", "sentence"),
    [
        (
            (Z, RX),
            (ELBOW, WRIST),
            "the task misses z by -0.25, rx by +0.001; in the way: elbow at upper position, wrist at locked",
        ),
        ((Z,), (), "the task misses z by -0.25; in the way: the arm cannot move that way (singular)"),
        ((), (ELBOW,), "the task misses nothing; in the way: elbow at upper position"),
    ],
)
def test_certificate_is_a_sentence_of_directions_and_joints(unreached, obstacles, sentence):
    assert str(Certificate(unreached=unreached, obstacles=obstacles)) == sentence


def test_certificate_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Certificate(unreached=(Z,), obstacles=()).obstacles = (ELBOW,)


def test_certificate_says_which_joints_are_outside_and_what_a_lock_has_thrown():
    beyond = Outside(joint="elbow", limit="upper position", amount=0.05)
    outside = Certificate(unreached=(), obstacles=(), outside=(beyond,))
    assert str(outside) == "outside: elbow beyond upper position by 0.05"
    both = Certificate(unreached=(Z,), obstacles=(), outside=(beyond,), jump=0.25)
    assert str(both) == (
        "the task misses z by -0.25; in the way: the arm cannot move that way (singular); "
        "outside: elbow beyond upper position by 0.05; 25% of the jump at the lock was made"
    )


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("what", ["position", "velocity"])
@pytest.mark.parametrize("fault", [None, ftqp.Locked(4), ftqp.FreeSwinging(4, 2.0)])
def test_ok_is_not_said_while_a_joint_is_outside_its_limits(level, side, what, fault):
    panda, sign = ftqp.robots.load("panda"), 1.0 if side == "upper" else -1.0
    planner = ftqp.Planner(panda, 2e-3, level=level)
    if fault is not None:
        planner.report(fault)
    q, v = panda.neutral.copy(), np.zeros(7)
    if what == "position":
        q[4] = sign * (panda.limits.q_max[4] if side == "upper" else -panda.limits.q_min[4]) + sign * 0.03
    else:
        v[4] = sign * (panda.limits.v_max[4] + 0.2)
    planner.reset(q, v)
    step = planner.step(q, v, ftqp.Target(pose=panda.pose(q))).copy()
    if what == "velocity" and fault is not None:
        assert step.outside == ()  # the speed of a failed joint is nobody's command
        return
    assert step.outside == ("panda_joint5",) and step.status is ftqp.StepStatus.RELAXED
    (found,) = step.certificate.outside
    assert (found.joint, found.limit) == ("panda_joint5", f"{side} {what}")
    assert found.amount == pytest.approx(0.03 if what == "position" else 0.2)
