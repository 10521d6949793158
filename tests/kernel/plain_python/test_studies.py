"""Studies of small arms: errors and their rates, self-motions, and QPs that no robot made."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import linprog
from studies import at, starts, study_of, unit_arm

import ftqp
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.enums import CurveEnd
from ftqp.model import catalog


@pytest.mark.parametrize("turn", [0.7, 1e-4])
def test_rates_of_an_error_are_its_differences_however_far_the_tip_is_turned(turn):
    robot = catalog.load("iiwa14")
    study = study_of(robot, range(6))
    goal, q = robot.pose(robot.neutral + 0.1), robot.neutral + 0.1
    goal[:3, :3] = pin.exp3(turn * np.array([0.6, 0.0, 0.8])) @ goal[:3, :3]
    study.aim(goal)

    def error(q):
        pose = robot.pose(q)
        left = pin.log3(goal[:3, :3] @ pose[:3, :3].T)
        return np.concatenate([goal[:3, 3] - pose[:3, 3], robot.length * left])

    e, _, D, _ = study.values(q[None])
    assert e[0] == pytest.approx(error(q), abs=1e-12)
    assert np.linalg.norm(e[0][3:]) == pytest.approx(turn * robot.length)
    for l in range(7):
        d = 1e-6 * np.eye(7)[l]
        assert D[0, :, l] == pytest.approx((error(q - d) - error(q + d)) / 2e-6, abs=1e-8)


def test_the_tool_axis_is_turned_the_shortest_way_and_about_itself_as_it_likes():
    robot = catalog.load("iiwa14")
    q = robot.neutral + 0.1
    pose = robot.pose(q)
    away = pin.exp3(np.array([0.3, -0.2, 0.0]))
    goal = pose.copy()
    goal[:3, :3] = pose[:3, :3] @ away @ pin.exp3(np.array([0.0, 0.0, 1.3]))
    wide, no = np.full(7, np.inf), np.zeros(7, bool)
    study = StudySession(
        robot.chain.constants(), range(5), robot.length, q_min=-wide, q_max=wide, wraps=no, axis=True
    )
    study.aim(goal)
    e, A, _, _ = study.values(q[None])
    angle = np.arccos(np.clip(goal[:3, 2] @ pose[:3, 2], -1.0, 1.0))
    assert angle == pytest.approx(np.hypot(0.3, 0.2))
    assert np.linalg.norm(e[0][3:]) == pytest.approx(robot.length * angle)
    assert np.linalg.matrix_rank(A[0]) == 5
    ends, left, _ = study.solutions(q[None])
    assert left[0] < 1e-10 and robot.pose(ends[0])[:3, 2] == pytest.approx(goal[:3, 2], abs=1e-9)
    along = robot.length * goal[:3, :2].T @ robot.jacobian(q)[3:]
    assert A[0][3:] == pytest.approx(along), "J_w along the goal's x and y axes"


def test_a_self_motion_with_a_joint_held_is_that_of_the_arm_without_it():
    """Four links, the last joint held straight, and three links whose last is twice as long."""
    long = catalog.load("planar", lengths=(1.0, 1.0, 2.0), continuous=True)
    three, four = study_of(long, (0, 1), 0.15), study_of(unit_arm(4), (0, 1), 0.15)
    q = np.array([0.4, 0.9, -1.1])
    goal = long.pose(q)
    curves = []
    for study, begin in ((three, q), (four, np.append(q, 0.0))):
        study.aim(goal)
        study.hold([3] if study.nv == 4 else [])
        curves.append(study.curve(begin))
    one, other = curves
    assert one.end is other.end is CurveEnd.CLOSED
    assert one.length == pytest.approx(other.length, rel=1e-3) and one.length > 5.0
    assert (
        not other.q[:, 3].any() and max(np.abs(long.pose(x)[:2, 3] - goal[:2, 3]).max() for x in one.q) < 1e-9
    )
    free = study_of(unit_arm(4), (0, 1), 0.15)
    free.aim(goal)
    assert np.ptp(free.curve(np.append(q, 0.0), most=30).q[:, 3]) > 0.05, "not held it moves"


def test_a_goal_out_of_reach_has_no_self_motion_and_what_is_found_is_near_the_edge():
    study = study_of(unit_arm(), (0, 1))
    study.aim(at(2.5, 2.5))
    curve = study.curve(np.array([0.4, 0.9, -1.1]))
    assert curve.end is CurveEnd.CUT and len(curve.q) == 0 and curve.length == 0.0
    _, left, _ = study.solutions(starts(3, 4))
    beyond = np.hypot(2.5, 2.5) - 3.0
    assert (left > beyond - 1e-12).all() and (left < beyond + 0.2).all()


def test_a_curve_that_meets_a_limit_runs_from_end_to_end():
    robot = catalog.load("planar", lengths=(1, 1, 1))
    study = study_of(robot, (0, 1), 0.2, limited=True)
    study.aim(at(1.0, 0.3))
    q, left, _ = study.solutions(robot.neutral[None], bounded=True)
    assert left[0] < 1e-10
    curve = study.curve(q[0])
    low, high = robot.limits.q_min, robot.limits.q_max
    assert curve.end is CurveEnd.CUT and (curve.q >= low - 1e-12).all() and (curve.q <= high + 1e-12).all()
    for end in (curve.q[0], curve.q[-1]):
        assert min(np.abs(end - low).min(), np.abs(high - end).min()) < 1e-9


def solved(**given):
    return ftqp.qp.solve(ftqp.QP(**given), backend="active_set")


def test_a_linear_programme_is_solved_as_by_linprog():
    rng = np.random.default_rng(3)
    for _ in range(6):
        g, C = rng.normal(size=4), rng.normal(size=(3, 4))
        u = rng.uniform(0.5, 1.5, 3)
        box = {"lb": -np.ones(4), "ub": np.ones(4)}
        solution = solved(H=np.zeros((4, 4)), g=g, C=C, l=np.full(3, -np.inf), u=u, **box)
        best = linprog(g, C, u, bounds=[(-1.0, 1.0)] * 4)
        assert solution.status.name == "SOLVED" and g @ solution.x == pytest.approx(best.fun, abs=1e-7)


def test_a_semidefinite_programme_is_solved_and_one_without_end_is_said_to_have_failed():
    H = np.diag([1.0, 0.0, 0.0])
    A, b = np.array([[1.0, 1.0, 0.0]]), np.array([2.0])
    solution = solved(H=H, g=np.array([-1.0, 0.0, 0.0]), A=A, b=b, lb=-np.ones(3), ub=np.full(3, 5.0))
    assert solution.status.name == "SOLVED" and solution.x[:2] == pytest.approx([1.0, 1.0], abs=1e-7)
    endless = solved(H=H, g=np.array([0.0, -1.0, 0.0]))
    assert endless.status.name in ("FAILED", "MAX_ITERATIONS")
    none = solved(H=np.zeros((3, 3)), g=np.zeros(3), A=A, b=np.array([9.0]), lb=-np.ones(3), ub=np.ones(3))
    assert none.status.name == "INFEASIBLE"


@pytest.mark.parametrize("backend", ["active_set", "dtrnn"])
def test_qps_without_a_robot_have_the_solution_of_their_conditions(backend):
    rng = np.random.default_rng(4)
    for rows in (0, 2):
        F = rng.normal(size=(5, 5))
        H, g = F @ F.T + np.eye(5), rng.normal(size=5)
        A, C = rng.normal(size=(2, 5)), rng.normal(size=(rows, 5))
        more = {"C": C, "l": -0.2 * np.ones(rows), "u": 0.2 * np.ones(rows)} if rows else {}
        problem = ftqp.QP(H, g, A=A, b=0.1 * rng.normal(size=2), lb=-np.ones(5), ub=np.ones(5), **more)
        found = ftqp.qp.solve(problem, backend=backend)
        assert found.status.name == "SOLVED"
        slope = H @ found.x + g + A.T @ found.y + found.z_box + (C.T @ found.z if rows else 0.0)
        assert np.abs(slope).max() < 1e-4 and pytest.approx(problem.b, abs=1e-6) == A @ found.x
        assert np.abs(found.x).max() < 1.0 + 1e-6 and (not rows or np.abs(C @ found.x).max() < 0.2 + 1e-6)
