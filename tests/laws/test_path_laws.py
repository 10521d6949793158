"""What leads a planner keeps limits and progress, and leaves no trace in it."""

import numpy as np
import pytest
from tests.every_fault import draw_fault
from tests.going import closed_loop
from tests.laws.episode import SMALL, breaches, draw_path, start_of

import ftqp
from ftqp.core.errors import InputError

ROBOTS = ("panda", "iiwa14", "xarm7", "planar6", "srs7", "planar(10)")
LIMITS = {"finite", "speed", "acceleration", "position", "braking", "torque", "failed"}
"""Laws of limits: what a follower says of its path is not asked here."""


def drawn(seed):
    """A follower with a fault to come, its start and when the joint fails."""
    generator = np.random.default_rng(seed)
    robot = ftqp.robots.load(str(generator.choice(ROBOTS)))
    level = str(generator.choice(["velocity", "acceleration"]))
    dt = float(generator.choice([0.002, 0.005, 0.01]))
    backend = str(generator.choice(["active_set"] * 4 + ["daqp"]))
    backend = backend if robot.nv <= SMALL else "active_set"
    q = start_of(generator, robot)
    duration = float(generator.uniform(0.5, 2.0))
    path = draw_path(generator, robot, robot.pose(q), duration)
    planner = ftqp.Planner(
        robot, dt, level=level, task=ftqp.Task(mode="scaled"), backend=backend, emergency=None
    )
    return (
        ftqp.PathFollower(planner, path),
        q,
        draw_fault(generator, robot, swings=robot.nv <= SMALL),
        int(generator.integers(0.5 / dt)),
    )


def run(seed):
    follower, q, fault, at = drawn(seed)
    planner = follower.planner
    truth, said, progress = [(q, np.zeros(planner.robot.nv))], [], [0.0]
    fails = {at: lambda planner: planner.report(fault)}
    for step in closed_loop(follower, None, round(2.0 / planner.dt), q, events=fails):
        progress.append(follower.progress)
        truth.append((step.q.copy(), step.v.copy()))
        said.append(step.status.name)
    targets = follower.path.sample(np.array(progress[:-1])).pose
    found = [one for one in breaches(planner, truth, said, targets, fault, at) if one.law in LIMITS]
    return found, np.array(progress), np.array(truth).tobytes(), follower


@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 40))]
)
def test_limits_are_kept_and_progress_never_runs_backwards(seed):
    found, progress, _, follower = run(seed)
    assert not found, [str(breach) for breach in found]
    assert (np.diff(progress) >= 0.0).all() and progress[-1] <= follower.path.duration
    assert (np.diff(progress) <= follower.planner.dt * (1.0 + 1e-9)).all()
    assert (follower.status is ftqp.PathStatus.BLOCKED) == (follower.blocked is not None)


@pytest.mark.parametrize("seed", range(0, 24, 8))
def test_same_inputs_give_the_same_commands(seed):
    assert run(seed)[2] == run(seed)[2]


DT = 5e-3
PANDA = ftqp.robots.load("panda")
HOME = PANDA.pose(PANDA.neutral)
REST = np.zeros(7)
MODES = {"path": "scaled", "base": "slack"}


def planner_of(leader):
    planner = ftqp.Planner(PANDA, DT, level="velocity", task=ftqp.Task(mode=MODES[leader]), emergency=None)
    planner.reset(PANDA.neutral)
    return planner


def led(leader, planner, reach=0.1):
    """A leader on a planner, and its step as a function of the state."""
    if leader == "path":
        path = ftqp.paths.Line(HOME, (0.0, reach, 0.0), duration=1.0)
        follower = ftqp.PathFollower(planner, path)
        return follower, follower.step
    follower = ftqp.InertialTask(planner, gain=0.5)
    goal = HOME.copy()
    goal[1, 3] += reach
    return follower, lambda q, v: follower.step(q, v, ftqp.Target(pose=goal), tip=PANDA.pose(PANDA.neutral))


def goes_as_one_that_was_never_led(planner, leader):
    """Whether a planner that is given targets commands as another one, bit by bit."""
    target, commands = ftqp.Target(pose=HOME, twist=[0.05, 0.02, 0.0, 0.0, 0.0, 0.1]), []

    def moving(k):
        target.position[0] = HOME[0, 3] + 0.05 * DT * k
        return target

    for one in (planner, planner_of(leader)):
        steps = closed_loop(one, moving, 20, reset=False)
        commands.append([np.concatenate([step.q, step.v, step.a, step.slack]) for step in steps])
    return np.array_equal(*commands)


@pytest.mark.parametrize("leader", MODES)
def test_making_a_leader_changes_no_command_of_its_planner(leader):
    planner = planner_of(leader)
    led(leader, planner)
    assert goes_as_one_that_was_never_led(planner, leader)


@pytest.mark.parametrize("leader", MODES)
@pytest.mark.parametrize("state", [(np.zeros(6), REST), (REST, np.zeros(8)), ("home", REST)], ids=repr)
def test_refused_step_of_a_leader_leaves_the_planners_next_steps_untouched(leader, state):
    planner = planner_of(leader)
    _, step = led(leader, planner)
    with pytest.raises(InputError):
        step(*state)
    assert goes_as_one_that_was_never_led(planner, leader)


@pytest.mark.parametrize("leader", MODES)
def test_planner_that_was_led_and_reset_commands_as_one_that_never_was(leader):
    planner = planner_of(leader)
    _, step = led(leader, planner)
    q, v = PANDA.neutral, REST
    for _ in range(30):
        done = step(q, v)
        q, v = done.q.copy(), done.v.copy()
    planner.reset(PANDA.neutral)
    assert goes_as_one_that_was_never_led(planner, leader)


def test_two_followers_on_one_planner_keep_their_own_progress():
    planner = planner_of("path")
    (first, step), (second, other) = led("path", planner), led("path", planner, reach=-0.2)
    q, v, seen = PANDA.neutral, REST, []
    for k in range(60):
        before = first.progress, second.progress
        done = (step if k % 3 else other)(q, v)
        q, v = done.q.copy(), done.v.copy()
        assert (first.progress if k % 3 == 0 else second.progress) == before[0 if k % 3 == 0 else 1]
        seen.append((first.progress, second.progress))
    assert 0.0 < seen[-1][1] < seen[-1][0]
    assert first.target.position[1] > HOME[1, 3] > second.target.position[1]


def test_two_inertial_tasks_on_one_planner_keep_what_they_know():
    planner = planner_of("base")
    (first, step), (second, _) = led("base", planner), led("base", planner, reach=-0.2)
    first.reset(PANDA.neutral)
    second.reset(PANDA.neutral)
    step(PANDA.neutral, REST)
    assert first.status is not ftqp.BaseStatus.STALE and second.status is ftqp.BaseStatus.STALE
    assert first.error.any() and not second.error.any()
