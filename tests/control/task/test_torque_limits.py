"""Torque limits as an entry of the list of constraints: the same as the keyword, or one sentence."""

import numpy as np
import pytest
from tests.control.planner.test_soft_tasks import LIGHT

import ftqp
from ftqp.core.errors import InputError
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation

PANDA = ftqp.robots.load("panda")
WEAK = PANDA.with_limits(tau_max=[87.0, 15.0, 87.0, 87.0, 12.0, 12.0, 12.0])
LIMITS = [ftqp.TorqueLimits()]


def ends(**settings):
    """Torques of every tick of an arm that is to swing faster than its second joint can."""
    planner = ftqp.Planner(WEAK, emergency=None, **settings)
    q, T, torques = WEAK.neutral.copy(), WEAK.pose(WEAK.neutral), []
    planner.reset(q)
    for k in range(300):
        pose = T.copy()
        pose[0, 3] += 0.1 * np.sin(0.03 * k)
        step = planner.step(q, None, ftqp.Target(pose=pose))
        q = step.q.copy()
        torques.append(step.tau.copy())
    return np.array(torques)


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_the_entry_and_the_keyword_are_the_same_to_the_last_bit(level):
    listed, usual = ends(level=level, constraints=LIMITS), ends(level=level)
    np.testing.assert_array_equal(listed, usual)
    without = ends(level=level, torque_limits=False)
    assert np.abs(without[:, 1]).max() > 16.0 > 15.0 * (1.0 + 1e-6) > np.abs(listed[:, 1]).max()


def test_it_is_an_entry_like_any_other():
    keep = ftqp.Keep(PANDA.tip, above=(0, 0, 0.1))
    planner = ftqp.Planner(PANDA, constraints=[keep, *LIMITS])
    assert list(planner.constraints) == [PANDA.tip, "torque limits"]
    one = planner.constraints["torque limits"]
    assert one.given == ftqp.TorqueLimits() and np.isnan(one.distance) and one.failed == ""
    closed = ftqp.Planner(PANDA, level="velocity", scheme="pseudoinverse", constraints=LIMITS)
    assert "torque limits" in closed.constraints


def test_a_log_names_it_and_can_be_read_again(tmp_path):
    planner = ftqp.Planner(PANDA, constraints=LIMITS)
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=0.05)
    Simulation(planner, path, q=PANDA.neutral, log=tmp_path / "log.npy").run()
    log = load_log(tmp_path)
    assert log.metadata["constraints"] == [{"name": "torque limits", "kind": "torque"}]


@pytest.mark.parametrize(("robot", "settings", "sentence"), [
    (PANDA, {"torque_limits": False}, "TorqueLimits beside torque_limits=False, expected one of them; leave"),
    (LIGHT, {}, "TorqueLimits, which need masses, and .* has none"),
    (PANDA.with_limits(tau_max=np.inf), {}, "and panda has no torque limit; leave them out or give"),
    (PANDA, {"constraints": LIMITS * 2}, "two things are called 'torque limits'"),
])  # fmt: skip
def test_where_they_could_have_no_effect_is_one_sentence(robot, settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(robot, **{"constraints": LIMITS, **settings})
