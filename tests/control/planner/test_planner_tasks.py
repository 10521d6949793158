"""What each task mode gives up, and what it says about it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import InputError

DT = 2e-3
OK, RELAXED, SCALED = ftqp.StepStatus.OK, ftqp.StepStatus.RELAXED, ftqp.StepStatus.SCALED
MODES = ("hard", "slack", "scaled", "lexicographic")


def started(robot, q=None, v=None, **options):
    planner = ftqp.Planner(robot, DT, emergency=None, **options)
    planner.reset(robot.neutral if q is None else q, v)
    return planner


def scale_of(robot):
    """Rows of a pose task: metres as they are, radians times the characteristic length."""
    return np.array([1.0, 1.0, 1.0, *[robot.length] * 3])


def box(planner, step, q, target):
    """Rows, right side and intervals of the QP of a first step at rest, the tip on its target."""
    arm, level = arm_at(planner.robot, q), planner.level
    _, kv = planner.task.gains(level)
    asked = target.twist if level == "velocity" else target.acceleration + kv * target.twist
    names = planner.robot.default_rows
    rows = [("x", "y", "z", "rx", "ry", "rz").index(name) for name in names]
    scale = scale_of(planner.robot)[rows]
    return scale[:, None] * arm.J[rows], scale * asked[rows], step.lower.copy(), step.upper.copy()


def decision(planner, step):
    return step.a if planner.level == "acceleration" else step.v


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_follows_a_feasible_task_with_the_same_command(panda, home, level, mode):
    target = ftqp.Target(pose=home, twist=[0.002, 0.0, 0.0, 0.0, 0.0, 0.002])
    planner = started(panda, level=level, task=ftqp.Task(mode=mode))
    step = planner.step(panda.neutral, np.zeros(7), target)
    reference = started(panda, level=level).step(panda.neutral, np.zeros(7), target)
    assert step.status is OK and step.certificate is None and step.scale == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(step.a, reference.a, rtol=2e-3, atol=2e-3 * np.abs(reference.a).max())


@pytest.mark.parametrize("mode", ["hard", "slack", "lexicographic"])
def test_infeasible_task_is_relaxed_with_a_certificate_of_directions_and_joints(panda, home, level, mode):
    target = ftqp.Target(pose=home, twist=[0.0, 0.0, 9.0, 0.0, 0.0, 0.0], acceleration=[0, 0, 900.0, 0, 0, 0])
    planner = started(panda, level=level, task=ftqp.Task(mode=mode))
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert step.status is RELAXED
    certificate = step.certificate
    assert certificate.unreached[0].direction == "z" and certificate.unreached[0].amount < 0.0
    assert certificate.obstacles and {o.joint for o in certificate.obstacles} <= set(panda.joints)
    assert all(o.limit.split()[0] in ("upper", "lower") for o in certificate.obstacles)
    assert "the task misses z by -" in str(certificate) and "panda_joint" in str(certificate)
    A, b, lb, ub = box(planner, step, panda.neutral, target)
    x = decision(planner, step)
    for obstacle in certificate.obstacles:
        if "torque" not in obstacle.limit:
            i = panda.joint(obstacle.joint)
            assert x[i] == pytest.approx(ub[i] if obstacle.limit.startswith("upper") else lb[i], abs=1e-7)
    missing = (A @ x - b) / scale_of(panda)
    for u in certificate.unreached:
        assert u.amount == pytest.approx(
            missing[("x", "y", "z", "rx", "ry", "rz").index(u.direction)], rel=1e-9
        )


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "daqp", "proxqp", "osqp"])
def test_hard_task_that_no_command_keeps_is_relaxed_as_the_page_of_choices_says(panda, home, level, backend):
    target = ftqp.Target(pose=home, twist=[0.0, 0.0, 9.0, 0.0, 0.0, 0.0], acceleration=[0, 0, 900.0, 0, 0, 0])
    planner = started(panda, level=level, task=ftqp.Task(mode="hard"), backend=backend)
    step = planner.step(panda.neutral, np.zeros(7), target)
    page = (Path(__file__).parents[3] / "docs" / "choosing.md").read_text(encoding="utf-8")
    (row,) = (line for line in page.splitlines() if "| `hard` |" in line)
    assert f"`{step.status.name}`" in row and f"`{step.qp.status.name}`" in row


def test_certificate_of_a_locked_arm_names_the_locked_joints(panda, home):
    planner = started(panda)
    for joint in range(7):
        planner.report(ftqp.Locked(joint))
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home, twist=[0.1, 0, 0, 0, 0, 0]))
    certificate = step.certificate
    assert {o.limit for o in certificate.obstacles} == {"locked"}
    assert [u.direction for u in certificate.unreached] == ["x"]
    assert step.limits_active == ()


def test_scaled_mode_keeps_the_direction_of_the_task_and_slows_it_down(panda, home, level):
    task = ftqp.Task(rows="position", mode="scaled")
    planner = started(panda, level=level, task=task, torque_limits=False)
    q, v = panda.neutral.copy(), np.zeros(7)
    direction = np.array([0.0, 0.6, 0.8])
    target = ftqp.Target(pose=home, twist=[*(9.0 * direction), 0, 0, 0])
    for _ in range(20):  # away from rest, where the tip has a direction already
        step = planner.step(q, v, target)
        assert step.status is SCALED and 0.0 < step.scale < 1.0
        at, q, v = q, step.q.copy(), step.v.copy()
        target.position[:] = panda.pose(q)[:3, 3]
        J = arm_at(panda, at).J[:3]
        velocity = J @ v
        assert velocity @ direction > 0.0
        assert np.linalg.norm(np.cross(velocity, direction)) < 2e-3 * np.linalg.norm(velocity) + 1e-6


@pytest.mark.parametrize("seed", range(10))
def test_residual_of_the_lexicographic_mode_is_the_least_possible(panda, level, seed):
    generator = np.random.default_rng(seed)
    q = panda.neutral + generator.uniform(-0.3, 0.3, 7)
    target = ftqp.Target(
        pose=panda.pose(q),
        twist=generator.normal(size=6) * 3.0,
        acceleration=generator.normal(size=6) * 100.0,
    )
    planner = started(panda, q, level=level, task=ftqp.Task(mode="lexicographic"), torque_limits=False)
    if seed % 2:
        planner.report(ftqp.Locked(int(generator.integers(7))))
    step = planner.step(q, np.zeros(7), target)
    A, b, lb, ub = box(planner, step, q, target)
    free = lb < ub
    best = lsq_linear(A[:, free], b - A[:, ~free] @ lb[~free], (lb[free], ub[free]), tol=1e-14)
    residual = np.linalg.norm(A @ decision(planner, step) - b)
    assert residual <= np.sqrt(2.0 * best.cost) * (1.0 + 1e-6) + 1e-6
    assert residual > 1e-2 and step.status is RELAXED


def test_lexicographic_mode_minimises_the_objective_among_the_least_residuals(planar6):
    """A second solver: least |x|^2 subject to A x = A x_best and the box."""
    q = planar6.neutral
    target = ftqp.Target(position=planar6.pose(q)[:3, 3], twist=[0.6, 0.0, 0.0])
    planner = started(planar6, level="velocity", task=ftqp.Task(mode="lexicographic"), torque_limits=False)
    step = planner.step(q, np.zeros(6), target)
    A, b, lb, ub = box(planner, step, q, target)
    best = lsq_linear(A, b, (lb, ub), tol=1e-14)
    problem = ftqp.QP(np.eye(6), np.zeros(6), A=A, b=A @ best.x, lb=lb, ub=ub)
    expected = ftqp.qp.solve(problem, backend="daqp")
    np.testing.assert_allclose(A @ step.v, A @ best.x, atol=1e-7)
    assert step.v @ step.v <= expected.x @ expected.x + 1e-6


@pytest.mark.parametrize("rows", [("x",), ("z", "rz"), "position", "position_axis", "pose"])
def test_only_the_rows_of_the_task_are_followed_and_counted(panda, home, rows, level):
    planner = started(panda, level=level, task=ftqp.Task(rows=rows))
    target = ftqp.Target(pose=home)
    target.position[1] += 0.01
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert step.slack.shape == ({"position": 3, "position_axis": 5, "pose": 6}.get(rows) or len(rows),)
    follows_y = rows in ("position", "position_axis", "pose")
    assert step.position_error == pytest.approx(0.01 if follows_y else 0.0, abs=1e-12)
    assert bool(np.abs(step.a).max() > 1e-3) is follows_y


PANDA = ftqp.robots.load("panda")
BODY = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BODY.tips
ELBOW, TIP, INF = "panda_joint4", PANDA.tip, np.inf
CUBE = ((0, 0, 0), (1, 1, 1))
CONE = {"along": (0, 0, 1), "within": 0.3}


def raises(state, A, b, c=None):
    raise ZeroDivisionError("by nothing")


def writes_nan(state, J, b):
    b[:] = np.nan


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
    (lambda: ftqp.PoseTask("a", weight=np.nan), "weight of a is nan, expected a finite number"),
    (lambda: ftqp.PoseTask("a", rows="pos"), r"rows of a is 'pos' \(did you mean 'pose'"),
    (lambda: ftqp.PoseTask("a", rows=("x", "x")), "rows of a is .* expected names among x, y, z"),
    (lambda: ftqp.PositionTask("a", rows="xw"), "rows of a is 'xw'"),
    (lambda: ftqp.PoseTask("a", target=np.eye(3)), r"target of a has shape \(3, 3\)"),
    (lambda: ftqp.PoseTask("a", target=2.0 * np.eye(4)), "target of a has a rotation part that is not"),
    (lambda: ftqp.RelativeTask("a", "a"), "a to a is relative to itself; expected another frame"),
    (lambda: ftqp.AxisTask("a", towards="a"), "a axis points at its own frame"),
    (lambda: ftqp.AxisTask("a", along=[0, 0, 0]), "expected a direction"),
    (lambda: ftqp.JointTask({}), "expected places by joint"),
    (lambda: ftqp.LeastSquares(7, print), "rows of LeastSquares is 7, expected a whole number from 1 to 6"),
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
    ({"above": (0, 0, 0), "name": ""}, "name is ''"),
    ({"above": (0, 0, 0), "within": 0.3}, "has within together with above, expected it only with along"),
    ({"inside": CUBE, "normal": (0, 0, 1)}, "has normal together with inside, expected it only with above"),
    ({**CONE, "point": (0, 0, 1)}, "has point together with along"),
    ({**CONE, "within": None}, "has along without within, expected how far"),
    ({**CONE, "within": 4.0}, "within is 4 rad, expected less than pi"),
    ({**CONE, "along": (0, 0, 0)}, "along is .*expected a direction"),
    ({**CONE, "axis": (0, 0, 0)}, "axis is .*expected a direction"),
    ({"inside": ((0, 0, 0), (1, 1))}, "inside"),
    ({"inside": ((0, 0.5, 0), (1, 0.5, 1))}, "inside goes from 0.5 to 0.5 along y"),
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
    ({"tasks": [ftqp.Task(), ftqp.Task()]}, "tasks has two of the end effector"),
    ({"tasks": [ftqp.Task(), ftqp.PoseTask(TIP)]}, "tasks has two of the end effector"),
    ({"tasks": [ftqp.PoseTask(TIP, weight=0.5)]}, "weight of panda_hand_tcp is 0.5, but it is the"),
    (
        {"tasks": [ftqp.PostureTask(name=str(k)) for k in range(9)]},
        "tasks has 9 next to that of the end effector",
    ),
    ({"tasks": [ftqp.PostureTask(), ftqp.PostureTask()]}, "two tasks are called 'PostureTask'; give one"),
    ({"tasks": [ftqp.PostureTask(name="tip")]}, "two tasks are called 'tip'"),
    ({"tasks": [ftqp.PositionTask("panda_joint44")]}, r"frame is 'panda_joint44' \(did you mean 'panda_jo"),
    ({"tasks": [ftqp.PoseTask("universe")]}, "frame 'universe' of universe does not move with any joint"),
    ({"tasks": [ftqp.PositionTask(ELBOW, kv=3000.0)]}, "kv of panda_joint4 is 3000, but with dt = 0.001 s"),
    ({"tasks": [ftqp.PostureTask(np.zeros(6))]}, r"target of PostureTask has shape \(6,\)"),
    ({"tasks": [ftqp.JointTask({"panda_joint9": 0.0})]}, "panda_joint9"),
    (
        {"tasks": [ftqp.JointTask({ELBOW: 9.0})]},
        "joint4 of JointTask is 9, expected a place .* limits.*degrees",
    ),
    ({"tasks": [ftqp.LeastSquares(1, raises)]}, r"raised ZeroDivisionError: .*into J \(1, 7\) and b \(1,\)"),
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
