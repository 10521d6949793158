"""Jin 2017: the figures of docs/evidence/jin2017.md, by the active set and by the network."""

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from tests.arm_at import arm_at
from tests.commands_on import commands_on
from tests.papers.jin2017 import START, Run, run
from tests.papers.jin2017_qps import LOCK, recording, solved

import ftqp
from ftqp import EmergencyStop, Locked, StepStatus
from ftqp.control.planner.assembly import make_session
from ftqp.control.planner.mounted_robot import braking_reserve
from ftqp.core.checks import FloatArray
from ftqp.faults.belief import Belief
from ftqp.kernel.entry.session import Session
from ftqp.kernel.jit import jit
from ftqp.kernel.rows.failed_joints import sort_joints
from ftqp.kernel.rows.joint_intervals import intervals
from ftqp.qp import Claim
from ftqp.qp import dtrnn as network
from ftqp.qp.dtrnn import DtrnnSettings

PAPER_STOP = EmergencyStop(position=0.01, rotation=1.0, samples=1)


def instant(joint: int, reset: str = "kinematic") -> Locked:
    """The paper's lock: at once."""
    return Locked(joint, mode="instant", reset=reset)


FIVE = tuple((15.0, instant(joint)) for joint in range(5))


@cache
def e1(law: str = "quintic") -> Run:
    return run(law=law)


@cache
def e2(**settings: Any) -> Run:
    return run(faults=((15.0, instant(0)),), **settings)


class TestArm:
    """Section 2: the six-link arm."""

    def test_start_pose_and_jacobian(self) -> None:
        robot = ftqp.robots.load("planar6")
        assert_allclose(robot.pose(START)[:2, 3], [0.87241288, 0.89010293], atol=5e-9)
        data = robot.model.createData()
        pin.computeJointJacobians(robot.model, data, START)
        frame = robot.model.getFrameId(robot.tip)
        J = pin.getFrameJacobian(robot.model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:2]
        assert_allclose(np.linalg.svd(J, compute_uv=False), [1.844142, 0.311927], atol=5e-7)

    def test_inertia_of_the_kernel(self) -> None:
        v = np.array([0.1, -0.2, 0.3, -0.1, 0.2, 0.05])
        arm = arm_at(ftqp.robots.load("planar6"), START, v)
        assert_allclose(arm.M[0], [3.07087, 2.071825, 1.164001, 0.581081, 0.193268, 0.018158], atol=5e-6)
        eigenvalues = [4.94955e-4, 1.87633e-3, 5.70791e-3, 2.25443e-2, 0.235669, 5.139285]
        assert_allclose(np.linalg.eigvalsh(arm.M), eigenvalues, rtol=2e-6)
        assert_allclose(arm.drift[:2], [-0.01803415, -0.04190422], atol=5e-9)
        assert_allclose(arm.h, [-0.013853, -0.003590, 0.001927, 0.003077, 0.002007, 0.000383], atol=5e-7)


class TestE1NoFault:
    def test_error(self) -> None:
        assert e1().error.max() == pytest.approx(3.69e-6, abs=0.005e-6)
        assert e1("cycloid").error.max() == pytest.approx(4.72e-6, abs=0.005e-6)

    def test_every_step_is_feasible(self) -> None:
        assert e1().count(StepStatus.OK) == len(e1().t) == 2001

    def test_final_configuration_and_torques(self) -> None:
        assert_allclose(e1().q[-1], [0.26991, 0.24936, 0.25794, 0.26770, 0.27009, 0.26075], atol=1e-4)
        peaks = [0.0434, 0.0347, 0.0227, 0.0118, 0.0032, 0.0002]
        assert_allclose(np.abs(e1().tau).max(axis=0), peaks, atol=6e-5)

    def test_mean_acceleration_feed_forward_is_more_accurate(self) -> None:
        assert run(mean_acceleration=True).error.max() == pytest.approx(6.6e-7, rel=0.02)


