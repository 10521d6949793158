"""Postures of a goal with the joints that work: they reach it, within limits, and say what is to spare."""

import numpy as np
import pinocchio as pin
import pytest

import ftqp
from ftqp.core.pose import rotation_vector, rotation_x

PANDA = ftqp.robots.load("panda")
HOME = PANDA.neutral


def goal_at(shift=(0.1, 0.2, 0.1)):
    goal = PANDA.pose(HOME)
    goal[:3, 3] += shift
    return goal


def errors(robot, q, goal):
    T = robot.pose(q)
    return np.concatenate([goal[:3, 3] - T[:3, 3], rotation_vector(goal[:3, :3] @ T[:3, :3].T)])


def inside(robot, q, but=()):
    good = (q >= robot.limits.q_min - 1e-12) & (q <= robot.limits.q_max + 1e-12)
    return np.delete(good, [robot.joint(joint) for joint in but]).all()


@pytest.mark.parametrize(
    ("name", "locked"),
    [("panda", None), ("panda", 0), ("iiwa14", 2), ("iiwa14", 5), ("xarm7", None), ("xarm7", 2)],
)
def test_every_posture_reaches_the_goal_within_limits_with_the_locked_joint_where_it_was(name, locked):
    robot = ftqp.robots.load(name)
    here = robot.neutral + 0.1
    there = here + np.array([0.4, -0.3, 0.2, 0.3, -0.4, 0.3, 0.5])
    faults = () if locked is None else ftqp.Locked(locked)
    if locked is not None:
        there[locked] = here[locked]
    goal = robot.pose(there)
    found = ftqp.postures(robot, goal, faults=faults, near=here)
    assert 1 <= len(found) <= 8 and found.joints == robot.joints
    for one in found:
        assert np.abs(errors(robot, one.q, goal)).max() < 1e-8 and inside(robot, one.q, found.joints[:0])
        assert locked is None or one.q[locked] == here[locked]
    times = [one.time for one in found if one.is_held]
    assert times == sorted(times)


def test_margins_are_those_of_pinocchio():
    one = ftqp.postures(PANDA, goal_at(), near=HOME)[0]
    q, limits = one.q, PANDA.limits
    assert one.limit == pytest.approx(np.minimum(q - limits.q_min, limits.q_max - q).min(), abs=1e-12)
    J = PANDA.jacobian(q).copy()
    J[3:] *= PANDA.length
    assert one.sigma_min == pytest.approx(np.linalg.svd(J)[1][-1], rel=1e-6)
    g = pin.computeGeneralizedGravity(PANDA.model, PANDA.model.createData(), q)
    assert one.effort == pytest.approx((np.abs(g) / limits.tau_max).max(), rel=1e-9)
    assert one.time == pytest.approx((np.abs(q - HOME) / limits.v_max).max(), rel=1e-12)
    assert one.clearance == np.inf and one.is_held


def test_same_seed_gives_the_same_postures_and_another_one_others():
    def take(seed):
        return np.array([one.q for one in ftqp.postures(PANDA, goal_at(), near=HOME, seed=seed)])

    assert np.array_equal(take(3), take(3)) and not np.array_equal(take(3), take(4))


def test_postures_of_an_arm_with_joints_to_spare_are_apart_and_away_from_limits():
    found = ftqp.postures(PANDA, goal_at(), near=HOME, count=6)
    q = np.array([one.q for one in found])
    apart = np.abs(q[:, None] - q[None]).max(axis=2)[np.triu_indices(len(q), 1)]
    assert len(found) == 6 and apart.min() > 0.05
    assert np.median([one.limit for one in found]) > 0.2


def test_goal_that_only_a_lock_puts_out_of_reach_is_said_not_to_be_found():
    bent = HOME.copy()
    bent[3] = -2.8
    goal = PANDA.pose(HOME)
    goal[:3, 3] *= 1.25
    assert ftqp.postures(PANDA, goal, near=bent)
    found = ftqp.postures(PANDA, goal, faults=ftqp.Locked("panda_joint4"), near=bent, starts=100)
    assert not found and found.sentence == "no posture found in 100 starts"


