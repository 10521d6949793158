"""Joints that a task can never do without."""

import numpy as np

from ftqp.analysis.tolerance import random_jacobians, structural_joints
from ftqp.model import catalog
from ftqp.model.catalog.arms import published
from ftqp.model.robot import Robot


def test_elbow_between_spherical_wrists_is_structural_with_a_pose_only() -> None:
    for name in ("iiwa14", "srs7"):
        arm = catalog.load(name)
        assert structural_joints(arm) == (arm.joints[3],)
        assert structural_joints(arm, "position") == ()
    assert structural_joints(catalog.load("panda")) == structural_joints(catalog.load("zhang7")) == ()


def test_every_joint_counts_where_there_are_as_many_as_rows() -> None:
    puma = catalog.load("puma560")
    assert structural_joints(puma) == puma.joints


def test_table_read_as_modified_has_five_structural_joints() -> None:
    table = published("zhang7")["dh"]
    arm = Robot.from_dh(table, convention="modified", name="literal", limits={"q_min": -2.6, "q_max": 2.6})
    assert structural_joints(arm) == arm.joints[:5]


def test_jacobians_of_a_tool_axis_are_taken_along_its_own_axes() -> None:
    panda = catalog.load("panda")
    J = random_jacobians(panda, "position_axis", 5)
    assert J.shape == (5, 5, 7) and np.linalg.matrix_rank(J[0]) == 5
    assert structural_joints(panda, "position_axis") == ()
