"""Plans on file, and plans of one arm of a robot with branches."""

import json

import numpy as np
import pytest
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.analysis import plan
from ftqp.analysis.planning.fault_plan import load_plan, plan_of
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.model import catalog

ARM = catalog.load("planar", count=3)
PATH = Line(ARM.pose(ARM.neutral), (-0.2, 0.0, 0.0), duration=2.0)
TASK = task_path(ARM, PATH, dt=0.1, rows="position")
Q = np.tile(ARM.neutral, (TASK.N + 1, 1))


@pytest.fixture
def made():
    return plan_of(TASK, Q, coverage=0.5, stride=4, method="dp", settings={"seed": 0, "theta": [0.1, 0.2]})


@pytest.fixture
def file(made, tmp_path):
    path = tmp_path / "deep" / "plan.npz"
    made.save(path)
    return path


def test_plan_comes_back_as_it_was_written(made, file) -> None:
    for found in (
        load_plan(file),
        load_plan(file, ARM),
        load_plan(file, ARM, PATH),
        load_plan(file, ARM, TASK),
    ):
        assert np.array_equal(found.q, made.q) and np.array_equal(found.goals, made.goals)
        assert np.array_equal(found.t, made.t) and found.settings == made.settings
        for name in (
            "dt",
            "joints",
            "rows",
            "axis",
            "coverage",
            "stride",
            "method",
            "robot_digest",
            "task_digest",
        ):
            assert getattr(found, name) == getattr(made, name)
        with pytest.raises(ValueError, match="read-only"):
            found.q[0] = 0.0
    assert load_plan(file, ARM).task.digest == TASK.digest
    assert [entry.name for entry in file.parent.iterdir()] == ["plan.npz"]


def test_plan_for_another_robot_or_path_is_refused(file) -> None:
    with pytest.raises(InputError, match="the plan is for another robot"):
        load_plan(file, catalog.load("planar", count=4))
    with pytest.raises(InputError, match="the plan is for another robot"):
        load_plan(file, ARM.with_limits(q_max=2.0))
    other = Line(ARM.pose(ARM.neutral), (-0.2, 0.01, 0.0), duration=2.0)
    with pytest.raises(InputError, match=r"another path: they differ at sample \d+"):
        load_plan(file, ARM, other)
    with pytest.raises(InputError, match=r"another path: it has 21 samples of 0\.1 s and not 11 of 0\.2 s"):
        load_plan(file, ARM, task_path(ARM, PATH, dt=0.2, rows="position"))
    with pytest.raises(InputError, match="another path: it has the rows x, y and not x, y, rz"):
        load_plan(file, ARM, task_path(ARM, PATH, dt=0.1, rows=("x", "y", "rz")))


def rewritten(file, about=(), **arrays):
    """The file with some of its contents changed."""
    with np.load(file) as archive:
        content = {name: archive[name] for name in archive.files} | arrays
    text = json.loads(str(content["about"])) | dict(about)
    np.savez(file, **(content | {"about": np.array(json.dumps(text))}))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda file: file.unlink(), "does not exist"),
        (lambda file: file.write_bytes(b""), "is not a plan"),
        (lambda file: file.write_bytes(file.read_bytes()[:-200]), "is not a plan"),
        (lambda file: np.savez(file, q=Q), "is not a plan"),
        (lambda file: rewritten(file, {"format": 2}), "has format 2, this ftqp reads 1"),
    ],
)
def test_damaged_file_is_refused_in_one_sentence(file, change, sentence) -> None:
    change(file)
    with pytest.raises(InputError, match=sentence):
        load_plan(file)


def test_plan_is_for_its_path_whatever_the_last_bits_of_the_path_are(tmp_path) -> None:
    goals = TASK.goals.copy()
    goals[:, 0, 3] += (
        0.5e-9 - goals[0, 0, 3] % 1e-9 - 1e-12
    )  # just below where the ninth decimal is rounded up
    below = task_path(ARM, goals, rows="position", dt=0.1)
    goals[:, 0, 3] += 2e-12
    above = task_path(ARM, goals, rows="position", dt=0.1)
    assert below.digest != above.digest
    plan_of(below, Q, coverage=1.0, stride=4, method="dp", settings={}).save(tmp_path / "plan.npz")
    assert load_plan(tmp_path / "plan.npz", ARM, above).task_digest == below.digest


