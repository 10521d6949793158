"""Belief writes faults as codes and bounds, and takes them back without a trace."""

from dataclasses import replace

import numpy as np
import pytest
from tests.commands_on import commands_on

from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.kernel.commands.believed import LOCK_SHARE
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import BRAKING, HEALTHY, INSTANT, LOCKED, MEASURED
from ftqp.kernel.layout.record import load_chain
from ftqp.model import catalog

PANDA = catalog.load("panda")
LIMITS = ("q_min", "q_max", "v_max", "a_max", "tau_max")


@pytest.fixture
def session():
    session = Session(7)
    load_chain(session.K, **PANDA.chain.constants())
    return session


@pytest.fixture
def K(session):
    return session.K


class Held:
    """A belief and the record that it is written into."""

    def __init__(self, robot, session):
        self.commands, self.belief = commands_on(session, robot), Belief(robot)
        self.belief.write(self.commands)

    def _hold(self, belief):
        belief.write(self.commands, self.belief)
        self.belief = belief

    def report(self, fault):
        self._hold(self.belief.reported(fault))

    def withdraw(self, joint):
        self._hold(self.belief.without(joint))

    @property
    def faults(self):
        return self.belief.faults

    @property
    def needs_dynamics(self):
        return self.belief.needs_dynamics


@pytest.fixture
def belief(session):
    return Held(PANDA, session)


def limits_of(K):
    return {name: getattr(K.limits, name)[:7].copy() for name in LIMITS}


def test_healthy_record_holds_the_limits_of_the_robot(belief, K):
    for name in LIMITS:
        np.testing.assert_array_equal(getattr(K.limits, name)[:7], getattr(PANDA.limits, name))
    assert not K.faults.code[:7].any() and belief.faults == {}


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (Locked(3), BRAKING),
        (Locked(3, mode="instant"), INSTANT),
        (FreeSwinging(3), MEASURED),
        (Degraded(3), HEALTHY),
    ],
    ids=str,
)
def test_fault_sets_the_code_of_its_joint_only(belief, K, fault, code):
    belief.report(fault)
    expected = np.zeros(7)
    expected[3] = code
    np.testing.assert_array_equal(K.faults.code[:7], expected)
    assert belief.faults == {"panda_joint4": fault}


def test_lock_brakes_at_a_quarter_of_the_acceleration_limit_unless_told(belief, K):
    belief.report(Locked(3))
    assert K.faults.lock_rate[3] == LOCK_SHARE * PANDA.limits.a_max[3]
    belief.report(Locked(2, deceleration=0.3))
    assert K.faults.lock_rate[2] == 0.3


def test_degraded_joint_gets_its_share_of_the_limits(belief, K):
    belief.report(Degraded("panda_joint2", velocity=0.5, acceleration=0.25, torque=0.75, q_min=-1.0))
    assert K.limits.v_max[1] == 0.5 * PANDA.limits.v_max[1]
    assert K.limits.a_max[1] == 0.25 * PANDA.limits.a_max[1]
    assert K.limits.tau_max[1] == 0.75 * PANDA.limits.tau_max[1]
    assert K.limits.q_min[1] == -1.0 and K.limits.q_max[1] == PANDA.limits.q_max[1]
    assert K.limits.v_max[0] == PANDA.limits.v_max[0]


def test_range_of_a_degraded_joint_never_grows(belief, K):
    belief.report(Degraded(1, q_min=-99.0, q_max=99.0))
    assert K.limits.q_min[1] == PANDA.limits.q_min[1] and K.limits.q_max[1] == PANDA.limits.q_max[1]


@pytest.mark.parametrize(
    "fault", [Locked(3), FreeSwinging(3, damping=2.0), Degraded(3, velocity=0.2, q_max=-1.0)], ids=str
)
def test_withdrawn_fault_leaves_no_trace_in_limits_and_codes(belief, K, fault):
    before = limits_of(K)
    belief.report(fault)
    belief.withdraw("panda_joint4")
    for name, value in limits_of(K).items():
        np.testing.assert_array_equal(value, before[name])
    assert not K.faults.code[:7].any() and belief.faults == {} and not K.faults.friction[:7].any()


def test_locking_a_degraded_joint_gives_its_limits_back(belief, K):
    belief.report(Degraded(3, velocity=0.2))
    belief.report(Locked(3))
    assert K.limits.v_max[3] == PANDA.limits.v_max[3]


def test_a_healthy_belief_forgets_every_fault(belief, K):
    belief.report(Locked(3))
    belief.report(Degraded(1, velocity=0.5))
    Belief(PANDA).write(belief.commands)
    assert not K.faults.code[:7].any()
    np.testing.assert_array_equal(K.limits.v_max[:7], PANDA.limits.v_max)


@pytest.mark.parametrize(
    "again", [Locked(3), Locked("panda_joint4"), Locked(3, deceleration=1.0), Locked(3, mode="instant")]
)
def test_locked_joint_reported_locked_again_stays_locked(belief, K, again):
    belief.report(Locked(3))
    K.faults.code[3] = LOCKED  # as the kernel does once the joint is at rest
    belief.report(again)
    assert K.faults.code[3] == LOCKED
    (believed,) = belief.faults.values()
    assert replace(believed, joint=3) == replace(again, joint=3)


def test_withdrawn_joint_that_locks_again_brakes_again(belief, K):
    belief.report(Locked(3))
    K.faults.code[3] = LOCKED
    belief.withdraw(3)
    belief.report(Locked(3))
    assert K.faults.code[3] == BRAKING


def test_fault_of_an_empty_range_is_refused_and_what_was_believed_stays(belief, K):
    belief.report(Locked(3))
    K.faults.code[3] = LOCKED
    before = limits_of(K)
    with pytest.raises(InputError, match=r"the range left of panda_joint4 is empty: \[2, -0\.0698\]"):
        belief.report(Degraded(3, velocity=0.5, q_min=2.0))
    assert belief.faults == {"panda_joint4": Locked(3)} and K.faults.code[3] == LOCKED
    for name, value in limits_of(K).items():
        np.testing.assert_array_equal(value, before[name])


@pytest.mark.parametrize(
    ("joint", "valid"),
    [("panda_joint9", "panda_joint1, .*panda_joint7"), (7, "expected 0 to 6"), (-8, "expected 0 to 6")],
)
def test_unknown_joint_names_the_valid_ones(belief, joint, valid):
    for call in (lambda: belief.report(Locked(joint)), lambda: belief.withdraw(joint)):
        with pytest.raises(InputError, match=valid):
            call()
    assert belief.faults == {}


def test_free_swinging_joint_needs_the_inertia_of_the_robot():
    srs7 = catalog.load("srs7")
    belief = Held(srs7, Session(srs7.nv))
    with pytest.raises(
        InputError, match=r"srs7 has no inertia, so the motion of free-swinging .* is unknown"
    ):
        belief.report(FreeSwinging(0))
    assert belief.faults == {} and not belief.needs_dynamics
