"""The problems of a stop, how joints come to rest, and the QP without limits, solved in one pass."""

import numpy as np
import pytest
from records import believe, empty_record, formula
from scipy.optimize import lsq_linear
from tests.arm_at import arm_at
from tests.puppet import Puppet, writes

import ftqp
from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.judge import stage_problems
from ftqp.kernel.judge.solution_check import check_solution
from ftqp.kernel.judge.unconstrained import unconstrained_solve
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import JOINTS
from ftqp.qp.adapters.backend import Claim
from ftqp.qp.problem import SolveStatus

TICK = 0.004
deceleration = formula(stage_problems.deceleration)


@pytest.mark.parametrize(("v", "expected"), [(0.1, -2.0), (-0.1, 2.0), (1.0, -8.0), (-1.0, 8.0), (0.0, 0.0)])
@pytest.mark.parametrize("rise", [0.0, TICK])
def test_without_a_jerk_limit_a_joint_is_braked_by_its_speed_over_the_time_up_to_its_limit(v, expected, rise):
    assert deceleration(v, 3.0, 8.0, 0.05, rise, TICK) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("v", [0.02, 0.3, -0.9])
@pytest.mark.parametrize("rise", [2.0 * TICK, 0.04, 0.2])
def test_with_a_jerk_limit_a_joint_rests_without_a_jolt_and_never_turns_round(v, rise):
    a_max, side = 8.0, np.sign(v)
    jerk, a, begun, ticks = a_max / rise, 0.0, v, 0
    while v != 0.0:
        before, a = a, deceleration(v, a, a_max, TICK, rise, TICK)
        assert abs(a) <= a_max * (1.0 + 1e-12) and side * a <= 0.0
        v = 0.0 if abs(v + TICK * a) < 1e-12 else v + TICK * a
        assert side * v >= 0.0
        last = 9.0 / 8.0 if v == 0.0 else 1.0  # the last tick ends at rest exactly
        assert abs(a - before) <= last * jerk * TICK * (1.0 + 1e-6)
        ticks += 1
        assert ticks < 1000
    assert abs(a) <= jerk * TICK, "it ends with hardly any deceleration"
    quick = abs(begun) / a_max + 2.0 * np.sqrt(abs(begun) / jerk) + rise
    assert TICK * ticks <= quick + 6.0 * TICK


PANDA = ftqp.robots.load("panda")
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
DT = 2e-3
WEAK = tuple(ftqp.Degraded(j, torque=0.2, acceleration=0.05) for j in range(7))
"""An arm that can neither carry itself nor fall: the motors are too weak, and so are the accelerations."""


def refuses(qp):
    return Claim.INFEASIBLE


def planner_of(level, *faults, backend="active_set", scheme="mvn", mode="slack"):
    planner = ftqp.Planner(
        PANDA, DT, level=level, backend=backend, scheme=scheme, emergency=None, task=ftqp.Task(mode=mode)
    )
    for fault in faults:
        planner.report(fault)
    return planner


def torques_of(step, q, v, faults=None):
    arm = arm_at(PANDA, q, v)
    return arm.M @ step.a + arm.h


@pytest.mark.parametrize("scheme", ["mvn", "mtn", "iiwt"])
def test_torque_limits_give_way_by_the_least_that_the_box_allows(level, scheme):
    """Against bounded least squares: min |M a + h - tau|^2 over the box and |tau| <= tau_max."""
    planner = planner_of(level, *WEAK, scheme=scheme)
    tau_max = 0.2 * PANDA.limits.tau_max
    rng, met = np.random.default_rng(3), 0
    for _ in range(60):
        q, v = Q + rng.uniform(-0.3, 0.3, 7), rng.uniform(-0.5, 0.5, 7)
        planner.reset(q, v)
        step = planner.step(q, v, ftqp.Target(pose=PANDA.pose(Q)))
        if step.torque_excess == 0.0:
            continue
        met += 1
        arm = arm_at(PANDA, q, v)
        box = (step.lower, step.upper) if level == "acceleration" else (
            (step.lower - v) / DT, (step.upper - v) / DT)  # fmt: skip
        best = lsq_linear(
            np.hstack([arm.M, -np.eye(7)]),
            -arm.h,
            (np.concatenate([box[0] - 1e-9, -tau_max]), np.concatenate([box[1] + 1e-9, tau_max])),
            method="bvls",
            tol=1e-14,
        )
        over = np.maximum(np.abs(torques_of(step, q, v)) - tau_max, 0.0)
        assert np.linalg.norm(over) <= np.sqrt(2.0 * best.cost) + 1e-4
        assert abs(step.torque_excess - over.max()) < 1e-9
        assert step.status is ftqp.StepStatus.RELAXED
    assert met >= 10


