"""Nothing of what users hold takes an attribute and goes on as before, and nothing of it is lost half-way."""

import inspect
import pickle
from copy import deepcopy

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
DT = 2e-3
TIP = PANDA.pose(PANDA.neutral)


def planner(**settings):
    made = ftqp.Planner(PANDA, DT, **settings)
    made.reset(PANDA.neutral)
    return made


MADE = {
    "planner": lambda: planner(noise=ftqp.Noise(q=1e-4), detector=ftqp.Detector()),
    "goto": lambda: ftqp.GoTo(planner(), q=PANDA.neutral + 0.1),
    "targetfollower": lambda: ftqp.TargetFollower(planner()),
    "pathfollower": lambda: ftqp.PathFollower(planner(task=ftqp.Task(mode="scaled")), MADE["circle"]()),
    "inertialtask": lambda: ftqp.InertialTask(planner(level="velocity")),
    "detector": lambda: ftqp.Detector(robot=PANDA, dt=DT, noise=ftqp.Noise(q=1e-4)),
    "plant": lambda: ftqp.KinematicPlant(PANDA, DT),
    "schedule": lambda: ftqp.Schedule([ftqp.FaultEvent(0.1, ftqp.Locked(2))]),
    "simulation": lambda: ftqp.Simulation(planner(), MADE["circle"](), q=PANDA.neutral),
    "circle": lambda: ftqp.paths.Circle(TIP, 0.05, duration=1.0),
    "line": lambda: ftqp.paths.Line(TIP, displacement=[0.1, 0.0, 0.0], duration=1.0),
    "targets": lambda: ftqp.Targets(TIP[None]),
}
"""What users make and hold, by its class in small letters."""
SETTABLE = {"planner": {"speed"}, "targets": {"row", "packed"}}
"""Attributes that do what they say, or are looked at by every step."""


@pytest.mark.parametrize("name", MADE)
def test_no_attribute_is_taken_and_ignored(name):
    thing = MADE[name]()
    given = [*inspect.signature(type(thing).__init__).parameters][1:]
    public = {one for one in dir(thing) if not one.startswith("_")} | {*given, "gain_of_my_own"}
    for one in sorted(public - SETTABLE.get(name, set())):
        with pytest.raises(AttributeError):
            setattr(thing, one, 12.5)
        with pytest.raises(AttributeError):
            delattr(thing, one)


VERBS = {
    "faults": "planner.report", "payload": "planner.carry", "stopped_because": "planner.resume",
    "pace": "planner.speed", "backend": "ftqp.Planner", "plan": "ftqp.Planner", "dt": "ftqp.Planner",
}  # fmt: skip


@pytest.mark.parametrize("name", VERBS)
def test_setting_or_deleting_names_what_does_it(name):
    made = planner()
    with pytest.raises(AttributeError, match=rf"planner\.{name} cannot be set: .*{VERBS[name]}"):
        setattr(made, name, None)
    with pytest.raises(AttributeError, match=rf"planner\.{name} cannot be deleted: .*{VERBS[name]}"):
        delattr(made, name)
    with pytest.raises(
        AttributeError, match=r"detector\.calibration cannot be set: .*ftqp\.Detector\(calibration="
    ):
        ftqp.Detector().calibration = None


@pytest.mark.parametrize("name", ["kinematic", "mujoco"])
def test_the_true_arm_can_be_looked_at_and_not_be_moved(name):
    if name == "mujoco":
        pytest.importorskip("mujoco", reason='needs the extra "sim"')
        plant = ftqp.MujocoPlant(PANDA, DT)
    else:
        plant = ftqp.KinematicPlant(PANDA, DT)
    plant.reset(PANDA.neutral, np.zeros(7))
    arrays = [plant.q, plant.v, *(plant.motors or ())]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array *= 180.0 / np.pi
    assert np.array_equal(plant.q, PANDA.neutral)


def test_a_copy_of_a_true_arm_shows_where_it_is_itself():
    plant = ftqp.KinematicPlant(PANDA, DT)
    for twin in (deepcopy(plant), pickle.loads(pickle.dumps(plant))):
        twin.reset(PANDA.neutral + 0.1, np.zeros(7))
        assert np.array_equal(twin.q, PANDA.neutral + 0.1) and np.array_equal(plant.q, PANDA.neutral)


def test_memory_that_is_handed_out_cannot_be_made_shorter():
    for array in (PANDA.neutral, PANDA.limits.q_max, PANDA.chain.mass, ftqp.Targets(TIP[None]).packed):
        with pytest.raises(ValueError, match=r"resize|own"):
            array.resize(1, refcheck=False)


def test_what_a_planner_beside_a_moving_base_observes_is_not_written():
    task = MADE["inertialtask"]()
    with pytest.raises(ValueError, match="read-only"):
        task.observed_twist[0] = 1.0
