"""What the check of a solution lets pass, and what a command is made of."""

import daqp
import numpy as np
import pytest
from random_qps import EQUALITY
from records import empty_record, formula
from session_ticks import Ticks

import ftqp
from ftqp.kernel.judge import solution_check
from ftqp.kernel.judge.solution_check import check_solution, sizes, unpack
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import FREE, HEALTHY, LOCKED, JointCode
from ftqp.qp.adapters.buffers import QPBuffers

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])


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


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
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
        qp.H[:n, :n], qp.H_diagonal[:n] = H + H.T, rng.uniform(0.5, 2.0, n)
        qp.g[:n], qp.A[:m, :n], qp.C[:p, :n] = (
            rng.normal(size=n),
            rng.normal(size=(m, n)),
            rng.normal(size=(p, n)),
        )
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


@pytest.mark.parametrize("which", ["residual_task", "residual_bounds", "residual_dual"])
def test_each_residual_alone_keeps_an_answer_from_passing(which):
    K = solved()
    qp = K.qp
    qp.nc, qp.C[0, :7], qp.l[0], qp.u[0], qp.z[0] = 1, 1.0, -np.inf, np.inf, 0.0
    assert check_solution(K.task, K.cascade, K.qp, K.scratch)
    if which == "residual_task":
        qp.b[0] += 1e-3 * (1.0 + np.abs(qp.b[:6]).max())
    elif which == "residual_bounds":
        qp.u[0] = qp.x[:7].sum() - 1e-3 * (1.0 + np.abs(qp.x[:7]).max())
    else:
        qp.g[0] += 1e-3 * (1.0 + np.linalg.norm(qp.H_diagonal[:7] * qp.x[:7]) + np.abs(qp.y).max())
    assert not check_solution(K.task, K.cascade, K.qp, K.scratch)
    bad = {
        name
        for name in ("residual_task", "residual_bounds", "residual_dual")
        if K.cascade[name] > K.cascade.accept
    }
    assert bad == {which}


N = 8


def arm(codes=(HEALTHY,) * N):
    """A record of an arm well inside its limits, joint by joint different."""
    K = empty_record()
    K.chain.n = N
    K.faults.code[:N] = codes
    K.limits.q_min[:N], K.limits.q_max[:N] = -1.0 - 0.1 * np.arange(N), 2.0 + 0.1 * np.arange(N)
    K.limits.v_max[:N], K.limits.tau_max[:N] = 1.5, np.inf
    return K


def test_each_joint_outside_is_counted_once():
    rng = np.random.default_rng(2)
    for _ in range(60):
        codes = rng.choice([int(code) for code in JointCode], N)
        K = arm(codes)
        K.state.q[:N] = rng.uniform(-2.5, 3.5, N)
        K.state.v[:N] = rng.uniform(-2.0, 2.0, N)
        beyond = (K.state.q[:N] < K.limits.q_min[:N]) | (K.state.q[:N] > K.limits.q_max[:N])
        fast = (np.abs(K.state.v[:N]) > 1.5) & (codes == HEALTHY)
        assert solution_check.joints_outside(K) == np.sum(beyond | fast)
    for side in (1.0, -1.0):
        K = arm()
        K.state.q[:N] = 4.0 * side
        assert solution_check.joints_outside(K) == N


def test_torque_excess_is_the_worst_of_motors_and_of_what_swings_free():
    rng = np.random.default_rng(4)
    met = set()
    for _ in range(80):
        codes = rng.choice([HEALTHY, FREE, LOCKED], N, p=[0.6, 0.25, 0.15])
        K = arm(codes)
        K.limits.tau_max[:N] = rng.uniform(0.5, 3.0, N)
        K.state.tau[:N], K.state.a_command[:N] = rng.normal(size=(2, N)) * 2.0
        K.state.v[:N], K.state.v_command[:N] = rng.normal(size=(2, N))
        K.kinematics.h[:N], K.kinematics.M[:N, :N] = rng.normal(size=N), rng.normal(size=(N, N))
        K.faults.friction[:N], K.faults.coulomb[:N] = rng.uniform(0.0, 1.0, (2, N))
        K.chain.viscous[:N] = rng.uniform(0.0, 1.0, N)
        K.free.contact[:N] = rng.random(N) < 0.3
        motors = np.abs(K.state.tau[:N]) - K.limits.tau_max[:N]
        dv = K.state.v_command[:N] - K.state.v[:N]
        swung = K.kinematics.h[:N] + K.kinematics.M[:N, :N] @ K.state.a_command[:N]
        swung += K.faults.friction[:N] * K.state.v_command[:N] + K.chain.viscous[:N] * dv
        free = np.abs(swung) - K.faults.coulomb[:N]
        every = np.where(
            codes == HEALTHY, motors, np.where((codes == FREE) & ~K.free.contact[:N].astype(bool), free, 0)
        )
        met.add(int(codes[np.argmax(every)]))
        assert formula(solution_check.torque_excess)(K) == pytest.approx(max(every.max(), 0.0), abs=1e-12)
    assert met >= {HEALTHY, FREE}
    K = arm()
    K.limits.tau_max[:N], K.state.tau[:N] = 1.0, -0.5
    assert formula(solution_check.torque_excess)(K) == 0.0


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


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
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


def test_packed_qp_repeats_the_record_term_by_term():
    b, K, _ = packed("slack", "acceleration")
    mean = np.trace(K.qp.H[:7, :7]) / 7
    assert np.array_equal(b.H[:7, :7], K.qp.H[:7, :7]) and np.all(b.H[:7, 7:] == 0.0)
    assert np.allclose(b.H[7:, 7:], mean * np.eye(6), rtol=1e-14)
    assert np.array_equal(b.g[:7], K.qp.g[:7]) and np.all(b.g[7:] == 0.0)
    assert np.array_equal(b.A[:, :7], K.qp.A[:6, :7])
    assert np.allclose(b.A[:, 7:] ** 2, np.diag(K.qp.soft[:6] * mean), rtol=1e-13)
    assert np.array_equal(b.C[:, :7], K.qp.C[:7, :7]) and np.all(b.C[:, 7:] == 0.0)
    for mine, theirs in ((b.b, "b"), (b.l, "l"), (b.u, "u"), (b.lb[:7], "lb"), (b.ub[:7], "ub")):
        assert np.array_equal(mine, K.qp[theirs][: len(mine)])
    assert np.all(b.lb[7:] == -np.inf) and np.all(b.ub[7:] == np.inf)


def test_answer_comes_back_whole():
    b, K, _ = packed("scaled", "acceleration")
    b.solution[:] = np.arange(len(b.solution)) + 0.5
    unpack(K.task, K.cascade, K.chain, K.qp, b.solution)
    for mine, theirs, count in ((b.x, "x", 8), (b.z_box, "z_box", 8), (b.y, "y", 6), (b.z, "z", 7)):
        assert np.array_equal(K.qp[theirs][:count], mine[:count])
