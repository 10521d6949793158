"""Every law holds in random episodes, and a run with a fault is told in full."""

import os

import numpy as np
import pytest
from tests.every_fault import FAULTS
from tests.laws.episode import run
from tests.witness import Witness

import ftqp
from ftqp.app.output.words import fault_sentence
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.metrics import summary
from ftqp.viz.figures.run_figures import save_figures

EPISODES = int(os.environ.get("FTQP_EPISODES", "200"))
GROUP, QUICK = 20, 2
GROUPS = range((EPISODES + GROUP - 1) // GROUP)


@pytest.mark.long
@pytest.mark.parametrize(
    "group", [k if k < QUICK else pytest.param(k, marks=pytest.mark.slow) for k in GROUPS]
)
def test_every_law_holds_in_random_episodes(group):
    for seed in range(group * GROUP, min((group + 1) * GROUP, EPISODES)):
        episode = run(seed, everything=group >= 5)
        found = [str(breach) for breach in episode.breaches]
        assert not found, f"seed {seed}: {episode.description}: {found}"


DT = 2e-3
AT = 0.1
JOINT = 3
DRAWN = {kind: draw for kind, draw in FAULTS}


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS.values(), ids=str)
@pytest.mark.parametrize("announced", [None, "never"])
def test_a_run_with_a_fault_is_told_in_full_and_the_other_joints_obey(kind, level, announced, tmp_path):
    robot = ftqp.robots.load("panda")
    fault = DRAWN[kind](np.random.default_rng(1), JOINT)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=0.4)
    plant = Witness(robot, DT, level)
    run = ftqp.Simulation(
        ftqp.Planner(robot, DT, level=level, emergency=None), path, q=robot.neutral, plant=plant,
        schedule=ftqp.Schedule([ftqp.FaultEvent(AT, fault, announced)]), log="memory",
    ).run()  # fmt: skip
    assert np.isfinite(plant.differs).all() and not np.delete(plant.differs, JOINT).any()
    facts = summary(run.log)
    (told,) = facts["faults"]
    assert told["kind"] == kind.kind and told["joint"] == "panda_joint4"
    assert kind.happens in fault_sentence(told)
    assert facts["max_limit_violation"]["q"] == 0.0 or not kind.works
    assert ("panda_joint4" in facts["max_failed_joint_motion"]) is not kind.works
    if announced == "never" and level == "velocity":
        assert all(file.stat().st_size for file in save_figures(run.log, tmp_path))
