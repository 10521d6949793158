"""Rest postures: the residual's Jacobian by finite differences, and what the search finds."""

import numpy as np
import pytest
from records import believe, chain_record

import ftqp
from ftqp.kernel.entry.session import ArmSession, rooms
from ftqp.kernel.free.holding import begin_start, residual, seek
from ftqp.kernel.layout.enums import AXIS_KEPT, FREE, NOTHING_KEPT, POSE_KEPT, POSITION_KEPT
from ftqp.kernel.layout.record import dtype

SETS = (NOTHING_KEPT, POSITION_KEPT, AXIS_KEPT, POSE_KEPT)


def arm(rows, joint=4, turned=0.0):
    """A Panda at its neutral posture that is to keep ``rows`` where its tip is; (K, F)."""
    robot = ftqp.robots.load("panda")
    K, F = chain_record(robot), rooms(np.zeros(1, dtype("free", 8)))
    for name in ("q_min", "q_max", "v_max", "a_max"):
        getattr(K.limits, name)[:7] = getattr(robot.limits, name)
    believe(K, {joint: FREE})
    pose = robot.pose(robot.neutral)
    c, s = np.cos(turned), np.sin(turned)
    F.joint, F.rows = joint, rows
    F.goal[:] = pose[:3, 3]
    F.goal_rotation[:] = (pose[:3, :3] @ [[1, 0, 0], [0, c, -s], [0, s, c]]).ravel()
    K.task.axis[:] = np.eye(3).ravel()
    F.start[:7] = F.trial[:7] = robot.neutral
    return K, F


@pytest.mark.parametrize("rows", SETS)
def test_jacobian_is_that_of_finite_differences(rows):
    rng = np.random.default_rng(0)
    K, F = arm(rows)
    q = K.state.q[:7] + F.start[:7] + rng.uniform(-0.02, 0.02, 7)  # the axis' rows are exact near the goal
    F.trial[:7] = q
    residual(K, F)
    m, step = int(F.unknowns), 1e-6
    C = F.C[:m, :7].copy()
    for j in range(7):
        ends = []
        for sign in (1.0, -1.0):
            F.trial[:7] = q + sign * step * np.eye(7)[j]
            residual(K, F)
            ends.append(F.c[:m].copy())
        numeric = (ends[0] - ends[1]) / (2.0 * step)
        assert np.abs(C[:, j] - numeric).max() < (2e-2 if m == 7 else 1e-6)


@pytest.mark.parametrize(("rows", "joint"), [(NOTHING_KEPT, 3), (POSITION_KEPT, 4), (AXIS_KEPT, 6)])
def test_posture_found_keeps_the_rows_and_needs_no_torque_of_the_free_joint(rows, joint):
    robot = ftqp.robots.load("panda")
    K, F = arm(rows, joint)
    for number in range(5):
        begin_start(K.faults, K.chain, F, number)
        while not seek(K, F, 20):
            pass
    assert F.found > 0
    session = ArmSession(robot.chain.constants())
    for q in F.rests[: int(F.found), :7]:
        session.dynamics(q)
        assert abs(session.K.kinematics.h[joint]) < 2e-4
        assert (q >= robot.limits.q_min).all() and (q <= robot.limits.q_max).all()
        pose = robot.pose(q)
        if rows != NOTHING_KEPT:
            assert np.abs(pose[:3, 3] - F.goal).max() < 2e-5
        if rows == AXIS_KEPT:
            assert pose[:3, 2] @ F.goal_rotation.reshape(3, 3)[:, 2] > 1.0 - 1e-8