@pytest.mark.parametrize("mode", ["hard", "slack", "scaled", "lexicographic"])
def test_a_false_claim_of_infeasibility_is_a_fallback(level, mode):
    planner = planner_of(level, backend=Puppet(refuses), mode=mode)
    planner.reset(Q)
    step = planner.step(Q, np.zeros(7), ftqp.Target(pose=PANDA.pose(Q)))
    assert step.status is ftqp.StepStatus.FALLBACK
    assert step.qp.status is SolveStatus.FAILED


@pytest.mark.parametrize("mode", ["hard", "slack", "scaled"])
def test_a_true_claim_of_infeasibility_is_proved(level, mode):
    planner = planner_of(level, *WEAK, backend=Puppet(refuses), mode=mode)
    planner.reset(Q)
    step = planner.step(Q, np.zeros(7), ftqp.Target(pose=PANDA.pose(Q)))
    assert step.torque_excess > 1.0
    assert step.status is ftqp.StepStatus.RELAXED
    assert step.qp.status is SolveStatus.INFEASIBLE


@pytest.mark.parametrize("answer", [refuses, writes(7.0)])
@pytest.mark.parametrize("mode", ["hard", "slack"])
def test_fallback_commands_keep_the_row_of_a_free_joint_and_tell_the_true_excess(level, answer, mode):
    rng = np.random.default_rng(4)
    planner = planner_of(level, ftqp.FreeSwinging(3, damping=0.4), ftqp.Degraded(1, torque=0.2),
                         backend=Puppet(answer), mode=mode)  # fmt: skip
    tau_max = PANDA.limits.tau_max * np.array([1.0, 0.2, 1.0, 1.0, 1.0, 1.0, 1.0])
    for _ in range(20):
        q, v = Q + rng.uniform(-0.3, 0.3, 7), rng.uniform(-0.5, 0.5, 7)
        planner.reset(q, v)
        step = planner.step(q, v, ftqp.Target(pose=PANDA.pose(Q)))
        tau = torques_of(step, q, v)
        assert abs(tau[3] + 0.4 * step.v[3]) < 1e-5 * (1.0 + np.abs(tau).max())
        worst = np.delete(np.abs(tau) - tau_max, 3).max()
        assert step.torque_excess == pytest.approx(max(worst, 0.0), abs=1e-5)


@pytest.mark.parametrize("torque", [1.0, 0.45])
def test_a_joint_found_outside_its_range_returns_as_its_torque_allows(level, torque):
    """Back it comes, steadily, and no torque limit is broken for it that the arm could have kept."""
    planner = planner_of(level, ftqp.Degraded(1, torque=torque))
    q, v = Q.copy(), np.zeros(7)
    q[1] = PANDA.limits.q_min[1] - 0.1
    home, outside = PANDA.pose(q), []
    planner.reset(q, v)
    for _ in range(1500):
        step = planner.step(q, v, ftqp.Target(pose=home))
        assert step.torque_excess == 0.0
        assert step.status is not ftqp.StepStatus.FALLBACK
        outside.append(PANDA.limits.q_min[1] - q[1])
        assert (step.status is ftqp.StepStatus.RELAXED) or outside[-1] <= 1e-6
        assert step.outside == (("panda_joint2",) if outside[-1] > 1e-6 else ())
        q, v = step.q.copy(), step.v.copy()
    assert outside[-1] < 0.01 and np.max(np.diff(outside)) < 1e-7


SIZES = (
    *((2, 2, 8), (7, 6, 8), (8, 5, 8)),
    *(pytest.param(n, m, JOINTS, marks=pytest.mark.slow) for n, m in ((12, 6), (30, 6), (32, 3))),
)


