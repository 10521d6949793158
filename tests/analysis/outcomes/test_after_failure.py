"""Motions of arms in space after failures that nobody is told of."""

import re
import threading

import numpy as np
import pytest

import ftqp
from ftqp.analysis import outcome, point_to_point
from ftqp.core.errors import InputError


@pytest.fixture(scope="module")
def goal(panda):
    return panda.pose(panda.neutral + 0.3 * np.array([1, -1, 0.5, 0.3, 0.2, 0.5, 1]))


@pytest.mark.parametrize("joint", [0, 1, 3])
def test_pose_ends_where_the_motion_in_real_time_ends(panda, goal, joint):
    found = outcome(panda, goal, panda.neutral, joint, rows="pose")
    assert found.kind == ("correct" if joint == 0 else "erroneous")
    late = point_to_point(
        panda, goal, panda.neutral, duration=8.0 / found.rate, locked=joint, rows="pose", samples=1
    )
    assert np.abs(late.q[-1] - found.q).max() < 2e-3 and found.q[joint] == panda.neutral[joint]


def test_last_approach_has_the_rate_that_is_stated(panda, goal):
    found = outcome(panda, goal, panda.neutral, "panda_joint3", rows="pose", gain=2.0)
    late = point_to_point(
        panda, goal, panda.neutral, duration=60.0, locked="panda_joint3", rows="pose", gain=2.0, samples=60
    )
    assert found.kind == "correct"
    assert np.log(late.errors[-11] / late.errors[-1]) / 10.0 == pytest.approx(found.rate, rel=1e-3)


def test_redundant_arm_ends_where_it_really_ends_among_many_rests(panda, goal):
    found = outcome(panda, goal[:3, 3], panda.neutral, 1)
    late = point_to_point(panda, goal[:3, 3], panda.neutral, duration=60.0, locked=1, samples=1)
    assert found.kind == "correct" and np.abs(late.q[-1] - found.q).max() < 1e-5


def test_a_qp_of_another_solver_gives_the_same_motion_of_a_pose(panda, goal):
    W = np.linspace(1.0, 3.0, 7)
    options = {"duration": 1.0, "locked": 4, "rows": "pose", "v_max": 0.3, "samples": 5}
    law = point_to_point(panda, goal, panda.neutral, W=W, **options)

    def rates(A, wanted):
        return ftqp.qp.solve(ftqp.QP(np.diag(W), np.zeros(7), A=A, b=wanted)).x

    qp = point_to_point(panda, goal, panda.neutral, controller=rates, **options)
    assert np.abs(law.q - qp.q).max() < 1e-8


def test_failure_on_the_way_begins_on_the_line_of_the_healthy_arm(panda, goal):
    half = outcome(panda, goal[:3, 3], panda.neutral, 1, at=0.5)
    whole = outcome(panda, goal[:3, 3], panda.neutral, 1, at=1.0)
    begin, end = panda.pose(panda.neutral)[:3, 3], goal[:3, 3]
    assert panda.pose(half.path[0])[:3, 3] == pytest.approx(0.5 * (begin + end), abs=1e-6)
    assert whole.kind == "correct" and whole.errors[0] < 1e-6


@pytest.mark.parametrize(
    ("lengths", "goal", "q", "reach"),
    [
        (
            (1, 1, 1),
            (4.0, 0.5),
            (0.3, 0.5, 0.4),
            3.0,
        ),  # the arm stretches out towards a goal beyond its reach
        ((1, 1), (3.0, 0.0), (0.3, 0.5), 2.0),
        ((1, 0.5), (-1.0, 0.0), (0.3, 0.5), 0.5),  # the way leads through the hole that the folded arm leaves
    ],
)
@pytest.mark.parametrize("beyond", [1e-3, 0.5, 1.0])
def test_singularity_of_the_healthy_arm_on_its_way_is_said_with_what_is_done(lengths, goal, q, reach, beyond):
    arm = ftqp.robots.load("planar", lengths=lengths, continuous=True)
    begin = arm.pose(np.array(q))[:2, 3]
    way = np.array(goal) - begin
    shares = np.roots([way @ way, 2.0 * begin @ way, begin @ begin - reach**2]).real
    done = shares[(shares > 0.0) & (shares < 1.0)].min()  # of the line, up to the circle of singular postures
    at = min(done + beyond, 1.0)
    said = []

    def ask():
        try:
            outcome(arm, goal, np.array(q), 0, at=at)
        except InputError as error:
            said.append(str(error))

    user = threading.Thread(target=ask, daemon=True)
    user.start()
    user.join(60.0)
    assert said, "it hangs, or does not refuse"
    found = re.search(r"does only (\S+) of the motion's distance: it meets a singularity", said[0])
    assert found is not None, said
    assert float(found[1]) == pytest.approx(done, abs=1e-5)
    before = outcome(arm, goal, np.array(q), 0, at=0.9 * done)
    assert arm.pose(before.path[0])[:2, 3] == pytest.approx(begin + 0.9 * done * way, abs=1e-6)


def test_horizon_asks_what_is_reached_in_time(panda, goal):
    long = outcome(panda, goal, panda.neutral, 2, rows="pose", horizon=200.0)
    short = outcome(panda, goal, panda.neutral, 2, rows="pose", horizon=1.0)
    assert long.kind == "correct" and long.t[-1] < 200.0 and "fell below" in long.reason
    assert short.kind == "unresolved" and short.t[-1] == pytest.approx(1.0) and "still" in short.reason


def test_weights_may_make_the_goal_itself_repel():
    """rho_i = n_i (W n)_i / n'W n is negative for some W that are not diagonal."""
    arm = ftqp.robots.load("planar", lengths=(1, 1, 1), continuous=True)
    q = np.array([0.3, 0.9, 0.8])
    goal = arm.pose(q)[:2, 3]
    _, _, Vt = np.linalg.svd(arm.jacobian(q)[:2])
    n = Vt[2]
    off = -np.sign(n[0] * n[1]) * 0.95 * np.sqrt(1.0 * 40.0)
    W = np.array([[1.0, off, 0.0], [off, 40.0, 0.0], [0.0, 0.0, 1.0]])
    rho = n * (W @ n) / (n @ W @ n)
    joint = int(np.argmin(rho))
    assert rho[joint] < -0.01
    near = q + 1e-3 * np.array([0.0 if k == joint else 1.0 for k in range(3)])
    found = outcome(arm, goal, near, joint, W=W)
    assert np.linalg.norm(found.q - q) > 0.01
    assert outcome(arm, goal, near, joint).kind == "correct"
