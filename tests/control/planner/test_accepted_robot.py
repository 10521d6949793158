"""What a planner says of what is no robot, or of one that it cannot drive."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError, ModelError


@pytest.mark.parametrize("given", ["panda", None, 7, np.eye(4), {"name": "panda"}, ftqp.Robot])
def test_what_is_no_robot_is_refused_with_the_way_to_one(given):
    with pytest.raises(
        InputError, match=r"^robot is .*, expected an ftqp.Robot, for example ftqp.robots.load"
    ):
        ftqp.Planner(given)


def test_arm_without_velocity_limits_is_told_of_those():
    arm = ftqp.Robot.from_dh([[0.0, 0.1, 0.3, 0.0], [0.0, 0.0, 0.3, 0.0]])
    with pytest.raises(ModelError, match=r"no velocity limit, .* on j1, j2; .*with_limits\(v_max=...\)$"):
        ftqp.Planner(arm)
    assert ftqp.Planner(arm.with_limits(v_max=1.0)).robot.limits.a_max.tolist() == [5.0, 5.0]
