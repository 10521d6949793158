"""The table of the fallback cascade: its columns, and that every way through it ends at a command."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from session_ticks import Ticks
from tests.puppet import Puppet, writes

import ftqp
from ftqp.kernel.judge.fallback_cascade import CASCADE
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import Stage

ORDER = [row.stage for row in CASCADE]


def test_every_stage_has_one_row():
    assert sorted([*ORDER, Stage.COMMAND]) == sorted(Stage)


@pytest.mark.parametrize("row", CASCADE, ids=lambda row: row.stage.name)
def test_the_cascade_only_goes_down_the_table(row):
    """So that it ends, whatever the answers are."""
    for following in (row.good, row.bad):
        assert following is Stage.COMMAND or ORDER.index(following) > ORDER.index(row.stage)


Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
NAMES = ("acceleration", "velocity")


def planner_of(backend="active_set", **options):
    """A Panda's planner at its start."""
    planner = ftqp.Planner(ftqp.robots.load("panda"), 0.002, backend=backend, emergency=None, **options)
    planner.reset(Q)
    return planner


def same_tick(pose, **options):
    """The session of a Panda after its first tick, at rest."""
    ticks = Ticks(ftqp.robots.load("panda"), 0.002, **options)
    ticks.reset(Q)
    ticks.tick(Q, np.zeros(7), ftqp.Target(pose=pose))
    return ticks


@pytest.mark.parametrize("level", NAMES)
@pytest.mark.parametrize("mode", ["hard", "slack"])
def test_in_calm_a_lying_solver_is_not_asked(level, mode):
    planners = [
        planner_of(backend, level=level, task=ftqp.Task(mode=mode))
        for backend in ("active_set", Puppet(writes(7.0)))
    ]
    pose = planners[0].robot.pose(Q)
    pose[:3, 3] += [0.01, 0.0, -0.01]
    honest, lied = (planner.step(Q, np.zeros(7), ftqp.Target(pose=pose)) for planner in planners)
    assert planners[0].session().K.settling.entered, "the error bends more than the rows can hold"
    assert lied.status is honest.status
    assert np.abs(lied.v - honest.v).max() < 1e-9


def test_the_relaxed_motion_is_the_least_squares_one():
    """Hard mode, infeasible: no x of the box leaves a smaller task residual."""
    pose = ftqp.robots.load("panda").pose(Q)
    pose[:3, 3] += [0.5, 0.2, -0.2]
    K = same_tick(pose, task=ftqp.Task(mode="hard", calm=False)).K
    assert K.cascade.status == codes.RELAXED
    A, b, x = K.qp.A[:6, :7], K.task.asked[:6], K.qp.x[:7]
    best = lsq_linear(A, b, (K.qp.lb[:7], K.qp.ub[:7]), tol=1e-14)
    assert np.linalg.norm(A @ x - b) <= np.sqrt(2.0 * best.cost) * (1.0 + 1e-4)


ROBOT = ftqp.robots.load("planar", count=4)
LIMITS = ROBOT.limits
DT = 0.005
STOPPING, STOPPED, FALLBACK = ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED, ftqp.StepStatus.FALLBACK
V = np.array([0.3, -0.2, 0.004, 0.0])


def moving_planner(level, v=V, **settings):
    """A planner of a moving arm, and a target at its tip that moves away."""
    planner = ftqp.Planner(ROBOT, DT, level=level, **{"emergency": None, **settings})
    planner.reset(ROBOT.neutral, v)
    target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
    target.position[1] += 0.01
    return planner, target


def refuse(planner, refused=True):
    """From now on no answer to any QP is good enough."""
    planner._session.K.cascade.accept = -1.0 if refused else 1e-6


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
def test_where_no_answer_is_good_the_arm_decays_towards_rest_within_its_limits(level, mode):
    planner, target = moving_planner(level, task=ftqp.Task(mode=mode))
    refuse(planner)
    q, v = ROBOT.neutral.copy(), V.copy()
    for _ in range(4):
        step = planner.step(q, v, target)
        assert step.status is FALLBACK
        expected = np.clip(-v / 0.05, -LIMITS.a_max, LIMITS.a_max)
        assert np.allclose(step.a, expected, atol=1e-9)
        assert np.allclose(step.v, v + DT * expected, atol=1e-12)
        assert np.all(step.slack == 0.0) and step.scale == 0.0
        q, v = step.q.copy(), step.v.copy()


def test_the_box_holds_on_the_last_rung_too(level):
    planner, target = moving_planner(level, np.zeros(4))
    q, v = ROBOT.neutral.copy(), np.zeros(4)
    q[0], v[0] = LIMITS.q_max[0] - 2e-4, 0.09
    planner.reset(q, v)
    planner.report(ftqp.Locked(1))
    refuse(planner)
    step = planner.step(q, v, target)
    assert step.status is FALLBACK
    assert step.a[0] < -0.09 / 0.05 - 0.1, "the end of the range asks for more than the decay"
    assert step.lower[0] <= (step.a if level == "acceleration" else step.v)[0] <= step.upper[0]
    assert step.v[1] == 0.0 and step.q[1] == q[1]


def test_so_many_fallbacks_in_a_row_stop_the_arm_and_one_good_answer_begins_the_count_anew(level):
    planner, target = moving_planner(level, np.zeros(4))
    limit = int(planner.session().K.watch.fallback_limit)
    assert 1 < limit < 1000
    planner._session.K.watch.fallback_limit = 4
    q = ROBOT.neutral
    for refused in (True,) * 4 + (False,) + (True,) * 4:
        refuse(planner, refused)
        step = planner.step(q, np.zeros(4), target)
        assert (step.status is FALLBACK) == refused and planner.stopped_because is None
    refuse(planner)
    planner.step(q, np.zeros(4), target)
    assert planner.stopped_because is not None
    refuse(planner, False)
    assert planner.step(q, np.zeros(4), target).status in (STOPPING, STOPPED)


@pytest.mark.parametrize(("share", "expected"), [(1.2e-3, STOPPING), (0.8e-3, STOPPED)])
@pytest.mark.parametrize("joint", [0, 3])
def test_an_arm_has_stopped_when_every_joint_is_slower_than_a_thousandth_of_its_limit(
    joint, share, expected, level
):
    v = np.zeros(4)
    v[joint] = -share * LIMITS.v_max[joint]
    planner, target = moving_planner(level, v)
    planner.stop()
    step = planner.step(ROBOT.neutral, v, target)
    assert step.status is expected
    assert np.all(step.slack == 0.0) and step.scale == 0.0 and step.certificate is None
    assert np.all(np.abs(step.v) <= np.abs(v))


def test_a_stopped_arm_outside_its_range_is_brought_to_rest_and_not_pushed_back(level):
    q, v = ROBOT.neutral.copy(), np.zeros(4)
    q[0], v[0] = LIMITS.q_max[0] + 0.05, 0.01
    planner, target = moving_planner(level)
    planner.reset(q, v)
    planner.stop()
    for _ in range(6):
        step = planner.step(q, v, target)
        assert -1e-15 <= step.v[0] <= v[0]
        q, v = step.q.copy(), step.v.copy()
    assert v[0] == pytest.approx(0.0, abs=1e-12)