DUAL = ftqp.robots.load("dual_panda")
LEFT, RIGHT = DUAL.tips
OF = {LEFT: slice(0, 7), RIGHT: slice(7, 14)}
DT = 2e-3


def line(frame):
    return ftqp.paths.Line(DUAL.pose(DUAL.neutral, frame), (0.0, 0.05, 0.05), duration=1.0)


@pytest.fixture(scope="module")
def planned():
    return plan(DUAL, line(LEFT), DUAL.neutral, "constant", dt=0.1)


@pytest.mark.parametrize("frame", [LEFT, RIGHT])
def test_a_plan_is_that_of_the_arm_to_the_frame(frame):
    found = plan(DUAL, line(frame), DUAL.neutral, "constant", dt=0.25, frame=frame)
    arm = DUAL.arm_to(frame)
    alone = plan(arm, line(frame), arm.neutral, "constant", dt=0.25)
    assert found.joints == arm.joints and np.array_equal(found.q, alone.q)
    goals = line(frame).sample(found.t).pose
    for row, goal in zip(found.q, goals, strict=True):
        whole = DUAL.neutral.copy()
        whole[OF[frame]] = row
        assert DUAL.pose(whole, frame) == pytest.approx(goal, abs=1e-8)


def followed(lock=None, lead=None):
    planner = ftqp.Planner(DUAL, DT, plan=lead, scheme="rmp", tasks=[ftqp.Task()])
    fails = {250: lambda planner: planner.report(ftqp.Locked(lock))} if lock else None
    *_, step = closed_loop(planner, targets_along(line(LEFT), 500, DT).at, 500, events=fails)
    return planner, step.q.copy(), step


def test_a_plan_of_one_arm_leads_the_whole_robot(planned):
    _, led, step = followed(lead=planned)
    assert step.status is ftqp.StepStatus.OK and step.position_error < 1e-4
    free = followed()[1]
    away = [float(np.abs(q[OF[LEFT]] - planned.q[-1]).max()) for q in (led, free)]
    assert away[0] < 0.5 * away[1], "its postures lead the null space"
    assert np.abs(led[OF[RIGHT]] - DUAL.neutral[OF[RIGHT]]).max() < 1e-6


@pytest.mark.parametrize("lock", ["left_joint3", "right_joint2"])
def test_what_is_left_after_a_lock_is_said_of_all_joints(planned, lock):
    planner, q, step = followed(lock, planned)
    assert step.status is ftqp.StepStatus.OK
    options = planner.options()
    assert options and all(one.q.shape[1] == DUAL.nv for one in options)
    assert all((one.q[:, OF[RIGHT]] == one.q[0, OF[RIGHT]]).all() for one in options)
    assert options[0].q[0] == pytest.approx(q, abs=1e-6)


@pytest.mark.parametrize("frame", [LEFT, RIGHT])
def test_postures_move_the_arm_to_the_frame_and_leave_the_others(frame):
    near = DUAL.neutral + 0.05
    goal = DUAL.pose(near, frame)
    goal[:3, 3] += (0.05, 0.05, 0.05)
    fault = ftqp.Locked(f"{frame.split('_', maxsplit=1)[0]}_joint3")
    found = ftqp.postures(
        DUAL, goal, near=near, faults=[fault, ftqp.Locked(13 if frame == LEFT else 0)], frame=frame
    )
    assert len(found) > 0 and found.joints == DUAL.joints
    others = np.setdiff1d(np.arange(14), np.arange(14)[OF[frame]])
    for one in found:
        assert DUAL.pose(one.q, frame) == pytest.approx(goal, abs=1e-9)
        assert (one.q[others] == near[others]).all()
        assert one.q[DUAL.joint(fault.joint)] == near[DUAL.joint(fault.joint)]
