"""A motion is a witness that a target can be followed; where the target leaves what is possible, it ends."""

import numpy as np
import pytest

from ftqp.checker.model_file import ModelFile
from ftqp.checker.recovery_law import followable
from ftqp.control.paths import Circle, Line
from ftqp.model import catalog

ROBOT = catalog.load("panda")
POSE = ("x", "y", "z", "rx", "ry", "rz")
DT = 0.01


def arm(robot=ROBOT):
    return ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)


def poses(path):
    return path.sample(DT * np.arange(round(path.duration / DT) + 1)).pose


def reported_at(path, *, model=None, q=None, rows=POSE):
    return followable(model or arm(), ROBOT.neutral if q is None else q, poses(path), rows, DT)


def circle(duration=3.0, radius=0.05):
    return Circle(ROBOT.pose(ROBOT.neutral), radius, duration=duration)


def test_slow_small_circle_can_be_followed_to_its_end():
    assert reported_at(circle()) == pytest.approx(3.0 + DT)


def test_circle_that_is_faster_than_half_of_the_limits_allow_has_no_witness():
    assert reported_at(circle(duration=0.3)) < 0.1


def test_witness_ends_where_the_path_leaves_the_workspace():
    path = Line(ROBOT.pose(ROBOT.neutral), (1.0, 0.0, 0.0), duration=10.0)
    assert 1.0 < reported_at(path) < 8.0


def test_weak_arm_has_no_witness():
    assert reported_at(circle(), model=arm(ROBOT.with_limits(tau_max=20.0))) == 0.0


def test_start_at_the_end_of_a_range_has_no_witness():
    q = ROBOT.neutral.copy()
    q[3] = ROBOT.limits.q_min[3] + 0.01
    path = Circle(ROBOT.pose(q), 0.01, duration=3.0)
    assert reported_at(path, q=q) == 0.0


def test_stretched_arm_has_no_witness_once_it_would_have_to_fold():
    robot = catalog.load("planar", count=3)
    path = Line(robot.pose(np.zeros(3)), (-0.01, 0.0, 0.0), duration=5.0)
    assert reported_at(path, model=arm(robot), q=np.zeros(3), rows=("x", "y")) < 0.1
