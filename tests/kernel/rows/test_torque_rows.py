"""Rows of torque limits, and those by which weak joints hold the arm."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import closed_loop, started

import ftqp
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.rows.holding_rows import holding_rate

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])


def torque(arm, q, v, a):
    """M a + h at (q, v)."""
    arm.dynamics(q, v)
    return arm.K.kinematics.M[:7, :7] @ a + arm.K.kinematics.h[:7]


def swinging(planner, ticks, bare=None):
    """Closed loop round the start, the tip drawn to and fro; every tick's step, its torque, and v before it.

    The torque is recomputed, by the arm without its friction where that is given.
    """
    p, arm = planner.robot.pose(Q)[:3, 3], ArmSession((bare or planner.robot).chain.constants())
    ways, rates = np.array([0.0, 0.15, 0.15]), np.array([0.0, 5.0, 3.0])
    aim = lambda k: ftqp.Target(position=p + ways * np.sin(rates * k * planner.dt))  # noqa: E731
    q, v = Q, np.zeros(7)
    for step in closed_loop(planner, aim, ticks, Q):
        yield step, torque(arm, q, v, step.a), v
        q, v = step.q.copy(), step.v.copy()


def test_torque_limits_are_kept_and_bind(level):
    robot = ftqp.robots.load("panda").with_limits(tau_max=[4.0, 34.0, 8.0, 21.0, 3.0, 3.0, 2.0])
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    binding = 0
    for step, tau, _ in swinging(planner, 600):
        assert np.abs(step.tau - tau).max() < 1e-9
        assert step.torque_excess == 0.0
        assert np.all(np.abs(tau) <= robot.limits.tau_max + 1e-6)
        binding += bool(np.any(np.abs(tau) > robot.limits.tau_max - 1e-6))
    assert binding > 10


@pytest.mark.parametrize("damping", [0.0, 0.4, 50.0])
@pytest.mark.parametrize("joint", [0, 4, 6])
def test_torque_of_a_free_swinging_joint_is_exactly_its_friction(level, damping, joint):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    planner.report(ftqp.FreeSwinging(joint, damping=damping))
    for step, tau, _ in swinging(planner, 200):
        assert abs(tau[joint] + damping * step.v[joint]) < 1e-8
        assert step.tau[joint] == 0.0 and step.tau_brake[joint] == 0.0


@pytest.mark.parametrize("own", [0.4, 50.0])
def test_free_swinging_joint_keeps_its_own_friction_beside_that_of_the_fault(level, own):
    """At the velocity after the step, so that no friction is too strong; that of the others before it."""
    bare = ftqp.robots.load("panda").with_limits(tau_max=np.inf)
    robot = bare.with_friction(viscous=own)
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    planner.report(ftqp.FreeSwinging(6, damping=0.1))
    for step, tau, v in swinging(planner, 200, bare):
        assert abs(tau[6] + (0.1 + own) * step.v[6]) < 1e-8
        assert np.abs(step.tau[:6] - tau[:6] - own * v[:6]).max() < 1e-8
    assert np.abs(step.v).max() > 0.05


def test_motors_that_turn_against_friction_keep_their_limits():
    robot = ftqp.robots.load("panda").with_limits(tau_max=[10.0, 40.0, 10.0, 24.0, 4.0, 4.0, 2.0])
    rough = robot.with_friction(viscous=2.0)
    planner = ftqp.Planner(rough, 0.002, emergency=None, task=ftqp.Task(rows="position"))
    binding = 0
    for step, tau, v in swinging(planner, 600, robot):
        motor = tau + 2.0 * v
        assert step.torque_excess == 0.0
        assert np.all(np.abs(motor) <= robot.limits.tau_max + 1e-6)
        binding += bool(np.any(np.abs(motor) > robot.limits.tau_max - 1e-6))
    assert binding > 10


DT, TICKS = 2e-3, 500
WEAK = np.array([4.0, 37.0, 9.0, 24.0, 3.0, 3.0, 2.0])
"""Motors [N m] that hold a Panda at Q, and reach their limits when its tip is drawn to and fro."""


def driven(planner, *, every_tick, events=None, ticks=TICKS):
    """Closed loop with the tip drawn to and fro: commands, statuses, and which ticks had rows."""
    robot, q, v = planner.robot, Q.copy(), np.zeros(7)
    planner.reset(q, v)
    K = planner._session.K
    pose = robot.pose(q)
    aim = ftqp.Target(pose=pose)
    commands, statuses, rows = [], [], []
    for k in range(ticks):
        if events and k in events:
            planner.report(events[k])
        if every_tick:
            K.limits.on_demand = 0
            K.limits.guard = 0.0
        away = np.array([0.0, 0.15, 0.15]) * np.sin(np.array([0.0, 5.0, 3.0]) * k * DT)
        aim.pose[:3, 3] = pose[:3, 3] + away * min(max((430 - k) / 100, 0.0), 1.0)
        step = planner.step(q, v, aim)
        commands.append(np.concatenate([step.q, step.v, step.a, step.tau, step.tau_brake]))
        statuses.append(step.status)
        rows.append(int(K.qp.nc) > 0)
        assert step.torque_excess == 0.0
        q, v = step.q.copy(), step.v.copy()
    return np.array(commands), statuses, np.array(rows)


@pytest.mark.parametrize(
    ("settings", "events"),
    [
        ({"task": ftqp.Task(rows="position")}, None),
        ({"task": ftqp.Task(rows="position")}, {60: ftqp.Locked(2), 200: ftqp.Degraded(4, torque=0.7)}),
        ({"task": ftqp.Task(rows="position", mode="scaled")}, None),
        ({"task": ftqp.Task(rows="position", calm=False), "scheme": "rmp"}, None),
    ],
)
def test_commands_are_those_with_rows_in_every_tick(level, settings, events):
    robot = ftqp.robots.load("panda").with_limits(tau_max=WEAK)

    def planner():
        return ftqp.Planner(robot, DT, level=level, emergency=None, posture=Q, **settings)

    own, said, rows = driven(planner(), every_tick=False, events=events)
    other, expected, always = driven(planner(), every_tick=True, events=events)
    assert always.all()
    binding = np.abs(other[:, 21:28]) > 0.999 * WEAK * np.where(
        np.arange(7) == 4, 0.7 if events else 1.0, 1.0
    )
    assert binding.any(axis=1).sum() > 10, "a torque limit binds now and then"
    assert 0.1 < rows.mean() < 0.9, "rows come and go"
    assert said == expected
    assert np.abs(own[:, :7] - other[:, :7]).max() < 1e-9
    assert np.abs(own[:, 21:] - other[:, 21:]).max() < 1e-4


IIWA = ftqp.robots.load("iiwa14")
NEAR = np.array([0.0, 0.02, 0.0, -1.2, 0.0, 1.0, 0.0])
"""Joint 2 near zero: with it locked the tip can hardly move one way."""


def jacobian(q):
    """The position rows of the arm's Jacobian, (3, 7)."""
    arm = ArmSession(IIWA.chain.constants())
    arm.kinematics(q)
    return arm.K.kinematics.J[:3, :7]


