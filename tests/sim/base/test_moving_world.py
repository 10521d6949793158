"""The world under a moving base: truth above, measurements below, and a log that tells both."""

import numpy as np
import pytest

import ftqp
from ftqp import InertialTask, MovingBase, Observer
from ftqp.control.paths import Hold
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Locked
from ftqp.sim.base.disturbances import Sinusoid
from ftqp.sim.base.moving_world import FreeBase, MovingWorld, Platform
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import summary
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule

DT = 0.01
SWAY = (
    Sinusoid("x", 0.05, frequency=0.3, phase=-0.5 * np.pi),
    Sinusoid("rz", 0.08, frequency=0.4, phase=-0.5 * np.pi),
)


def simulate(robot, base, log=None, schedule=None, disturbances=SWAY, **options):
    planner = ftqp.Planner(robot, DT, level="velocity")
    world = MovingWorld(InertialTask(planner, base), FreeBase(), disturbances, **options)
    path = Hold(world.start() @ robot.pose(robot.neutral), duration=3.0)
    run = Simulation(planner, path, q=robot.neutral, world=world, log=log, schedule=schedule)
    return run.run(), world


SENSING = {
    "unknown": MovingBase(),
    "observed": MovingBase(observer=Observer()),
    "known": MovingBase(sensing="known"),
    "late": MovingBase(sensing="late", delay=0.05),
}


@pytest.mark.parametrize(
    ("name", "worst"), [("unknown", 2e-3), ("observed", 3e-5), ("known", 1e-5), ("late", 5e-4)]
)
def test_tip_stays_in_space_however_the_base_is_measured(panda, tmp_path, name, worst):
    result, _ = simulate(panda, SENSING[name], tmp_path / "log.npy")
    found = summary(load_log(tmp_path / "log.npy"))["inertial"]
    assert result.completed and 0.0 < found["max_position_error"] < worst
    assert found["status_counts"]["TRACKING"] > 290


def test_log_tells_true_pose_disturbance_error_and_status(panda, tmp_path):
    schedule = Schedule([FaultEvent(1.0, Locked("panda_joint3"))])
    simulate(panda, SENSING["observed"], tmp_path / "log.npy", schedule)
    log = load_log(tmp_path / "log.npy")
    t = log["t"]
    np.testing.assert_allclose(log["disturbance.x"], 0.05 * (1.0 - np.cos(2 * np.pi * 0.3 * t)), atol=1e-12)
    np.testing.assert_allclose(log["base"][:, :3], log["disturbance"][:, :3], atol=1e-15)
    np.testing.assert_allclose(
        log["target"][:, :3] - log["tip"][:, :3], log["inertial_error"][:, :3], atol=1e-12
    )
    assert log.units["disturbance.rz"] == "rad" and log.units["disturbance.x"] == "m"
    assert log["base_status"].max() == 0
    rest = log["q"][log["t"] > 1.5, 2]
    assert np.all(rest == rest[0])


def test_sensors_hide_the_truth_and_repeat_for_their_seed(panda):
    ends = [
        simulate(panda, SENSING["unknown"], position_noise=1e-3, rotation_noise=1e-3, seed=seed)[0].q
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(ends[0], ends[1])
    assert np.abs(ends[0] - ends[2]).max() > 1e-5


def test_world_of_another_planner_is_refused(panda):
    planner, other = (ftqp.Planner(panda, DT, level="velocity") for _ in range(2))
    world = MovingWorld(InertialTask(other), Platform(), ())
    path = Hold(panda.pose(panda.neutral), duration=1.0)
    with pytest.raises(InputError, match="the world's inertial task has another planner than the simulation"):
        Simulation(planner, path, q=panda.neutral, world=world)


def test_nothing_measured_is_refused(panda):
    planner = ftqp.Planner(panda, DT, level="velocity")
    with pytest.raises(InputError, match="end_point is false, but with sensing 'unknown'"):
        MovingWorld(InertialTask(planner), FreeBase(), (), end_point=False)


def test_world_without_a_run_cannot_be_sensed(panda):
    planner = ftqp.Planner(panda, DT, level="velocity")
    world = MovingWorld(InertialTask(planner), FreeBase(), ())
    with pytest.raises(InputError, match="the world has no run; call reset"):
        world.sense(0, panda.neutral)
