"""A certificate reads as a sentence about the robot."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.certificate import Certificate, Obstacle, Outside, Unreached

Z = Unreached(direction="z", amount=-0.25, unit="m/s2")
RX = Unreached(direction="rx", amount=1e-3, unit="rad/s2")
ELBOW = Obstacle(joint="elbow", limit="upper position", weight=1.0)
WRIST = Obstacle(joint="wrist", limit="locked", weight=0.5)


@pytest.mark.parametrize(
    ("unreached", "obstacles", "sentence"),
    [
        (
            (Z, RX),
            (ELBOW, WRIST),
            "the task misses z by -0.25 m/s2, rx by +0.001 rad/s2; "
            "in the way: elbow at upper position, wrist at locked",
        ),
        ((), (ELBOW,), "the task misses nothing; in the way: elbow at upper position"),
    ],
)
def test_certificate_is_a_sentence_of_directions_and_joints(unreached, obstacles, sentence):
    assert str(Certificate(unreached=unreached, obstacles=obstacles)) == sentence


def test_certificate_says_which_joints_are_outside_and_what_a_lock_has_thrown():
    beyond = Outside(joint="elbow", limit="upper position", amount=0.05, unit="rad")
    outside = Certificate(unreached=(), obstacles=(), outside=(beyond,))
    assert str(outside) == "outside: elbow beyond upper position by 0.05 rad"
    both = Certificate(unreached=(Z,), obstacles=(), outside=(beyond,), jump=0.25, without_bound="singular")
    assert str(both) == (
        "the task misses z by -0.25 m/s2; in the way: the arm cannot move that way (singular); "
        "outside: elbow beyond upper position by 0.05 rad; 25% of the jump at the lock was made"
    )


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("what", ["position", "velocity"])
@pytest.mark.parametrize("fault", [None, ftqp.Locked(4), ftqp.FreeSwinging(4, 2.0)])
def test_ok_is_not_said_while_a_joint_is_outside_its_limits(level, side, what, fault):
    panda, sign = ftqp.robots.load("panda"), 1.0 if side == "upper" else -1.0
    planner = ftqp.Planner(panda, 2e-3, level=level)
    if fault is not None:
        planner.report(fault)
    q, v = panda.neutral.copy(), np.zeros(7)
    if what == "position":
        q[4] = sign * (panda.limits.q_max[4] if side == "upper" else -panda.limits.q_min[4]) + sign * 0.03
    else:
        v[4] = sign * (panda.limits.v_max[4] + 0.2)
    planner.reset(q, v)
    step = planner.step(q, v, ftqp.Target(pose=panda.pose(q))).copy()
    if what == "velocity" and fault is not None:
        assert step.outside == ()  # the speed of a failed joint is nobody's command
        return
    assert step.outside == ("panda_joint5",) and step.status is ftqp.StepStatus.RELAXED
    (found,) = step.certificate.outside
    assert (found.joint, found.limit) == ("panda_joint5", f"{side} {what}")
    assert found.amount == pytest.approx(0.03 if what == "position" else 0.2)


def far_target(robot, q):
    pose = robot.pose(q).copy()
    pose[:3, 3] += (0.3, 0.1, -0.2)
    return ftqp.Target(pose=pose)


@pytest.mark.parametrize(("level", "per"), [("acceleration", "s2"), ("velocity", "s")])
def test_calm_is_not_called_singular_and_amounts_have_the_units_of_the_level(level, per):
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, 2e-3, level=level)
    q = panda.neutral
    planner.reset(q)
    target, said = far_target(panda, q), []
    for _ in range(500):
        step = planner.step(q, None, target)
        q = step.q.copy()
        found = step.certificate
        if found is not None and found.unreached and not found.obstacles and step.sigma_min > 0.3:
            said.append(found)
            for missing in found.unreached:
                unit = "rad" if missing.direction.startswith("r") else "m"
                assert missing.unit == f"{unit}/{per}" and f"{missing.amount:+.3g} {unit}/{per}" in str(found)
    assert said and all(found.without_bound == "calm" for found in said)
    assert "no limit, but the damping with which the arm comes to rest" in str(said[0])


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize(("q", "cause"), [(np.zeros(4), "singular"), (np.full(4, 0.5), "objective")])
def test_singular_is_said_of_the_direction_that_the_arm_cannot_move_in(level, q, cause):
    robot = ftqp.robots.load("planar(4)")
    planner = ftqp.Planner(robot, 2e-3, level=level, task=ftqp.Task(rows=("x", "y"), slack=1.0, calm=False))
    planner.reset(q)
    twist = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])  # a straight arm cannot move along itself
    found = planner.step(q, None, ftqp.Target(pose=robot.pose(q), twist=twist)).certificate
    assert found.unreached[0].direction == "x" and not found.obstacles
    assert found.without_bound == cause
    assert ("singular" in str(found)) == (cause == "singular")


def test_joint_that_slides_is_outside_by_metres():
    table = [[0.0, 0.0, 0.4, 0.0], [0.0, 0.0, 0.3, np.pi], [0.0, 0.0, 0.0, 0.0]]  # a SCARA
    limits = {"q_min": [-2, -2, 0], "q_max": [2, 2, 0.2], "v_max": 1.0, "a_max": 5.0}
    robot = ftqp.Robot.from_dh(table, limits=limits, prismatic=[2])
    q = np.array([0.3, 0.4, 0.25])
    planner = ftqp.Planner(robot, 2e-3, task=ftqp.Task(rows="position"))
    planner.reset(q)
    step = planner.step(q, None, ftqp.Target(pose=robot.pose(q)))
    (found,) = step.certificate.outside
    assert (found.joint, found.unit) == (robot.joints[2], "m") and "by 0.05 m" in str(step.certificate)


def test_relaxed_beside_a_free_swinging_joint_says_what_is_done_instead_of_the_task():
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, 2e-3)
    planner.reset(panda.neutral)
    planner.report(ftqp.FreeSwinging(3))
    step = planner.step(panda.neutral, None, ftqp.Target(pose=panda.pose(panda.neutral)))
    assert step.status is ftqp.StepStatus.RELAXED
    assert step.certificate.instead == (step.notice,)
    assert str(step.certificate).startswith("panda_joint4 swings freely: ")


def test_torques_beyond_their_limits_and_rows_that_were_given_up_are_named():
    weak, gone = (
        "torques exceed their limits by up to 3.2 N m",
        "rows of the task were given up, x, y are kept",
    )
    assert str(Certificate(unreached=(), obstacles=(ELBOW,), instead=(weak, gone))) == f"{weak}; {gone}"


DT, JOINT, NOISE = 1e-3, 1, 1e-4


def seen_beyond(amount, sigma=0.0, *, seed=None):
    """The steps of an arm whose joint stands at its upper limit and is measured beyond it by ``amount``."""
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, DT, noise=ftqp.Noise(q=sigma))
    q = panda.neutral.copy()
    q[JOINT] = panda.limits.q_max[JOINT]
    planner.reset(q)
    target, random = ftqp.Target(pose=panda.pose(q)), np.random.default_rng(seed)
    place, steps = q, []
    for _ in range(100):
        measured = place.copy()
        measured[JOINT] += amount
        if seed is not None:
            measured += sigma * random.standard_normal(7)
        steps.append(planner.step(measured, np.zeros(7), target).copy())
        place = steps[-1].q
    return steps


@pytest.mark.parametrize("amount", [1e-5, 1e-4, 1e-3])
def test_a_joint_measured_beyond_its_range_is_named_and_nothing_is_ok(amount):
    for step in seen_beyond(amount):
        assert step.outside == ("panda_joint2",)
        assert step.status is not ftqp.StepStatus.OK
        if step.certificate is not None:
            (found,) = step.certificate.outside
            assert found.limit == "upper position" and found.amount > 0.5 * amount


def test_noise_that_the_planner_knows_puts_no_joint_outside():
    assert not any(step.outside for step in seen_beyond(0.0, NOISE, seed=1))
    assert all(step.outside for step in seen_beyond(12.0 * NOISE, NOISE, seed=1)[:20])