class TestE2Joint1Locks:
    def test_error_stays_below_the_published_bound(self) -> None:
        assert e2().error.max() < 4e-6
        assert e2().error.max() == pytest.approx(3.48e-6, abs=0.01e-6)

    def test_locked_joint_is_still_and_its_motor_silent(self) -> None:
        after = e2().t >= 15.0 - 1e-9
        assert np.ptp(e2().q[after, 0]) <= 1e-12
        assert e2().q[-1, 0] == pytest.approx(0.3334, abs=1e-4)
        assert (e2().v[e2().t > 15.0 + 1e-9, 0] == 0.0).all()
        assert (e2().tau[after, 0] == 0.0).all()

    def test_brake_carries_the_torque(self) -> None:
        after = e2().t >= 15.0 - 1e-9
        assert np.abs(e2().tau_brake[after, 0]).max() == pytest.approx(0.035, abs=5e-4)

    def test_state_before_and_after(self) -> None:
        assert e2().v[1500, 0] == pytest.approx(-1.1e-5, abs=1e-6)
        assert_allclose(e2().q[-1], [0.3334, 0.15119, 0.24319, 0.29756, 0.31481, 0.28904], atol=1e-4)

    def test_ramp_repairs_what_viability_bounds_leave_moving(self) -> None:
        assert e2(bounds="viability").error.max() == pytest.approx(5.9e-5, rel=0.02)
        ramped = run(faults=((15.0, Locked(0)),), bounds="viability")
        assert ramped.error.max() == pytest.approx(3.4e-6, rel=0.02)


class TestE3FiveJointsLock:
    @pytest.mark.parametrize(("law", "time"), [("quintic", 16.83), ("cycloid", 16.87)])
    def test_stop(self, law: str, time: float) -> None:
        stopped = run(faults=FIVE, law=law, emergency=PAPER_STOP)
        assert stopped.stopped_at == pytest.approx(time, abs=1e-9)
        assert stopped.status[-1] is StepStatus.STOPPED
        after = stopped.t >= 15.0 - 1e-9
        assert (np.ptp(stopped.q[after, :5], axis=0) == 0.0).all()

    def test_infeasible_from_the_fault_on(self) -> None:
        free = run(faults=FIVE)
        first = free.status.index(StepStatus.RELAXED)
        assert free.t[first] == pytest.approx(15.0)
        assert free.count(StepStatus.RELAXED) == 501
        assert free.error.max() == pytest.approx(0.0388, abs=5e-5)


class TestE4VelocityLevel:
    @pytest.mark.parametrize("scheme", ["mvn", "rmp"])
    def test_errors(self, scheme: str) -> None:
        healthy = run(scheme, level="velocity")
        assert healthy.error.max() == pytest.approx(4.52e-6, abs=0.01e-6)
        locked = run(scheme, level="velocity", faults=((15.0, instant(0)),))
        assert locked.error.max() == pytest.approx(4.56e-6, abs=0.01e-6)

    @pytest.mark.parametrize("scheme", ["mvn", "rmp"])
    def test_stop_with_five_joints_locked(self, scheme: str) -> None:
        stopped = run(scheme, level="velocity", faults=FIVE, emergency=PAPER_STOP)
        assert stopped.stopped_at == pytest.approx(16.83, abs=1e-9)

    def test_repetitive_motion_returns(self) -> None:
        result = run("rmp", level="velocity")
        assert np.abs(result.q[-1] - result.q[0]).max() < 2e-6


