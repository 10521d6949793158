"""Bad tasks and targets: one sentence when a planner is made, a status or a warning in its loop."""

import logging
import pickle
import time
from copy import copy, deepcopy
from dataclasses import dataclass

import numpy as np
import pytest
from tests.going import started

import ftqp
from ftqp.core.pose import rotation_x, transform
from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION

BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips
TRANSPOSED = "a last row other than 0 0 0 1, as a transposed pose has"


def planner_of(*tasks, **more):
    """A planner that has begun at neutral, and its tip's target there."""
    planner = started(BODY, tasks=[ftqp.PoseTask(LEFT), *tasks], **more)
    return planner, BODY.pose(BODY.neutral)


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({"elbo": (0, 0, 0.5)}, "there is no task 'elbo' .did you mean 'elbow'"),
        ({"elbow": (0, 0.5)}, "target of elbow has shape"),
        ({"elbow": "high"}, "target of elbow"),
        ({RIGHT: ftqp.Target(position=np.zeros(3))}, "target of right_hand has no rotation, expected"),
        ({LEFT: "home"}, "the target of the end effector is str, expected"),
        ({"elbow": (0, 0, 0.5)}, "the target of the end effector is no target so far"),
    ],
)
def test_a_target_for_no_task_or_of_a_wrong_shape_raises_and_changes_nothing(targets, message):
    planner, _ = planner_of(ftqp.PositionTask("left_joint4", rows="z", name="elbow"), ftqp.PoseTask(RIGHT))
    before = planner.tasks["elbow"].target
    with pytest.raises(ftqp.InputError, match=message):
        planner.step(BODY.neutral, None, targets)
    assert np.array_equal(planner.tasks["elbow"].target, before)


def test_a_task_of_the_tips_frame_is_that_of_the_tip_and_keeps_its_last_target():
    planner, home = planner_of(ftqp.RelativeTask(RIGHT, LEFT, level=0, name="grip"))
    same = started(BODY, tasks=[ftqp.Task(), ftqp.RelativeTask(RIGHT, LEFT, level=0, name="grip")])
    goal = home.copy()
    goal[2, 3] += 0.01
    for k in range(30):
        step = planner.step(BODY.neutral, None, {LEFT: goal} if k == 0 else {})
        other = same.step(BODY.neutral, None, ftqp.Target(pose=goal))
        assert np.array_equal(step.q, other.q)
    assert step.tasks[LEFT].error == pytest.approx(step.task_error) and step.tasks["grip"].kept
    far = home.copy()
    far[2, 3] += 0.1
    assert not planner.step(BODY.neutral, None, {LEFT: far}).tasks[LEFT].kept


def test_a_target_that_is_given_with_the_task_needs_none_in_a_step():
    home = BODY.pose(BODY.neutral)
    planner = started(BODY, tasks=[ftqp.PositionTask(LEFT, rows="xz", target=home[:3, 3], kp=9.0)])
    assert planner.step(BODY.neutral, None, {}).status is ftqp.StepStatus.OK
    assert planner.task_rows == ("x", "z")


def test_a_function_that_takes_longer_than_a_tick_is_told_of_once(caplog):
    def fill(state, J, b):
        time.sleep(3e-3)

    def rows(state, C, l, u):
        time.sleep(3e-3)

    own = ftqp.LeastSquares(1, fill, name="own")
    planner, home = planner_of(own, constraints=[ftqp.Rows(1, rows, name="mine")])
    with caplog.at_level(logging.WARNING, "ftqp"):
        for _ in range(8):
            planner.step(BODY.neutral, None, {LEFT: home})
    slow = [r.getMessage() for r in caplog.records if "so that the loop is late" in r.getMessage()]
    assert len(slow) == 2 and "fill of own took" in slow[0] + slow[1]
    assert "fill of constraint mine took" in slow[0] + slow[1]


NAN = float("nan")
NO_TURN = np.diag([1.0, 1.0, 2.0, 1.0])


