"""Arms with weak joints, and random ways to a goal: they end within limits, and say how."""

import logging

import numpy as np
import pinocchio as pin
import pytest
from tests.going import closed_loop, started, targets_along

import ftqp
from ftqp.core.pose import rotation_exp, transform

TWO_MS = 2e-3
ARMS = ("panda", "iiwa14", "xarm7")


def weight(robot, q):
    """The torques that hold the arm still, by pinocchio."""
    return pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.configuration(q))


def posture(robot, rng):
    """A posture well inside the ranges."""
    low = np.where(np.isfinite(robot.limits.q_min), robot.limits.q_min, -3.0)
    high = np.where(np.isfinite(robot.limits.q_max), robot.limits.q_max, 3.0)
    return low + (high - low) * rng.uniform(0.2, 0.8, robot.nv)


def loaded(robot, q):
    """Joints that gravity loads at q, the heaviest first."""
    held = np.abs(weight(robot, q))
    return [int(i) for i in np.argsort(-held) if held[i] > 0.02 * held.max()]


@pytest.mark.long
@pytest.mark.parametrize("emergency", [None, ftqp.EmergencyStop()], ids=["goes on", "stops"])
@pytest.mark.parametrize("name", ARMS)
def test_arm_that_can_hold_itself_is_led_to_where_it_can(name, level, emergency):
    """From rest to a random place: gravity takes less than what the weak joint has left, at every tick."""
    robot, rng = ftqp.robots.load(name), np.random.default_rng(ARMS.index(name))
    tempted = 0
    for _ in range(6):
        q = posture(robot, rng)
        goal = robot.pose(posture(robot, rng))
        joint = int(rng.choice(loaded(robot, q)))
        left = min(rng.uniform(1.06, 1.6) * abs(weight(robot, q)[joint]), robot.limits.tau_max[joint])
        planner = started(
            robot, TWO_MS, at=q, level=level, task=ftqp.Task(rows="position"), emergency=emergency
        )
        planner.report(ftqp.Degraded(joint, torque=left / robot.limits.tau_max[joint]))
        begin, most = robot.pose(q)[:3, 3], 0.0
        shares = np.minimum(np.arange(1500) / 1000, 1.0)
        way = [ftqp.Target(position=begin + share * (goal[:3, 3] - begin)) for share in shares]
        for step in closed_loop(planner, way.__getitem__, len(way), q, reset=False):
            assert (np.abs(step.v) <= robot.limits.v_max * (1.0 + 1e-9)).all()
            most = max(most, abs(weight(robot, step.q)[joint]) / left)
        assert most <= 1.0, (joint, most)
        tempted += most > 0.9
    assert tempted > 0 or emergency is not None, "an arm that is stopped for its error may not come near"


def circle_of(seed, duration):
    """A Panda's posture, and a circle from there in a plane of its own."""
    robot, rng = ftqp.robots.load("panda"), np.random.default_rng(seed)
    q = np.clip(robot.neutral + rng.uniform(-0.6, 0.6, 7), robot.limits.q_min + 0.3, robot.limits.q_max - 0.3)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return robot, q, ftqp.paths.Circle(robot.pose(q), 0.1, duration=duration, axes=(axes[0], axes[1]))


def test_weak_shoulder_goes_round_a_circle_whose_shortest_way_it_could_not_hold(level):
    """A Panda whose second joint has 8 % of its torque, a twentieth more than it needs where that is told."""
    robot, q, path = circle_of(100, 5.0)
    targets, left = targets_along(path, 2800, TWO_MS), np.inf
    for tells in (True, False):
        planner = started(robot, TWO_MS, at=q, level=level, task=ftqp.Task(rows="position"))
        needed = 0.0
        for k, step in enumerate(closed_loop(planner, targets.at, 2800, q)):
            held = abs(weight(robot, step.q)[1])
            if k == 499 and tells:
                left = 1.05 * held
                planner.report(ftqp.Degraded(1, torque=left / robot.limits.tau_max[1]))
            needed = max(needed, held if k >= 500 else 0.0)
        assert step.position_error < 1e-3
        assert (needed <= left) == tells, "healthy it goes where the weak joint could not hold the arm"
    assert planner.stopped_because is None


