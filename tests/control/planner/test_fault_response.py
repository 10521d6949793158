"""What a planner does about faults of a torque arm that it finds."""

import logging

import numpy as np
import pytest
from tests.going import targets_along

import ftqp

DT = 1e-3
SIGMA = 1e-4
KNOWN = ftqp.Drive(kind="torque", inertia_error=0.0)


def planner_of(detector=None, **settings):
    robot = ftqp.robots.load("panda")
    return ftqp.Planner(robot, DT, drive=KNOWN, noise=ftqp.Noise(q=SIGMA), detector=detector, **settings)


def drive(planner, seconds, *, truth=lambda k, q, sent: sent, seen=lambda k, q: q):
    """Lead the tip round a circle by the clock; ``truth`` moves the arm, ``seen`` makes the samples."""
    q = planner.robot.neutral.copy()
    path = ftqp.paths.Circle(planner.robot.pose(q), 0.1, duration=4.0, axes=("y", "z"))
    targets, generator = targets_along(path, round(seconds / DT), DT), np.random.default_rng(5)
    planner.reset(q)
    steps = []
    for k in range(len(targets)):
        noisy = seen(k, q + SIGMA * generator.standard_normal(7))
        step = planner.step(noisy, None, targets.at(k))
        steps.append(step.copy())
        q = truth(k, q, step.q.copy())
    return steps


def lock(joint, at):
    """A joint stands still from a time on."""

    def truth(k, q, sent):
        if k * DT >= at:
            sent[joint] = q[joint]
        return sent

    return truth


@pytest.mark.parametrize("joint", [4, 5])
def test_a_lock_that_nobody_announces_is_found_and_the_task_goes_on(joint):
    planner = planner_of()
    steps = drive(planner, 4.0, truth=lock(joint, 1.7))
    name = planner.robot.joints[joint]
    assert [(finding.joint, finding.kind) for finding in planner.findings] == [(name, "locked")]
    assert 1.69 < planner.findings[0].onset < planner.findings[0].detected_at < 1.8
    assert planner.faults == {name: ftqp.Locked(name)}
    assert steps[-1].status is ftqp.StepStatus.OK
    assert max(step.position_error for step in steps[-500:]) < 2e-3


@pytest.mark.long
def test_a_healthy_arm_moves_bit_for_bit_as_without_a_detector():
    watched, alone = planner_of(), planner_of(False)
    for with_one, without in zip(drive(watched, 2.0), drive(alone, 2.0), strict=True):
        assert (with_one.q == without.q).all() and (with_one.a == without.a).all()
    assert watched.findings == () and watched.faults == {}
    assert watched.diagnosis is not None and watched.diagnosis.suspicion < 1.0


@pytest.mark.parametrize(
    ("kind", "seen"),
    [
        ("sensor_dropped", lambda k, q: np.where(np.arange(7) == 3, np.nan, q) if k >= 1500 else q),
        ("sensor_biased", lambda k, q: q + (0.02 + 2e-3 * (k - 1500)) * (np.arange(7) == 3) * (k >= 1500)),
    ],
)
def test_a_lost_sensor_stops_the_arm_at_once_and_is_named(kind, seen, caplog):
    planner = planner_of()
    with caplog.at_level(logging.WARNING, "ftqp"):
        steps = drive(planner, 2.0, seen=seen)
    assert planner.findings[0].kinds == {kind}
    assert planner.findings[0].detected_at < 1.53  # its patience is 20 ms
    assert steps[1530].status is ftqp.StepStatus.STOPPING
    assert planner.stopped_because is not None and "panda_joint4" in planner.stopped_because
    assert any("panda_joint4" in message and "stopped" in message for message in caplog.messages)
    assert not planner.resume()
    planner.reset(planner.robot.neutral)
    assert planner.findings == () and planner.stopped_because is None


@pytest.mark.long
def test_a_joint_that_is_withdrawn_is_looked_at_again(caplog):
    planner = planner_of()
    with caplog.at_level(logging.WARNING, "ftqp"):
        drive(planner, 2.0, truth=lock(4, 1.7))
    assert planner.findings
    assert "a joint that locks; if it works, planner.withdraw('panda_joint5') takes" in caplog.messages[-1]
    planner.withdraw("panda_joint5")
    assert planner.findings == () and planner.faults == {}
