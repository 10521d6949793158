"""A failed joint as a bound equals the arm without it; instant locks and ramps follow their formulas."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.entry import entries as entry

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
OPEN = {"q_min": -np.inf, "q_max": np.inf, "v_max": 1e3, "a_max": 1e5, "tau_max": np.inf}
TASK = ftqp.Task(rows="position", mode="hard")


def target(robot):
    """A point near the tip, moving."""
    p = robot.pose(Q)[:3, 3]
    return ftqp.Target(
        position=p + np.array([0.001, -0.002, 0.001]), twist=[0.05, 0.02, -0.1], acceleration=[0.3, 0.1, -0.2]
    )


def planner_of(robot, scheme, level="acceleration", task=TASK, **options):
    """A planner without limits."""
    return ftqp.Planner(robot, DT, level=level, scheme=scheme, task=task, torque_limits=False, **options)


@pytest.mark.parametrize("scheme", ["mvn", "rmp", "mke", "iiwt", "dlsm"])
@pytest.mark.parametrize("joint", [0, 2, 3, 5])
def test_locked_joint_as_bound_equals_removal_and_the_reduced_model(joint, scheme):
    robot = ftqp.robots.load("panda").with_limits(**OPEN)
    v = V.copy()
    v[joint] = 0.0
    planner = planner_of(robot, scheme, posture=Q + 0.1)
    planner.report(ftqp.Locked(joint))
    planner.reset(Q, v)
    a = planner.step(Q, v, target(robot)).copy().a
    K, H = planner._record[0], [i for i in range(7) if i != joint]
    assert a[joint] == 0.0

    W = K["H"][:7, :7] if K["dense"] else np.diag(K["H_diagonal"][:7])
    J, b = K["A"][:3, :7][:, H], K["b"][:3]  # column removal: x_F = 0
    kkt = np.block([[W[np.ix_(H, H)], J.T], [J, np.zeros((3, 3))]])
    removed = np.linalg.solve(kkt, np.concatenate([-K["g"][:7][H], b]))[:6]
    assert np.abs(a[H] - removed).max() < 1e-9

    held = ftqp.Robot.from_pinocchio(
        robot.model, robot.tip, [robot.joints[joint]], q_locked={robot.joints[joint]: Q[joint]}, limits=OPEN
    )
    reduced = planner_of(held, scheme, posture=(Q + 0.1)[H])
    reduced.reset(Q[H], v[H])
    assert np.abs(a[H] - reduced.step(Q[H], v[H], target(robot)).a).max() < 1e-9


def test_braking_joint_is_compensated_like_removal_with_its_motion_on_the_right():
    robot = ftqp.robots.load("panda").with_limits(**OPEN)
    planner = planner_of(robot, "mvn")
    planner.report(ftqp.Locked(2, deceleration=3.0))
    planner.reset(Q, V)
    a, K = planner.step(Q, V, target(robot)).a, planner._record[0]
    H = [0, 1, 3, 4, 5, 6]
    assert abs(a[2] + 3.0) < 1e-12
    J = K["A"][:3, :7]
    shift = -4.0 * V[H]
    expected = shift + np.linalg.pinv(J[:, H]) @ (K["b"][:3] - J[:, 2] * a[2] - J[:, H] @ shift)
    assert np.abs(a[H] - expected).max() < 1e-9


def instantly_locked(reset, rows):
    """Velocities after an instant lock of joint 3 of a moving Panda, with J and M at that configuration."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, scheme="dlsm", task=ftqp.Task(rows=rows), emergency=None)
    planner.report(ftqp.Locked(3, mode="instant", reset=reset))
    planner.reset(Q, V)
    planner.step(Q, V, ftqp.Target(pose=robot.pose(Q)))
    v = planner._record["v"][0, :7].copy()
    entry.inverse_dynamics(planner._record.ctypes.data, Q, V)
    K = planner._record[0]
    return v, K["J"][:, :7].copy(), K["M"][:7, :7].copy()


H = [0, 1, 2, 4, 5, 6]


def test_kinematic_reset_leaves_the_others_alone():
    v, _, _ = instantly_locked("kinematic", "pose")
    assert v[3] == 0.0
    assert np.array_equal(v[H], V[H])


def test_momentum_reset_is_a_free_impulse():
    v, _, M = instantly_locked("momentum", "pose")
    assert v[3] == 0.0
    expected = V[H] - np.linalg.solve(M[np.ix_(H, H)], M[H, 3] * -V[3])
    assert np.abs(v[H] - expected).max() < 1e-12
    assert np.abs(M[H] @ (v - V)).max() < 1e-12  # no impulse on the joints that are free


@pytest.mark.parametrize("rows", ["pose", "position", ("x", "z")])
def test_task_reset_keeps_the_velocity_of_the_tip(rows):
    v, J, _ = instantly_locked("task", rows)
    J = J[{"pose": slice(0, 6), "position": slice(0, 3)}.get(rows, [0, 2])]
    assert v[3] == 0.0
    assert np.abs(J @ (v - V)).max() < 1e-7  # regularised by 1e-12 of its trace
    expected = V[H] - np.linalg.pinv(J[:, H]) @ (J[:, 3] * -V[3])
    assert np.abs(v[H] - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("start", [0.35, -0.4, 1e-9, 0.003])
def test_a_ramp_ends_exactly_at_rest_and_stays_there(level, start):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))
    q, v = Q.copy(), np.zeros(7)
    v[2] = start
    planner.report(ftqp.Locked(2, deceleration=0.7))
    planner.reset(q, v)
    aim, held = ftqp.Target(position=robot.pose(q)[:3, 3]), None
    for _ in range(int(abs(start) / (0.7 * DT)) + 5):
        before = v[2]
        step = planner.step(q, v, aim)
        q, v = step.q.copy(), step.v.copy()
        slowed = abs(before) - abs(v[2])
        assert abs(slowed - min(0.7 * DT, abs(before))) < 1e-15
        if v[2] == 0.0 and before == 0.0:
            assert step.a[2] == 0.0
            assert held is None or q[2] == held  # bitwise
            held = q[2]
    assert held is not None


def test_velocity_noise_cannot_keep_a_joint_braking():
    rng, robot = np.random.default_rng(1), ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT)
    planner.report(ftqp.Locked(0, deceleration=1.0))
    planner.reset(Q, V)
    aim = ftqp.Target(pose=robot.pose(Q))
    steps = [planner.step(Q, V + 0.05 * rng.normal(size=7), aim).v[0] for _ in range(int(0.3 / DT) + 2)]
    assert steps[-1] == 0.0 and planner.step(Q, V, aim).a[0] == 0.0