def test_stop_brakes_the_arm_before_a_weak_joint_is_where_it_could_not_hold_it(level):
    """A Panda loses its task because its second joint keeps 5 % of its torque, and is stopped on the way."""
    robot, q, path = circle_of(107, 6.0)
    planner = started(robot, TWO_MS, at=q, level=level)
    targets, weak, stopped = targets_along(path, 3500, TWO_MS), ftqp.Degraded(1, torque=0.05), 0
    steps = closed_loop(planner, targets.at, 3500, q, events={900: lambda planner: planner.report(weak)})
    for k, step in enumerate(steps):
        stopped += planner.stopped_because is not None
        assert abs(weight(robot, step.q)[1]) <= 0.05 * robot.limits.tau_max[1] or k < 900, k
    assert stopped > 500
    assert step.status == ftqp.StepStatus.STOPPED


def test_arm_that_cannot_hold_itself_is_stopped_as_before(level):
    robot = ftqp.robots.load("panda")
    planner = started(robot, TWO_MS, level=level)
    share = 0.9 * abs(weight(robot, robot.neutral)[3]) / robot.limits.tau_max[3]
    planner.report(ftqp.Degraded(3, torque=share))
    assert planner.stopped_because == "panda_joint4 cannot hold the arm here with the torque that it has left"


LEVELS = ["acceleration", "velocity"]
DT = 4e-3