def test_goal_outside_the_workspace_and_all_joints_locked_are_no_exceptions():
    far = goal_at((3.0, 0.0, 0.0))
    assert ftqp.postures(PANDA, far, near=HOME, starts=64).sentence == "no posture found in 64 starts"
    every = [ftqp.Locked(joint) for joint in PANDA.joints]
    assert not ftqp.postures(PANDA, goal_at(), faults=every, near=HOME, starts=8)
    (here,) = ftqp.postures(PANDA, PANDA.pose(HOME), faults=every, near=HOME, starts=8)
    assert np.array_equal(here.q, HOME) and here.sigma_min == 0.0


def test_goal_at_a_singularity_is_found():
    straight = np.zeros(7)
    straight[3] = PANDA.limits.q_max[3]
    found = ftqp.postures(PANDA, PANDA.pose(straight), near=straight)
    assert found and np.abs(errors(PANDA, found[0].q, PANDA.pose(straight))).max() < 1e-8


def test_fewer_rows_leave_more_postures_and_the_tool_axis_alone_is_kept():
    goal, bent = goal_at((0.15, 0.3, 0.2)), [ftqp.Locked(2), ftqp.Locked(3)]
    assert not ftqp.postures(PANDA, goal, faults=bent, near=HOME, starts=16)
    found = ftqp.postures(PANDA, goal[:3, 3], faults=bent, near=HOME, rows="position")
    assert found and np.abs(errors(PANDA, found[0].q, goal)[:3]).max() < 1e-8
    turned = goal_at()
    turned[:3, :3] = turned[:3, :3] @ rotation_x(0.4)
    axis = ftqp.postures(PANDA, turned, faults=ftqp.Locked(2), near=HOME, rows="position_axis")
    T = PANDA.pose(axis[0].q)
    assert T[:3, 2] @ turned[:3, 2] > 1.0 - 1e-9 and np.abs(T[:3, 3] - turned[:3, 3]).max() < 1e-8


def test_range_and_torque_that_are_left_of_a_weak_joint_count():
    weak = ftqp.Degraded("panda_joint2", torque=0.3, q_max=-0.2)
    found = ftqp.postures(PANDA, goal_at(), faults=weak, near=HOME)
    assert found and all(one.q[1] <= -0.2 + 1e-12 for one in found)
    g = pin.computeGeneralizedGravity(PANDA.model, PANDA.model.createData(), found[0].q)
    limit = PANDA.limits.tau_max * np.where(np.arange(7) == 1, 0.3, 1.0)
    assert found[0].effort == pytest.approx((np.abs(g) / limit).max(), rel=1e-9)


def test_continuous_joints_are_as_near_as_they_can_be():
    arm = ftqp.robots.load("planar", lengths=(1, 1, 0.5), continuous=True)
    near = np.array([7.0, 0.3, -5.0])
    found = ftqp.postures(arm, arm.pose(np.array([0.9, 0.5, 1.2])), near=near, rows="position")
    assert found and all(np.abs(one.q - near).max() <= np.pi + 1e-9 for one in found)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"faults": ftqp.Locked(2)}, "panda_joint3 is locked and near is None"),
        ({"faults": ftqp.FreeSwinging(2)}, "swings freely"),
        ({"faults": ftqp.Locked("elbow")}, "'elbow' is not a joint"),
        ({"faults": "lock"}, "fault"),
        ({"rows": "attitude"}, "rows"),
        ({"starts": 1.5}, "starts is 1.5"),
        ({"near": np.full(7, np.nan)}, "NaN"),
        ({"pose": np.ones((4, 4))}, "rotation"),
        ({"pose": np.zeros(3)}, "give a pose"),
    ],
)
def test_bad_input_gets_a_sentence(given, sentence):
    given = {"pose": goal_at(), **given}
    with pytest.raises(ftqp.InputError, match=sentence):
        ftqp.postures(PANDA, given.pop("pose"), **given)
