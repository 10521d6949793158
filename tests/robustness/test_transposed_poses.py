"""A pose whose last row is not 0 0 0 1, as that of a transposed one, drives no arm to its base."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
POSE = PANDA.pose(PANDA.neutral)
SKEWED = POSE.copy()
SKEWED[3] = (0.0, 0.0, 0.1, 1.0)
SCALED = POSE.copy()
SCALED[3, 3] = 2.0
WRONG = {"transposed": POSE.T, "another last row": SKEWED, "another scale": SCALED}
MADE = {
    "target": lambda T: ftqp.Target(pose=T),
    "targets": lambda T: ftqp.Targets(np.array([POSE, T, POSE])),
    "goto": lambda T: ftqp.GoTo(started(), pose=T),
    "line": lambda T: ftqp.paths.Line(T, displacement=[0.1, 0, 0], duration=1.0),
    "hold": lambda T: ftqp.paths.Hold(T, duration=1.0),
    "circle": lambda T: ftqp.paths.Circle(T, radius=0.1, duration=1.0),
    "postures": lambda T: ftqp.postures(PANDA, T),
    "tip": lambda T: PANDA.with_tip(T),
    "box": lambda T: ftqp.Box(size=(0.1, 0.1, 0.1), place=T),
}


def started(**more):
    planner = ftqp.Planner(PANDA, **more)
    planner.reset(PANDA.neutral)
    return planner


@pytest.mark.parametrize("make", list(MADE.values()), ids=list(MADE))
@pytest.mark.parametrize("T", list(WRONG.values()), ids=list(WRONG))
def test_nothing_is_made_of_what_is_no_pose(make, T):
    with pytest.raises(ftqp.InputError, match=r"last row .*expected the last row 0 0 0 1.*\.T"):
        make(T)
    make(POSE)


@pytest.mark.parametrize("T", list(WRONG.values()), ids=list(WRONG))
@pytest.mark.parametrize("how", ["at", "written", "pose"])
def test_a_target_that_becomes_none_in_a_loop_is_an_invalid_input_and_moves_nothing(T, how):
    planner, target = started(), ftqp.Target(pose=POSE)
    assert planner.step(PANDA.neutral, None, target).status.name == "OK"
    if how == "at":
        target.at(np.ascontiguousarray(T))
    elif how == "written":
        target.pose[:] = T
    else:
        target.pose = T
    q = PANDA.neutral.copy()
    for _ in range(50):
        step = planner.step(q, None, target)
        assert step.status.name == "INVALID_INPUT"
        q = step.q.copy()
    np.testing.assert_allclose(q, PANDA.neutral, atol=1e-6)
    assert planner.step(q, None, target.at(POSE)).status.name == "OK"


def test_a_target_follower_calls_it_invalid_and_stands():
    planner = started()
    led = ftqp.TargetFollower(planner)
    led.reset(PANDA.neutral)
    target = ftqp.Target(pose=POSE)
    target.pose[:] = POSE.T
    step = led.step(PANDA.neutral, None, target)
    assert led.status.name == "INVALID" and step.status.name == "INVALID_INPUT"


def test_a_measured_tip_that_is_transposed_counts_as_not_measured():
    planner, target = started(), ftqp.Target(pose=POSE)
    plain = started()
    for k in range(10):
        step = planner.step(PANDA.neutral, None, target, tip=POSE.T if k % 3 == 0 else POSE)
        want = plain.step(PANDA.neutral, None, target, tip=POSE)
        np.testing.assert_allclose(step.q, want.q, atol=1e-9)


def test_a_task_beside_that_of_the_tip_keeps_its_last_target_and_says_so():
    elbow = ftqp.PoseTask("panda_joint4", level=3, weight=0.1, name="elbow")
    planner = started(tasks=[elbow])
    target = ftqp.Target(pose=POSE)
    place = PANDA.pose(PANDA.neutral, "panda_joint4")
    planner.step(PANDA.neutral, None, {"tip": target, "elbow": place})
    step = planner.step(PANDA.neutral, None, {"tip": target, "elbow": place.T.copy()})
    assert "last row" in (step.tasks["elbow"].failed or "")
    assert step.status.name == "OK"
