"""Tools, loads, further tasks and things that move: the library does what Python does, bit by bit."""

import ctypes

import numpy as np
import pytest
from tests.app.deployment.in_c import MISTAKES, PANDA, Both, fault_of, numbers
from tests.going import targets_along

import ftqp
from ftqp.app.deployment.headers import arm_header
from ftqp.app.scenario.setup import load

DT, TICKS = 1e-3, 600
TOOL = np.eye(4)
TOOL[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
TOOL[:3, 3] = 0.02, -0.03, 0.11
LOAD = ftqp.Payload(mass=0.7, com=(0.01, 0.0, 0.04))
LOADED = [0.7, 0.01, 0.0, 0.04, *np.zeros(9)]


def moved(T, by):
    found = np.array(T)
    found[:3, 3] += by
    return found


def pair(built, **given):
    return Both(built, ftqp.Planner(PANDA, DT, **given), noise=1e-5)


def circle(pose, radius):
    return targets_along(ftqp.paths.Circle(pose, radius=radius, duration=1.5), TICKS, DT)


@pytest.mark.parametrize("drive", ["position", "torque"])
def test_a_tool_and_a_load_are_those_of_python(built, drive):
    both = pair(built, drive=drive)
    targets = circle(PANDA.pose(PANDA.neutral), 0.02)
    for k in range(TICKS):
        if k == 100:
            both.planner.tool(TOOL)
            assert both.arm.call("tool", numbers(TOOL)) == 0
            targets = circle(both.planner.robot.pose(both.q), 0.02)
        if k == 200:
            both.planner.carry(LOAD)
            assert both.arm.call("carry", numbers(LOADED)) == 0
        if k == 300:
            both.report(ftqp.Locked(2))
        if k == 400:
            both.planner.carry(None)
            assert both.arm.call("carry", None) == 0
        if k == 500:
            both.planner.tool(None)
            assert both.arm.call("tool", None) == 0
            targets = circle(both.planner.robot.pose(both.q), 0.02)
        step = both.step(targets.at(k if k < 100 else (k - 100 if k < 500 else k - 500)))
    assert step.position_error < 5e-3


TASKS = {
    "hand over": ftqp.PoseTask("panda_joint5", name="hand over", level=2),
    "elbow": ftqp.PositionTask("panda_joint4", name="elbow", rows="xz"),
    "looks": ftqp.AxisTask("panda_joint6", along=(0.0, 0.2, -1.0), name="looks"),
    "mass": ftqp.CentreOfMass(name="mass"),
    "posture": ftqp.PostureTask(name="posture", weight=0.3),
    "wrist": ftqp.RelativeTask("panda_joint6", to="panda_joint2", name="wrist", rows="position"),
    "first": ftqp.PositionTask("panda_joint4", name="first", rows="z", level=0),
}


@pytest.mark.parametrize("name", TASKS)
def test_a_further_task_is_that_of_python(built, name, level):
    """Its goal is where the arm begins, is moved, and counts less in the end; a joint locks meanwhile."""
    both = pair(built, level=level, task=ftqp.Task("position"), tasks=[TASKS[name]])
    task, targets = both.planner.tasks[name], circle(PANDA.pose(PANDA.neutral), 0.04)
    error = np.zeros(6)
    for k in range(TICKS):
        if k == 150:
            aimed(both, task, name)
        if k == 300:
            both.report(ftqp.Locked(1))
        if k == 450:
            task.weight = 0.0
            assert both.arm.call("weight", 0, ctypes.c_double(0.0)) == 0
        step = both.step(targets.at(k))
        if name != "posture" and k < 450:
            assert both.arm.call("task_error", 0, error.ctypes.data_as(ctypes.c_void_p)) == 0
            said = step.tasks[name].error
            np.testing.assert_array_equal(error[: len(said)], said)


def aimed(both, task, name):
    """Another goal for both."""
    if name == "posture":
        goal = PANDA.neutral + 0.1
        task.target = goal
        assert both.arm.call("aim_joints", 0, numbers(goal)) == 0
        return
    if name == "looks":
        goal = np.array([0.3, 0.1, -0.7])
    else:
        goal = moved(task.target, (0.02, -0.01, 0.03)) if task.target.shape == (4, 4) else task.target + 0.02
    task.target = goal
    packed = np.zeros(29)
    packed[:16] = np.eye(4).ravel() if goal.shape == (3,) else goal.ravel()
    if goal.shape == (3,):
        packed[[3, 7, 11]] = goal
    assert both.arm.call("aim", 0, numbers(packed)) == 0


def test_a_thing_that_moves_is_avoided_as_in_python(built):
    scene = ftqp.Scene()
    tip = PANDA.pose(PANDA.neutral)[:3, 3]
    scene.add("ball", ftqp.Sphere(radius=0.05, place=tip + np.array([0.0, 0.3, 0.0])))
    scene.add("box", ftqp.Box(size=(0.1, 0.1, 0.1), place=tip + np.array([0.0, -0.4, 0.1])))
    both = pair(built, scene=scene, detector=False)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    least = np.inf
    for k in range(TICKS):
        if k == 50:
            place, twist = (
                moved(np.eye(4), tip + np.array([0.0, 0.25, 0.0])),
                np.array([0.0, -0.4, 0.0, 0.0, 0.0, 0.0]),
            )
            scene.move("ball", place, twist)
            assert both.arm.call("move", 0, numbers(place), numbers(twist)) == 0
        if k == 450:
            place = moved(np.eye(4), tip + np.array([0.0, 0.5, 0.0]))
            scene.move("ball", place)
            assert both.arm.call("move", 0, numbers(place), None) == 0
        step = both.step(target)
        assert both.arm.call("clearance") == step.clearance
        least = min(least, step.clearance)
    assert least < 0.03, "the ball has come near"


def test_what_is_wrong_with_an_order_is_a_number_with_a_sentence_and_changes_nothing(built):
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(radius=0.05, place=(0.0, 1.0, 0.0)))
    tasks = [ftqp.PostureTask(), ftqp.PositionTask("panda_joint4", level=0, rows="z")]
    both = pair(built, scene=scene, tasks=tasks)
    arm, header = both.arm, arm_header(both.planner, "panda", b"", embedded=False)
    assert "#define FTQP_ARM_TASKS 2\n" in header and 'ftqp_arm_things[] = {"ball"};' in header
    assert [arm.call("has", what) for what in range(1, 8)] == [1, 0, 1, 1, 1, 1, 0]
    assert arm.call("has", 99) == MISTAKES["UNSUPPORTED"]
    assert (arm.call("tasks"), arm.call("things")) == (2, 1)
    unknown, shifted = np.full(29, np.nan), moved(np.eye(4), (0.0, 1.0, 0.0))
    stretched = 2.0 * np.eye(4)
    before = arm.room.copy()
    for code, arguments in (
        (-38, ("aim", 2, numbers(unknown))), (-38, ("aim", -1, numbers(unknown))), (-20, ("aim", 1, None)),
        (-40, ("aim", 1, numbers(unknown))), (-34, ("aim", 0, numbers(np.zeros(29)))),
        (-34, ("aim_joints", 1, numbers(PANDA.neutral))), (-40, ("aim_joints", 0, numbers(unknown))),
        (-20, ("aim_joints", 0, None)), (-38, ("weight", 7, ctypes.c_double(1.0))),
        (-41, ("weight", 0, ctypes.c_double(-1.0))), (-41, ("weight", 0, ctypes.c_double(np.nan))),
        (-41, ("weight", 1, ctypes.c_double(0.5))), (-39, ("move", 1, numbers(shifted), None)),
        (-39, ("move", -1, numbers(shifted), None)), (-20, ("move", 0, None, None)),
        (-40, ("move", 0, numbers(stretched), None)), (-40, ("move", 0, numbers(shifted), numbers(unknown))),
        (-40, ("tool", numbers(stretched))), (-40, ("tool", numbers(unknown))),
        (-29, ("believed", 7)), (-29, ("believed", -1)), (-42, ("brake", 2)), (-29, ("brake", 9)),
        (-20, ("task_error", 1, None)),
    ):  # fmt: skip
        assert arm.call(*arguments) == code, arguments
        assert len(arm.code.ftqp_status_name(code)) > 15
    np.testing.assert_array_equal(arm.room, before)
    assert arm.call("report", fault_of(3, 2)) == arm.call("brake", 3) == 0
    assert arm.call("brakes", None) == 1


def test_a_brake_that_is_closed_is_that_of_python(built):
    both = pair(built)
    targets = circle(PANDA.pose(PANDA.neutral), 0.04)
    for k in range(200):
        if k == 50:
            both.report(ftqp.FreeSwinging(4))
        if k == 100:
            both.planner.brake(4)
            assert both.arm.call("brake", 4) == 0
        step = both.step(targets.at(k))
        assert both.arm.call("brakes", None) == step.brakes.sum()
    assert step.brakes[4]


def test_two_arms_carry_a_bar_as_in_python(built):
    """The bundled scenario, whose second arm keeps its place on the first: a joint locks half-way."""
    setup = load("dual-panda-bar")
    both = Both(built, setup.planner, setup.q)
    targets = targets_along(setup.path, 400, setup.planner.dt)
    assert both.arm.call("tasks") == 1
    for k in range(400):
        if k == 200:
            both.report(ftqp.Locked(3))
        both.step(targets.at(k))
