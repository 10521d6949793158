"""Tasks and constraints that make no sense: one sentence when they, or a planner of them, are made."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips
ELBOW, TIP, INF = "panda_joint4", PANDA.tip, np.inf
CUBE = ((0, 0, 0), (1, 1, 1))
CONE = {"along": (0, 0, 1), "within": 0.3}


def raises(state, A, b, c=None):
    raise ZeroDivisionError("by nothing")


def writes_another_shape(state, A, b, c=None):
    A[:] = np.zeros((3, 6))


def writes_nan(state, J, b):
    b[:] = np.nan


def crosses(state, C, l, u):
    l[0], u[0] = 1.0, 0.0


def returns(state, J, b):
    return np.zeros((1, 7)), np.zeros(1)


TASKS = [
    (lambda: ftqp.PoseTask(None), "frame of PoseTask is None, expected the name of a frame"),
    (lambda: ftqp.RelativeTask("a", 3), "to of RelativeTask is 3, expected the name of a frame"),
    *((lambda level=level: ftqp.PoseTask("a", level=level), f"level of a is {level!r}, expected 0, 1, 2 or 3")
      for level in (4, -1, True)),
    (lambda: ftqp.PoseTask("a", level=np.arange(2)), "level of a is array"),
    (lambda: ftqp.PostureTask(level=0), "PostureTask draws joints and cannot be on level 0"),
    (lambda: ftqp.PostureTask(level=1), "PostureTask draws joints and cannot be on level 1"),
    (lambda: ftqp.PoseTask("a", required=True), "cannot be required: level 3 promises nothing"),
    (lambda: ftqp.PoseTask("a", level=0, required="yes"), "required of a is 'yes'"),
    (lambda: ftqp.LeastSquares(1, print, level=1, required=True), "its error is not known"),
    (lambda: ftqp.PoseTask("a", weight=-1.0), "weight of a is -1, expected >= 0"),
    (lambda: ftqp.PoseTask("a", weight=np.nan), "weight of a is nan, expected a finite number"),
    (lambda: ftqp.PoseTask("a", rows="pos"), r"rows of a is 'pos' \(did you mean 'pose'"),
    (lambda: ftqp.PoseTask("a", rows=("x", "x")), "rows of a is .* expected names among x, y, z"),
    (lambda: ftqp.RelativeTask("a", "b", rows=("x",)), "rows of a to b is .* expected one of pose, position"),
    (lambda: ftqp.PositionTask("a", rows="xw"), "rows of a is 'xw'"),
    (lambda: ftqp.PoseTask("a", target=np.eye(3)), r"target of a has shape \(3, 3\)"),
    (lambda: ftqp.PoseTask("a", target=2.0 * np.eye(4)), "target of a has a rotation part that is not"),
    (lambda: ftqp.PositionTask("a", target=[1, 2]), "target has shape"),
    (lambda: ftqp.RelativeTask("a", "a"), "a to a is relative to itself; expected another frame"),
    (lambda: ftqp.AxisTask("a", towards="a"), "a axis points at its own frame"),
    (lambda: ftqp.AxisTask("a"), "expected one of them: a direction, or a place to point at"),
    (lambda: ftqp.AxisTask("a", along=[0, 0, 0]), "expected a direction"),
    (lambda: ftqp.JointTask({}), "expected places by joint"),
    (lambda: ftqp.LeastSquares(7, print), "rows of LeastSquares is 7, expected 1 to 6"),
    (lambda: ftqp.LeastSquares(1, 3), "expected a function"),
    (lambda: ftqp.PostureTask(name=""), "name is ''"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "sentence"), TASKS)
def test_wrong_tasks_are_one_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


KEEPS = [
    ({}, "has neither above, inside nor along, expected one of them"),
    ({"above": (0, 0)}, "above has shape"),
    ({"above": (0, 0, np.nan)}, "above"),
    ({"above": (0, 0, 0), "normal": (0, 0, 0)}, "normal is .*expected a direction"),
    ({"above": (0, 0, 0), "braking": 0.0}, "braking is 0"),
    ({"above": (0, 0, 0), "braking": -1.0}, "braking is -1"),
    ({"above": (0, 0, 0), "name": ""}, "name is ''"),
    ({"above": (0, 0, 0), "inside": CUBE}, "has above and inside, expected one of them"),
    ({"above": (0, 0, 0), "within": 0.3}, "has within beside above, expected it only with along"),
    ({"inside": CUBE, "normal": (0, 0, 1)}, "has normal beside inside, expected it only with above"),
    ({**CONE, "point": (0, 0, 1)}, "has point beside along"),
    ({**CONE, "within": None}, "has along without within, expected how far"),
    ({**CONE, "within": 4.0}, "within is 4 rad, expected less than pi"),
    ({**CONE, "within": 0.0}, "within is 0"),
    ({**CONE, "along": (0, 0, 0)}, "along is .*expected a direction"),
    ({**CONE, "axis": (0, 0, 0)}, "axis is .*expected a direction"),
    ({"inside": ((0, 0, 0), (1, 1))}, "inside"),
    ({"inside": (0, 1)}, r"inside has shape \(2,\), expected \(2, 3\)"),
    ({"inside": ((0, 0, np.nan), (1, 1, 1))}, "inside contains NaN"),
    ({"inside": ((0, 0.5, 0), (1, 0.5, 1))}, "inside goes from 0.5 to 0.5 along y"),
    ({"inside": ((-INF,) * 3, (INF,) * 3)}, "expected a finite side at least"),
]


@pytest.mark.parametrize(("given", "sentence"), KEEPS)
def test_what_does_not_belong_together_in_a_keep_is_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Keep(TIP, **given)


def floor(**more):
    return ftqp.Keep(TIP, above=[0, 0, 0], **more)


LISTS = [
    ({"tasks": ftqp.Task()}, "tasks is Task, expected a list of tasks"),
    ({"tasks": ["elbow"]}, "tasks has str, expected ftqp.Task"),
    ({"tasks": [ftqp.Task(), ftqp.Task()]}, "tasks has two of the tip"),
    ({"tasks": [ftqp.Task(), ftqp.PoseTask(TIP)]}, "tasks has two of the tip"),
    ({"tasks": [ftqp.PoseTask(TIP, weight=0.5)]}, "weight of panda_hand_tcp is 0.5, but it is the"),
    ({"tasks": [ftqp.PostureTask(name=str(k)) for k in range(9)]}, "tasks has 9 beside that of the tip"),
    ({"tasks": [ftqp.PostureTask(), ftqp.PostureTask()]}, "two tasks are called 'PostureTask'; give one"),
    ({"tasks": [ftqp.PostureTask(name="tip")]}, "two tasks are called 'tip'"),
    ({"tasks": [ftqp.PositionTask("panda_joint44")]}, r"frame is 'panda_joint44' \(did you mean 'panda_jo"),
    ({"tasks": [ftqp.PoseTask("universe")]}, "frame 'universe' of universe does not move with any joint"),
    ({"tasks": [ftqp.PositionTask(ELBOW, kv=3000.0)]}, "kv of panda_joint4 is 3000, but with dt = 0.001 s"),
    ({"tasks": [ftqp.PostureTask(np.zeros(6))]}, r"target of PostureTask has shape \(6,\)"),
    ({"tasks": [ftqp.JointTask({"panda_joint9": 0.0})]}, "panda_joint9"),
    ({"tasks": [ftqp.JointTask({ELBOW: 9.0})]}, "joint4 of JointTask is 9, expected a place within its limi"),
    ({"tasks": [ftqp.LeastSquares(1, raises)]}, r"raised ZeroDivisionError: .*into J \(1, 7\) and b \(1,\)"),
    ({"tasks": [ftqp.LeastSquares(1, writes_another_shape)]}, "raised ValueError: could not broadcast"),
    ({"tasks": [ftqp.LeastSquares(1, writes_nan)]}, "gave numbers that are not finite"),
    ({"tasks": [ftqp.LeastSquares(1, returns)]}, "fill of LeastSquares returned tuple"),
    ({"tasks": [ftqp.LeastSquares(1, lambda state: None)]}, "fill of LeastSquares raised TypeError"),
    ({"constraints": floor()}, "constraints is Keep, expected a list"),
    ({"constraints": ["table"]}, "constraints has str, expected ftqp.Keep"),
    ({"constraints": [ftqp.Task()]}, "constraints has Task, expected ftqp.Keep, ftqp.Rows or ftqp.TorqueL"),
    ({"constraints": [floor(name=str(k)) for k in range(9)]}, "has 9 sides of planes"),
    ({"constraints": [ftqp.Keep(at, inside=CUBE) for at in (TIP, ELBOW)]}, "has 12 sides of planes, boxes"),
    ({"constraints": [floor(), floor()]}, "two things are called 'panda_hand_tcp'"),
    ({"constraints": [ftqp.Keep("panda_hand", above=[0, 0, 0])]}, "frame is 'panda_hand'"),
    ({"constraints": [ftqp.Keep("universe", above=[0, 0, 0])]}, "does not move with any joint"),
    ({"constraints": [ftqp.Rows(5, raises, name="a"), ftqp.Rows(4, raises)]}, "9 rows of your own, expected"),
    ({"constraints": [ftqp.Rows(1, raises), ftqp.Rows(1, raises)]}, "two things are called 'rows'"),
    ({"constraints": [ftqp.Rows(2, crosses)]}, r"fill of rows gave l > u, or NaN at the neutral posture .*"),
    ({"constraints": [ftqp.Rows(1, writes_another_shape)]}, "fill of rows raised ValueError"),
]


@pytest.mark.parametrize(("given", "sentence"), LISTS)
def test_wrong_lists_of_a_planner_are_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        ftqp.Planner(PANDA, **given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("tasks", "sentence"), [
    ([ftqp.PoseTask(RIGHT, level=0), ftqp.PositionTask(RIGHT, level=0, name="again")],
     "right_hand and again are both on level 0 and ask the same of frame 'right_hand'"),
    ([ftqp.RelativeTask(RIGHT, LEFT, level=0), ftqp.RelativeTask(LEFT, RIGHT, level=0)],
     "are both on level 0 and ask the same of frame 'left_hand'"),
    ([ftqp.PoseTask(RIGHT, level=0), ftqp.PoseTask("right_joint4", level=0), ftqp.CentreOfMass(level=0)],
     "tasks on level 0 have 15 rows, expected at most 12"),
    ([ftqp.RelativeTask(RIGHT, "nowhere")], "frame is 'nowhere'"),
])  # fmt: skip
def test_wrong_lists_of_an_arm_with_two_hands_are_one_sentence(tasks, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(BODY, tasks=tasks)
