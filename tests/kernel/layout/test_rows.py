"""Kinds of rows: labels, owners and counts are those of what the kernel writes into C."""

import numpy as np
import pytest
from session_ticks import Ticks

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.layout.rows import (
    HOLD,
    KEEP,
    ROW_KINDS,
    TORQUE,
    constraint_capacity,
    constraint_labels,
    constraint_owners,
    kind_of,
)
from ftqp.kernel.rows.constraint_rows import add_constraints
from ftqp.kernel.rows.failed_joints import sort_joints

PANDA = ftqp.robots.load("panda")
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
DT = 0.002


def constrained(level, codes=(), robot=PANDA):
    """The record of a moving arm with all its rows of C; what is beyond them was NaN before."""
    K = Ticks(robot, DT, level=level, torque_limits=robot.has_inertia).K
    K.state.q[:7], K.state.v[:7] = Q, V
    for joint, code in codes:
        K.faults.code[joint] = code
        K.faults.friction[joint] = 0.5
    sort_joints(K.faults, K.chain)
    forward_kinematics(K, K.state)
    if level == "acceleration":
        motion(K, K.state)
    for field in (K.qp.C, K.qp.l, K.qp.u):
        field[...] = np.nan
    add_constraints(K)
    return K


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_counts_labels_and_owners_agree_with_the_rows_that_are_filled(level):
    K = constrained(level)
    filled = int(K.qp.nc)
    labels = constraint_labels(PANDA.joints, True)
    assert filled == len(labels) == int(K.cascade.p)
    assert np.isfinite(K.qp.C[:filled, :7]).all()
    assert not np.isnan(K.qp.l[:filled]).any() and not np.isnan(K.qp.u[:filled]).any()
    assert np.isnan(K.qp.C[filled:]).all() and np.isnan(K.qp.l[filled:]).all()
    for label, (kind, joint, _) in zip(labels, constraint_owners(PANDA.joints, True), strict=True):
        assert label == kind.label(PANDA.joints[joint]) and label.startswith(kind.prefix)
        assert label.removeprefix(kind.prefix) == PANDA.joints[joint]


@pytest.mark.parametrize(("level", "scale"), [("acceleration", 1.0), ("velocity", DT)])
def test_a_torque_row_limits_the_joint_that_owns_it(level, scale):
    K = constrained(level)
    M, h = K.kinematics.M[:7, :7], K.kinematics.h[:7]
    before = M @ V if level == "velocity" else np.zeros(7)
    owners = constraint_owners(PANDA.joints, True)
    assert [row for row, (kind, _, _) in enumerate(owners) if kind is TORQUE] == [*range(7)]
    for row, (_, joint, _) in enumerate(owners[:7]):
        assert np.array_equal(K.qp.C[row, :7], M[joint])
        tau_max = PANDA.limits.tau_max[joint]
        ends = scale * (np.array([-tau_max, tau_max]) - h[joint]) + before[joint]
        assert [K.qp.l[row], K.qp.u[row]] == pytest.approx(ends, rel=1e-12)


def test_an_arm_without_masses_has_no_rows_that_need_them():
    assert constraint_owners(PANDA.joints, False) == ()
    assert constraint_labels(PANDA.joints, False, {"keep": ["a", "b"]}) == ("keep a", "keep b")
    K = constrained("velocity", robot=ftqp.robots.load("srs7"))
    assert K.qp.nc == 0 and np.isnan(K.qp.l).all()


def test_rows_that_a_planner_asks_for_stand_behind_those_of_joints():
    asked = {"hold": ["grip x", "grip rz"], "keep": ["table", "wall"]}
    owners = constraint_owners(PANDA.joints, True, asked)
    assert owners[6:9] == ((TORQUE, 6, "panda_joint7"), (KEEP, 0, "table"), (KEEP, 1, "wall"))
    assert owners[9:] == ((HOLD, 0, "grip x"), (HOLD, 1, "grip rz"))
    labels = constraint_labels(PANDA.joints, True, asked)
    assert labels[7:] == ("keep table", "keep wall", "hold grip x", "hold grip rz")
    assert [kind_of(label) for label in labels[6:10]] == [TORQUE, KEEP, KEEP, HOLD]


@pytest.mark.parametrize("capacity", [8, 16, 32])
def test_a_record_has_room_for_every_row_of_its_class(capacity):
    qp = dtype("record", capacity)["qp"]
    assert qp["C"].shape == (constraint_capacity(capacity), capacity + 1)
    assert qp["l"].shape == qp["u"].shape == qp["z"].shape == (constraint_capacity(capacity),)
    joints = [str(i) for i in range(capacity)]
    asked = {kind.name: [f"{kind.name} {i}" for i in range(kind.most)] for kind in ROW_KINDS if kind.most}
    owners = constraint_owners(joints, True, asked)
    assert len({(kind.name, i) for kind, i, _ in owners}) == len(owners) == constraint_capacity(capacity)