@pytest.mark.parametrize(
    ("task", "bad", "why"),
    [
        (ftqp.PositionTask("left_joint4", name="more"), (0.0, 0.0, NAN), "is not finite"),
        (ftqp.PoseTask(RIGHT, level=1, name="more"), NO_TURN, "has a rotation part that is none"),
        (ftqp.PoseTask(RIGHT, level=1, name="more"), BODY.pose(BODY.neutral).T, f"has {TRANSPOSED}"),
        (ftqp.AxisTask(RIGHT, along=(0, 0, 1), name="more"), (0, 0, 0), "has no direction"),
    ],
)
def test_a_target_that_is_not_finite_is_left_out_and_told_until_another_one_comes(task, bad, why, caplog):
    planner, home = planner_of(task)
    one = planner.tasks["more"]
    before = one.target
    step = planner.step(BODY.neutral, None, {"tip": home, "more": bad})
    assert step.status is ftqp.StepStatus.OK and np.array_equal(one.target, before)
    assert step.tasks["more"].failed == f"target {why}, so that the last one of 'more' stays"
    one.target = bad
    kept = planner.step(BODY.neutral, None, {}).copy()
    assert np.array_equal(one.target, before) and why in kept.tasks["more"].failed
    assert len([record for record in caplog.records if "said once" in record.message]) == 1
    step = planner.step(BODY.neutral, None, {"more": before})
    assert step.tasks["more"].failed is None and kept.tasks["more"].failed is not None


@pytest.mark.parametrize("row", [-1, 5, 10**6, 2**58, -(2**62)])
def test_a_row_that_a_trajectory_does_not_have_is_refused(row):
    planner, home = planner_of()
    targets = ftqp.Targets(np.stack([home] * 5))
    targets.row = row
    with pytest.raises(ftqp.InputError, match=r"make a new Target|take targets\.at"):
        planner.step(BODY.neutral, None, targets)


def test_an_array_is_read_as_it_is_at_the_step_and_let_go_of():
    (planner, home), (copied, _) = planner_of(), planner_of()
    q, aim = bytearray(BODY.neutral.tobytes()), ftqp.Target(pose=home)
    with memoryview(q).cast("d") as view:
        for k in range(5):
            view[0] += 1e-4 * k
            aim.position[0] += 1e-4
            step = planner.step(view, None, aim)
            other = copied.step(np.array(view), None, ftqp.Target(pose=aim.pose.copy()))
            assert np.array_equal(step.q, other.q)
    q.clear()  # raises BufferError while anybody holds it


def test_a_velocity_that_is_not_finite_is_left_out_and_a_reset_forgets_it():
    planner, home = planner_of(ftqp.PositionTask("left_joint4", name="elbow"))
    planner.tasks["elbow"].velocity = (0.0, 0.0, NAN)
    step = planner.step(BODY.neutral, None, {"tip": home})
    assert step.tasks["elbow"].failed.startswith("velocity is not finite")
    assert not planner.tasks["elbow"].velocity.any()
    planner.reset(BODY.neutral)
    assert planner.step(BODY.neutral, None, {"tip": home}).tasks["elbow"].failed is None


@pytest.mark.parametrize("bad", [np.full((4, 4), NAN), NO_TURN])
def test_a_pose_of_the_tip_that_is_none_is_a_status(bad):
    planner, home = planner_of(ftqp.PositionTask("left_joint4", name="elbow"))
    assert planner.step(BODY.neutral, None, {"tip": bad}).status is ftqp.StepStatus.INVALID_INPUT
    assert planner.step(BODY.neutral, None, {"tip": home}).status is ftqp.StepStatus.OK


def test_reports_say_the_error_of_joints_and_know_no_error_of_least_squares():
    q = BODY.neutral
    places = {"left_joint3": float(q[BODY.joint("left_joint3")]) + 0.2}
    rows = ftqp.LeastSquares(2, lambda state, J, b: None, name="own")
    planner, home = planner_of(
        ftqp.JointTask(places, name="some"), ftqp.PostureTask(q + 0.1, name="all"), rows
    )
    step = planner.step(q, None, {"tip": home})
    for one in (step, step.copy(), pickle.loads(pickle.dumps(step))):
        assert one.tasks["some"].error == pytest.approx([0.2])
        assert one.tasks["all"].error == pytest.approx(np.full(14, 0.1))
        assert np.isnan(one.tasks["own"].error).all() and one.tasks["own"].failed is None