def test_e6_torque_limit_is_kept_by_the_other_joints() -> None:
    limited = run("rmp", tau_max=[0.0303360, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert limited.count(StepStatus.OK) == len(limited.t)
    assert np.abs(limited.tau[:, 0]).max() <= 0.0303360 + 1e-9
    active = sum("j1 upper torque" in names or "j1 lower torque" in names for names in limited.limits)
    assert active == pytest.approx(540, abs=10)
    assert limited.error.max() == pytest.approx(3.6e-6, rel=0.02)
    assert np.abs(limited.q[-1] - limited.q[0]).max() == pytest.approx(3e-3, rel=0.1)


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        (instant(0), 2.3e-3),
        (instant(0, "momentum"), 8.3e-5),
        (instant(0, "task"), 4.7e-6),
        (Locked(0, deceleration=0.5), 4.6e-6),
        (Locked(0, deceleration=2.0), 1.7e-4),
    ],
    ids=["instant-kinematic", "instant-momentum", "instant-task", "ramp-0.5", "ramp-2"],
)
def test_e7_joint_that_moves_when_it_fails(fault: Locked, error: float) -> None:
    result = run(faults=((12.5, fault),))
    assert result.v[1250, 0] == pytest.approx(-0.0227, abs=1e-4)
    assert result.error.max() == pytest.approx(error, rel=0.1)


def test_e8_bounds_decide_whether_the_fault_is_survived() -> None:
    fault = ((2.5, Locked(0, deceleration=0.5)),)
    jin = run(faults=fault)
    assert jin.count(StepStatus.RELAXED) == 216
    assert jin.error.max() == pytest.approx(7.9e-3, rel=0.01)
    viable = run(faults=fault, bounds="viability")
    assert viable.count(StepStatus.OK) == len(viable.t)
    assert viable.error.max() == pytest.approx(3.4e-6, rel=0.02)


@jit
def bounded(K: Any) -> None:
    """The intervals of healthy joints at the state in the record."""
    sort_joints(K.faults, K.chain)
    intervals(K)


def interval_session(planner: ftqp.Planner) -> Session:
    """A session that makes the intervals of a healthy planner, and counts those that came out empty."""
    robot, level = planner.robot, planner.level
    criterion = ftqp.schemes.mvn().at(level)
    session = make_session(robot, planner.task, criterion, planner.bounds, None, level=level, dt=planner.dt)
    limits = session.K.limits
    Belief(robot).write(commands_on(session, robot))
    a_max, tau_max = robot.limits.a_max, robot.limits.tau_max
    limits.a_brake[: robot.nv] = braking_reserve(robot).shares(a_max, tau_max)[0] * a_max
    return session


