"""What the judge lets pass, and what a command is made of."""

import numpy as np
import pytest
from records import address, on_record

import ftqp
from ftqp.kernel.judge.verdict import judge
from ftqp.kernel.layout import enums as codes

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
good = on_record(judge)


def solved(**options):
    """The record of a tick whose QP is solved, some bound active."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 0.002, emergency=None, **options)
    planner.reset(Q)
    pose = robot.pose(Q)
    pose[:3, 3] += 0.1
    step = planner.step(Q, np.zeros(7), ftqp.Target(pose=pose))
    assert step.code == codes.RELAXED and planner._record["stage"][0] == codes.MAIN_STAGE
    return planner._record.copy()


def test_a_solved_qp_passes():
    W = solved()
    assert np.abs(W["z_box"]).max() > 0.0
    assert good(address(W))
    assert W["residual_task"][0] < 1e-9 and W["residual_dual"][0] < 1e-9 and W["residual_bounds"][0] < 1e-9


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
    W = solved()
    if index is None:  # a joint between its bounds
        index = int(np.argmax(np.minimum(W["x"] - W["lb"], W["ub"] - W["x"])[0, :7]))
        assert abs(W["z_box"][0, index]) == 0.0
    W[field][0, index] += change * (1.0 + np.abs(W["y"]).max() if field in ("y", "z_box", "z", "g") else 1.0)
    assert not good(address(W))


@pytest.mark.parametrize("field", ["x", "y", "z", "z_box"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_does_not_pass(field, value):
    W = solved(scheme="dlsm")
    W["nc"] = 7  # torque rows, open ones here, are looked at
    W["C"][0, :7, :7], W["l"], W["u"] = np.eye(7), -np.inf, np.inf
    assert good(address(W))
    W[field][0, :6] = value
    assert not good(address(W))
    if field == "x" and np.isinf(value):  # clamped into the box, like any x outside
        assert np.isfinite(W["x"][0, :7]).all()


def test_multiplier_of_the_wrong_sign_does_not_pass():
    W = solved()
    i = int(np.argmax(np.abs(W["z_box"][0, :7])))
    free = [j for j in range(7) if W["z_box"][0, j] == 0.0]
    W["z_box"][0, i] *= -1.0
    assert not good(address(W)) and free


def test_x_outside_its_box_is_clamped():
    W = solved()
    W["x"][0, :7] = 1e9
    good(address(W))
    assert np.array_equal(W["x"][0, :7], W["ub"][0, :7])


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_command_is_the_exact_hold_of_x(level):
    robot, v = ftqp.robots.load("panda"), np.linspace(-0.2, 0.2, 7)
    planner = ftqp.Planner(robot, 0.01, level=level)
    planner.reset(Q, v)
    step, K = planner.step(Q, v, ftqp.Target(pose=robot.pose(Q))), planner._record[0]
    x = K["x"][:7]
    if level == "acceleration":
        expected = (Q + 0.01 * v + 0.5e-4 * x, v + 0.01 * x, x)
    else:
        expected = (Q + 0.01 * x, x, (x - v) / 0.01)
    for got, value in zip((step.q, step.v, step.a), expected, strict=True):
        assert np.abs(got - value).max() < 1e-13
