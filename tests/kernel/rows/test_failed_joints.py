"""A failed joint as a bound equals the arm without it; instant locks and ramps follow their formulas."""

import numpy as np
import pytest
from session_ticks import Ticks, hessian
from tests.going import closed_loop

import ftqp
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.rows.failed_joints import braked_velocity, lock_rate

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
OK = ftqp.StepStatus.OK
OPEN = {"q_min": -np.inf, "q_max": np.inf, "v_max": 1e3, "a_max": 1e5, "tau_max": np.inf}
TASK = ftqp.Task(rows="position", mode="hard")


def target(robot):
    """A point near the tip, moving."""
    p = robot.pose(Q)[:3, 3]
    return ftqp.Target(
        position=p + np.array([0.001, -0.002, 0.001]), twist=[0.05, 0.02, -0.1], acceleration=[0.3, 0.1, -0.2]
    )


def planner_of(robot, scheme, level="acceleration", task=TASK, **options):
    """A planner without limits."""
    return ftqp.Planner(robot, DT, level=level, scheme=scheme, task=task, torque_limits=False, **options)


def assembled(robot, v, fault, **options):
    """The record of one tick of the same arm, with the QP in it."""
    ticks = Ticks(robot, DT, fault, task=TASK, torque_limits=False, **options)
    ticks.reset(Q, v)
    ticks.tick(Q, v, target(robot))
    return ticks.K


@pytest.mark.parametrize("scheme", ["mvn", "rmp", "mke", "iiwt", "dlsm"])
@pytest.mark.parametrize("joint", [0, 2, 3, 5])
def test_locked_joint_as_bound_equals_removal_and_the_reduced_model(joint, scheme):
    robot = ftqp.robots.load("panda").with_limits(**OPEN)
    v = V.copy()
    v[joint] = 0.0
    planner = planner_of(robot, scheme, posture=Q + 0.1)
    planner.report(ftqp.Locked(joint))
    planner.reset(Q, v)
    a = planner.step(Q, v, target(robot)).copy().a
    H = [i for i in range(7) if i != joint]
    assert a[joint] == 0.0

    K = assembled(robot, v, ftqp.Locked(joint), scheme=scheme, posture=Q + 0.1)
    W = hessian(K)
    J, b = K.qp.A[:3, :7][:, H], K.qp.b[:3]  # column removal: x_F = 0
    kkt = np.block([[W[np.ix_(H, H)], J.T], [J, np.zeros((3, 3))]])
    removed = np.linalg.solve(kkt, np.concatenate([-K.qp.g[:7][H], b]))[:6]
    assert np.abs(a[H] - removed).max() < 1e-9

    held = ftqp.Robot.from_pinocchio(
        robot.model, robot.tip, [robot.joints[joint]], q_locked={robot.joints[joint]: Q[joint]}, limits=OPEN
    )
    reduced = planner_of(held, scheme, posture=(Q + 0.1)[H])
    reduced.reset(Q[H], v[H])
    assert np.abs(a[H] - reduced.step(Q[H], v[H], target(robot)).a).max() < 1e-9


def test_braking_joint_is_compensated_like_removal_with_its_motion_on_the_right():
    robot = ftqp.robots.load("panda").with_limits(**OPEN)
    planner = planner_of(robot, "mvn")
    planner.report(ftqp.Locked(2, deceleration=3.0))
    planner.reset(Q, V)
    a = planner.step(Q, V, target(robot)).a
    K = assembled(robot, V, ftqp.Locked(2, deceleration=3.0), scheme="mvn")
    H = [0, 1, 3, 4, 5, 6]
    assert abs(a[2] + 3.0) < 1e-12
    J = K.qp.A[:3, :7]
    shift = -4.0 * V[H]
    expected = shift + np.linalg.pinv(J[:, H]) @ (K.qp.b[:3] - J[:, 2] * a[2] - J[:, H] @ shift)
    assert np.abs(a[H] - expected).max() < 1e-9


