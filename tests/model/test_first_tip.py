"""Another tip or frame as the first: it is the same robot, and paths and goals are of that frame."""

import numpy as np
import pytest

import ftqp

BOTH = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BOTH.tips
TURNED = BOTH.with_first_tip(RIGHT)


@pytest.mark.parametrize("frame", [RIGHT, LEFT, "right_joint4", "left_joint3"])
def test_the_robot_is_the_same_and_its_tip_is_the_frame(frame):
    robot, q = BOTH.with_first_tip(frame), BOTH.neutral + 0.1
    assert robot.tip == frame and set(robot.tips) == {frame, LEFT, RIGHT} and robot.joints == BOTH.joints
    np.testing.assert_array_equal(robot.pose(q), BOTH.pose(q, frame))
    np.testing.assert_array_equal(robot.jacobian(q), BOTH.jacobian(q, frame))
    np.testing.assert_array_equal(robot.pose(q, LEFT), BOTH.pose(q, LEFT))
    np.testing.assert_array_equal(robot.mass_matrix(q), BOTH.mass_matrix(q))
    assert robot.length == BOTH.length and robot.limits is BOTH.limits
    assert robot.with_first_tip(LEFT).tips[0] == LEFT


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_a_goal_is_of_that_tip_while_the_other_stays_and_a_joint_fails(level):
    tasks = [ftqp.Task(), ftqp.PoseTask(LEFT, level=0)]
    planner = ftqp.Planner(TURNED, 2e-3, level=level, tasks=tasks)
    goal = TURNED.pose(TURNED.neutral).copy()
    goal[:3, 3] += [0.05, 0.0, -0.1]
    going, q = ftqp.GoTo(planner, pose=goal), TURNED.neutral.copy()
    going.reset(q)
    for k in range(3000):
        if k == 100:
            planner.report(ftqp.Locked("right_joint3"))
        q = going.step(q, None).q.copy()
        if going.done:
            break
    assert going.status is ftqp.GoToStatus.REACHED
    np.testing.assert_allclose(BOTH.pose(q, RIGHT), goal, atol=1e-3)
    np.testing.assert_allclose(BOTH.pose(q, LEFT), BOTH.pose(BOTH.neutral, LEFT), atol=1e-5)
