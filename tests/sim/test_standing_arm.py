"""An arm that stands, in physics: what fails there shows by probing alone."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import ftqp

DT, SIGMA, BANDWIDTH = 1e-3, 1e-4, 94.0
LOCKS_AT = 1.0


def standing(
    drive: str,
    probe_after: float | None,
    *,
    seconds: float,
    locked: int | None = None,
    friction: Sequence[float] | None = None,
) -> tuple[ftqp.Planner, np.ndarray]:
    """A Panda that is to hold its tip where it is, and the largest true error of the tip before any lock [m].

    A brake closes at LOCKS_AT, and nobody announces it.
    """
    robot = ftqp.robots.load("panda")
    robot = robot if friction is None else robot.with_friction(coulomb=friction)
    taken = ftqp.Drive(kind=drive, bandwidth=BANDWIDTH)
    if drive == "torque":  # an arm that has not moved has learned nothing: its model is said to be right
        taken = ftqp.Drive(kind="torque", inertia_error=0.0)
    planner = ftqp.Planner(
        robot, DT, drive=taken, task=ftqp.Task(rows="position"), noise=ftqp.Noise(q=SIGMA),
        detector=ftqp.Detector(probe_after=probe_after),
    )  # fmt: skip
    servo: dict[str, Any] = {} if drive == "torque" else {"bandwidth": BANDWIDTH}
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, drive, **servo))
    sensors = ftqp.JointSensors(robot, DT, position_noise=SIGMA, seed=1)
    planner.reset(robot.neutral)
    plant.reset(robot.neutral, np.zeros(7))
    sensors.reset()
    target, worst = ftqp.Target(pose=robot.pose(robot.neutral)), 0.0
    for k in range(round(seconds / DT)):
        if locked is not None and k == round(LOCKS_AT / DT):
            plant.fail(ftqp.Locked(robot.joints[locked]))
        sensors.measure(plant.q, plant.v)
        plant.advance(planner.step(sensors.q, None, target))
        if k * DT < LOCKS_AT:
            worst = max(worst, float(np.linalg.norm(robot.pose(plant.q)[:3, 3] - target.pose[:3, 3])))
    return planner, np.array(worst)


@pytest.mark.parametrize(
    ("drive", "joint"), [("position", 1), ("position", 3), ("velocity", 0), ("torque", 5), ("torque", 6)]
)
def test_a_joint_that_locks_at_rest_is_found_within_a_second(drive: str, joint: int) -> None:
    planner, worst = standing(drive, 0.5, seconds=LOCKS_AT + 1.0, locked=joint)
    name = planner.robot.joints[joint]
    assert [finding.joint for finding in planner.findings] == [name]
    assert "locked" in planner.findings[0].kinds and planner.findings[0].detected_at > LOCKS_AT
    assert planner.faults == {name: ftqp.Locked(name)}
    assert worst < 2e-4


def test_without_probing_it_is_never_noticed() -> None:
    planner, _ = standing("position", None, seconds=LOCKS_AT + 1.0, locked=1)
    assert planner.findings == () and planner.faults == {}


@pytest.mark.long
@pytest.mark.parametrize("drive", ["position", "torque"])
def test_known_friction_is_no_lock(drive: str) -> None:
    friction = [0.5] * 4 + [0.17] * 3
    planner, _ = standing(drive, 0.3, seconds=3.0, friction=friction)
    assert planner.findings == ()


@pytest.mark.long
@pytest.mark.parametrize("drive", ["position", "velocity", "torque"])
def test_a_healthy_arm_is_probed_and_nothing_is_found(drive: str) -> None:
    planner, _ = standing(drive, 0.3, seconds=4.0)
    assert planner.findings == () and planner.diagnosis is not None
    assert any(joint.unobservable is not None for joint in planner.diagnosis.joints.values())
