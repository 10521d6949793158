"""What serves which robots: every field of the table is tried."""

from pathlib import Path

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp
from ftqp.analysis.planning.plan_case import PlanSettings
from ftqp.control.task.compatibility import NEEDS, ROBOTS, robots_table
from ftqp.core.errors import InputError
from ftqp.model.serial import Inertial
from ftqp.sim.plants.servo_plant import ServoPlant

DT = 1e-3
PAGE = Path(__file__).resolve().parents[2] / "docs/compatibility.md"


@pytest.fixture(scope="module")
def robots():
    """A robot of each kind, with a posture away from its limits."""
    panda = ftqp.robots.load("panda").with_rotors(0.1)
    dual = ftqp.robots.load("dual_panda").with_rotors(0.1)
    body = Inertial(mass=150.0, com=np.zeros(3), inertia=np.diag([20.0, 15.0, 18.0]))
    led = ftqp.Robot.from_urdf(telescope(), "tool")
    q = np.array([0.3, 0.2, 0.0, 0.5, 0.0, 0.2, 0.9, 0.3])
    q = led.chain.ratio * q[led.chain.lead] + led.chain.offset
    floating = panda.on_free_base(body)
    return dict(zip(ROBOTS, ((panda, panda.neutral), (dual, dual.neutral), (led, q),
                             (floating, floating.neutral)), strict=True))  # fmt: skip


def stepped(robot, q, **settings):
    planner = ftqp.Planner(robot, DT, **{"task": ftqp.Task("position"), **settings})
    planner.reset(q)
    planner.step(q, None, ftqp.Target(pose=robot.pose(q)))
    return planner


def motor(robot):
    """A joint with a motor of its own, that no other follows."""
    return next(j for i, j in enumerate(robot.joints) if i >= robot.chain.floating + 2
                and robot.chain.lead[i] == i)  # fmt: skip


def line(robot, q):
    return ftqp.paths.Line(robot.pose(q), (0.0, 0.0, 0.02), duration=0.5)


def with_tasks(robot, q):
    tasks = [ftqp.Task("position"), ftqp.PostureTask(q)]
    keep = ftqp.Keep(robot.tip, above=[0, 0, -9.0])
    stepped(robot, q, task=None, tasks=tasks, constraints=[keep], clearance=ftqp.Clearance())


def failing(robot, q):
    stepped(robot, q).report(ftqp.Locked(motor(robot)))
    stepped(robot, q, n_minus_one=ftqp.NMinusOne()).report(ftqp.Degraded(motor(robot), velocity=0.5))


def led(robot, q):
    follower = ftqp.PathFollower(stepped(robot, q, task=ftqp.Task("position", mode="scaled")), line(robot, q))
    follower.reset(q)
    follower.step(q, None)
    goto = ftqp.GoTo(stepped(robot, q), pose=line(robot, q).sample([0.5]).pose[0])
    goto.reset(q)
    goto.step(q, None)


def searched(robot, q):
    ftqp.postures(robot, robot.pose(q), near=q)
    ftqp.analysis.plan(robot, line(robot, q), q, settings=PlanSettings(waypoints=20))


def spherical(robot, q):
    """The same kind of robot with a spherical wrist, which the scheme needs; only the serial one has it."""
    serial = robot.is_serial and not robot.chain.floating
    arm = ftqp.robots.load("puma560") if serial and (robot.chain.lead == np.arange(robot.nv)).all() else robot
    stepped(arm, arm.neutral, level="velocity", scheme="approximate_pseudoinverse", task=ftqp.Task("pose"))


USES = {
    "targets, tasks, constraints, a scene": with_tasks,
    "locked and degraded joints, `NMinusOne`": failing,
    "`PathFollower`, `GoTo`": led,
    "drives `position` and `velocity`": lambda robot, q: stepped(robot, q, drive="velocity"),
    "a detector": lambda robot, q: stepped(
        robot, q, detector=ftqp.Detector(), noise=ftqp.Noise(q=1e-4, tau=0.3)
    ),
    "drive `torque`": lambda robot, q: stepped(robot, q, drive="torque"),
    "schemes without a QP": lambda robot, q: stepped(robot, q, level="velocity", scheme="pseudoinverse"),
    "`planner.ways_out`": lambda robot, q: stepped(robot, q).ways_out(),
    "`MujocoPlant`": lambda robot, q: ftqp.MujocoPlant(robot, DT),
    "`ServoPlant`": lambda robot, q: ServoPlant(robot, DT),
    "a free-swinging joint that is reported": lambda robot, q: stepped(robot, q).report(
        ftqp.FreeSwinging(motor(robot))
    ),
    "`approximate_pseudoinverse`": spherical,
    "`ftqp.postures`, `ftqp.analysis.plan`": searched,
}
"""A use of each."""


@pytest.mark.parametrize("kind", ROBOTS)
@pytest.mark.parametrize("what", USES)
def test_every_field_of_the_table_is_true(robots, what, kind):
    if what == "`MujocoPlant`":
        pytest.importorskip("mujoco", reason='needs the extra "sim"')
    robot, q = robots[kind]
    if kind in NEEDS[what]:
        USES[what](robot, q)
        return
    with pytest.raises(InputError, match="need"):
        USES[what](robot, q)


def test_there_is_a_use_of_each_and_the_page_shows_the_table():
    assert list(USES) == list(NEEDS)
    assert robots_table() in PAGE.read_text(encoding="utf-8")