def posed(seed=0, n=7, m=6, capacity=8, held=(), soft=1e-7, wide=1e3):
    """A record whose QP has a diagonal H and bounds far away; joints ``held`` are fixed at their x."""
    rng = np.random.default_rng(seed)
    K = empty_record(capacity)
    K.chain.n, K.cascade.accept, K.qp.tolerance, K.qp.max_iterations = n, 1e-6, 1e-9, 100
    K.qp.nx, K.qp.meq, K.task.m, K.cascade.stage = n, m, m, codes.MAIN_STAGE
    believe(K, dict.fromkeys(held, codes.LOCKED))
    qp = K.qp
    qp.H_diagonal[:n], qp.g[:n] = rng.uniform(0.1, 10.0, n), rng.normal(size=n)
    qp.A[:m, :n], qp.b[:m], qp.soft[:m] = rng.normal(size=(m, n)), rng.normal(size=m), soft
    qp.lb[:n], qp.ub[:n] = -wide, wide
    for i in held:
        qp.lb[i] = qp.ub[i] = rng.normal()
    K.task.asked[:m] = qp.b[:m] + 0.25
    # what an earlier tick of another task may have left behind the last joint
    if n < len(qp.g):
        qp.g[n], qp.H_diagonal[n], qp.lb[n], qp.ub[n], qp.A[:m, n] = -7.0, 5.0, 2.0, 3.0, 4.0
    return K


def answer(K):
    n, m = K.chain.n, K.task.m
    return {name: getattr(K.qp, name)[:size].copy() for name, size in (("x", n), ("y", m), ("z_box", n))}


def coupled(K, seed):
    """The same record with the H of a soft task beside, and something behind its last column."""
    n, qp = K.chain.n, K.qp
    J = np.random.default_rng(seed).normal(size=(3, n))
    qp.H[:n, :n], qp.dense = np.diag(qp.H_diagonal[:n]) + J.T @ J, 1
    if n < len(qp.g):
        qp.H[:n, n] = -3.0
    K.terms.count = 1
    return K


@pytest.mark.parametrize(("n", "m", "capacity"), SIZES)
@pytest.mark.parametrize("soft", [0.0, 1e-8, 1e-2])
@pytest.mark.parametrize("failed", [0, 1])
@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside soft tasks"])
def test_it_is_the_active_sets_answer(n, m, capacity, soft, failed, beside):
    held = (n // 2,) if failed and n > m else ()
    ours, theirs = (posed(n, n, m, capacity, held, soft) for _ in range(2))
    if beside:
        ours, theirs = coupled(ours, n), coupled(theirs, n)
    assert unconstrained_solve(ours)
    assert active_set(theirs.qp) == codes.SOLVED and check_solution(
        theirs.task, theirs.cascade, theirs.qp, theirs.scratch
    )
    for name, value in answer(ours).items():
        expected = answer(theirs)[name]
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1.0 + np.abs(expected).max())), name
    assert ours.task.slack[:m] == pytest.approx(theirs.task.slack[:m], abs=1e-10)
    assert ours.cascade.residual_task < 1e-10 and ours.cascade.residual_dual < 1e-10
    assert beside or (ours.qp.iterations == 1 and ours.qp.warm == 0)


@pytest.mark.parametrize("side", ["lb", "ub"])
@pytest.mark.parametrize("joint", [0, 6])
def test_a_bound_that_would_hold_is_left_to_the_active_set(side, joint):
    K = posed(1)
    assert unconstrained_solve(K)
    x = K.qp.x[joint]
    getattr(K.qp, side)[joint] = x + (1e-3 if side == "lb" else -1e-3)
    untouched = posed(1)
    getattr(untouched.qp, side)[joint] = getattr(K.qp, side)[joint]
    assert not unconstrained_solve(K)
    assert active_set(K.qp) == codes.SOLVED and active_set(untouched.qp) == codes.SOLVED
    for name, value in answer(K).items():
        assert np.array_equal(value, answer(untouched)[name]), name
    assert K.qp.warm > 0 and not unconstrained_solve(K), "a limit that held is looked at first"
