"""The plant and the sensors that a scenario describes, and what it is told of wrong ones."""

from typing import Any

import numpy as np
import pytest
from tests.app.conftest import setup_of

from ftqp.core.errors import ScenarioError

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


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        (
            {"simulation": {"plant": "mujocco"}},
            "simulation.plant is 'mujocco', expected one of kinematic, servo",
        ),
        ({"simulation": {"mujoco": {"substep": 2}}}, "simulation.mujoco.substep is not a key"),
        ({"simulation": {"mujoco": {"substeps": 0}}}, "simulation.mujoco.substeps is 0, expected"),
        (
            {"simulation": {"mujoco": {"payload": {"mass": 1.0, "com": [0.0]}}}},
            "payload.com has 1 entries, expected",
        ),
        ({"simulation": {"mujoco": {"viscous": {"panda_joint1": -1.0}}}}, "simulation.mujoco.viscous"),
        ({"simulation": {"mujoco": {"rotors": -0.1}}}, "simulation.mujoco.rotors"),
        ({"simulation": {"mujoco": {"jitter": 1.0}}}, "simulation.mujoco.jitter"),
        (
            {"simulation": {"plant": "mujoco", "mujoco": {"rotors": {"j9": 1.0}}}},
            "simulation: 'j9' is not a joint of panda",
        ),
        ({"simulation": {"mujoco": {"brake": {"panda_joint1": 0.0}}}}, "simulation.mujoco.brake"),
        (
            {"simulation": {"plant": "mujoco", "mujoco": {"brake": {"j9": 1.0}}}},
            "simulation: 'j9' is not a joint of panda",
        ),
        (
            {"robot": {"name": "puma560"}, "simulation": {"plant": "mujoco"}},
            "simulation: puma560 has no inertia",
        ),
        ({"sensors": {"latency": -1}}, "sensors.latency is -1, expected a number at least 0"),
        ({"sensors": {"latency": 0.5}}, "sensors.latency is 0.5, expected a whole number"),
        ({"sensors": {"bias": [0.1, 0.2]}}, "sensors: bias of the sensors has shape (2,), expected (7,)"),
        ({"sensors": {"velocity_noise": float("inf")}}, "sensors.velocity_noise is inf, expected a finite"),
        (
            {"sensors": {"faults": [{"kind": "frosen", "at": 1.0}]}},
            "has kind 'frosen', expected one of frozen",
        ),
        ({"sensors": {"faults": [{"kind": "frozen"}]}}, "sensors.faults[0].at is missing"),
        (
            {"sensors": {"faults": [{"kind": "offset", "at": 1.0, "samples": 0}]}},
            "sensors.faults[0].samples",
        ),
        (
            {"sensors": {"faults": [{"kind": "drifting", "at": 1.0, "size": 1.0}]}},
            "sensors.faults[0].size is not a key",
        ),
        (
            {"sensors": {"faults": [{"kind": "frozen", "at": 1.0, "joint": "j9"}]}},
            "sensors: 'j9' is not a joint of panda",
        ),
    ],
)
def test_every_wrong_key_is_told_with_its_place(tables: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        setup_of(**tables)
    assert sentence in str(caught.value)


def test_drive_is_a_name_or_a_table() -> None:
    assert setup_of(planner={}).planner.drive.kind == "position"
    assert setup_of(planner={"drive": "torque"}).planner.drive.kind == "torque"
    drive = setup_of(
        planner={"drive": {"kind": "velocity", "bandwidth": 90.0, "latency": 0.002}}
    ).planner.drive
    assert (drive.kind, drive.bandwidth, drive.latency) == ("velocity", 90.0, 0.002)


def test_noise_is_what_the_planner_believes() -> None:
    assert setup_of(planner={"noise": {"q": 1e-4, "tau": 0.2}}).planner.noise.q == 1e-4


@pytest.mark.parametrize(
    ("planner", "sentence"),
    [
        ({"drive": "force"}, "planner.drive.kind is 'force', expected one of position, velocity, torque"),
        ({"drive": 3}, "planner.drive is 3, expected position, velocity, torque or a table with a kind"),
        ({"drive": {"band": 3.0}}, "planner.drive.band is not a key"),
        ({"drive": {"bandwidth": 0.0}}, "planner.drive.bandwidth is 0.0, expected a number greater than 0"),
        ({"drive": {"latency": -1.0}}, "planner.drive.latency is -1.0, expected a number at least 0"),
        ({"drive": {"latency": 9.0}}, "planner: latency of the drive is 9 s"),
        ({"drive": {"stiffness": 10.0}}, "planner.drive: stiffness is for drive 'torque'"),
        ({"drive": {"kind": "torque", "lead": 0.01}}, "planner.drive: lead is for drive 'position'"),
        ({"noise": {"q": -1.0}}, "planner.noise.q is -1.0, expected a number at least 0"),
        ({"noise": {"v": 0.1}}, "planner.noise.v is not a key"),
    ],
)
def test_every_wrong_key_of_a_drive_is_told_with_its_place(planner: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        setup_of(planner=planner)
    assert sentence in str(caught.value)
