"""How an answer is judged, and what commands the arm where none is good."""

import daqp
import numpy as np
import pytest
from random_qps import EQUALITY
from scipy.optimize import lsq_linear
from session_ticks import Ticks
from tests.puppet import Puppet, writes

import ftqp
from ftqp.kernel.judge.fallback_cascade import CASCADE
from ftqp.kernel.judge.solution_check import check_solution, sizes
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import Stage
from ftqp.qp.adapters.backend import QPBuffers

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
FIVE_MS = 0.005
STOPPING, STOPPED, FALLBACK = ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED, ftqp.StepStatus.FALLBACK
V4 = np.array([0.3, -0.2, 0.004, 0.0])


def moving_planner(level, v=V4, **settings):
    """A planner of a moving arm, and a target at its tip that moves away."""
    planner = ftqp.Planner(ROBOT, FIVE_MS, level=level, **{"emergency": None, **settings})
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
    q, v = ROBOT.neutral.copy(), V4.copy()
    for _ in range(4):
        step = planner.step(q, v, target)
        assert step.status is FALLBACK
        expected = np.clip(-v / 0.05, -LIMITS.a_max, LIMITS.a_max)
        assert np.allclose(step.a, expected, atol=1e-9)
        assert np.allclose(step.v, v + FIVE_MS * expected, atol=1e-12)
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


