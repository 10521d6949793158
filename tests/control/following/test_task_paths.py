"""Paths and goals of tasks beside the tip's."""

import numpy as np
import pytest
from tests.going import closed_loop

import ftqp

BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips


def lift(height=0.05, duration=1.0):
    """Both hands straight up."""
    q = BODY.neutral
    return {
        hand: ftqp.paths.Line(BODY.pose(q, hand), displacement=(0.0, 0.0, height), duration=duration)
        for hand in (LEFT, RIGHT)
    }


def hands(**given):
    return ftqp.Planner(BODY, tasks=[ftqp.PoseTask(LEFT), ftqp.PoseTask(RIGHT, level=0)], **given)


def led(leader, steps, target=None, **given):
    """Steps from neutral until it has arrived; the last one."""
    count = 0
    for step in closed_loop(leader, target, steps, **given):
        count, last = count + 1, step
        if getattr(leader, "done", leader.status is ftqp.PathStatus.DONE):
            break
    return last, last.q.copy(), count


def test_two_hands_follow_paths_of_their_own_in_one_time(level):
    follower = ftqp.TaskPaths(hands(level=level), lift())
    step, q, k = led(follower, 3000)
    assert follower.status is ftqp.PathStatus.DONE and follower.progress == 1.0 and k < 1250
    for hand, path in follower.paths.items():
        assert BODY.pose(q, hand)[:3, 3] == pytest.approx(path.sample([9.0]).pose[0, :3, 3], abs=2e-4)
    assert step.status is ftqp.StepStatus.OK


def test_both_slow_down_where_one_cannot_follow():
    follower, worst, slow = ftqp.TaskPaths(hands(), lift(0.2, duration=0.25)), 0.0, False
    for step in closed_loop(follower, None, 6000):
        slow = slow or follower.status is ftqp.PathStatus.SCALED
        worst = max(worst, step.position_error, np.linalg.norm(step.tasks[RIGHT].error[:3]))
        assert (np.abs(step.v) <= BODY.limits.v_max * (1 + 1e-12)).all()
        if follower.status is ftqp.PathStatus.DONE:
            break
    assert follower.status is ftqp.PathStatus.DONE and slow and worst < 0.02


def test_a_path_of_one_hand_leaves_the_tip_where_its_target_is_and_a_point_follows_with_its_speed():
    tasks = [ftqp.PoseTask(LEFT), ftqp.PositionTask(RIGHT, level=0, point=(0.0, 0.0, 0.05), name="tool")]
    planner = ftqp.Planner(BODY, tasks=tasks)
    start = BODY.pose(BODY.neutral, RIGHT) @ np.array([*np.eye(4)[:2], [0, 0, 1, 0.05], [0, 0, 0, 1]])
    follower = ftqp.TaskPaths(planner, {"tool": ftqp.paths.Circle(start, radius=0.04, duration=2.0)})
    home = BODY.pose(BODY.neutral)
    step, q, _ = led(follower, 4000, target=home)
    assert follower.status is ftqp.PathStatus.DONE
    assert BODY.pose(q) == pytest.approx(home, abs=1e-6)
    assert np.linalg.norm(step.tasks["tool"].error) < 1e-4


@pytest.mark.slow
def test_a_path_that_cannot_go_on_is_blocked_and_says_for_whom():
    follower = ftqp.TaskPaths(hands(emergency=None), lift(1.5, duration=1.5))
    led(follower, 6000)
    assert follower.status is ftqp.PathStatus.BLOCKED and 0.1 < follower.progress < 1.4
    assert follower.rate < 0.01 and "all paths wait at" in follower.blocked


def test_a_stop_holds_the_paths():
    follower = ftqp.TaskPaths(hands(), lift())
    step, _, _ = led(follower, 900, events={300: lambda planner: planner.stop()})
    assert step.status is ftqp.StepStatus.STOPPED and follower.rate == 0.0 and follower.progress < 0.4


@pytest.mark.parametrize(
    ("paths", "message"),
    [
        ({}, "expected a path by task"),
        ({"nose": None}, "path of nose"),
        ({"nose": lift()[LEFT]}, "there is no task 'nose'"),
        ({"grip": lift()[LEFT]}, "task 'grip' is a RelativeTask, which follows no pose of its own"),
    ],
)
def test_wrong_paths_are_refused_in_a_sentence(paths, message):
    planner = ftqp.Planner(BODY, tasks=[ftqp.RelativeTask(RIGHT, LEFT, level=0, name="grip")])
    with pytest.raises(ftqp.InputError, match=message):
        ftqp.TaskPaths(planner, paths)


def test_another_hand_goes_to_a_pose_and_the_tip_stays():
    goal, home = BODY.pose(BODY.neutral, RIGHT), BODY.pose(BODY.neutral)
    goal[:3, 3] += [0.05, 0.05, 0.1]
    mover = ftqp.GoTo(hands(), pose=goal, task=RIGHT)
    lock = {300: lambda planner: planner.report(ftqp.Locked("right_joint4"))}
    _, q, _ = led(mover, 4000, events=lock)
    assert mover.status is ftqp.GoToStatus.REACHED and mover.position_error < 1e-3
    assert BODY.pose(q, RIGHT) == pytest.approx(goal, abs=1e-3)
    assert BODY.pose(q) == pytest.approx(home, abs=1e-9)


def test_a_pose_out_of_reach_of_another_hand_is_told_with_its_name():
    goal = BODY.pose(BODY.neutral, RIGHT)
    goal[:3, 3] += [0.0, 0.0, 1.5]
    mover = ftqp.GoTo(hands(dt=5e-3), pose=goal, task=RIGHT)
    led(mover, 2400)
    assert mover.done and mover.status is not ftqp.GoToStatus.REACHED
    assert mover.status is ftqp.GoToStatus.UNREACHABLE and "right_hand is" in mover.sentence


def test_the_tip_goes_to_a_pose_while_another_hand_has_a_target_of_its_own():
    planner = hands()
    goal, other = BODY.pose(BODY.neutral), BODY.pose(BODY.neutral, RIGHT)
    goal[2, 3] += 0.05
    other[2, 3] += 0.005
    mover = ftqp.GoTo(planner, pose=goal)
    _, q, _ = led(mover, 12000, target={RIGHT: other})
    assert mover.status is ftqp.GoToStatus.REACHED
    assert BODY.pose(q, RIGHT) == pytest.approx(other, abs=1e-4)
    with pytest.raises(ftqp.InputError, match="expected a table of targets of other tasks"):
        mover.step(q, None, target=ftqp.Target(pose=goal))
    with pytest.raises(ftqp.InputError, match="goes to a pose"):
        ftqp.GoTo(planner, q=q, task=RIGHT)
    with pytest.raises(ftqp.InputError, match="a posture takes all joints"):
        ftqp.GoTo(planner, q=q).step(q, None, target={RIGHT: other})