def step_at(damping, q=NEAR, mode="slack", twist=(0.1, 0.2, 0.1, 0.0, 0.0, 0.0), level="velocity"):
    robot = IIWA.with_limits(a_max=1e9, v_max=1e5)
    task = ftqp.Task(rows="position", mode=mode, kp=0.0, slack=1e-12, damping=damping)
    planner = ftqp.Planner(robot, 1e-3, level=level, task=task, torque_limits=False, emergency=None)
    planner.report(ftqp.Locked(1, mode="instant"))
    planner.reset(q)
    return planner, planner.step(q, np.zeros(7), ftqp.Target(pose=robot.pose(q), twist=twist))


def expected(planner, damping, twist):
    """sum_k sigma_k/(sigma_k^2 + damp_k) v_k u_k'twist, written out."""
    length = planner.robot.length
    J = jacobian(NEAR)[:, [0, 2, 3, 4, 5, 6]]
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    share = sigma / (length * damping.threshold)
    damp = np.where(share < 1.0, (length * damping.factor * (1.0 - share**2)) ** 2, 0.0)
    x = np.zeros(7)
    x[[0, 2, 3, 4, 5, 6]] = Vt.T @ (sigma / (sigma**2 + damp) * (U.T @ np.array(twist[:3])))
    return x, sigma / length


@pytest.mark.parametrize("mode", ["slack", "hard", "lexicographic"])
def test_only_singular_directions_are_damped(mode):
    damping, twist = ftqp.DirectionalDamping(threshold=1.0, factor=0.5), (0.1, 0.2, 0.1, 0.0, 0.0, 0.0)
    planner, step = step_at(damping, mode=mode, twist=twist)
    x, sigma = expected(planner, damping, twist)
    assert sigma[-1] < damping.threshold < sigma[0]
    np.testing.assert_allclose(step.v, x, rtol=1e-4, atol=1e-5)


def test_slack_is_told_along_the_rows_of_the_task():
    _, step = step_at(ftqp.DirectionalDamping(threshold=1.0, factor=0.5))
    np.testing.assert_allclose(step.slack, jacobian(NEAR) @ step.v - [0.1, 0.2, 0.1], atol=1e-9)
    assert step.status is ftqp.StepStatus.RELAXED and step.certificate.unreached


def test_away_from_singularities_damping_changes_nothing():
    q = np.array([0.3, 0.9, 0.2, -1.2, 0.4, 1.0, 0.0])
    (_, damped), (_, plain) = step_at(ftqp.DirectionalDamping(threshold=0.05), q), step_at(None, q)
    np.testing.assert_allclose(damped.v, plain.v, atol=1e-7)


