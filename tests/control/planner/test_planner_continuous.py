"""Continuous joints: angles or pinocchio's configuration, and never a jump at half a turn."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

DT = 2e-3

TURNING = """<robot name="turner"><link name="base"/>
{}<link name="tip"/><joint name="end" type="fixed"><parent link="l3"/><child link="tip"/><origin xyz="0.3 0
0"/></joint>
</robot>""".format(
    "".join(
        f'<link name="l{i}"/><joint name="j{i}" type="{kind}">'
        f'<parent link="{"base" if i == 1 else f"l{i - 1}"}"/>'
        f'<child link="l{i}"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-2" upper="2" velocity="1" effort="10"/></joint>'
        for i, kind in ((1, "continuous"), (2, "revolute"), (3, "continuous"))
    )
)


@pytest.fixture(scope="module")
def turner():
    return ftqp.Robot.from_urdf(
        TURNING, tip="tip", acceleration=5.0, default_rows=("x", "y"), kinematics_only=True
    )


@pytest.mark.parametrize("angles", [[0.3, 0.5, -0.4], [3.1, -0.5, -3.1]])
def test_configuration_and_angles_of_continuous_joints_give_the_same_command(turner, angles, level):
    assert turner.nq == 5 and turner.nv == 3
    q = np.array(angles)
    target = ftqp.Target(position=turner.pose(q)[:3, 3], twist=[0.05, 0.02, 0.0])
    commands = []
    for given in (q, turner.configuration(q)):
        planner = ftqp.Planner(turner, DT, level=level)
        planner.reset(given)
        commands.append(planner.step(given, np.zeros(3), target).copy())
    np.testing.assert_allclose(commands[0].a, commands[1].a, atol=1e-10)
    np.testing.assert_allclose(commands[0].q, commands[1].q, atol=1e-12)


def test_continuous_joint_turns_past_half_a_turn_without_a_jump(turner, level):
    planner = ftqp.Planner(turner, DT, level=level, scheme="rmp", posture=[3.6, 0.5, 0.3], emergency=None)
    q, v = np.array([3.0, 0.5, 0.3]), np.zeros(3)
    planner.reset(q)
    where = turner.pose([3.6, 0.5, 0.3])[:3, 3]
    passed = [q[0]]
    for _ in range(2000):
        step = planner.step(turner.configuration(q), v, ftqp.Target(position=where))
        q, v = step.q.copy(), step.v.copy()
        passed.append(q[0])
    assert np.abs(np.diff(passed)).max() <= 1.0 * DT + 1e-12
    assert passed[-1] > np.pi + 0.2


def test_wrong_shape_of_a_robot_with_continuous_joints_names_both_shapes(turner):
    planner = ftqp.Planner(turner, DT)
    planner.reset(np.zeros(3))
    with pytest.raises(
        InputError, match=r"q has shape \(4,\), expected \(nv,\) = \(3,\) or \(nq,\) = \(5,\)"
    ):
        planner.step(np.zeros(4), np.zeros(3), ftqp.Target(position=[0.5, 0.0, 0.0]))