def instantly_locked(reset, rows, V=V, *others):
    """Velocities after an instant lock of joint 3 of a moving Panda, with J and M at that configuration."""
    robot = ftqp.robots.load("panda")
    fault = ftqp.Locked(3, mode="instant", reset=reset)
    ticks = Ticks(robot, DT, fault, *others, scheme="dlsm", task=ftqp.Task(rows=rows))
    ticks.reset(Q, V)
    ticks.tick(Q, V, ftqp.Target(pose=robot.pose(Q)))
    arm = ArmSession(robot.chain.constants())
    arm.dynamics(Q, V)
    K = arm.K.kinematics
    return ticks.K.state.v[:7].copy(), K.J[:, :7], K.M[:7, :7]


H = [0, 1, 2, 4, 5, 6]


def test_kinematic_reset_leaves_the_others_alone():
    v, _, _ = instantly_locked("kinematic", "pose")
    assert v[3] == 0.0
    assert np.array_equal(v[H], V[H])


def test_momentum_reset_is_a_free_impulse():
    v, _, M = instantly_locked("momentum", "pose")
    assert v[3] == 0.0
    expected = V[H] - np.linalg.solve(M[np.ix_(H, H)], M[H, 3] * -V[3])
    assert np.abs(v[H] - expected).max() < 1e-12
    assert np.abs(M[H] @ (v - V)).max() < 1e-12  # no impulse on the joints that are free


@pytest.mark.parametrize("rows", ["pose", "position", ("x", "z")])
def test_task_reset_keeps_the_velocity_of_the_tip(rows):
    slow = 0.1 * V  # so that the whole jump is within the speed limits
    v, J, _ = instantly_locked("task", rows, slow)
    J = J[{"pose": slice(0, 6), "position": slice(0, 3)}.get(rows, [0, 2])]
    assert v[3] == 0.0
    assert np.abs(J @ (v - slow)).max() < 1e-7  # regularised by 1e-12 of its trace
    expected = slow[H] - np.linalg.pinv(J[:, H]) @ (J[:, 3] * -slow[3])
    assert np.abs(v[H] - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.long
@pytest.mark.parametrize("reset", ["momentum", "task"])
@pytest.mark.parametrize("name", ["panda", "iiwa14", "planar6"])
def test_an_instant_lock_never_throws_the_others_over_their_speed_limits(name, reset, level):
    """Fast arms, each joint locked in its turn; all others make the same share of the jump."""
    robot = ftqp.robots.load(name)
    limits, n = robot.limits, robot.nv
    rng, shortened = np.random.default_rng(11), 0
    for _ in range(40):
        q = rng.uniform(limits.q_min, limits.q_max)
        room = np.minimum(limits.q_max - q, q - limits.q_min)
        v = rng.choice([-1.0, 1.0], n) * 0.95 * np.minimum(limits.v_max, np.sqrt(0.1 * limits.a_max * room))
        joint = int(rng.integers(n))
        planner = ftqp.Planner(robot, DT, level=level, emergency=None)
        planner.reset(q, v)
        planner.report(ftqp.Locked(joint, mode="instant", reset=reset))
        step = planner.step(q, v, ftqp.Target(pose=robot.pose(q)))
        after, others = planner.session().K.state.v[:n], np.arange(n) != joint
        assert np.all(np.abs(after) <= limits.v_max * (1.0 + 1e-9)) and after[joint] == 0.0
        assert np.all(np.abs(step.v) <= limits.v_max * (1.0 + 1e-9))
        assert step.outside == ()
        if step.certificate is not None and step.certificate.jump < 1.0:
            shortened += 1
            assert step.status is not OK
            assert f"{step.certificate.jump:.0%} of the jump" in str(step.certificate)
            most = np.where(after > 0.0, limits.q_max - q, q - limits.q_min)
            reserve = planner.session().K.limits.a_brake[:n]
            full = np.minimum(limits.v_max, np.sqrt(2.0 * reserve * most))
            assert np.any(np.abs(after[others]) >= full[others] * (1.0 - 1e-9))
    assert shortened >= 3


@pytest.mark.parametrize("room", [0.3, 0.05, 0.01])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_lock_ramp_stops_within_the_range_where_the_acceleration_limit_can(side, room, level):
    robot = ftqp.robots.load("panda")
    limits = robot.limits
    planner = ftqp.Planner(robot, DT, level=level, emergency=None)
    q, v = Q.copy(), np.zeros(7)
    v[4] = side * 0.98 * np.sqrt(2.0 * limits.a_max[4] * room) if room < 0.3 else side * 2.0
    q[4] = side * (limits.q_max[4] if side > 0.0 else -limits.q_min[4]) - side * room
    planner.report(ftqp.Locked(4))
    before = v[4]
    for step in closed_loop(planner, ftqp.Target(pose=robot.pose(q)), 600, q, v):
        assert abs(before - step.v[4]) <= limits.a_max[4] * DT * (1.0 + 1e-9)
        assert limits.q_min[4] - 1e-9 <= step.q[4] <= limits.q_max[4] + 1e-9
        before = step.v[4]
    assert before == 0.0 and step.outside == ()


@pytest.mark.parametrize("asked", [1e-6, 0.3])
def test_a_ramp_of_whole_ticks_ends_at_the_end_of_its_room_and_not_beyond(asked):
    """Joints that the limit can just stop, and others with up to half as much room again."""
    rng = np.random.default_rng(5)
    a_max, v = rng.uniform(2.0, 15.0, 2000), rng.uniform(0.01, 2.0, 2000)
    room = v * (v / a_max + DT) / 2.0 * rng.uniform(1.0, 1.5, 2000)
    way = np.zeros(2000)
    for _ in range(4000):
        after = braked_velocity(v, lock_rate(v, room - way, asked * a_max, a_max, DT), DT)
        way, v = way + DT * (v + after) / 2.0, after
    assert not v.any() and (way <= room).all()
    assert (room - way < a_max * DT**2).mean() > 0.5, "nor does it brake harder than it has to"


@pytest.mark.parametrize("start", [0.35, -0.4, 1e-9, 0.003])
def test_a_ramp_ends_exactly_at_rest_and_stays_there(level, start):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows="position"))
    v = np.zeros(7)
    v[2] = start
    planner.report(ftqp.Locked(2, deceleration=0.7))
    before, held, off, ticks = start, None, [], int(abs(start) / (0.7 * DT)) + 5
    for step in closed_loop(planner, ftqp.Target(position=robot.pose(Q)[:3, 3]), ticks, Q, v):
        slowed = abs(before) - abs(step.v[2])
        off.append(abs(slowed - min(0.7 * DT, abs(before))))
        if step.v[2] == 0.0 and before == 0.0:
            assert step.a[2] == 0.0
            assert held is None or step.q[2] == held  # bitwise
            held = step.q[2]
        before = step.v[2]
    assert held is not None
    most, *others = sorted(off, reverse=True)
    assert most < 4e-15 and max(others) < 1e-15  # once: rounding of what was sent until then


