"""A plant that is held as a whole for a while: it stands, follows again, and keeps what has failed."""

import numpy as np
import pytest
from tests.judged import broken_laws

from ftqp.core.errors import InputError, ScenarioError
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.plants.troubled_plant import HeldPlant, Hold

ROBOT = catalog.load("panda")
DT = 0.01
SCENARIO = """
[robot]
name = "panda"
[planner]
dt = 0.002
drive = {{ kind = "{drive}" }}
[path]
kind = "circle"
duration = 1.5
radius = 0.06
[simulation]
plant = "{plant}"
duration = 3.5
[simulation.servo]
time_constant = 0.02
[[simulation.holds]]
at = 0.6
duration = 0.5
"""


class Sent:
    """What is sent: joint velocities."""

    q, tau = ROBOT.neutral, np.zeros(ROBOT.nv)
    v, brakes = np.full(ROBOT.nv, 0.2), np.zeros(ROBOT.nv, dtype=bool)


def places(*events):
    """Where a velocity arm is at each of 40 ticks, held from 0.1 to 0.2 s; events are (tick, function)."""
    plant = HeldPlant(ServoPlant(ROBOT, DT, drive="velocity"), ROBOT, DT, [Hold(0.1, 0.1)])
    plant.reset(ROBOT.neutral, np.zeros(ROBOT.nv))
    result = []
    for k in range(40):
        for tick, happens in events:
            if tick == k:
                happens(plant)
        plant.advance(Sent)
        result.append(plant.q.copy())
    return np.array(result)


def test_held_joints_stand_and_follow_again():
    moved = np.abs(np.diff(places(), axis=0)).max(axis=1)
    assert (moved[:9] > 0.0).all() and (moved[10:19] == 0.0).all() and (moved[20:] > 0.0).all()


@pytest.mark.parametrize("tick", [5, 15])
def test_joint_that_failed_before_or_during_a_hold_has_failed_after_it(tick):
    moved = np.abs(np.diff(places((tick, lambda plant: plant.fail(Locked(2)))), axis=0))[20:]
    assert (moved[:, 2] == 0.0).all() and (np.delete(moved, 2, axis=1) > 0.0).all()


def test_joint_that_is_repaired_during_a_hold_works_after_it():
    moved = places((5, lambda plant: plant.fail(Locked(2))), (15, lambda plant: plant.repair(2)))
    assert np.abs(moved[-1] - moved[25]).min() > 0.0


def test_plant_that_does_what_it_is_told_is_not_held():
    with pytest.raises(InputError, match="nothing can hold it"):
        HeldPlant(KinematicPlant(ROBOT, DT), ROBOT, DT, [Hold(0.1, 0.1)])
    with pytest.raises(ScenarioError, match="nothing can hold it"):
        broken_laws(SCENARIO.format(drive="position", plant="kinematic"))


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_scenario_with_a_hold_keeps_every_law(drive):
    assert broken_laws(SCENARIO.format(drive=drive, plant="servo"), "in physics") == {}


def test_scenario_with_a_hold_keeps_every_law_in_physics(drive):
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    assert broken_laws(SCENARIO.format(drive=drive, plant="mujoco"), "in physics") == {}