PANDA = ftqp.robots.load("panda")


def weight(robot, q):
    """The torques that hold the arm still, by pinocchio."""
    return pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.configuration(q))


def weakened(level, joint, room):
    """A planner at rest whose joint has so many times the torque that holds the arm there."""
    planner = started(PANDA, DT, level=level, task=ftqp.Task(rows="position"), at=Q)
    share = room * abs(weight(PANDA, Q)[joint]) / PANDA.limits.tau_max[joint]
    planner.report(ftqp.Degraded(joint, torque=share))
    return planner


def rows(planner):
    """C, l, u of the first tick of an arm at rest that is to stay there, joint by joint."""
    planner.step(Q, np.zeros(7), ftqp.Target(pose=PANDA.pose(Q)))
    qp = planner.session().K.qp
    nc = int(qp.nc)
    return qp.C[:nc, :7].copy(), qp.l[:nc].copy(), qp.u[:nc].copy()


@pytest.mark.parametrize("joint", [1, 2, 3, 4, 5, 6])
def test_row_is_the_direction_in_which_gravity_loads_the_joint_more(level, joint):
    C, l, u = rows(weakened(level, joint, 1.3))
    assert C.shape == (14, 7)
    step = 1e-6 * np.eye(7)
    slope = [(weight(PANDA, Q + d)[joint] - weight(PANDA, Q - d)[joint]) / 2e-6 for d in step]
    np.testing.assert_allclose(C[7 + joint], slope / np.linalg.norm(slope), atol=1e-6)
    others = np.arange(7) != joint
    assert not C[7:][others].any() and np.isinf(l[7:][others]).all() and np.isinf(u[7:][others]).all()
    nearer, farther = (u, -l) if weight(PANDA, Q)[joint] > 0.0 else (-l, u)
    assert 0.0 < nearer[7 + joint] < farther[7 + joint] < np.inf


@pytest.mark.parametrize("fault", [None, ftqp.Degraded(1, velocity=0.5), ftqp.Locked(1)], ids=str)
def test_no_rows_where_no_joint_lost_torque(level, fault):
    planner = weakened(level, 3, 1.3)
    planner.withdraw(3)
    if fault is not None:
        planner.report(fault)
    assert len(rows(planner)[0]) in (0, 7)


def test_joint_that_needs_its_reserve_is_led_back_but_not_in_a_stop(level):
    planner = weakened(level, 3, 1.02)
    _, l, u = rows(planner)
    assert not l[10] <= 0.0 <= u[10]
    planner.stop()
    _, l, u = rows(planner)
    assert l[10] <= 1e-12 and u[10] >= -1e-12


@pytest.mark.parametrize("cost", [0.1, 0.5, 3.0])
@pytest.mark.parametrize("reserve", [0.0, 0.2, 1.0])
def test_what_approaches_as_fast_as_it_may_stops_before_the_limit_with_the_torque_left(reserve, cost):
    """Each tick takes no more of the braking than the share that the torque left pays for."""
    brake, dt = 8.0, 1e-3
    for d in (0.01, 0.3, 2.0):
        rate, least = holding_rate(d, reserve, brake, cost, dt), d
        for _ in range(20000):
            following = holding_rate(d - 0.5 * dt * rate, reserve, brake, cost, dt)
            share = min(1.0, (d + reserve) / cost)
            assert (rate - following) / dt <= 1.02 * brake * share + 1e-9
            d -= 0.5 * dt * (rate + following)
            rate, least = following, min(least, d)
        assert -1e-12 <= least < 0.02


def test_without_a_reserve_it_is_what_an_inverted_pendulum_can_be_caught_from():
    for d in (0.01, 0.1, 0.9):
        assert holding_rate(d, 0.0, 4.0, 1.0, 1e-6) == pytest.approx(2.0 * d, rel=1e-4)


def test_certificate_names_the_joint_that_could_not_hold_the_arm(level):
    """The tip is drawn past what the elbow, which has a tenth more torque than it needs, could hold."""
    planner = weakened(level, 3, 1.1)
    pose, q, v = PANDA.pose(Q), Q.copy(), np.zeros(7)
    goal = pose.copy()
    goal[:3, 3] += [0.4, 0.0, 0.0]
    named, least = set(), np.inf
    left = planner.session().K.limits.tau_max[3]
    for k in range(1500):
        share = min(1.0, k / 1000)
        step = planner.step(q, v, ftqp.Target(position=(1.0 - share) * pose[:3, 3] + share * goal[:3, 3]))
        named |= {(o.joint, o.limit) for o in step.certificate.obstacles} if step.certificate else set()
        q, v = step.q.copy(), step.v.copy()
        least = min(least, left - abs(weight(PANDA, q)[3]))
    assert {limit for joint, limit in named if joint == "panda_joint4"} & {
        "upper holding torque",
        "lower holding torque",
    }
    assert least > 0.0
