"""An arm on a body that floats: momentum stays 0 by pinocchio, and the tip arrives, also with a lock."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from tests.ets7 import ets7
from tests.going import closed_loop, targets_along

import ftqp
from ftqp.core.errors import InputError
from ftqp.model.serial import Inertial
from ftqp.sim.plants.servo_plant import ServoPlant

BODY = Inertial(mass=150.0, com=np.array([0.0, 0.0, -0.3]), inertia=np.diag([20.0, 15.0, 18.0]))
ROBOT = ftqp.robots.load("panda").on_free_base(BODY)
LEVELS = ("acceleration", "velocity")
DT = 1e-3


def momentum(q, v):
    """Linear [kg m/s] and angular [kg m2/s] momentum of all bodies about their centre of mass, (6,)."""
    data = ROBOT.model.createData()
    return pin.computeCentroidalMomentum(ROBOT.model, data, ROBOT.configuration(q), v).vector.copy()


def moved(level, lock=None, steps=2000, **settings):
    """The tip goes 0.3 m along a line in space; steps' q and v, the last step, and the target at last."""
    planner = ftqp.Planner(ROBOT, DT, level=level, task=ftqp.Task("pose"), **settings)
    line = ftqp.paths.Line(ROBOT.pose(ROBOT.neutral), (-0.1, 0.2, 0.2), duration=0.8 * steps * DT)
    return *followed(planner, line, steps, ROBOT.neutral, lock), line.sample(DT * steps).pose[0]


def followed(planner, line, steps, q, lock=None):
    """Each tick's q, v and a on a line, and the last step; a joint may lock after a third of the way."""
    told, fails = [], {}
    if lock is not None:
        fails[steps // 3] = lambda planner: planner.report(ftqp.Locked(lock))
    for step in closed_loop(planner, targets_along(line, steps, DT).at, steps, q, events=fails):
        told.append((q, step.v.copy(), step.a.copy()))
        q = step.q.copy()
    return told, step


@pytest.mark.parametrize("lock", [None, "panda_joint3"])
def test_momentum_stays_zero_and_the_tip_arrives(level, lock):
    told, step, target = moved(level, lock)
    assert step.status is ftqp.StepStatus.OK
    assert np.linalg.norm(ROBOT.pose(step.q)[:3, 3] - target[:3, 3]) < 1e-4
    scale = 150.0 * 0.1
    ends = [(q, v) for q, v, _ in told]
    if level == "acceleration":  # the velocity is that at the end of the tick
        ends = [(after[0], before[1]) for before, after in pairwise(told)]
    assert max(np.abs(momentum(q, v)).max() for q, v in ends) < 1e-9 * scale
    turned = np.abs(step.q[3:6]).max()
    assert 1e-3 < turned < 0.3, "the body gives way"


def test_the_forces_on_the_body_are_zero_in_every_tick():
    """By pinocchio: the rows of M a + h that belong to the body, at the commanded acceleration."""
    told, _, _ = moved("acceleration", "panda_joint3", steps=600)
    data = ROBOT.model.createData()
    before = np.zeros(13)
    for q, v, a in told:
        tau = pin.rnea(ROBOT.model, data, ROBOT.configuration(q), before, a)
        assert np.abs(tau[:6]).max() < 1e-6
        before = v


def reacted(robot, told, level):
    """Where the body comes to by its momentum, 0, while the arm moves as told: pinocchio, two steps a tick.

    The momentum is that about the centre of mass, which the kernel's M does not know. In a tick the arm moves
    at constant velocity, or at constant acceleration from the last velocity on.
    """
    data, body, start = robot.model.createData(), robot.neutral[:6].copy(), robot.neutral[6:]
    first, fine, n = np.zeros(robot.nv - 6), 2, robot.nv
    for _, v, _ in told:
        last = v[6:]
        first = first if level == "acceleration" else last

        def rate(s, body, start=start, first=first, last=last):
            arm = start + s * DT * (first + 0.5 * s * (last - first))
            q = robot.configuration(np.r_[body, arm])
            A = pin.computeCentroidalMap(robot.model, data, q)
            return np.linalg.solve(A[:, :6], -A[:, 6:n] @ (first + s * (last - first)))

        for s in np.arange(fine) / fine:
            h = DT / fine
            a = rate(s, body)
            b = rate(s + 0.5 / fine, body + 0.5 * h * a)
            c = rate(s + 0.5 / fine, body + 0.5 * h * b)
            body = body + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(s + 1.0 / fine, body + h * c))
        start, first = start + 0.5 * DT * (first + last), last
    return body


@pytest.mark.parametrize(
    ("level", "lock", "rows"),
    [("acceleration", 2, "position"), ("velocity", None, "pose")]
    + [pytest.param(level, 2, "pose", marks=pytest.mark.slow) for level in LEVELS],
)
def test_the_attitude_of_ets7_is_that_of_an_integration_of_the_momentum_equations(level, lock, rows):
    """Also where a joint locks on the way; six joints then follow what they can."""
    robot, steps = ets7(), 1500
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(rows), emergency=None)
    q = robot.neutral + np.r_[np.zeros(6), 0.4, -0.9, 1.2, 0.6, -0.7, 0.3]
    robot = replace(robot, neutral=q)
    line = ftqp.paths.Line(robot.pose(q), (-0.05, 0.1, -0.05), duration=0.9 * steps * DT)
    told, step = followed(planner, line, steps, q, lock and f"joint{lock}")
    q = step.q
    assert np.abs(q[6:] - robot.neutral[6:]).max() > 0.01 and np.abs(q[3:6]).max() > 1e-4
    assert np.abs(q[:6] - reacted(robot, told, level)).max() < 1e-9


def test_a_stop_brings_the_arm_and_the_body_to_rest():
    planner = ftqp.Planner(ROBOT, DT, level="velocity", task=ftqp.Task("pose"))
    away = ftqp.paths.Line(ROBOT.pose(ROBOT.neutral), (-0.1, 0.0, 0.1), duration=1.0)
    stop = {400: lambda planner: planner.stop()}
    *_, step = closed_loop(planner, targets_along(away, 900, DT).at, 900, events=stop)
    assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-9


def test_what_cannot_float_is_refused_in_one_sentence():
    with pytest.raises(InputError, match="has no masses, so no base that floats"):
        ftqp.robots.load("srs7").on_free_base(BODY)
    with pytest.raises(InputError, match="has a joint 'float_x' already"):
        ROBOT.on_free_base(BODY)
    with pytest.raises(InputError, match="inertial"):
        ftqp.robots.load("panda").on_free_base(150.0)


def of_planner(**settings):
    return lambda: ftqp.Planner(ROBOT, **settings)


def told(fault):
    return lambda: ftqp.Planner(ROBOT).report(fault)


@pytest.mark.parametrize(("use", "sentence"), [
    (of_planner(level="velocity", scheme="pseudoinverse"), "'pseudoinverse', which solves no QP, needs"),
    (of_planner(drive="torque"), "drive 'torque' needs a base that stands, but panda floats"),
    (lambda: ftqp.MujocoPlant(ROBOT, DT), "plant 'mujoco', whose motors would hold it, needs"),
    (lambda: ServoPlant(ROBOT, DT), "plant 'servo', which would hold it, needs a base that stands"),
    (told(ftqp.Locked("float_yaw")), "float_yaw has no motor that could fail, .* panda_joint1"),
    (told(ftqp.FreeSwinging("panda_joint3")), "needs a base that stands, but panda floats"),
])  # fmt: skip
def test_what_would_forget_the_momentum_is_refused_in_one_sentence(use, sentence):
    with pytest.raises(InputError, match=sentence):
        use()