TICK = 1e-3
PANDA = ftqp.robots.load("panda")


def strays(joint, at=700):
    """How far the tip strays after a joint has stopped at once, and how far at full acceleration [m]."""
    planner = ftqp.Planner(PANDA, TICK, task=ftqp.Task(rows="position"), emergency=None)
    q, v = PANDA.neutral.copy(), np.zeros(7)
    planner.reset(q)
    path = ftqp.paths.Circle(PANDA.pose(q), radius=0.1, duration=2.0).sample(TICK * np.arange(2000))
    targets, worst, bound, held = ftqp.Targets(path.pose, path.twist, path.acceleration), 0.0, 0.0, None
    for k in range(1600):
        if k == at:
            held = float(q[joint])
            J = PANDA.jacobian(q)[:3]
            lost, others = J[:, joint] * v[joint], [i for i in range(7) if i != joint]
            jump = np.linalg.pinv(J[:, others]) @ lost
            bound = (
                float(np.linalg.norm(lost)) * 0.5 * float(np.max(np.abs(jump) / PANDA.limits.a_max[others]))
            )
            planner.report(ftqp.Locked(joint))
        step = planner.step(q, None, targets.at(k))
        q, v = step.q.copy(), step.v.copy()
        if held is not None:
            q[joint] = held
            tip = PANDA.pose(q)[:3, 3]
            worst = max(worst, float(np.linalg.norm(tip - path.pose[k + 1][:3, 3])))
    return worst, bound


@pytest.mark.parametrize("joint", [0, 2, 3])
def test_the_tip_strays_no_more_than_twice_what_the_joints_need_at_full_acceleration(joint):
    worst, bound = strays(joint)
    assert 0.0 < worst < 2.0 * bound + 2e-5, (worst, bound)
