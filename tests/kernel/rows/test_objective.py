"""H and g of schemes beside failed joints, and of single coefficients, in plain numpy."""

import numpy as np
import pytest
from random_chains import random_robot
from session_ticks import Ticks, hessian

import ftqp
from ftqp.control.following.path_intervals import path_table
from ftqp.kernel.entry.session import ArmSession, PathMemory

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
POSTURE = np.array([0.0, -0.3, 0.1, -1.8, 0.1, 1.4, 0.7])


def assembled(scheme, level, *faults):
    """H, g, M and h of one tick of a moving Panda."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, DT, *faults, level=level, scheme=scheme, posture=POSTURE, torque_limits=False)
    ticks.reset(Q, V)
    ticks.tick(Q, V, ftqp.Target(pose=robot.pose(Q)))
    K, arm = ticks.K, ArmSession(robot.chain.constants())
    v = K.state.v[:7].copy()
    arm.dynamics(Q, v)
    return hessian(K), K.qp.g[:7].copy(), arm.K.kinematics.M[:7, :7], arm.K.kinematics.h[:7], v


def table(name, level, M, h, v, healthy=slice(None)):
    """W and c of a scheme by the published table; a failed joint's torque is left out of torque norms."""
    eye, S, bias = np.eye(7), M[healthy], h[healthy]
    if level == "acceleration":
        torque, pull = S.T @ bias, 8.0 * v + 16.0 * (Q - POSTURE)
        still = 4.0 * v
    else:
        torque, pull = S.T @ (DT * bias - S @ v), 4.0 * (Q - POSTURE)
        still = 0.0 * v
    share, c = {"mtn": (1.0, 0.0 * v), "dlsm": (0.995, pull), "dlsm_mvn": (0.995, still)}[name]
    return share * S.T @ S + (1.0 - share) * eye, share * torque + (1.0 - share) * c


def close(got, expected):
    """To 1e-12 of the largest entry."""
    return np.abs(got - expected).max() <= 1e-12 * max(1e-300, np.abs(expected).max())


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("name", ["mtn", "dlsm", "dlsm_mvn"])
def test_torque_of_a_locked_joint_is_not_in_the_objective(name, level):
    H, g, M, h, v = assembled(name, level, ftqp.Locked(2, mode="instant"))
    W, c = table(name, level, M, h, v, healthy=[0, 1, 3, 4, 5, 6])
    assert v[2] == 0.0
    assert close(H, W) and close(g, c)
    full, _ = table(name, level, M, h, v)
    assert not close(H, full)


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_torque_of_a_free_swinging_joint_is_not_minimised(level, damping):
    """What stands in its place is zero for every x that its equality row allows: no answer changes."""
    H, g, M, h, v = assembled("mtn", level, ftqp.FreeSwinging(3, damping=damping))
    W, c = table("mtn", level, M, h, v, healthy=[0, 1, 2, 4, 5, 6])
    row = M[3] + damping * DT * np.eye(7)[3]
    scale = DT if level == "velocity" else 1.0
    side = -scale * h[3] + (M[3] @ v if level == "velocity" else -damping * v[3])
    assert close(H, W + np.outer(row, row)) and close(g, c - row * side)
    assert np.linalg.eigvalsh(H).min() > 0.0


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("coefficient", ["inertia_v", "inertia_h"])
def test_a_linear_term_counts_without_the_weight_of_its_quadratic_form(coefficient, level):
    level_of = {level: ftqp.Criterion(norm=1.0, **{coefficient: 2.0})}
    other = {"velocity": "acceleration", "acceleration": "velocity"}[level]
    H, g, M, h, v = assembled(ftqp.Scheme(name="own", **level_of, **{other: ftqp.Criterion()}), level)
    scale = DT if level == "velocity" else 1.0
    assert close(H, np.eye(7)) and close(g, 2.0 * {"inertia_v": M @ v, "inertia_h": scale * h}[coefficient])


def test_a_continuous_joint_returns_to_its_posture_the_short_way():
    robot = random_robot(np.random.default_rng(4), 12)
    i = int(np.flatnonzero(robot.continuous)[0])
    q, posture = np.zeros(12), np.zeros(12)
    posture[i] = 6.0
    ticks = Ticks(robot, DT, scheme="rmp", posture=posture)
    ticks.reset(q)
    ticks.tick(q, np.zeros(12), ftqp.Target(pose=robot.pose(q)))
    assert abs(ticks.K.qp.g[i] - 16.0 * 2.0 * np.sin(0.5 * (2.0 * np.pi - 6.0))) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("scheme", ["mvn", "man", "rmp", "mke"])
def test_drive_is_where_the_null_space_comes_to_rest(level, scheme):
    """With a path that rests, of one row, the joints take the velocity of the drive; a locked joint stays."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(
        robot, 2e-3, level=level, scheme=scheme, task=ftqp.Task(rows=("x",), kp=0.0, mode="scaled")
    )
    planner.report(ftqp.Locked(0, mode="instant"))
    planner.reset(robot.neutral)
    drive = 0.02 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
    memory = PathMemory(8, path_table(ftqp.paths.Hold(robot.pose(robot.neutral), duration=9.0)))
    lead = planner.lead(memory)
    memory.path.rate, memory.path.limit = -1.0, 1.0
    memory.path.drive[:7], memory.path.driven = drive, 1
    q, v = robot.neutral.copy(), np.zeros(7)
    for _ in range(1000):
        step = lead.step(q, v, (), None, None)
        v = step.v.copy()
        planner.reset(q, v)  # the posture's pull stays zero
    J = lead.rows()[2]
    free = np.arange(1, 7)
    along = v[free] @ drive[free] / (drive[free] @ drive[free])
    assert v[0] == 0.0 and 0.3 < along < 1.1 and np.abs(J @ v)[0] < 0.02
