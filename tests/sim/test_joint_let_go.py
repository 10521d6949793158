"""In physics a joint that was jammed and is free again goes on being used, and a locked one never is."""

from collections.abc import Callable

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.hidden_faults import Jammed, Weakened

DT, SIGMA, BANDWIDTH = 1e-3, 1e-4, 94.0
AT, FREED = 1.0, 1.5


def led(
    drive: str,
    happens: Callable[[int, ftqp.MujocoPlant, ftqp.Planner], None],
    *,
    ticks: int,
    probe_after: float | None = 0.5,
    seed: int = 1,
) -> tuple[ftqp.Planner, np.ndarray]:
    """A Panda led round circles, and the true errors of its tip [m]."""
    robot = ftqp.robots.load("panda")
    servos = drive != "torque"
    planner = ftqp.Planner(
        robot, DT, drive=ftqp.Drive(kind=drive, bandwidth=BANDWIDTH) if servos else drive,
        noise=ftqp.Noise(q=SIGMA), detector=ftqp.Detector(probe_after=probe_after),
    )  # fmt: skip
    servo = ftqp.JointServo(robot, drive, bandwidth=BANDWIDTH) if servos else ftqp.JointServo(robot, drive)
    plant = ftqp.MujocoPlant(robot, DT, servo, substeps=2)
    sensors = ftqp.JointSensors(robot, DT, position_noise=SIGMA, seed=seed)
    planner.reset(robot.neutral)
    plant.reset(robot.neutral, np.zeros(7))
    sensors.reset()
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.08, duration=6.0, axes=("y", "z"))
    sample = path.sample(np.mod(DT * np.arange(ticks), 6.0))
    targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
    errors = np.zeros(ticks)
    for k in range(ticks):
        happens(k, plant, planner)
        sensors.measure(plant.q, plant.v)
        plant.advance(planner.step(sensors.q, None, targets.at(k)))
        errors[k] = np.linalg.norm(robot.pose(plant.q)[:3, 3] - sample.pose[k, :3, 3])
    return planner, errors


def jam(joint: int) -> Callable[[int, ftqp.MujocoPlant, ftqp.Planner], None]:
    """A joint is held for half a second."""

    def happens(k: int, plant: ftqp.MujocoPlant, planner: ftqp.Planner) -> None:
        if k == round(AT / DT):
            plant.suffer(Jammed(joint))
        if k == round(FREED / DT):
            plant.suffer(Weakened(joint, 1.0))

    return happens


@pytest.mark.long
@pytest.mark.parametrize(("drive", "joint"), [("position", 2), ("velocity", 3), ("torque", 3)])
def test_a_joint_that_was_jammed_for_half_a_second_goes_on_being_used(drive: str, joint: int) -> None:
    planner, errors = led(drive, jam(joint), ticks=3800)
    name = planner.robot.joints[joint]
    assert [finding.joint for finding in planner.findings] == [name]
    assert planner.findings[0].withdrawn_at is not None
    assert FREED < planner.findings[0].withdrawn_at < 4.0
    assert planner.faults == {}
    assert errors.max() < 0.04 and errors[-500:].max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("drive", "joint"), [("position", 2), ("torque", 3)])
def test_a_joint_that_is_locked_is_never_withdrawn(drive: str, joint: int) -> None:
    def happens(k: int, plant: ftqp.MujocoPlant, planner: ftqp.Planner) -> None:
        if k == round(AT / DT):
            plant.fail(ftqp.Locked(joint))

    planner, _ = led(drive, happens, ticks=60_000)
    name = planner.robot.joints[joint]
    assert [(finding.joint, finding.withdrawn_at) for finding in planner.findings] == [(name, None)]
    assert planner.faults == {name: ftqp.Locked(name)}


@pytest.mark.long
def test_what_a_user_reported_stays_whatever_the_joint_does() -> None:
    def happens(k: int, plant: ftqp.MujocoPlant, planner: ftqp.Planner) -> None:
        jam(2)(k, plant, planner)
        if k == round(1.4 / DT):
            assert planner.findings
            planner.report(ftqp.Locked("panda_joint3"))

    planner, _ = led("position", happens, ticks=3000)
    assert planner.faults == {"panda_joint3": ftqp.Locked("panda_joint3")}
    assert planner.findings[0].withdrawn_at is None


@pytest.mark.long
def test_without_probing_no_joint_of_an_arm_with_servos_is_asked_to_move() -> None:
    sent = []

    def happens(k: int, plant: ftqp.MujocoPlant, planner: ftqp.Planner) -> None:
        jam(2)(k, plant, planner)
        sent.append(float(planner._session.K.feedback.v_sent[2]))

    planner, _ = led("position", happens, ticks=2600, probe_after=None)
    assert planner.findings[0].withdrawn_at is None and set(sent[2000:]) == {0.0}
