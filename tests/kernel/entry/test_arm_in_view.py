"""What a detector takes over of the arm that its planner has learned, and when it does not."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.entry.detect_entries import see_arm
from ftqp.kernel.entry.detection_session import DetectionSession
from ftqp.kernel.entry.session import Session, rooms
from ftqp.kernel.layout.record import dtype, load_chain


@pytest.fixture
def seen():
    """A detector's record, the arm that it looks at, and a planner that has learned."""
    robot = ftqp.robots.load("panda")
    D, session = DetectionSession(robot.chain.constants()).D, Session(7)
    load_chain(session.K, **robot.chain.constants())
    A = rooms(np.zeros(1, dtype("arm")))
    load_chain(A, **robot.chain.constants())
    learned = session.K.learned
    learned.on, learned.based, learned.estimates = 1, 1, 1000
    learned.friction[:7], learned.sigma[:7] = 2.0, 0.05
    session.K.chain.armature[:7] = 0.1
    session.K.chain.mass[session.K.chain.tip_joint] += 1.0
    D.tau_max[:7], D.taken = 50.0, 500
    return D, A, session.K


def test_rotors_load_and_friction_are_those_that_were_learned(seen):
    D, A, K = seen
    D.told_coulomb[:7] = -1.0
    see_arm(D, A, K)
    assert (A.chain.armature[:7] == 0.1).all() and (D.coulomb[:7] == 2.0).all()
    assert A.chain.mass[K.chain.tip_joint] == K.chain.mass[K.chain.tip_joint]
    assert D.taken == 500


def test_friction_of_which_nobody_knows_may_hold_nearly_as_much_as_a_joint_that_sticks_is_pushed(seen):
    D, A, K = seen
    D.told_coulomb[:7] = -1.0
    see_arm(D, A, K)
    np.testing.assert_allclose(D.holds[:7], 0.8 * 0.1 * 50.0)


def test_friction_that_was_told_holds_little_more_than_itself(seen):
    D, A, K = seen
    D.told_coulomb[:7] = 3.0
    see_arm(D, A, K)
    assert (D.coulomb[:7] == 3.0).all()
    np.testing.assert_allclose(D.holds[:7], 1.3 * 3.0 + 0.02)


def test_nothing_is_taken_over_during_a_suspicion(seen):
    D, A, K = seen
    D.watch = 1
    see_arm(D, A, K)
    assert not D.coulomb[:7].any() and (A.chain.armature[:7] != 0.1).all()


def test_means_begin_once_the_arm_is_known(seen):
    D, A, K = seen
    K.learned.estimates = 3
    see_arm(D, A, K)
    assert D.taken == 0


def test_an_arm_that_is_not_learned_is_its_model(seen):
    D, A, K = seen
    K.learned.on = 0
    see_arm(D, A, K)
    assert not D.holds[:7].any() and (A.chain.armature[:7] != 0.1).all()
