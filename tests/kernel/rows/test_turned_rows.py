"""Directional damping against the damped least squares that it stands for."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.entry.session import ArmSession

IIWA = ftqp.robots.load("iiwa14")
NEAR = np.array([0.0, 0.02, 0.0, -1.2, 0.0, 1.0, 0.0])
"""Joint 2 near zero: with it locked the tip can hardly move one way."""


def jacobian(q):
    """The position rows of the arm's Jacobian, (3, 7)."""
    arm = ArmSession(IIWA.chain.constants())
    arm.kinematics(q)
    return arm.K.kinematics.J[:3, :7]


def step_at(damping, q=NEAR, mode="slack", twist=(0.1, 0.2, 0.1, 0.0, 0.0, 0.0), level="velocity"):
    robot = IIWA.with_limits(a_max=1e9, v_max=1e5)
    task = ftqp.Task(rows="position", mode=mode, kp=0.0, slack=1e-12, damping=damping)
    planner = ftqp.Planner(robot, 1e-3, level=level, task=task, torque_limits=False, emergency=None)
    planner.report(ftqp.Locked(1, mode="instant"))
    planner.reset(q)
    return planner, planner.step(q, np.zeros(7), ftqp.Target(pose=robot.pose(q), twist=twist))


def expected(planner, damping, twist):
    """sum_k sigma_k/(sigma_k^2 + damp_k) v_k u_k'twist, written out."""
    length = planner.robot.length
    J = jacobian(NEAR)[:, [0, 2, 3, 4, 5, 6]]
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    share = sigma / (length * damping.threshold)
    damp = np.where(share < 1.0, (length * damping.factor * (1.0 - share**2)) ** 2, 0.0)
    x = np.zeros(7)
    x[[0, 2, 3, 4, 5, 6]] = Vt.T @ (sigma / (sigma**2 + damp) * (U.T @ np.array(twist[:3])))
    return x, sigma / length


@pytest.mark.parametrize("mode", ["slack", "hard", "lexicographic"])
def test_only_singular_directions_are_damped(mode):
    damping, twist = ftqp.DirectionalDamping(threshold=1.0, factor=0.5), (0.1, 0.2, 0.1, 0.0, 0.0, 0.0)
    planner, step = step_at(damping, mode=mode, twist=twist)
    x, sigma = expected(planner, damping, twist)
    assert sigma[-1] < damping.threshold < sigma[0]
    np.testing.assert_allclose(step.v, x, rtol=1e-4, atol=1e-5)


def test_slack_is_told_along_the_rows_of_the_task():
    _, step = step_at(ftqp.DirectionalDamping(threshold=1.0, factor=0.5))
    np.testing.assert_allclose(step.slack, jacobian(NEAR) @ step.v - [0.1, 0.2, 0.1], atol=1e-9)
    assert step.status is ftqp.StepStatus.RELAXED and step.certificate.unreached


def test_away_from_singularities_damping_changes_nothing():
    q = np.array([0.3, 0.9, 0.2, -1.2, 0.4, 1.0, 0.0])
    (_, damped), (_, plain) = step_at(ftqp.DirectionalDamping(threshold=0.05), q), step_at(None, q)
    np.testing.assert_allclose(damped.v, plain.v, atol=1e-7)