def test_an_error_of_ones_own_that_raises_is_not_known_and_says_why():
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Mine(ftqp.OwnTask):
        @property
        def count(self):
            return 1

        def filling(self, robot):
            return lambda state, J, b: None

        def error(self, robot, q):
            raise RuntimeError("camera lost")

    planner, home = planner_of(Mine())
    report = planner.step(BODY.neutral, None, {"tip": home}).tasks["Mine"]
    assert (
        np.isnan(report.error).all() and report.failed == "error of 'Mine' raised RuntimeError: camera lost"
    )


def test_reports_are_looked_up_as_tasks_are():
    planner, home = planner_of(ftqp.PositionTask("left_joint4", name="elbow"))
    tasks = planner.step(BODY.neutral, None, {"tip": home}).tasks
    assert list(tasks) == [LEFT, "elbow"] and "tip" in tasks and "elbw" not in tasks
    assert np.array_equal(tasks["tip"].error, tasks[LEFT].error) and tasks.get("elbw") is None
    for known, more in ((tasks, f"{LEFT}, elbow"), (planner.tasks, "elbow")):
        with pytest.raises(
            ftqp.InputError, match=rf"no task 'elbw' \(did you mean 'elbow'.*; the planner has {more}$"
        ):
            known["elbw"]


def test_what_stopped_the_arm_is_the_constraint_that_failed_and_not_a_call_of_stop(caplog):
    lost = []

    def fill(state, C, l, u):
        if lost:
            raise RuntimeError("{camera} lost")

    planner, home = planner_of(constraints=[ftqp.Rows(1, fill, name="cable")])
    planner.step(BODY.neutral, None, {"tip": home})
    lost.append(0)
    planner.step(BODY.neutral, None, {"tip": home})
    why = "fill of constraint 'cable' raised RuntimeError: {camera} lost, so that the arm is stopped"
    assert planner.stopped_because == why and [record.message for record in caplog.records] == [why]
    lost.clear()
    assert planner.resume() and planner.stopped_because is None
    planner.stop()
    assert planner.stopped_because == "stop() was called"


def test_a_task_without_a_target_may_stand_beside_n_minus_one():
    panda = ftqp.robots.load("panda")
    tasks = [ftqp.Task(), ftqp.PositionTask("panda_joint4", name="elbow")]
    planner = started(panda, tasks=tasks, n_minus_one=ftqp.NMinusOne())
    target = ftqp.Target(pose=panda.pose(panda.neutral))
    assert planner.step(panda.neutral, None, target).status is ftqp.StepStatus.OK


def test_a_weight_that_says_nothing_is_refused():
    planner, _ = planner_of(ftqp.RelativeTask(RIGHT, LEFT, level=0, name="grip"))
    with pytest.raises(ftqp.InputError, match="weight of grip is 5, but a task of level 0 is an equation"):
        planner.tasks["grip"].weight = 5.0
    planner.tasks["grip"].weight = 0.0
    planner.tasks["grip"].weight = 1.0


T = transform(rotation_x(0.4), np.array([0.1, 0.2, 0.3]))


TWIST, MORE = np.arange(6.0) + 1.0, np.arange(6.0) - 9.0


def moving():
    return ftqp.Target(pose=T, twist=TWIST, acceleration=MORE)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ftqp.Target(), "a target needs exactly one of pose and position"),
        (lambda: ftqp.Target(pose=2.0 * np.eye(4)), "pose has a rotation part that is not a rotation"),
        (lambda: ftqp.Target(pose=T, stamp=1), "needs a stamp"),
        (lambda: ftqp.Target(twist=np.zeros(6), stamp=1.0).at(T), r"write target\.twist and target\.stamp"),
        (lambda: ftqp.Targets(T[None]).at(-1), "there is no target -1; the trajectory has targets 0 to 0"),
    ],
)
def test_wrong_target_is_refused_with_one_sentence(call, sentence):
    with pytest.raises(ftqp.InputError, match=sentence):
        call()


