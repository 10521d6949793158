"""What the cascade gives up, in which order, and that no answer of a solver reaches the command unchecked."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from session_ticks import Ticks

import ftqp
from ftqp.kernel.layout import enums as codes
from ftqp.qp.adapters.backend import Backend, Claim

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
NAMES = ("acceleration", "velocity")


class Liar(Backend):
    """A backend that claims success and answers ``value`` everywhere."""

    package = "none"

    def __init__(self, value, claim=Claim.SOLVED):
        super().__init__("liar")
        self._value, self._claim = value, claim

    def _prepare(self, qp):
        """Nothing to prepare."""

    def _run(self, qp, cold):
        qp.solution[:] = self._value
        return self._claim

    def _attempt(self, qp, cold):
        return self._run(qp, cold)


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


def inside(planner, step, v):
    """Whether the command is finite and within the limits of velocity and acceleration."""
    limits = planner.robot.limits
    values = np.concatenate([step.q, step.v, step.a])
    assert np.isfinite(values).all()
    assert np.all(np.abs(step.v) <= limits.v_max + 1e-9)
    assert np.all(np.abs(step.a) <= limits.a_max * (1.0 + 1e-9) + 1e-9)


@pytest.mark.parametrize("level", NAMES)
@pytest.mark.parametrize("mode", ["hard", "slack", "scaled", "lexicographic"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, 0.0, 7.0])
@pytest.mark.parametrize("claim", list(Claim))
def test_no_answer_of_a_lying_solver_reaches_the_command(value, claim, level, mode):
    planner = planner_of(Liar(value, claim), level=level, task=ftqp.Task(mode=mode, calm=False))
    pose = planner.robot.pose(Q)
    pose[:3, 3] += [0.01, 0.0, -0.01]
    q, v = Q.copy(), np.zeros(7)
    for _ in range(3):
        step = planner.step(q, v, ftqp.Target(pose=pose))
        inside(planner, step, v)
        assert step.status in (ftqp.StepStatus.FALLBACK, ftqp.StepStatus.RELAXED)
        q, v = step.q.copy(), step.v.copy()


@pytest.mark.parametrize("level", NAMES)
@pytest.mark.parametrize("mode", ["hard", "slack"])
def test_in_calm_a_lying_solver_is_not_asked(level, mode):
    planners = [
        planner_of(backend, level=level, task=ftqp.Task(mode=mode))
        for backend in ("active_set", Liar(7.0, Claim.SOLVED))
    ]
    pose = planners[0].robot.pose(Q)
    pose[:3, 3] += [0.01, 0.0, -0.01]
    honest, lied = (planner.step(Q, np.zeros(7), ftqp.Target(pose=pose)) for planner in planners)
    assert planners[0].session().K.calm.entered, "the error bends more than the rows can hold"
    assert lied.status is honest.status
    assert np.abs(lied.v - honest.v).max() < 1e-9


@pytest.mark.parametrize("level", NAMES)
@pytest.mark.parametrize("mode", ["hard", "slack", "scaled", "lexicographic"])
def test_an_unreachable_task_gives_the_nearest_motion_within_the_box(level, mode):
    planner = planner_of(level=level, task=ftqp.Task(mode=mode, calm=False))
    pose = planner.robot.pose(Q)
    pose[:3, 3] += [0.5, 0.2, -0.2]
    step = planner.step(Q, np.zeros(7), ftqp.Target(pose=pose))
    inside(planner, step, np.zeros(7))
    expected = ftqp.StepStatus.SCALED if mode == "scaled" else ftqp.StepStatus.RELAXED
    assert step.status is expected
    if mode == "scaled":
        assert 0.0 < step.scale < 1.0
    else:
        assert np.abs(step.slack).max() > 1e-3
    ticks = same_tick(pose, level=level, task=ftqp.Task(mode=mode, calm=False))
    assert np.abs(ticks.K.state.v_command[:7] - step.v).max() < 1e-9
    x, lb, ub = (ticks.K.qp[name][:7] for name in ("x", "lb", "ub"))
    assert np.all(x >= lb) and np.all(x <= ub)
    at_bound = np.minimum(x - lb, ub - x) < 1e-9  # the second stage restates the first one's A x, rounded
    assert mode == "scaled" or np.any(at_bound)


def test_the_relaxed_motion_is_the_least_squares_one():
    """Hard mode, infeasible: no x of the box leaves a smaller task residual."""
    pose = ftqp.robots.load("panda").pose(Q)
    pose[:3, 3] += [0.5, 0.2, -0.2]
    K = same_tick(pose, task=ftqp.Task(mode="hard", calm=False)).K
    assert K.cascade.status == codes.RELAXED
    A, b, x = K.qp.A[:6, :7], K.task.asked[:6], K.qp.x[:7]
    best = lsq_linear(A, b, (K.qp.lb[:7], K.qp.ub[:7]), tol=1e-14)
    assert np.linalg.norm(A @ x - b) <= np.sqrt(2.0 * best.cost) * (1.0 + 1e-4)


@pytest.mark.parametrize("level", NAMES)
def test_a_joint_that_is_locked_stays_so_on_every_rung(level):
    planner = planner_of(Liar(np.nan), level=level)
    planner.report(ftqp.Locked(3))
    pose = planner.robot.pose(Q)
    pose[:3, 3] += [0.5, 0.2, -0.2]
    step = planner.step(Q, np.zeros(7), ftqp.Target(pose=pose))
    assert step.v[3] == 0.0 and step.a[3] == 0.0 and step.q[3] == Q[3]
