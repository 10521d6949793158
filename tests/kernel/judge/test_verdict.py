"""What the judge lets pass, and what a command is made of."""

import numpy as np
import pytest
from ticks import Ticks

import ftqp
from ftqp.kernel.judge.verdict import judge
from ftqp.kernel.layout import enums as codes

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])


def solved(**options):
    """The record of a tick whose QP is solved, some bound active."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, 0.002, task=ftqp.Task(calm=False), **options)
    ticks.reset(Q)
    pose = robot.pose(Q)
    pose[:3, 3] += 0.1
    assert ticks.tick(Q, np.zeros(7), ftqp.Target(pose=pose)) == codes.RELAXED
    assert ticks.K.ladder.stage == codes.MAIN_STAGE
    return ticks.K


def test_a_solved_qp_passes():
    K = solved()
    assert np.abs(K.qp.z_box).max() > 0.0
    assert judge(K)
    ladder = K.ladder
    assert ladder.residual_task < 1e-9 and ladder.residual_dual < 1e-9 and ladder.residual_bounds < 1e-9


@pytest.mark.parametrize(
    ("field", "index", "change"),
    [
        ("x", None, 1e-2),
        ("x", None, -1e-2),
        ("y", 0, 1.0),
        ("z_box", 1, 1e6),
        ("z", 2, 1e3),
        ("b", 3, 1.0),
        ("g", 0, 1e6),
    ],
)
def test_a_wrong_number_does_not_pass(field, index, change):
    K = solved()
    qp = K.qp
    if index is None:  # a joint between its bounds
        index = int(np.argmax(np.minimum(qp.x - qp.lb, qp.ub - qp.x)[:7]))
        assert abs(qp.z_box[index]) == 0.0
    size = 1.0 + np.abs(qp.y).max() if field in ("y", "z_box", "z", "g") else 1.0
    getattr(qp, field)[index] += change * size
    assert not judge(K)


@pytest.mark.parametrize("field", ["x", "y", "z", "z_box"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_does_not_pass(field, value):
    K = solved(scheme="dlsm")
    qp = K.qp
    qp.nc = 7  # torque rows, open ones here, are looked at
    qp.C[:7, :7], qp.l[:], qp.u[:] = np.eye(7), -np.inf, np.inf
    assert judge(K)
    getattr(qp, field)[:6] = value
    with np.errstate(invalid="ignore"):  # plain Python warns
        assert not judge(K)
    if field == "x" and np.isinf(value):  # clamped into the box, like any x outside
        assert np.isfinite(qp.x[:7]).all()


def test_multiplier_of_the_wrong_sign_does_not_pass():
    K = solved()
    i = int(np.argmax(np.abs(K.qp.z_box[:7])))
    free = [j for j in range(7) if K.qp.z_box[j] == 0.0]
    K.qp.z_box[i] *= -1.0
    assert not judge(K) and free


def test_x_outside_its_box_is_clamped():
    K = solved()
    K.qp.x[:7] = 1e9
    judge(K)
    assert np.array_equal(K.qp.x[:7], K.qp.ub[:7])


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_command_is_the_exact_hold_of_x(level):
    robot, v = ftqp.robots.load("panda"), np.linspace(-0.2, 0.2, 7)
    ticks = Ticks(robot, 0.01, level=level)
    ticks.reset(Q, v)
    ticks.tick(Q, v, ftqp.Target(pose=robot.pose(Q)))
    x, state = ticks.K.qp.x[:7], ticks.K.state
    if level == "acceleration":
        expected = (Q + 0.01 * v + 0.5e-4 * x, v + 0.01 * x, x)
    else:
        expected = (Q + 0.01 * x, x, (x - v) / 0.01)
    for got, value in zip((state.q_command, state.v_command, state.a_command), expected, strict=True):
        assert np.abs(got[:7] - value).max() < 1e-13