@pytest.mark.parametrize(
    ("write", "sentence"),
    [
        (lambda target: target.at(np.eye(3)), r"pose has shape \(3, 3\), expected \(4, 4\)"),
        (lambda target: target.at("home"), "pose is not an array of numbers: 'home'"),
        (lambda target: target.at(np.eye(4), "fast"), "twist is not an array of numbers: 'fast'"),
        (lambda target: setattr(target, "pose", np.zeros((4, 3))), "pose "),
        (lambda target: setattr(target, "acceleration", "none"), "acceleration is not an array"),
    ],
)
def test_what_is_no_number_of_a_target_is_one_sentence_and_writes_nothing(write, sentence):
    target = moving()
    before = target.packed.copy()
    with pytest.raises(ftqp.InputError, match=sentence):
        write(target)
    assert np.array_equal(target.packed, before)


@pytest.mark.parametrize(
    "as_given",
    [
        lambda values: values,
        lambda values: values.tolist(),
        lambda values: values.astype(np.float32).astype(">f8"),
        lambda values: np.asfortranarray(values),
        lambda values: memoryview(values),
    ],
    ids=["array", "list", "other bytes", "other order", "buffer"],
)
def test_a_target_that_is_moved_is_what_a_new_one_would_be(as_given):
    there = transform(np.eye(3), np.array([0.25, -0.5, 2.0]))
    target = ftqp.Target(pose=np.eye(4), twist=np.ones(6), acceleration=np.ones(6))
    assert target.at(as_given(there), as_given(TWIST), as_given(MORE)) is target
    assert np.array_equal(target.packed, ftqp.Target(pose=there, twist=TWIST, acceleration=MORE).packed)
    assert np.array_equal(target.at(T).packed, ftqp.Target(pose=T).packed), "what is not given is zero"
    moved = ftqp.Target(position=[1.0, 2.0, 3.0]).at(np.array([4.0, 5.0, 6.0]), [0.1, 0.2, 0.3])
    assert np.array_equal(moved.packed, ftqp.Target(position=[4.0, 5.0, 6.0], twist=[0.1, 0.2, 0.3]).packed)


@pytest.mark.parametrize("again", [copy, deepcopy, lambda target: pickle.loads(pickle.dumps(target))])
def test_copy_of_a_target_has_a_buffer_of_its_own(again):
    first = ftqp.Target(pose=T)
    second = again(first)
    first.position[0] = 9.0
    assert second.position[0] == second.packed[3] == 0.1 and second.row == 0


def test_assigning_a_pose_writes_into_the_buffer():
    target = ftqp.Target(pose=np.eye(4))
    target.pose = T
    np.testing.assert_array_equal(target.packed[:16], T.ravel())
    with pytest.raises(AttributeError, match="not 'packed'"):
        target.packed = np.zeros(29)


def test_twist_alone_needs_a_stamp_and_a_stamp_a_twist_alone():
    target = ftqp.Target(twist=np.arange(6), stamp=3)
    np.testing.assert_array_equal(target.twist, np.arange(6))
    assert target.packed[TARGET_HAS_ROTATION] == -1.0 and target.stamp == 3.0
    for wrong in ("now", None, [1.0, 2.0]):
        with pytest.raises(ftqp.InputError):
            target.stamp = wrong
    with pytest.raises(AttributeError):
        ftqp.Target(pose=T).stamp = 1.0


def test_twist_alone_need_not_be_finite_and_is_kept_with_its_stamp():
    target = ftqp.Target(twist=np.full(6, np.nan), stamp=1)
    target.twist, target.stamp = np.arange(6), 2
    for kept in (pickle.loads(pickle.dumps(target)), copy(target), deepcopy(target)):
        assert kept.stamp == 2.0
        np.testing.assert_array_equal(kept.packed, target.packed)
    assert "stamp=2" in repr(target)
