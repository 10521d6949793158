"""The table [base]: what it makes, and what it refuses in one sentence with its path."""

import numpy as np
import pytest
from tests.app.conftest import setup_of

from ftqp.app.scenario.setup import load
from ftqp.core.errors import ScenarioError

BASE = {"kind": "platform"}


HELD = {
    "planner": {"level": "velocity"},
    "path": {"kind": "hold", "duration": 1.0},
    "base": BASE,
}


def setup(folder=None, **tables):
    """What a scenario of a Panda that holds its pose stands for, with these tables."""
    return setup_of(folder, **HELD | tables)


def refused(**tables):
    """The errors of a scenario, in one text."""
    with pytest.raises(ScenarioError) as caught:
        setup(**tables)
    return str(caught.value) + " ".join(caught.value.errors)


def test_path_begins_where_the_base_has_put_the_tip():
    found = setup()
    assert found.world is not None
    np.testing.assert_allclose(found.path.start, found.world.start() @ found.robot.pose(found.q), atol=1e-15)
    np.testing.assert_allclose(found.world.start()[:3, 3], [0.20, 0.0, 0.75])


def test_settings_reach_the_inertial_task():
    table = BASE | {
        "sensing": "late",
        "delay": 0.002,
        "attitude": "nominal",
        "gain": 0.7,
        "observer": {"lowpass": 0.3},
        "anti_windup": True,
        "patience": 0.1,
    }
    world = setup(base=table).world
    assert world is not None
    base = world.follower.base
    assert (base.sensing, base.delay, base.attitude, base.anti_windup, base.patience) == (
        "late", 0.002, "nominal", True, 0.1,
    )  # fmt: skip
    assert world.follower.gain == 0.7 and base.observer is not None and base.observer.lowpass == 0.3


def test_random_motion_follows_the_seed():
    table = BASE | {"disturbances": [{"kind": "random", "coordinate": "tilt", "rms": 0.1, "corner": 1.0}]}

    def moved(seed):
        world = setup(base=table, simulation={"seed": seed}).world
        assert world is not None
        world.reset(np.zeros(7), np.zeros(7), 50)
        world.sense(49, np.zeros(7))
        return world.eta.copy()

    np.testing.assert_array_equal(moved(1), moved(1))
    assert not np.array_equal(moved(1), moved(2))


def test_recording_is_found_beside_the_scenario_and_resolved(tmp_path):
    (tmp_path / "motion.csv").write_text("t,rx\n0,0\n1,0.1\n", encoding="utf-8")
    table = {"kind": "free", "disturbances": [{"kind": "recorded", "file": "motion.csv"}]}
    found = setup(tmp_path, base=table)
    assert found.content["base"]["disturbances"][0]["file"] == str(tmp_path / "motion.csv")


def test_servos_take_what_the_drive_sends_and_add_up_velocities_above_a_moving_base():
    servo = {"simulation": {"plant": "servo"}, "base": None}
    assert setup(**servo, planner={"drive": "velocity"}).plant.drive == "velocity"
    assert "plant 'servo'" in refused(**servo, planner={"drive": "torque"})
    assert load("puma-step-10").plant.drive is None


def test_branch_limits_and_priority_reach_the_planner():
    planner = {
        "level": "velocity",
        "branch_limits": {"panda_joint4": [-2.5, -1.0]},
        "task": {"priority": "position_first"},
    }
    found = setup(planner=planner).planner
    assert (found.robot.limits.q_min[3], found.robot.limits.q_max[3]) == (-2.5, -1.0)
    assert found.task.priority == "position_first"


def test_planner_that_does_not_fit_a_moving_base_is_named():
    assert "base: leader 'base' does not go with level 'acceleration'" in refused(
        planner={"level": "acceleration"}
    )
