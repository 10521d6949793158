"""What an arm in physics reaches with each drive when a brake closes and when encoders fail, in mm."""

from dataclasses import dataclass

import numpy as np
import pytest

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.paths import Circle
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import StepStatus
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.model.payload import Payload
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import Drifting, Dropped, Frozen, JointSensors, Offset, Scattered

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.joint_servo import BANDWIDTH, JointServo
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.true_arm import TrueArm

pytestmark = pytest.mark.slow

DT, SECONDS, AT, SETTLED = 1e-3, 6.0, 3.25, 0.3
START = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
PANDA = catalog.load("panda")
RUB = dict(zip(PANDA.joints, [0.5] * 4 + [0.17] * 3, strict=True))
"""Dry friction of every joint [N m]."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Errors of the true tip [mm], attitude [mrad], and what was said."""

    t: np.ndarray
    error: np.ndarray
    turned: np.ndarray
    status: list[StepStatus]
    speed: float
    torque: float

    @property
    def settled(self):
        """Errors from 0.3 s after the brake on."""
        return self.error[self.t > AT + SETTLED]

    def first(self, *statuses):
        """When one of these was said first [s]; None if never."""
        return next((t for t, status in zip(self.t, self.status, strict=True) if status in statuses), None)


def outcome(drive, events=(), *, real=False, faults=(), noise=0.0, latency=0, seconds=SECONDS):
    """A circle of the Panda, r = 0.1 m."""
    noise, latency = (1e-4, 2) if real else (noise, latency)
    servo = {} if drive == "torque" else {"bandwidth": BANDWIDTH}
    planner = Planner(PANDA, DT, drive=Drive(kind=drive, latency=latency * DT, **servo), noise=Noise(q=noise))
    log = Simulation(
        planner,
        Circle(PANDA.pose(START), 0.1, axes=("y", "z"), duration=seconds),
        q=START,
        plant=MujocoPlant(
            PANDA,
            DT,
            JointServo(PANDA, drive),
            TrueArm(payload=Payload(0.5), coulomb=RUB) if real else None,
        ),
        sensors=JointSensors(PANDA, DT, latency=latency, position_noise=noise, faults=faults, seed=1),
        schedule=Schedule(events),
        log="memory",
    ).run().log  # fmt: skip
    cosine = np.abs(np.sum(log["tip"][:, 3:] * log["target"][:, 3:], axis=1))
    works = (log["truth"] == 0) & ~((log["t"] >= AT) & (log["t"] < AT + 0.1))[:, None]
    return Outcome(
        t=log["t"],
        error=1e3 * np.linalg.norm(log["tip"][:, :3] - log["target"][:, :3], axis=1),
        turned=2e3 * np.arccos(np.minimum(cosine, 1.0)),
        status=[list(StepStatus)[code] for code in log["status"]],
        speed=float((np.abs(log["v"]) / PANDA.limits.v_max)[works].max()),
        torque=float((np.abs(log["tau"]) / PANDA.limits.tau_max).max()),
    )


def brake(told=None):
    """Joint 3 brakes."""
    return [FaultEvent(AT, Locked(2), told)]


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_ideal_arm_follows_within_a_fifth_of_a_millimetre(drive):
    found = outcome(drive)
    assert rms(found.error) < 0.1
    assert found.error.max() < 0.2
    assert set(found.status) == {StepStatus.OK}


def test_brake_that_is_told_at_once_costs_two_millimetres(drive):
    found = outcome(drive, brake())
    assert rms(found.settled) < 0.5
    assert found.error.max() < 2.0
    assert found.speed < 1.02


def test_brake_that_is_told_late_costs_five_millimetres(drive):
    found = outcome(drive, brake(AT + 0.05))
    assert rms(found.settled) < 1.0
    assert found.settled.max() < 2.0
    assert found.error.max() < 5.0


def test_noise_delay_load_and_friction_leave_five_millimetres_and_thirty_milliradians(drive):
    found = outcome(drive, brake(), real=True)
    assert rms(found.settled) < 1.0
    assert found.error.max() < 5.0
    assert rms(found.turned) < 10.0
    assert found.turned.max() < 30.0


@pytest.mark.parametrize("drive", ["position", "velocity", "torque"])
def test_brake_that_is_never_told_is_found_where_the_drive_shows_it(drive):
    found = outcome(drive, brake("never"))
    assert found.error.max() < 10.0 and found.error[-1] < 0.2
    assert found.status[-1] is StepStatus.OK


@pytest.mark.parametrize("drive", ["position", "torque"])
@pytest.mark.parametrize(
    "fault",
    [
        Offset(joint=1, at=3.0, samples=1, size=0.5),
        Offset(joint=3, at=3.0, samples=5, size=0.5),
        Offset(joint=3, at=3.0, samples=10, speed=50.0),
        Dropped(joint=2, at=3.0, samples=10),
        Dropped(at=3.0, samples=15),
        Scattered(joint=5, at=2.0, samples=1000, share=0.05, size=0.5),
    ],
    ids=["spike", "five spikes", "fast", "dropped", "all dropped", "random"],
)
def test_glitch_costs_less_than_a_third_of_a_millimetre(drive, fault):
    found = outcome(drive, faults=[fault])
    assert found.error.max() < 0.3
    assert StepStatus.STOPPING not in found.status


LOST = [
    pytest.param(Dropped(joint=2, at=3.0), 0.0, id="dropped"),
    pytest.param(Frozen(joint=3, at=3.0), 1e-4, id="frozen"),
    pytest.param(Drifting(joint=3, at=3.0, rate=5.0), 0.0, id="runs on"),
]


@pytest.mark.parametrize(("fault", "noise"), LOST)
def test_lost_sensor_stops_an_arm_that_takes_torques_within_thirty_milliseconds(fault, noise):
    found = outcome("torque", faults=[fault], noise=noise)
    stop = found.first(StepStatus.STOPPING)
    assert stop is not None and stop < 3.04
    assert found.status[-1] is StepStatus.STOPPED
    assert found.speed < 1.02