def intervals_at(session: Session, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends of the intervals at a state."""
    K, n = session.K, len(q)
    K.state.q[:n], K.state.v[:n] = q, v
    bounded(K)
    return K.qp.lb[:n], K.qp.ub[:n]


@pytest.mark.parametrize("level", [pytest.param("velocity", marks=pytest.mark.slow), "acceleration"])
def test_e9_bounds_are_never_empty_and_never_broken(level: str) -> None:
    """Adversarial choices inside the interval, random or bang-bang, on every joint of the arm."""
    generator = np.random.default_rng(9)
    for dt in (0.01, 0.05):
        planner = ftqp.Planner(
            ftqp.robots.load("planar6"), dt, level=level, task=ftqp.Task(kp=1.0, kv=1.0), emergency=None
        )
        limits, session = planner.robot.limits, interval_session(planner)
        target = ftqp.Target(pose=planner.robot.pose(START))
        q, v = START.copy(), np.zeros(6)
        planner.reset(q)
        for k in range(500):
            planner.reset(q, v)
            step = planner.step(q, v, target)
            if k % 10 == 0:  # the formulas are plain Python here
                lower, upper = intervals_at(session, q, v)
                for own, said in ((lower, step.lower), (upper, step.upper)):  # built code fuses
                    np.testing.assert_allclose(own, said, rtol=1e-12, atol=1e-12)
            choice = generator.random(6) if generator.random() < 0.5 else generator.integers(0, 2, 6)
            x = step.lower + choice * (step.upper - step.lower)
            if level == "acceleration":
                q, v = q + dt * v + 0.5 * dt**2 * x, v + dt * x
            else:
                assert (np.abs(x - v) <= limits.a_max * dt + 1e-9).all()
                q, v = q + dt * x, x
            assert (q <= limits.q_max + 1e-9).all() and (q >= limits.q_min - 1e-9).all()
            assert (np.abs(v) <= limits.v_max + 1e-9).all()
        assert session.K.limits.empty_intervals == 0


@pytest.mark.parametrize(
    ("scheme", "peak"),
    [("man", 0.038), ("mvn", 0.038), ("rmp", 0.038), ("dlsm", 0.043), ("mke", 0.060), ("iiwt", 0.114)],
)
def test_section_4_peak_torque_of_joint_1(scheme: str, peak: float) -> None:
    assert np.abs(run(scheme).tau[:, 0]).max() == pytest.approx(peak, abs=6e-4)


@pytest.mark.parametrize(
    ("scheme", "drift"),
    [("rmp", 4e-6), ("mvn", 8e-4), ("dlsm", 0.012), ("man", 0.022), ("mke", 0.24), ("dlsm_mvn", 0.34)],
)
def test_section_4_joint_drift(scheme: str, drift: float) -> None:
    result = run(scheme)
    assert np.abs(result.q[-1] - result.q[0]).max() == pytest.approx(drift, rel=0.15)


COLD, WARM = dict(warm=False, every=10), dict(warm=True, every=1)
CAP = 20_000
IMPLICIT: dict[str, Any] = dict(method="implicit")
SCALED = IMPLICIT | dict(scaling=True)
NEWTON = SCALED | dict(newton=True, tolerance=1e-9)
LVI: dict[str, Any] = dict(method="94lvi")

TABLE = [
    ("RMP", LVI, COLD, 478, 1338),
    ("RMP", LVI, WARM, 203, 744),
    ("RMP", IMPLICIT, COLD, 173, 729),
    ("RMP", SCALED, COLD, 24, 39),
    ("RMP", SCALED, WARM, 13, 24),
    ("RMP", NEWTON, WARM, 1, 1),
    ("DLSM", LVI, COLD, 2803, 12639),
    ("DLSM", LVI, WARM, 244, 8246),
    ("DLSM", IMPLICIT, COLD, 221, 850),
    ("DLSM", SCALED, COLD, 57, 248),
    ("DLSM", SCALED, WARM, 12, 176),
    ("DLSM", NEWTON, WARM, 1, 36),
    ("IIWT", LVI, COLD, 5243, 14165),
    ("IIWT", LVI, WARM, 1362, 7384),
    ("IIWT", IMPLICIT, COLD, 1383, 3435),
    ("IIWT", SCALED, COLD, 91, 192),
    ("IIWT", SCALED, WARM, 37, 147),
    ("IIWT", NEWTON, WARM, 1, 46),
    ("MTN", SCALED, COLD, 248, 3156),
    ("MTN", SCALED, WARM, 100, 3252),
    ("MTN", NEWTON, WARM, 1, 721),
    ("gravity", IMPLICIT, COLD, 413, 2419),
    ("gravity", SCALED, COLD, 173, 749),
    ("gravity", SCALED, WARM, 72, CAP),
    ("gravity", NEWTON, WARM, 1, CAP),
]
"""Row, settings, start, median and largest number of iterations; where that is the cap, one QP of 2001 runs
into it."""


def within(value: float, expected: float) -> bool:
    return abs(value - expected) <= 0.2 * expected


@pytest.mark.parametrize(("row", "settings", "start", "median", "most"), TABLE)
def test_table_9_3(row: str, settings: Any, start: Any, median: int, most: int) -> None:
    found = solved(row, DtrnnSettings(mode="paper", **settings), **start)
    assert found.not_converged == (most == CAP)
    assert within(float(np.median(found.iterations)), median)
    assert within(int(found.iterations.max()), most)


@pytest.mark.parametrize(
    ("row", "settings", "start", "expected", "slack"),
    [
        ("MTN", LVI, COLD, 149, 30),
        ("MTN", LVI, dict(warm=True, every=10), 141, 28),
        ("MTN", IMPLICIT, COLD, 58, 12),
        ("gravity", LVI, COLD, 2, 1),
    ],
)
def test_table_9_3_counts_of_what_does_not_converge(
    row: str, settings: Any, start: Any, expected: int, slack: int
) -> None:
    found = solved(row, DtrnnSettings(mode="paper", **settings), **start)
    assert abs(found.not_converged - expected) <= slack


@pytest.mark.parametrize("row", ["RMP", "DLSM"])
def test_e47_behaves_like_94lvi(row: str) -> None:
    medians = [
        float(np.median(solved(row, DtrnnSettings(mode="paper", method=method), **COLD).iterations))
        for method in ("94lvi", "e47")
    ]
    assert abs(medians[1] - medians[0]) <= 0.16 * medians[0]


class TestE5NetworkInTheLoop:
    """E2 with the network, |e| <= 1e-5, warm, cap 20 000."""

    @pytest.mark.parametrize("method", ["94lvi", "e47"])
    def test_explicit_methods(self, method: str) -> None:
        result = run(faults=LOCK, backend={"name": "dtrnn", "mode": "paper", "method": method})
        assert result.count(StepStatus.OK) == 2001
        assert result.error.max() <= 1e-5
        assert result.error.max() == pytest.approx(8.2e-6, rel=0.02)
        assert within(float(np.median(result.iterations)), 250)
        assert result.iterations.max() <= 1.2 * 8400

    def test_implicit_with_scaling(self) -> None:
        result = run(faults=LOCK, backend={"name": "dtrnn", "mode": "paper", "scaling": True})
        assert result.error.max() == pytest.approx(4.1e-6, rel=0.02)
        assert within(float(np.median(result.iterations)), 12)

    def test_product_mode_is_as_exact_as_the_active_set(self) -> None:
        exact, found = run(faults=LOCK), run(faults=LOCK, backend="dtrnn")
        assert found.status == exact.status
        assert np.abs(found.q - exact.q).max() <= 1e-9
        assert np.median(found.iterations) == 1.0


class TestE10EveryQPofE2:
    """The network against the active set on the QPs that it solved."""

    def test_newton_variant_is_exact(self) -> None:
        found = solved("DLSM", DtrnnSettings(mode="paper", **NEWTON), **WARM)
        assert found.claims.count(Claim.SOLVED) == 2001
        assert found.error.max() <= 1e-9

    @pytest.mark.parametrize("start", [COLD, WARM])
    def test_product_mode_is_exact(self, start: Any) -> None:
        found = solved("DLSM", DtrnnSettings(), **start)
        assert found.not_converged == 0
        assert found.error.max() <= 1e-9

    @pytest.mark.parametrize(("row", "error"), [("RMP", 5e-5), ("DLSM", 1.5e-3), ("IIWT", 7.6e-3)])
    def test_the_papers_tolerance_leaves_x_less_exact_than_it_looks(self, row: str, error: float) -> None:
        found = solved(row, DtrnnSettings(mode="paper", method="94lvi"), **COLD)
        assert found.error.max() == pytest.approx(error, rel=0.2)


@pytest.mark.parametrize("row", ["RMP", "DLSM", "IIWT", "MTN", "gravity"])
def test_product_mode_solves_every_row_cold_as_one_batch(row: str) -> None:
    qps = recording(row)
    many = network.solve_batch(qps.H, qps.g, qps.A, qps.b, qps.C, qps.l, qps.u, qps.lb, qps.ub)
    assert (many.codes == Claim.SOLVED).all()
    assert np.abs(many.x - qps.x).max() <= (1e-5 if row == "MTN" else 1e-8)
