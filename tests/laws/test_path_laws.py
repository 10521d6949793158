"""What holds for every path that is followed by its progress, whatever arm, fault, law and time are drawn."""

import numpy as np
import pytest
from tests.every_fault import draw_fault
from tests.laws.episode import SMALL, Episode, check, draw_path, start_of

import ftqp

ROBOTS = ("panda", "iiwa14", "xarm7", "planar6", "srs7", "planar(10)")
ON_PATH = 0.02
"""Largest distance from the path at its progress, in characteristic lengths, while no status says more."""


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
    episode = Episode(
        seed=seed, description=f"{planner.robot.name} {planner.level} {fault}", backend=planner.backend
    )
    follower.reset(q)
    v = np.zeros(planner.robot.nv)
    progress, off, commands = [0.0], [0.0], []
    for k in range(round(2.0 / planner.dt)):
        if k == at:
            planner.report(fault)
        before = v
        step = follower.step(q, v)
        check(episode, planner, step, q, before, planner.dt, k)
        progress.append(follower.progress)
        if step.status in (ftqp.StepStatus.OK, ftqp.StepStatus.SCALED):
            off.append(step.position_error / planner.robot.length)
        q, v = step.q.copy(), step.v.copy()
        commands.append(v.tobytes())
    return episode, np.array(progress), max(off), commands, follower


@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 40))]
)
def test_limits_are_kept_and_progress_never_runs_backwards(seed):
    episode, progress, _, _, follower = run(seed)
    assert not episode.broken, f"{episode.description}: {episode.broken}"
    assert (np.diff(progress) >= 0.0).all()
    assert (np.diff(progress) <= follower.planner.dt * (1.0 + 1e-9)).all() and progress[
        -1
    ] <= follower.path.duration
    assert (follower.status is ftqp.PathStatus.BLOCKED) == (follower.blocked is not None)


@pytest.mark.parametrize("seed", range(0, 24, 8))
def test_same_inputs_give_the_same_commands(seed):
    assert run(seed)[3] == run(seed)[3]
