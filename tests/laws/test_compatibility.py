"""Every combination of choices, and of kinds of robots and uses, works or is refused as the table says."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp
from ftqp.analysis.planning.plan_case import PlanSettings
from ftqp.control.task.compatibility import RULES
from ftqp.core.errors import InputError
from ftqp.model.serial import Inertial
from ftqp.sim.plants.servo_plant import ServoPlant

PANDA = ftqp.robots.load("panda")
HOME = PANDA.pose(PANDA.neutral)
DT = 5e-3
CHOICES = {
    "level": ("acceleration", "velocity"),
    "mode": ("slack", "hard", "scaled", "lexicographic"),
    "priority": ("weighted", "position_first"),
    "damping": ("none", "directional"),
    "scheme": ("criterion", "closed form"),
    "backend": ("active_set", "dtrnn", "external"),
    "leader": ("clock", "path", "base"),
}
"""Every choice with its values; the default comes first."""
ROBOTS = ("serial", "branches", "mimic joints", "floating base")
"""Kinds of robots: one arm, joints beside the way to a tip, joints that follow others, a body in space."""
NEEDS = {
    "targets, tasks, constraints, a scene": ROBOTS,
    "locked and degraded joints, `NMinusOne`": ROBOTS,
    "`PathFollower`, `GoTo`": ROBOTS,
    "drives `position` and `velocity`": ROBOTS,
    "a detector": ROBOTS,
    "drive `torque`": ("serial", "branches", "mimic joints"),
    "schemes without a QP": ("serial", "branches", "mimic joints"),
    "`planner.ways_out`": ("serial", "branches", "mimic joints"),
    "`MujocoPlant`": ("serial", "branches", "mimic joints"),
    "`ServoPlant`": ("serial", "branches", "mimic joints"),
    "a free-swinging joint that is reported": ("serial",),
    "`approximate_pseudoinverse`": ("serial",),
    "`ftqp.postures`, `ftqp.analysis.plan`": ("serial", "branches"),
}
"""What serves which of them; the others are refused in a sentence, by what they ask for.

A joint that swings freely is led by what all links of one chain sweep and where its stops are, which on a
tree, or through a joint that another one drags along, is another study. ``approximate_pseudoinverse`` is a
formula for arms with a spherical wrist. A body that floats has no motor that could give torque or hold it,
and a scheme without a QP has no rows for its momentum. Plans and postures are of one chain at a time.
"""
PAGE = Path(__file__).parents[2] / "docs" / "compatibility.md"
VALUES = {
    "damping": {"none": None, "directional": ftqp.DirectionalDamping()},
    "scheme": {"criterion": "mvn", "closed form": "pseudoinverse"},
    "backend": {"active_set": "active_set", "dtrnn": "dtrnn", "external": "daqp"},
}
"""What stands for a value of the table."""


def robots_table():
    """What serves which kinds of robots, as a table in Markdown."""
    rows = [f"| | {' | '.join(ROBOTS)} |", "|---|" + "---|" * len(ROBOTS)]
    for what, served in NEEDS.items():
        rows.append(f"| {what} | {' | '.join('yes' if one in served else 'no' for one in ROBOTS)} |")
    return "\n".join(rows)


def table():
    """The rules as a table in Markdown."""
    rows = ["| this | does not go with | because | instead |", "|---|---|---|---|"]
    for rule in RULES:
        choice, value = rule.of
        other, refused = rule.excludes
        values = ", ".join(f"`{name}`" for name in refused)
        rows.append(f"| {choice} `{value}` | {other} {values} | {rule.reason} | {rule.remedy} |")
    return "\n".join(rows)


def broken(chosen):
    """The sentences of all rules that a combination breaks."""
    given = {name: VALUES[name][chosen[name]] for name in ("scheme", "backend")}
    return [
        rule.sentence(chosen[rule.excludes[0]], given)
        for rule in RULES
        if chosen[rule.of[0]] == rule.of[1] and chosen[rule.excludes[0]] in rule.excludes[1]
    ]


def steps(level, mode, priority, damping, scheme, backend, leader):
    """Three steps of a planner of these choices, copied."""
    task = ftqp.Task(mode=mode, priority=priority, damping=VALUES["damping"][damping])
    planner = ftqp.Planner(
        PANDA,
        DT,
        level=level,
        task=task,
        scheme=VALUES["scheme"][scheme],
        backend=VALUES["backend"][backend],
    )
    target = ftqp.Target(pose=HOME, twist=[0.02, 0.0, 0.01, 0.0, 0.0, 0.0])
    if leader == "path":
        follower = ftqp.PathFollower(planner, ftqp.paths.Line(HOME, (0.1, 0.0, 0.0), duration=2.0))
        reset, step = follower.reset, follower.step
    elif leader == "base":
        inertial = ftqp.InertialTask(planner)
        reset, step = inertial.reset, lambda q, v: inertial.step(q, v, target, tip=PANDA.pose(q))
    else:
        reset, step = planner.reset, lambda q, v: planner.step(q, v, target)
    q, v, done = PANDA.neutral.copy(), np.zeros(7), []
    reset(q)
    for _ in range(3):
        done.append(step(q, v).copy())
        q, v = done[-1].q, done[-1].v
    return done


def taking_long(chosen):
    """Whether code is compiled for it that no other test needs: the network for paths and for bases."""
    of = dict(zip(CHOICES, chosen, strict=True))
    return of["backend"] == "dtrnn" and of["leader"] in ("path", "base") and not broken(of)


@pytest.mark.parametrize(
    "chosen",
    [
        pytest.param(chosen, id="-".join(chosen), marks=[pytest.mark.slow] if taking_long(chosen) else [])
        for chosen in product(*CHOICES.values())
    ],
)
def test_every_combination_works_or_is_refused_with_the_sentence_of_the_table(chosen):
    sentences = broken(dict(zip(CHOICES, chosen, strict=True)))
    if sentences:
        with pytest.raises(InputError) as refused:
            steps(*chosen)
        assert str(refused.value) in sentences
        return
    for step in steps(*chosen):
        assert step.status in (ftqp.StepStatus.OK, ftqp.StepStatus.SCALED, ftqp.StepStatus.RELAXED)
        assert all(np.isfinite(x).all() for x in (step.q, step.v, step.a, step.tau))


def test_every_rule_speaks_of_choices_that_there_are_and_excludes_no_default_pair():
    defaults = {choice: values[0] for choice, values in CHOICES.items()}
    assert not broken(defaults)
    for rule in RULES:
        (choice, value), (other, values) = rule.of, rule.excludes
        assert value in CHOICES[choice] and set(values) < set(CHOICES[other]) and choice != other


def test_the_page_shows_the_table():
    assert table() in PAGE.read_text(encoding="utf-8")


MILLISECOND = 1e-3


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
    planner = ftqp.Planner(robot, MILLISECOND, **{"task": ftqp.Task("position"), **settings})
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
    "`MujocoPlant`": lambda robot, q: ftqp.MujocoPlant(robot, MILLISECOND),
    "`ServoPlant`": lambda robot, q: ServoPlant(robot, MILLISECOND),
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