@pytest.mark.long
def test_random_ways_end_within_limits_and_say_so():
    """Robots, goals, starts outside the limits or moving, faults and a lost sample, all at random."""
    robots = [ftqp.robots.load(name) for name in ("panda", "iiwa14", "planar(4)")]
    for seed in range(18):
        rng = np.random.default_rng(seed)
        robot = robots[seed % 3]
        low, high = np.maximum(robot.limits.q_min, -3.0), np.minimum(robot.limits.q_max, 3.0)
        start, goal = (low + (high - low) * rng.uniform(0.1, 0.9, robot.nv) for _ in range(2))
        if seed % 5 == 0:
            start[0] = high[0] + 0.05
        v = rng.uniform(-0.3, 0.3, robot.nv) * (seed % 4 == 0)
        planner = ftqp.Planner(robot, DT, level=LEVELS[seed // 3 % 2])
        planner.reset(start, v)
        goto = ftqp.GoTo(planner, **({"q": goal} if seed % 2 else {"pose": robot.pose(goal)}))
        joint, at, lost = int(rng.integers(robot.nv)), int(rng.integers(600)), int(rng.integers(900))
        fault = (ftqp.Locked(joint), ftqp.Degraded(joint, velocity=0.4), ftqp.Degraded(joint, torque=0.6))[
            int(rng.integers(3))
        ]
        q, before = start, v
        for k in range(round(25.0 / DT)):
            if k == at:
                planner.report(fault)
            step = goto.step(np.full(robot.nv, np.nan) if k == lost else q, before)
            assert (np.abs(step.v) <= robot.limits.v_max * (1.0 + 1e-9)).all(), f"seed {seed}"
            healthy = [name not in planner.faults for name in robot.joints]
            change = np.abs(step.v - before)[healthy]
            assert (change <= DT * robot.limits.a_max[healthy] * (1.0 + 1e-6)).all(), f"seed {seed}"
            q, before = step.q.copy(), step.v.copy()
            assert np.isfinite(q).all()
            if goto.done:
                break
        assert goto.done, f"seed {seed}"
        assert goto.status is not ftqp.GoToStatus.HALTED, f"seed {seed}"
        if seed % 2 and goto.status is ftqp.GoToStatus.UNREACHABLE:
            off = np.abs(goto.joint_error) > 1e-3
            assert off.any() and not off[planner.view().working].any(), f"seed {seed}"


def solid(mass):
    axes = " ".join(f'{axis}="{0.02 * mass}"' for axis in ("ixx", "iyy", "izz"))
    return f'<inertial><mass value="{mass}"/><inertia {axes} ixy="0" ixz="0" iyz="0"/></inertial>'


SLIDER = f"""<robot name="slider">
<link name="base"/><link name="l1">{solid(0.5)}</link><link name="l2">{solid(4)}</link>
<link name="l3">{solid(1.5)}</link><link name="tool"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="l1"/>
<axis xyz="-0.82 0.09 0.57"/><limit effort="400" velocity="8"/></joint>
<joint name="slide" type="prismatic"><parent link="l1"/><child link="l2"/><axis xyz="0 0 -1"/>
<origin xyz="-0.49 0.26 -0.27" rpy="-1.69 1.42 -0.81"/>
<limit lower="-0.6" upper="0.19" effort="50" velocity="0.1"/></joint>
<joint name="tilt" type="revolute"><parent link="l2"/><child link="l3"/><axis xyz="-0.2 0.68 -0.7"/>
<origin xyz="-0.04 -0.04 -0.18" rpy="3.07 0.03 0.85"/>
<limit lower="-0.75" upper="0.71" effort="50" velocity="1"/></joint>
<joint name="hold" type="fixed"><parent link="l3"/><child link="tool"/>
<origin xyz="0.1 0 0.05" rpy="0.3 0.2 0.1"/></joint></robot>"""
"""An arm whose second joint is slow, and which swings for long at a pose out of its reach."""


def ended(goto, q, longest):
    """The end of a way: q there, and the largest share of a speed limit in the 2 s after it."""
    planner = goto.planner
    ticks, after, share = round(longest / planner.dt), round(2.0 / planner.dt), 0.0
    while ticks > 0 and not goto.done:
        q = goto.step(q, None).q.copy()
        ticks -= 1
    assert goto.done
    end = q
    for _ in range(after):
        step = goto.step(q, None)
        q, share = step.q.copy(), max(share, float(np.max(np.abs(step.v) / planner.robot.limits.v_max)))
    return end, share


def test_arm_that_swings_out_of_reach_is_said_to_rest_when_it_does():
    """Every half swing ends in a moment without speed, which is no rest."""
    start = np.array([1.19, 0.14, 0.16])
    planner = started(ftqp.Robot.from_urdf(SLIDER, tip="tool"), 0.01, at=start)
    goal = transform(rotation_exp(np.array([2.0, -0.4, 0.9])), np.array([0.24, -0.14, 0.6]))
    goto = ftqp.GoTo(planner, pose=goal)
    _, share = ended(goto, start, 25.0)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and share < 0.02
    assert f"{goto.position_error:.3g} m and" in goto.sentence and goto.position_error > 1.0


@pytest.mark.long
def test_arm_that_is_too_weak_for_its_load_at_a_pose_rests_where_it_is_strong_enough(level):
    panda = ftqp.robots.load("panda")
    planner = started(panda, DT, level=level)
    planner.carry(ftqp.Payload(8.0))
    goto = ftqp.GoTo(planner, pose=panda.pose(np.array([0.0, 1.47, 0.0, -0.2, 0.0, 1.6, 0.8])))
    q, share = ended(goto, panda.neutral, 20.0)
    model = planner.robot.model
    held = np.abs(pin.computeGeneralizedGravity(model, model.createData(), q))
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and share < 0.02
    assert (held < panda.limits.tau_max).all()


@pytest.mark.long
def test_arm_that_its_motors_cannot_hold_is_stopped_and_that_is_said(caplog):
    panda = ftqp.robots.load("panda")
    planner = started(panda, DT)
    planner.carry(ftqp.Payload(30.0))
    goal = panda.pose(panda.neutral)
    goal[:3, 3] += 0.5
    goto = ftqp.GoTo(planner, pose=goal, straight=True)
    caplog.set_level(logging.WARNING, logger="ftqp")
    ended(goto, panda.neutral, 30.0)
    assert goto.status is ftqp.GoToStatus.HALTED
    assert caplog.messages[-1] == (
        "the arm does not come to rest near its goal, so its planner stops it; call resume() or reset() to "
        "go on"
    )


@pytest.mark.long
def test_joints_that_the_scheme_goes_on_moving_do_not_keep_a_pose_from_being_reached():
    panda = ftqp.robots.load("panda")
    start = panda.neutral + np.random.default_rng(1).uniform(-0.4, 0.4, 7)
    planner = started(panda, DT, at=start, scheme="man")
    goto = ftqp.GoTo(planner, pose=panda.pose(panda.neutral), straight=True)
    ended(goto, start, 20.0)
    assert goto.status is ftqp.GoToStatus.REACHED
    assert goto.sentence == "the end effector is at its goal, while the scheme goes on moving the joints"
