"""The plant and the sensors that a scenario describes, and what it is told of wrong ones."""

import numpy as np
import pytest
from tests.app.conftest import setup_of

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.mujoco_plant import MujocoPlant


def test_mujoco_plant_is_made_as_the_scenario_says() -> None:
    mujoco = {
        "substeps": 2,
        "payload": {"mass": 0.5, "com": [0.0, 0.0, 0.05]},
        "mass_scale": 1.1,
        "rotors": {"panda_joint1": 0.1},
        "brake_delay": 0.02,
        "jitter": 0.5,
        "coulomb": 0.3,
        "viscous": {"panda_joint1": 2.0},
        "brake": {"panda_joint2": 5.0},
        "end_stops": 0.01,
    }
    plant = setup_of(simulation={"plant": "mujoco", "mujoco": mujoco}).plant
    assert isinstance(plant, MujocoPlant)


def test_sensors_are_made_as_the_scenario_says() -> None:
    table = {
        "latency": 1,
        "quantum": 0.5,
        "bias": 0.25,
        "faults": [{"kind": "dropped", "joint": 0, "at": 0.0}],
    }
    sensors = setup_of(sensors=table).sensors
    assert sensors is not None
    sensors.measure(np.full(7, 0.6), np.zeros(7))
    assert np.isnan(sensors.q[0])
    np.testing.assert_array_equal(sensors.q[1:], np.full(6, 0.75))
    assert setup_of().sensors is None


def test_drive_is_a_name_or_a_table() -> None:
    assert setup_of(planner={}).planner.drive.kind == "position"
    assert setup_of(planner={"drive": "torque"}).planner.drive.kind == "torque"
    drive = setup_of(
        planner={"drive": {"kind": "velocity", "bandwidth": 90.0, "latency": 0.002}}
    ).planner.drive
    assert (drive.kind, drive.bandwidth, drive.latency) == ("velocity", 90.0, 0.002)


def test_noise_is_what_the_planner_believes() -> None:
    assert setup_of(planner={"noise": {"q": 1e-4, "tau": 0.2}}).planner.noise.q == 1e-4