def solved(**options):
    """The record of a tick whose QP is solved, some bound active."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, 0.002, task=ftqp.Task(calm=False), **options)
    ticks.reset(Q)
    pose = robot.pose(Q)
    pose[:3, 3] += 0.1
    assert ticks.tick(Q, np.zeros(7), ftqp.Target(pose=pose)) == codes.RELAXED
    assert ticks.K.cascade.stage == codes.MAIN_STAGE
    return ticks.K


@pytest.mark.parametrize("field", ["x", "y", "z", "z_box"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_does_not_pass(field, value):
    K = solved(scheme="dlsm")
    qp = K.qp
    qp.nc = 7  # torque rows, open ones here, are looked at
    qp.C[:7, :7], qp.l[:], qp.u[:] = np.eye(7), -np.inf, np.inf
    assert check_solution(K.task, K.cascade, K.qp, K.scratch)
    getattr(qp, field)[:6] = value
    with np.errstate(invalid="ignore"):  # plain Python warns
        assert not check_solution(K.task, K.cascade, K.qp, K.scratch)
    if field == "x" and np.isinf(value):  # clamped into the box, like any x outside
        assert np.isfinite(qp.x[:7]).all()


def test_command_is_the_exact_hold_of_x(level):
    robot, v = ftqp.robots.load("panda"), np.linspace(-0.2, 0.2, 7)
    ticks = Ticks(robot, 0.01, level=level)
    ticks.reset(Q, v)
    ticks.tick(Q, v, ftqp.Target(pose=robot.pose(Q)))
    x, state = ticks.K.qp.x[:7], ticks.K.state
    if level == "acceleration":
        expected = (Q + 0.01 * v + 0.5e-4 * x, v + 0.01 * x, x)
    else:
        expected = (Q + 0.01 * x, x, (x - v) / 0.01)
    for got, value in zip((state.q_command, state.v_command, state.a_command), expected, strict=True):
        assert np.abs(got[:7] - value).max() < 1e-13


@pytest.mark.parametrize("dense", [0, 1])
@pytest.mark.parametrize("soft_rows", [0.0, 1e-8])
def test_residuals_are_those_of_their_formulas(dense, soft_rows):
    """A QP and an answer made of random numbers, of which plain numpy says what is wrong with them."""
    K, rng = solved(), np.random.default_rng(7)
    qp, n, m, p = K.qp, 7, 3, 5
    qp.nx, qp.meq, qp.nc, qp.dense, qp.soft_rows = n, m, p, dense, soft_rows
    for _ in range(6):
        H = rng.normal(size=(n, n))
        qp.H[:n, :n], qp.H_diagonal[:n], qp.g[:n] = H + H.T, rng.uniform(0.5, 2.0, n), rng.normal(size=n)
        qp.A[:m, :n], qp.C[:p, :n] = rng.normal(size=(m, n)), rng.normal(size=(p, n))
        qp.b[:m], qp.soft[:m], qp.y[:m] = rng.normal(size=m), rng.uniform(0.0, 0.1, m), rng.normal(size=m)
        qp.l[:p], qp.u[:p], qp.z[:p] = -0.1 * rng.random(p), 0.1 * rng.random(p), rng.normal(size=p)
        qp.l[0] = qp.u[0]  # an equation, which no softness opens
        qp.z[1] = 0.0
        qp.lb[:n], qp.ub[:n] = -rng.uniform(0.1, 3.0, n), rng.uniform(0.1, 3.0, n)
        qp.x[:n], qp.z_box[:n] = 2.0 * rng.normal(size=n), rng.normal(size=n)
        qp.z_box[2], qp.lb[3] = 0.0, qp.ub[3]
        x = np.clip(qp.x[:n], qp.lb[:n], qp.ub[:n])
        assert not check_solution(K.task, K.cascade, K.qp, K.scratch)
        assert np.array_equal(qp.x[:n], x)
        left = qp.A[:m, :n] @ x - qp.b[:m] - qp.soft[:m] * qp.y[:m]
        assert K.cascade.residual_task == pytest.approx(np.abs(left).max() / (1.0 + np.abs(qp.b[:m]).max()))
        assert np.allclose(K.task.slack[:m], qp.A[:m, :n] @ x - K.task.asked[:m], atol=1e-12)
        rows = qp.C[:p, :n] @ x
        over = np.maximum(np.maximum(qp.l[:p] - rows, rows - qp.u[:p]), 0.0)
        over[(soft_rows > 0.0) & (qp.l[:p] < qp.u[:p])] = 0.0
        assert K.cascade.residual_bounds == pytest.approx(over.max() / (1.0 + np.abs(x).max()))
        pull = qp.H[:n, :n] @ x if dense else qp.H_diagonal[:n] * x
        terms = [qp.g[:n], pull, *(qp.A[:m, :n] * qp.y[:m, None]), *(qp.C[:p, :n] * qp.z[:p, None])]
        z = qp.z_box[:n]
        room = np.where(z > 0.0, qp.ub[:n] - x, x - qp.lb[:n])
        wrong = np.where((z != 0.0) & (qp.lb[:n] < qp.ub[:n]), np.minimum(np.abs(z), room), 0.0)
        worst = max(np.abs(np.sum(terms, axis=0) + z).max(), wrong.max())
        size = np.sqrt(np.sum(np.square(terms)))
        assert K.cascade.residual_dual == pytest.approx(worst / (1.0 + size))


DT = 0.002
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
MODES = ("hard", "slack", "scaled", "lexicographic")
EXTRA = {"hard": 0, "slack": 6, "scaled": 7, "lexicographic": 6}


def packed(mode, level, *faults, scheme="dlsm"):
    """(buffers with the QP of a tick, the record it came from, the same tick solved in the kernel)."""
    robot = ftqp.robots.load("panda")
    pose = robot.pose(Q)
    pose[:3, 3] += [0.002, -0.001, 0.001]
    target = ftqp.Target(pose=pose, twist=[0.02, 0.01, 0.0, 0.0, 0.05, 0.0])
    outside, inside = (
        Ticks(robot, DT, *faults, level=level, scheme=scheme, task=ftqp.Task(mode=mode)) for _ in range(2)
    )
    for ticks in (outside, inside):
        ticks.reset(Q, V)
    outside.K.cascade.external = 1
    buffers = QPBuffers.zeros(*sizes(outside.K.task, outside.K.cascade, outside.K.chain))
    prepare = outside.session.bind("prepare_clock", buffers.flat)
    assert prepare(Q, V, target.packed, target.row) == codes.QP_READY
    inside.tick(Q, V, target)
    return buffers, outside.K, inside.K


@pytest.mark.parametrize("mode", MODES)
def test_packed_qp_has_the_solution_of_the_kernel(mode, level):
    for faults in ((), (ftqp.Locked(2),), (ftqp.FreeSwinging(4),)):
        b, _, inside = packed(mode, level, *faults)
        assert b.n == 7 + EXTRA[mode]
        sense = np.where(b.lower == b.upper, EQUALITY, 0).astype(np.intc)
        upper = b.upper.copy()
        upper[b.n : b.n + b.m] = b.b
        x, _, flag, _ = daqp.solve(b.H, b.g, b.rows, upper, b.lower, sense, primal_tol=1e-11, dual_tol=1e-12)
        if mode == "hard" and flag != 1:
            assert inside.cascade.status == codes.RELAXED
            continue
        assert flag == 1
        assert np.abs(x[:7] - inside.qp.x[:7]).max() < 1e-6 * (1.0 + np.abs(x[:7]).max())
