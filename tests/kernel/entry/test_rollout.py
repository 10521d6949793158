"""Many arms in compiled code do what a loop over one session does, faults and all."""

import numpy as np
import pytest
from records import SMALL
from ticks import Ticks

import ftqp
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.record import record

DT, COUNT, TICKS = 0.002, 6, 150
EVENTS = np.array([[-1, 0, 0], [2, 40, codes.BRAKING], [0, 0, codes.BRAKING], [3, 80, codes.INSTANT],
                   [5, 60, codes.FREE], [6, 149, codes.BRAKING]])  # fmt: skip
"""Joint, tick and code of each arm's fault; joint -1: none."""
RATE = 2.0
"""Deceleration of a joint that is being locked [rad/s2]."""
ROBOT = ftqp.robots.load("panda")


def ready():
    """A Panda's session, reset, with the scheme that needs inertia."""
    ticks = Ticks(ROBOT, DT, scheme="dlsm")
    ticks.reset(ROBOT.neutral)
    return ticks


@pytest.fixture(scope="module")
def starts():
    """Where each arm begins, (B, nv)."""
    return ROBOT.neutral + np.random.default_rng(2).uniform(-0.05, 0.05, (COUNT, 7))


@pytest.fixture(scope="module")
def targets():
    """Packed targets of all ticks: the tip is to rise."""
    aim, rows = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral)), np.empty((TICKS, codes.TARGET_SIZE))
    for k in range(TICKS):
        aim.position[2] += 2e-4
        rows[k] = aim.packed
    return rows


class Outcome:
    """What a batch of arms ends with: q, v, largest errors and ticks per status."""

    def __init__(self, starts):
        self.q, self.v = starts.copy(), np.zeros((COUNT, 7))
        self.worst, self.counts = np.zeros((COUNT, 2)), np.zeros((COUNT, len(codes.Status)), dtype=np.int64)


def rolled_out(session, starts, targets, parts=((0, COUNT),)):
    """The batch in compiled code, in portions."""
    out, memory, rates = Outcome(starts), record(SMALL), np.full(COUNT, RATE)
    for first, last in parts:
        call = session.bind("rollout", memory, first, last, TICKS, out.q, out.v, targets, EVENTS, rates,
                            out.worst, out.counts)  # fmt: skip
        assert call() == 0
    return out


@pytest.fixture(scope="module")
def looped(starts, targets):
    """The same tick by tick, each arm on a copy of the session."""
    out, model = Outcome(starts), ready().session
    for r, (joint, at, fault) in enumerate(EVENTS):
        session = model.copy()
        K, step = session.K, session.bind("step")
        K.state.q_command[:7], K.state.v_command[:7] = starts[r], 0.0
        q, v = starts[r].copy(), np.zeros(7)
        for k in range(TICKS):
            if joint >= 0 and at == k:
                K.faults.code[joint], K.faults.lock_rate[joint] = fault, RATE
                K.faults.lock_velocity[joint], K.qp.warm = 1e300, 0
            out.counts[r, step(q, v, targets, k)] += 1
            out.worst[r] = np.maximum(out.worst[r], (K.task.position_error, K.task.rotation_error))
            q, v = K.state.q_command[:7].copy(), K.state.v_command[:7].copy()
        out.q[r], out.v[r] = q, v
    return out


def agree(one, other):
    """Not bit for bit: the compiler may contract the two entry points differently."""
    return (
        np.abs(one.q - other.q).max() < 1e-13
        and np.abs(one.v - other.v).max() < 1e-11
        and np.abs(one.worst - other.worst).max() < 1e-12
        and np.array_equal(one.counts, other.counts)
    )


def test_batch_equals_the_loop_to_rounding_with_faults(starts, targets, looped):
    out = rolled_out(ready().session, starts, targets)
    assert agree(out, looped)
    assert np.all(out.counts.sum(axis=1) == TICKS)
    v = out.v
    assert v[1, 2] == 0.0 and v[2, 0] == 0.0 and v[3, 3] == 0.0 and v[0].any()


def test_arms_know_nothing_of_each_other(starts, targets):
    """Portions in any order give the same bits: nothing is left over from the arm before."""
    whole = rolled_out(ready().session, starts, targets)
    parts = rolled_out(ready().session, starts, targets, [(4, 6), (0, 1), (1, 4)])
    for name in ("q", "v", "worst", "counts"):
        assert np.array_equal(getattr(whole, name), getattr(parts, name))


def test_the_session_that_arms_begin_with_is_left_alone(starts, targets):
    session = ready().session
    before = session.copy()
    rolled_out(session, starts, targets)
    for room in session.K.dtype.names:
        for name in session.K[room].dtype.names:
            assert np.array_equal(session.field(room, name), before.field(room, name)), (room, name)
